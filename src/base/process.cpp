// SPDX-License-Identifier: Apache-2.0
#include "src/base/process.hpp"

#include <pthread.h>

#include <atomic>

namespace lrt {
namespace {
std::atomic<std::uint32_t> forks{0};
}

std::uint32_t OwnProcess::generation() noexcept {
  [[maybe_unused]] static const int registered = ::pthread_atfork(nullptr, nullptr, [] { forks.fetch_add(1, std::memory_order_relaxed); });
  return forks.load(std::memory_order_relaxed);
}

}  // namespace lrt
