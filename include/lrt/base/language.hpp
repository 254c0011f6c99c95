// SPDX-License-Identifier: Apache-2.0
#pragma once

// What lrt needs of the compiler. Each public header includes this, by itself or through another one, before it declares
// anything.

#if !defined(__cplusplus) || (__cplusplus < 201703L && !defined(_MSVC_LANG))
#error "lrt: lrt needs C++17; compile with -std=c++17 or later"
#endif

#if !defined(__cpp_exceptions) && !defined(_CPPUNWIND)
#error "lrt: lrt needs exceptions; compile without -fno-exceptions"
#endif
