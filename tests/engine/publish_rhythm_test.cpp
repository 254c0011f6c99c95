// SPDX-License-Identifier: Apache-2.0
#include "src/engine/publish_rhythm.hpp"

#include <chrono>
#include <cmath>
#include <random>

#include "tests/support/catch.hpp"

using namespace lrt::engine;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using Instant = PublishRhythm::Instant;

namespace {

const Instant begin = Instant(std::chrono::hours(1));

struct Outcome {
  int scans = 0, values = 0;
  microseconds worst{0};
};

/// A loop that publishes with jitter, and a scanner that comes when the rhythm says, as late as it wakes.
Outcome run(PublishRhythm& rhythm, milliseconds period, microseconds jitter, microseconds wake_time, int steps) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> spread(-static_cast<int>(jitter.count()), static_cast<int>(jitter.count()));
  Outcome outcome;
  for (int step = 1; step <= steps; ++step) {
    const Instant published = begin + step * period + microseconds(spread(random));
    if (!rhythm.due()) {
      rhythm.found(published, published + microseconds(250));
      continue;
    }
    Instant scan = *rhythm.due() + wake_time;
    for (;; scan = *rhythm.due() + wake_time) {
      ++outcome.scans;
      if (scan >= published) break;
      rhythm.missed(scan);
      if (!rhythm.due()) return outcome;
    }
    rhythm.found(published, scan);
    ++outcome.values;
    if (step > steps / 2) outcome.worst = std::max(outcome.worst, std::chrono::duration_cast<microseconds>(scan - published));
  }
  return outcome;
}

}  // namespace

TEST_CASE("a regular publish() is found by one scan soon after it", "[engine][control loop]") {
  for (const auto wake : {microseconds(5), microseconds(60)}) {
    PublishRhythm rhythm;
    const Outcome outcome = run(rhythm, milliseconds(1), microseconds(20), wake, 4000);
    CHECK(rhythm.is_regular());
    CHECK(std::abs((rhythm.period() - milliseconds(1)).count()) < 20'000);
    CHECK(outcome.values > 3980);
    CHECK(outcome.scans < outcome.values * 12 / 10);
    CHECK(outcome.worst < microseconds(200));
  }
}

TEST_CASE("the first values teach the period", "[engine][control loop]") {
  PublishRhythm rhythm;
  Instant at = begin;
  for (int i = 0; i < 5; ++i, at += milliseconds(2)) {
    CHECK_FALSE(rhythm.due());
    rhythm.found(at, at);
  }
  rhythm.found(at, at);
  REQUIRE(rhythm.due());
  CHECK(*rhythm.due() == at + milliseconds(2));
  CHECK(rhythm.period() == milliseconds(2));
}

TEST_CASE("irregular values have no rhythm", "[engine][control loop]") {
  PublishRhythm rhythm;
  std::mt19937 random(3);
  std::exponential_distribution<double> interval(1.0 / 5e6);
  Instant at = begin;
  int due = 0;
  for (int i = 0; i < 1000; ++i) {
    at += PublishRhythm::Duration(static_cast<std::int64_t>(interval(random)));
    rhythm.found(at, at);
    due += rhythm.due().has_value();
  }
  CHECK(due < 50);
}

TEST_CASE("a value that is lost or late does not end a rhythm", "[engine][control loop]") {
  PublishRhythm rhythm;
  Instant at = begin;
  for (int i = 0; i < 20; ++i) rhythm.found(at += milliseconds(1), at);
  rhythm.found(at += milliseconds(3), at);
  CHECK(rhythm.is_regular());
  rhythm.found(at += microseconds(400), at);
  CHECK(rhythm.is_regular());
  rhythm.found(at += microseconds(600), at);
  CHECK(rhythm.is_regular());
}

TEST_CASE("a rhythm ends when values stop, or change their period", "[engine][control loop]") {
  PublishRhythm rhythm;
  Instant at = begin;
  for (int i = 0; i < 20; ++i) rhythm.found(at += milliseconds(1), at);
  int scans = 0;
  for (; rhythm.due() && scans < 100; ++scans) rhythm.missed(*rhythm.due());
  CHECK_FALSE(rhythm.is_regular());
  CHECK(scans <= 9);
  for (int i = 0; i < 20; ++i) rhythm.found(at += milliseconds(1), at);
  for (int i = 0; i < 20; ++i) rhythm.found(at += milliseconds(100), at);
  CHECK(rhythm.is_regular());
  CHECK(rhythm.period() == milliseconds(100));
}

TEST_CASE("scans for other reasons do not count as too early", "[engine][control loop]") {
  PublishRhythm rhythm;
  Instant at = begin;
  for (int i = 0; i < 20; ++i) rhythm.found(at += milliseconds(1), at);
  const auto due = rhythm.due();
  for (int i = 1; i < 9; ++i) rhythm.missed(at + microseconds(100 * i));
  CHECK(rhythm.due() == due);
}
