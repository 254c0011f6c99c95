// SPDX-License-Identifier: Apache-2.0
// expect: lrt needs C\+\+17
// flags: -std=c++14
#include <lrt/lrt.hpp>

int main() {}
