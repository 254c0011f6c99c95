// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/window.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "tests/support/catch.hpp"

using lrt::mqtt::Window;
using std::chrono::milliseconds;

namespace {

/// A link in virtual time: it keeps all that it is given, passes on so many bytes in a millisecond after a delay, and stops at times.
struct SlowLink {
  double bytes_per_ms = 20;
  int delay_ms = 100;  ///< in each direction
  int stall_every_ms = 10'000, stall_ms = 500;
  std::size_t message_bytes = 200;

  struct Item {
    std::size_t left;
    int probe;        ///< 0: a message
    int made_at = 0;  ///< when its value was the newest
  };
  struct Late {
    int at, probe, made_at;
  };
  Window window;
  std::deque<Item> queue;
  std::deque<Late> on_way;   ///< through the delay to the broker
  std::deque<Late> answers;  ///< on their way back
  std::vector<int> ages;     ///< of the newest value at the receiver, each millisecond
  std::size_t arrived = 0, sent = 0;

  int now = 0;
  std::optional<int> newest;
  int next_probe = 1;
  double credit = 0;

  /// A robot with a new value in each millisecond.
  void run(int duration_ms) {
    for (const int end = now + duration_ms; now < end; ++now) {
      const Window::Instant instant{milliseconds(now)};
      for (; !answers.empty() && answers.front().at <= now; answers.pop_front()) window.confirmed(answers.front().probe, instant);
      for (int i = 0; i < 64 && window.is_open(); ++i) {
        window.sent(message_bytes);
        queue.push_back({message_bytes, 0, now});
        ++sent;
        if (window.wants_probe()) {
          queue.push_back({20, next_probe, now});
          window.probed(next_probe++, instant);
        }
      }
      const bool stalls = stall_every_ms > 0 && now % stall_every_ms >= stall_every_ms - stall_ms;
      credit = stalls ? 0 : std::min(credit + bytes_per_ms, 10 * bytes_per_ms);
      while (!queue.empty() && credit > 0) {
        const double part = std::min(credit, static_cast<double>(queue.front().left));
        credit -= part;
        queue.front().left -= static_cast<std::size_t>(part);
        if (queue.front().left >= 1) break;
        on_way.push_back({now + delay_ms, queue.front().probe, queue.front().made_at});
        queue.pop_front();
      }
      for (; !on_way.empty() && on_way.front().at <= now; on_way.pop_front()) {
        if (on_way.front().probe != 0) {
          answers.push_back({now + delay_ms, on_way.front().probe, 0});
        } else {
          newest = on_way.front().made_at;
          ++arrived;
        }
      }
      if (newest) ages.push_back(now - *newest);
    }
  }
  int worst() const { return *std::max_element(ages.begin(), ages.end()); }
  int median() {
    std::nth_element(ages.begin(), ages.begin() + static_cast<std::ptrdiff_t>(ages.size() / 2), ages.end());
    return ages[ages.size() / 2];
  }
};

}  // namespace

