// SPDX-License-Identifier: Apache-2.0
#include "src/engine/change_scanner.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include <lrt/engine/engine.hpp>
#include <lrt/thing.hpp>

#include "src/engine/representation_cache.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using std::chrono::milliseconds;

namespace {

class CountingWaker final : public Waker {
 public:
  void wake() noexcept override { ++count; }
  std::atomic<int> count{0};
};

/// A pushed, a pulled and an urgent property under a scanner.
struct Scanned {
  Scanned() {
    options.subscriptions.scan_period = milliseconds(10);
    options.subscriptions.idle_scans_before_sleep = 2;
    Thing thing{"arm"};
    pushed = thing.property<int>("pushed");
    pulled = thing.property("pulled", [this] { return ++reads; });
    pulled->sample(milliseconds(100));
    urgent = thing.property<int>("urgent");
    urgent->urgent();
    node = std::make_unique<ThingNode>(std::move(thing).release());
    for (Resource* r : node->resources()) registry.add(*r);
    for (const auto& p : node->properties) {
      if (p->spec->slot) p->spec->slot->attach(scanner.wake_signal()), p->spec->slot->set_clock(clock);
      else p->spec->changes->attach(scanner.wake_signal());
    }
    scanner.wake_signal()->set_waker(waker);
  }
  ~Scanned() {
    for (Resource* r : node->resources()) registry.remove(*r);
  }
  PropertyResource& of(std::size_t index) { return *node->properties[index]; }
  void scan() {
    clock.advance(milliseconds(10));
    scanner.scan(clock.now(), false, ChangeScanner::Instant::max());
  }
  void run() {
    for (Job& job : calls.take_jobs()) job.run();
    calls.inbox()->run_all(clock.now());
  }
  FakeClock clock;
  EngineOptions options;
  RepresentationCache cache{1000};
  Registry registry{cache};
  HostCalls calls{Dispatch::in_poll, 2};
  PropertyValues values{calls, registry, options, clock};
  ChangeScanner scanner{values, registry, calls, options.subscriptions, clock};
  std::shared_ptr<CountingWaker> waker = std::make_shared<CountingWaker>();
  std::optional<PushedProperty<int>> pushed, urgent;
  std::optional<PulledProperty<int>> pulled;
  std::unique_ptr<ThingNode> node;
  int reads = 0;
};

}  // namespace

TEST_CASE("a scan takes over what was published to watched properties", "[engine][R0.12]") {
  Scanned s;
  s.scanner.watch(s.of(0));
  CHECK(s.scanner.is_due(s.clock.now()));
  s.pushed->publish(4);
  s.scan();
  CHECK(*s.of(0).value.integer() == 4);
  CHECK_FALSE(s.scanner.is_due(s.clock.now()));
  CHECK(s.scanner.next_deadline() == s.clock.now().steady + milliseconds(10));
  s.scanner.unwatch(s.of(0));
}

TEST_CASE("the scanner sleeps after scans without a change, and publish() wakes it once", "[engine][control loop]") {
  Scanned s;
  s.scanner.watch(s.of(0));
  for (int i = 0; i < 3; ++i) s.scan();
  CHECK_FALSE(s.scanner.is_scanning());
  CHECK_FALSE(s.scanner.is_due(s.clock.now()));
  CHECK_FALSE(s.scanner.next_deadline());
  const int before = s.waker->count;
  s.pushed->publish(1);
  s.pushed->publish(2);
  CHECK(s.waker->count == before + 1);
  CHECK(s.scanner.is_due(s.clock.now()));
  s.scan();
  CHECK(s.scanner.is_scanning());
  CHECK(*s.of(0).value.integer() == 2);
  s.pushed->publish(3);
  CHECK(s.waker->count == before + 1);  // it scans by itself
  s.scanner.unwatch(s.of(0));
}

