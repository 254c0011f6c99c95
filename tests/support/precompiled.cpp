// SPDX-License-Identifier: Apache-2.0
// The program that owns the precompiled headers; it is not run.
int main() { return 0; }
