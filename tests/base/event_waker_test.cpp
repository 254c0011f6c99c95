// SPDX-License-Identifier: Apache-2.0
#include "src/base/event_waker.hpp"

#include <poll.h>

#include <chrono>
#include <thread>

#include "tests/support/catch.hpp"

using lrt::EventWaker;

namespace {
bool is_readable(const EventWaker& waker) {
  pollfd item{waker.descriptor(), POLLIN, 0};
  return ::poll(&item, 1, 0) == 1;
}
}  // namespace

TEST_CASE("the descriptor of a waker is readable from wake to clear", "[base]") {
  EventWaker waker;
  CHECK_FALSE(is_readable(waker));
  CHECK_FALSE(waker.is_awake());
  waker.wake();
  waker.wake();
  CHECK(is_readable(waker));
  CHECK(waker.is_awake());
  waker.clear();
  CHECK_FALSE(is_readable(waker));
  CHECK_FALSE(waker.is_awake());
  waker.wake();
  CHECK(is_readable(waker));
}

TEST_CASE("wait returns after a wake of another thread and clears it", "[base][threads]") {
  EventWaker waker;
  std::thread other([&] { waker.wake(); });
  waker.wait(std::chrono::hours(1));
  other.join();
  CHECK_FALSE(is_readable(waker));
  CHECK_FALSE(waker.is_awake());
}