TEST_CASE("the newest value is at most two seconds old behind a slow link that stalls", "[mqtt][newest]") {
  SlowLink link;
  link.message_bytes = GENERATE(60U, 200U, 1'500U);
  link.run(120'000);
  CAPTURE(link.message_bytes, link.window.limit(), link.sent, link.arrived);
  CHECK(link.worst() <= 2'000);
  CHECK(link.median() <= 1'000);
  // The link is used: it could carry 19 kB/s.
  CHECK(static_cast<double>(link.arrived * link.message_bytes) > 0.7 * 19 * 120'000);
}

TEST_CASE("a fast link is filled, also one with a long way", "[mqtt][newest]") {
  SlowLink link;
  link.stall_every_ms = 0;
  link.bytes_per_ms = 1'000;
  link.message_bytes = 1'000;
  link.delay_ms = GENERATE(1, 50);
  link.run(60'000);
  CAPTURE(link.delay_ms, link.window.limit());
  CHECK(static_cast<double>(link.arrived) > 0.8 * 60'000);
  CHECK(link.worst() <= 1'000);
}

TEST_CASE("a link that becomes slow is given less, and more when it is fast again", "[mqtt][newest]") {
  SlowLink link;
  link.stall_every_ms = 0;
  link.delay_ms = 20;
  link.bytes_per_ms = 200;
  link.run(20'000);
  const std::size_t fast = link.window.limit();
  link.bytes_per_ms = 10;
  link.run(40'000);
  const std::size_t slow = link.window.limit();
  CHECK(slow < fast / 4);
  link.ages.clear();
  link.run(20'000);
  CHECK(link.worst() <= 2'000);
  link.bytes_per_ms = 200;
  link.run(20'000);
  CHECK(link.window.limit() > 4 * slow);
}

TEST_CASE("a message that is larger than the window is sent when nothing else is on its way", "[mqtt][newest]") {
  Window window;
  CHECK(window.wants_probe());
  const Window::Instant now{std::chrono::hours(1)};
  window.probed(1, now);
  CHECK_FALSE(window.wants_probe());
  window.sent(10 * Window::max_bytes);
  CHECK_FALSE(window.is_open());
  CHECK(window.room() == 0);
  CHECK(window.wants_probe());  // else nothing would open it
  window.probed(2, now);
  CHECK(window.oldest() == now);
  window.confirmed(4'711, now + milliseconds(5));  // another one's
  window.confirmed(1, now + milliseconds(5));
  CHECK_FALSE(window.is_open());
  window.confirmed(2, now + std::chrono::seconds(100));
  CHECK(window.is_open());
  CHECK_FALSE(window.oldest());
  CHECK(window.limit() >= Window::min_bytes);
}

TEST_CASE("the answers to probes that were sent before a stall narrow the window once", "[mqtt][newest]") {
  Window window;
  Window::Instant now{std::chrono::hours(1)};
  int id = 0;
  window.probed(++id, now);
  window.confirmed(id, now += milliseconds(10));
  while (window.is_open()) {
    window.sent(500);
    if (window.wants_probe()) window.probed(++id, now);
  }
  REQUIRE(id >= 4);
  for (int i = 2; i <= id; ++i) window.confirmed(i, now + std::chrono::seconds(3));
  CHECK(window.limit() == Window::first_bytes / 2);
}

TEST_CASE("a window is closed only while an answer is awaited", "[mqtt][newest]") {
  Window window;
  Window::Instant now{std::chrono::hours(1)};
  std::deque<int> open;
  int id = 0;
  for (int step = 0; step < 10'000; ++step) {
    now += milliseconds(step % 97);
    if (window.is_open()) window.sent(static_cast<std::size_t>(1 + step * 7'919 % 9'000));
    if (window.wants_probe()) {
      window.probed(++id, now);
      open.push_back(id);
    }
    if (!window.is_open()) REQUIRE_FALSE(open.empty());
    if (step % 3 == 0 && !open.empty()) {
      window.confirmed(open.front(), now);
      open.pop_front();
    }
  }
}

TEST_CASE("a window is open behind a broker that answers no probe", "[mqtt][newest]") {
  Window window;
  const Window::Instant now{std::chrono::hours(1)};
  window.probed(1, now);
  window.sent(Window::max_bytes);
  CHECK_FALSE(window.is_open());
  window.give_up();
  CHECK(window.is_open());
  CHECK(window.room() > 0);
  CHECK_FALSE(window.wants_probe());
  CHECK_FALSE(window.oldest());
  window.begin();
  CHECK(window.wants_probe());  // the next connection may be to another broker
}

TEST_CASE("a probe can be wanted before a quarter of the window was used", "[mqtt][newest]") {
  Window window;
  const Window::Instant now{std::chrono::hours(1)};
  window.probed(1, now);
  window.sent(10);
  CHECK_FALSE(window.wants_probe());
  window.want_probe();
  CHECK(window.wants_probe());
  window.probed(2, now);
  CHECK_FALSE(window.wants_probe());
  CHECK(window.sent_bytes() == 10);
  CHECK(window.confirmed_bytes() == 0);
  window.confirmed(2, now);
  CHECK(window.confirmed_bytes() == 10);
}
