// SPDX-License-Identifier: Apache-2.0
#pragma once

// Counts the allocations of a program, thread by thread. Include it in one source file of the program and no more. Under a sanitizer
// nothing is counted: its own operators find more.

#include <cstddef>
#include <cstdlib>
#include <new>

#include "tests/support/allocation_counters.hpp"
#include "tests/support/sanitizer.hpp"

#if !LRT_TEST_SANITIZED
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++lrt::test::allocations;
  lrt::test::allocated_bytes += size;
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++lrt::test::allocations;
  lrt::test::allocated_bytes += size;
  return std::malloc(size ? size : 1);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++lrt::test::allocations;
  const std::size_t a = static_cast<std::size_t>(alignment);
  if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
#endif
