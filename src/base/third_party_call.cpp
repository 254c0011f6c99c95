// SPDX-License-Identifier: Apache-2.0
#include "src/base/third_party_call.hpp"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "src/base/process.hpp"

namespace lrt {
namespace {

constexpr std::chrono::seconds longest_wait{1};
constexpr std::chrono::microseconds pause{50};

std::atomic<int> calls{0};
std::atomic<bool> closed{false};
thread_local int own_calls = 0;  // exit() may be called below one

void close() noexcept {
  closed = true;
  const auto end = std::chrono::steady_clock::now() + longest_wait;
  while (calls > own_calls && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(pause);
}

}  // namespace

ThirdPartyCall::ThirdPartyCall() noexcept {
  ++calls;  // before the load: either close() counts this call, or this call finds the gate closed
  ++own_calls;
  entered_ = !closed;
  if (entered_) return;
  --calls;
  --own_calls;
}

ThirdPartyCall::~ThirdPartyCall() {
  if (!entered_) return;
  --calls;
  --own_calls;
}

bool ThirdPartyCall::close_at_exit() noexcept {
  static const OwnProcess process;  // a child of fork() has none of the threads that are inside
  return std::atexit([] {
           if (process.is_current()) close();
         }) == 0;
}

}  // namespace lrt
