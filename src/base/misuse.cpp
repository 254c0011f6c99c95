// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/misuse.hpp>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace lrt {
inline namespace v0 {
namespace {

/// No stream of the C++ library: the program may be in its end, or in a control loop with little stack.
void print_and_abort(const char* message) {
  char line[600];
  const int length = std::snprintf(line, sizeof line, "lrt: %s\n", message);
  if (::write(STDERR_FILENO, line, std::min(sizeof line - 1, static_cast<std::size_t>(std::max(length, 0)))) < 0) std::abort();  // no such stream
  std::abort();
}

std::atomic<MisuseHandler> handler_of_process{print_and_abort};

}  // namespace

MisuseHandler set_misuse_handler(MisuseHandler handler) noexcept {
  return handler_of_process.exchange(handler ? handler : print_and_abort, std::memory_order_acq_rel);
}

}  // namespace v0
}  // namespace lrt

namespace lrt::detail {
inline namespace v0 {

void misuse(const char* message) noexcept { handler_of_process.load(std::memory_order_acquire)(message); }

void fatal_misuse(const char* message) noexcept {
  misuse(message);
  std::abort();
}

}  // namespace v0
}  // namespace lrt::detail
