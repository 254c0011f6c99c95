// SPDX-License-Identifier: Apache-2.0
// expect: lrt needs exceptions
// flags: -fno-exceptions
#include <lrt/base/result.hpp>

int main() {}
