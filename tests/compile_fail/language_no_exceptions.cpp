// SPDX-License-Identifier: Apache-2.0
// expect: lrt needs exceptions
// flags: -fno-exceptions
#include <lrt/lrt.hpp>

int main() {}
