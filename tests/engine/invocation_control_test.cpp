// SPDX-License-Identifier: Apache-2.0
#include "src/engine/invocation_control.hpp"

#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/watchdog.hpp"

using namespace lrt;
using namespace lrt::engine;

namespace {

struct Control {
  std::vector<Result<rdf::Value>> results() {
    inbox->run_all({});
    return std::move(finished);
  }
  std::shared_ptr<Inbox> inbox = std::make_shared<Inbox>();
  std::vector<Result<rdf::Value>> finished;
  std::shared_ptr<InvocationControl> control =
      std::make_shared<InvocationControl>(inbox, [this](Result<rdf::Value> result, TimePoint) { finished.push_back(std::move(result)); });
};

Result<rdf::Value> dropped() { return unexpected(Errc::dropped, "dropped"); }

}  // namespace

TEST_CASE("the first result of an invocation counts", "[engine][R0.8]") {
  Control c;
  c.control->finish(rdf::Value(1.0));
  c.control->finish(rdf::Value(2.0));
  c.control->finish(dropped());
  const auto results = c.results();
  REQUIRE(results.size() == 1);
  CHECK(*results[0]->real() == 1.0);
}

TEST_CASE("a Responder that is dropped while the start function runs counts when that returns", "[engine][R0.6]") {
  Control c;
  c.control->start_begins();
  c.control->finish(dropped());
  CHECK(c.results().empty());
  SECTION("it returns") {
    c.control->start_ended({});
    const auto results = c.results();
    REQUIRE(results.size() == 1);
    CHECK(results[0].error().code == Errc::dropped);
  }
  SECTION("it throws") {
    c.control->start_ended(unexpected(Errc::failed, "hot"));
    const auto results = c.results();
    REQUIRE(results.size() == 1);
    CHECK(results[0].error().message == "hot");
  }
}

TEST_CASE("after a cancellation no result counts, and the hook is handed over once", "[engine][R0.5]") {
  Control c;
  int called = 0;
  c.control->on_cancel([&] { called += 1; });
  c.control->on_cancel([&] { called += 10; });  // instead of the first
  CHECK_FALSE(c.control->cancelled());
  auto hook = c.control->cancel();
  CHECK(c.control->cancelled());
  CHECK(called == 0);
  hook();
  CHECK(called == 10);
  CHECK_FALSE(c.control->cancel());
  c.control->finish(rdf::Value(1.0));
  CHECK(c.results().empty());
  c.control->on_cancel([&] { called += 100; });  // at once
  CHECK(called == 110);
}

TEST_CASE("progress is a fraction from 0 to 1", "[engine][R0.8]") {
  Control c;
  CHECK(c.control->fraction() == 0);
  c.control->progress(0.5);
  CHECK(c.control->fraction() == 0.5);
  c.control->progress(std::numeric_limits<double>::quiet_NaN());
  CHECK(c.control->fraction() == 0.5);
  c.control->progress(7);
  CHECK(c.control->fraction() == 1);
  c.control->progress(-1);
  CHECK(c.control->fraction() == 0);
}

TEST_CASE("what a hook has captured is destroyed without a lock", "[engine][user code]") {
  const lrt::test::Watchdog watchdog("the destructor of a hook");
  Control c;
  struct Calling {
    explicit Calling(InvocationControl& its_control) : control(its_control) {}
    ~Calling() {
      control.on_cancel([] {});
    }
    InvocationControl& control;
  };
  c.control->on_cancel([held = std::make_shared<Calling>(*c.control)] { (void)held; });
  SECTION("by another hook") {
    c.control->on_cancel([] {});
  }
  SECTION("by a result") { c.control->finish(rdf::Value(1.0)); }
  SECTION("by a cancellation") { (void)c.control->cancel(); }
}
