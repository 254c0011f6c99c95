// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace lrt::test {

// Counted thread by thread if one source file of the program includes allocations.hpp.
inline thread_local std::size_t allocations = 0;
inline thread_local std::size_t allocated_bytes = 0;  ///< in all, whatever was freed since

}  // namespace lrt::test
