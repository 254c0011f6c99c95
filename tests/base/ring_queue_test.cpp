// SPDX-License-Identifier: Apache-2.0
#include "src/base/ring_queue.hpp"

#include <deque>
#include <memory>

#include "tests/support/catch.hpp"

using lrt::RingQueue;

TEST_CASE("a ring queue does what a deque does", "[base]") {
  RingQueue<int> ring;
  std::deque<int> deque;
  unsigned random = 1;
  for (int i = 0; i < 10'000; ++i) {
    random = random * 1664525 + 1013904223;
    const unsigned act = random >> 29;
    if (act < 3) {
      ring.push_back(i);
      deque.push_back(i);
    } else if (act == 3) {
      ring.push_front(i);
      deque.push_front(i);
    } else if (!deque.empty()) {
      REQUIRE(ring.pop_front() == deque.front());
      deque.pop_front();
    }
    REQUIRE(ring.size() == deque.size());
    REQUIRE(ring.empty() == deque.empty());
    if (deque.empty()) continue;
    REQUIRE(ring.front() == deque.front());
    REQUIRE(ring.back() == deque.back());
  }
}

TEST_CASE("what was taken from a ring queue is not kept by it", "[base]") {
  RingQueue<std::shared_ptr<int>> ring;
  const auto item = std::make_shared<int>(1);
  for (int i = 0; i < 5; ++i) ring.push_back(item);
  for (long left = 5; left > 0; --left) {
    CHECK(item.use_count() == 1 + left);
    ring.pop_front();
  }
  CHECK(item.use_count() == 1);
}
