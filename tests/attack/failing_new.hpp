// SPDX-License-Identifier: Apache-2.0
// The allocations of a whole program, of which some fail: those for which fails_now() is true. The file that includes it defines that function before.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

[[gnu::noinline]] void* operator new(std::size_t size) {
  void* const p = fails_now() ? nullptr : std::malloc(size ? size : 1);
  if (!p) throw std::bad_alloc();
  return p;
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return fails_now() ? nullptr : std::malloc(size ? size : 1);
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
