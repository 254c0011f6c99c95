// SPDX-License-Identifier: Apache-2.0
#include "src/base/third_party_call.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/base/immortal.hpp>

#include "src/base/process.hpp"

namespace lrt {
namespace {

constexpr std::chrono::seconds longest_wait{1};  // a call may run user code, as libwebsockets does
constexpr std::chrono::microseconds pause{50};

std::atomic<int> calls{0};
std::atomic<bool> closed{false};
thread_local int own_calls = 0;  // exit() may be called below one

struct Waiting {
  std::mutex mutex;
  std::vector<std::weak_ptr<Waker>> wakers;
};
Waiting& waiting() noexcept {
  static Immortal<Waiting> all;
  return *all;
}

void close() noexcept {
  closed = true;
  {
    const std::lock_guard lock(waiting().mutex);
    for (const auto& waker : waiting().wakers)
      if (const auto there = waker.lock()) there->wake();
  }
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

void ThirdPartyCall::wake_at_exit(std::weak_ptr<Waker> waker) {
  const std::lock_guard lock(waiting().mutex);
  auto& wakers = waiting().wakers;
  wakers.erase(std::remove_if(wakers.begin(), wakers.end(), [](const auto& w) { return w.expired(); }), wakers.end());
  wakers.push_back(std::move(waker));
}

}  // namespace lrt