TEST_CASE("a property that is published at short regular intervals is scanned when it is due, without a system call", "[engine][control loop]") {
  Scanned s;
  s.scanner.watch(s.of(0));
  const int before = s.waker->count;
  for (int i = 1; i <= 50; ++i) {
    s.clock.advance(milliseconds(20));
    s.pushed->publish(i);
    s.clock.advance(milliseconds(1));
    s.scanner.scan(s.clock.now(), false, ChangeScanner::Instant::max());
    CHECK(*s.of(0).value.integer() == i);
  }
  REQUIRE(s.scanner.next_deadline());
  const auto wait = *s.scanner.next_deadline() - s.clock.now().steady;
  CHECK(wait > milliseconds(14));
  CHECK(wait <= milliseconds(20));
  CHECK(s.scanner.is_scanning());
  CHECK(s.waker->count == before);
  s.clock.advance(milliseconds(3));
  CHECK(s.scanner.is_due(s.clock.now()));  // whoever comes by may scan, too
  s.scanner.unwatch(s.of(0));
}

TEST_CASE("between values at long regular intervals the scanner sleeps", "[engine][control loop]") {
  Scanned s;
  s.scanner.watch(s.of(0));
  for (int i = 1; i <= 10; ++i) {
    s.clock.advance(milliseconds(60));
    s.pushed->publish(i);
    for (int scan = 0; scan < 4; ++scan) s.scan();  // 40 ms
  }
  for (int i = 11; i <= 20; ++i) {
    s.clock.advance(milliseconds(100));
    const int before = s.waker->count;
    s.pushed->publish(i);
    CHECK(s.waker->count == before + 1);
    CHECK(s.scanner.is_due(s.clock.now()));
    s.scanner.scan(s.clock.now(), false, ChangeScanner::Instant::max());
    CHECK(*s.of(0).value.integer() == i);
    CHECK_FALSE(s.scanner.is_scanning());
  }
  s.scanner.unwatch(s.of(0));
}

TEST_CASE("each urgent value wakes the engine while it is observed, and is scanned soon", "[engine][control loop]") {
  Scanned s;
  s.urgent->publish(1);
  CHECK(s.waker->count == 0);
  s.scanner.watch(s.of(2));
  s.scan();
  for (int i = 2; i <= 5; ++i) {
    const int before = s.waker->count;
    s.urgent->publish(i);
    CHECK(s.waker->count == before + 1);
    REQUIRE(s.scanner.next_deadline());
    CHECK(*s.scanner.next_deadline() <= s.clock.now().steady + milliseconds(2));
    s.clock.advance(milliseconds(2));
    CHECK(s.scanner.is_due(s.clock.now()));
    s.scanner.scan(s.clock.now(), false, ChangeScanner::Instant::max());
    CHECK(*s.of(2).value.integer() == i);
  }
  s.scanner.unwatch(s.of(2));
}

TEST_CASE("a scanner with nothing to watch stops", "[engine][control loop]") {
  Scanned s;
  s.scanner.watch(s.of(0));
  s.scanner.unwatch(s.of(0));
  s.scan();
  CHECK_FALSE(s.scanner.is_scanning());
  const int before = s.waker->count;
  s.pushed->publish(1);
  CHECK(s.waker->count == before);
}

TEST_CASE("a pulled property is read at its rate, or when it has changed, one read at a time", "[engine][delivery]") {
  Scanned s;
  s.scanner.watch(s.of(1));
  s.scan();
  s.run();
  CHECK(s.reads == 0);
  s.clock.advance(milliseconds(100));
  s.scanner.read_samples(s.clock.now());
  s.scanner.read_samples(s.clock.now());
  s.run();
  CHECK(s.reads == 1);
  s.pulled->changed();
  s.scan();
  s.run();
  CHECK(s.reads == 2);
  s.scan();
  s.run();
  CHECK(s.reads == 2);
  s.scanner.unwatch(s.of(1));
  s.clock.advance(milliseconds(500));
  s.scanner.read_samples(s.clock.now());
  s.run();
  CHECK(s.reads == 2);
}

TEST_CASE("a host that does not poll gets no more samples to read", "[engine][limits]") {
  Scanned s;
  s.scanner.watch(s.of(1));
  for (int i = 0; i < 2; ++i) s.calls.run(Dispatch::in_poll, [] {});
  s.clock.advance(milliseconds(100));
  s.scanner.read_samples(s.clock.now());
  s.run();
  CHECK(s.reads == 0);
  s.clock.advance(milliseconds(100));
  s.scanner.read_samples(s.clock.now());
  s.run();
  CHECK(s.reads == 1);
  s.scanner.unwatch(s.of(1));
}
