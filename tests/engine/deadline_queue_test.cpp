// SPDX-License-Identifier: Apache-2.0
#include "src/engine/deadline_queue.hpp"

#include <chrono>
#include <optional>
#include <string>

#include "tests/support/catch.hpp"

using namespace lrt::engine;
using Queue = DeadlineQueue<std::string>;

namespace {

Queue::Instant at(int seconds) { return Queue::Instant(std::chrono::seconds(seconds)); }

}  // namespace

TEST_CASE("what is due leaves the deadline queue, the earliest first", "[engine]") {
  Queue queue;
  Queue::Place a, b, c;
  queue.set(a, at(3), "a");
  queue.set(b, at(1), "b");
  queue.set(c, at(2), "c");
  CHECK(queue.next() == at(1));
  CHECK_FALSE(queue.take_due(at(0)));
  CHECK(queue.take_due(at(2)) == "b");
  CHECK(queue.take_due(at(2)) == "c");
  CHECK_FALSE(queue.take_due(at(2)));
  CHECK(queue.next() == at(3));
}

TEST_CASE("a place has one deadline, and none after it was cleared", "[engine]") {
  Queue queue;
  Queue::Place place;
  queue.set(place, at(1), "early");
  queue.set(place, at(5), "late");
  CHECK(queue.next() == at(5));
  queue.clear(place);
  CHECK_FALSE(place);
  queue.clear(place);
  CHECK_FALSE(queue.next());
  CHECK_FALSE(queue.take_due(at(9)));
}
