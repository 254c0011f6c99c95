// SPDX-License-Identifier: Apache-2.0
#include "src/engine/property_values.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/thing.hpp>

#include "src/engine/representation_cache.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

namespace {

/// The values of one Thing, with host calls that run when the test says.
struct Values {
  explicit Values(Thing thing) {
    node = std::make_unique<ThingNode>(std::move(thing).release());
    for (Resource* r : node->resources()) registry.add(*r);
  }
  ~Values() {
    for (Resource* r : node->resources()) registry.remove(*r);
  }
  PropertyResource& property(std::size_t index = 0) { return *node->properties[index]; }
  /// Runs the calls that there are now and takes their results; how many.
  std::size_t step() {
    auto jobs = calls.take_jobs();
    for (Job& job : jobs) job.run();
    calls.inbox()->run_all(clock.now());
    return jobs.size();
  }
  /// A refresh whose results are kept.
  void refresh(PropertyResource& p, Encodings encodings = {}) {
    values.refresh(p, encodings, [this](const Result<void>& result, TimePoint) { results.push_back(result ? "done" : result.error().message); });
  }

  FakeClock clock;
  EngineOptions options;
  RepresentationCache cache{1 << 20};
  Registry registry{cache};
  HostCalls calls{Dispatch::in_poll, 1000};
  PropertyValues values{calls, registry, options, clock};
  std::unique_ptr<ThingNode> node;
  std::vector<std::string> results;
};

Encodings one(std::size_t encoder) {
  Encodings e;
  e.one = encoder;
  return e;
}

Encodings all() {
  Encodings e;
  e.all = true;
  return e;
}

}  // namespace

TEST_CASE("a refresh that comes while one runs gets a value of its own time", "[engine][R0.5]") {
  int reads = 0;
  Thing thing{"arm"};
  thing.property("p", [&] { return ++reads; });
  Values v(std::move(thing));
  v.refresh(v.property());
  auto jobs = v.calls.take_jobs();
  REQUIRE(jobs.size() == 1);
  v.refresh(v.property());
  v.refresh(v.property());
  CHECK(v.calls.take_jobs().empty());  // one at a time
  jobs[0].run();
  v.calls.inbox()->run_all(v.clock.now());
  CHECK(v.results.size() == 1);
  CHECK(reads == 1);
  CHECK(v.step() == 1);
  CHECK(v.results.size() == 3);
  CHECK(reads == 2);  // both of them share it
}

TEST_CASE("a refresh of several properties ends once, when all have ended, also if one cannot be read", "[engine][R0.6]") {
  Thing thing{"arm"};
  thing.property("a", [] { return 1; });
  thing.property("b", []() -> int { throw std::runtime_error("no voltage"); });
  thing.property<double>("pushed");
  Values v(std::move(thing));
  int ends = 0;
  v.values.refresh(v.node->state, {}, [&](const Result<void>& result, TimePoint) {
    ++ends;
    CHECK(result);
  });
  CHECK(ends == 0);
  v.step();
  CHECK(ends == 1);
  CHECK_FALSE(v.property(0).is_failing());
  REQUIRE(v.property(1).is_failing());
  CHECK(v.property(1).failure() == "it could not be read: it threw: no voltage");
}

TEST_CASE("a published value that needs no user code is taken over at once", "[engine][R0.5]") {
  Thing thing{"arm"};
  auto pushed = thing.property<double>("p");
  Values v(std::move(thing));
  pushed.publish(2.5);
  CHECK(v.values.ready(v.property(), Variant(), false));
  CHECK(*v.property().value.real() == 2.5);
  CHECK(v.calls.take_jobs().empty());
}

TEST_CASE("only the encoder that is wanted runs, once for each value", "[engine][R0.17]") {
  int first = 0, second = 0;
  Thing thing{"arm"};
  auto pushed =
      thing.property<int>("p").representation("a/first", [&](int n) { return ++first, std::to_string(n); }).representation("a/second", [&](int n) {
        return ++second, std::to_string(n);
      });
  Values v(std::move(thing));
  pushed.publish(1);
  v.refresh(v.property(), one(1));
  v.step();
  CHECK((first == 0 && second == 1));
  CHECK(*v.property().value.integer() == 1);
  CHECK(v.values.ready(v.property(), Variant::encoded(1), true));
  CHECK_FALSE(v.values.ready(v.property(), Variant::encoded(0), true));
  CHECK_FALSE(v.values.ready(v.property(), Variant(), true));  // RDF states all sizes
  v.refresh(v.property(), all());
  v.step();
  CHECK((first == 1 && second == 1));
  CHECK(v.values.ready(v.property(), Variant(), true));
}

TEST_CASE("value and encodings change together", "[engine][R0.11][R0.17]") {
  Thing thing{"arm"};
  auto pushed = thing.property<int>("p").representation("a/b", [](int n) { return std::to_string(n); });
  Values v(std::move(thing));
  pushed.publish(1);
  v.refresh(v.property(), all());
  pushed.publish(2);  // while the call waits: it takes the newest
  v.step();
  CHECK(*v.property().value.integer() == 2);
  CHECK(**v.property().encodings[0].bytes == "2");
  pushed.publish(3);
  v.refresh(v.property(), all());
  auto jobs = v.calls.take_jobs();
  for (auto& job : jobs) job.run();
  CHECK(*v.property().value.integer() == 2);  // until the result is there
  v.calls.inbox()->run_all(v.clock.now());
  CHECK(**v.property().encodings[0].bytes == "3");
}

TEST_CASE("a refresh keeps what it made until its requests have been served, whoever comes next", "[engine][R0.11][R0.17]") {
  Thing thing{"arm"};
  auto pushed = thing.property<int>("p").representation("a/b", [](int n) { return std::to_string(n); });
  Values v(std::move(thing));
  pushed.publish(1);
  bool was_ready = false;
  v.values.refresh(v.property(), one(0),
                   [&](const Result<void>&, TimePoint) { was_ready = v.values.ready(v.property(), Variant::encoded(0), true); });
  v.refresh(v.property());  // of a variant that no encoder makes
  auto jobs = v.calls.take_jobs();
  for (auto& job : jobs) job.run();
  pushed.publish(2);
  v.calls.inbox()->run_all(v.clock.now());
  CHECK(was_ready);
  while (v.step() > 0) {}
  CHECK(v.results.size() == 1);
  CHECK(*v.property().value.integer() == 2);
}

TEST_CASE("an encoder that fails is no failed refresh", "[engine][R0.6]") {
  Thing thing{"arm"};
  auto pushed = thing.property<int>("p").representation("a/b", [](int) -> Result<std::string> { return unexpected(Errc::failed, "no film"); });
  Values v(std::move(thing));
  pushed.publish(1);
  v.refresh(v.property(), all());
  v.step();
  CHECK(v.results == std::vector<std::string>{"done"});
  REQUIRE(v.property().encodings[0].made);
  CHECK(v.property().encodings[0].bytes.error().message.find("no film") != std::string::npos);
}

TEST_CASE("a property that goes ends all its refreshes", "[engine][R0.6]") {
  Thing thing{"arm"};
  thing.property("p", [] { return 1; });
  Values v(std::move(thing));
  v.refresh(v.property());
  v.refresh(v.property());
  v.values.cancel(v.property(), v.clock.now());
  CHECK(v.results.size() == 2);
  CHECK(v.results[0].find("removed") != std::string::npos);
  v.step();
  CHECK(v.results.size() == 2);
}

TEST_CASE("requests of a host that does not poll are not kept for ever", "[engine][limits]") {
  Thing thing{"arm"};
  thing.property("p", [] { return 1; });
  Values v(std::move(thing));
  const std::size_t limit = 2 * v.options.max_waiting_requests;
  for (std::size_t i = 0; i < limit; ++i) v.refresh(v.property());
  CHECK(v.results.empty());
  v.refresh(v.property());
  CHECK(v.results.size() == limit);
}

// ------------------------------------------------------------------------------------------------ with all of the engine

namespace {

struct Encoded {
  explicit Encoded(std::size_t keep = 0) {
    Thing thing{"arm"};
    value = thing.property<int>("p").on_write([](int) {}).representation("text/x-n", [this](int n) -> Result<std::string> {
      ++made;
      if (n < 0) return unexpected(Errc::failed, "no film");
      return "n" + std::to_string(n);
    });
    value->representation("text/x-other", [this](int) { return ++others, std::string("other"); });
    if (keep != 0) value->keep(keep);
    bench.add(std::move(thing));
  }
  void publish(int n) {
    value->publish(n);
    bench.look();
  }
  Answer get(const std::string& accept) { return bench.ask("GET /arm/p\nAccept: " + accept); }
  int made = 0, others = 0;
  std::optional<PushedProperty<int>> value;
  Bench bench;
};

}  // namespace

TEST_CASE("RDF states the sizes of the encodings of the value that it states", "[engine][R0.11][R1.2]") {
  Encoded e;
  for (const int n : {9, 99}) {
    e.value->publish(n);
    const Bench::Sent sent = e.bench.send("GET /arm/p\nAccept: text/turtle");
    e.value->publish(n + 1);  // a writer without end
    e.bench.run();
    const Answer a = *e.bench.answer(sent);
    CHECK(a.status == 200);
    const auto shows = [&](int number) {
      const std::string text = std::to_string(number), size = std::to_string(text.size() + 1);
      return missing(a, "<arm/p> vom:numericalValue \"" + text + "\"^^xsd:int . <arm/p?accept=text/x-n> dcat:byteSize \"" + size +
                            "\"^^xsd:nonNegativeInteger .") == "";
    };
    CHECK((shows(n) || shows(n + 1)));
  }
}

TEST_CASE("a subscriber to an encoded variant gets the newest value, by the one encoder", "[engine][R0.12][R0.17]") {
  Encoded e;
  e.publish(1);
  const Channel channel = e.bench.open("/arm/p?accept=text/x-n");
  CHECK(e.bench.messages(channel) == std::vector<std::string>{"n1"});
  e.value->publish(2);
  e.publish(3);
  CHECK(e.bench.messages(channel) == std::vector<std::string>{"n3"});
  CHECK(e.get("application/json").body == "3");
  CHECK(e.get("text/x-n").body == "n3");
  CHECK(e.made == 2);
  CHECK(e.others == 0);
}

TEST_CASE("each value that is kept reaches a queue of an encoded variant, whoever finds it", "[engine][R0.12][R0.17][delivery]") {
  Encoded e(8);
  e.publish(1);
  const Channel queue = e.bench.open("/arm/p?accept=text/x-n&queueLength=100");
  (void)e.bench.pushes();
  std::vector<std::string> expected;
  for (int n = 2; n <= 6; ++n) {
    e.value->publish(n);
    expected.push_back("n" + std::to_string(n));
  }
  SECTION("a scan") { e.bench.look(); }
  SECTION("a GET") { CHECK(e.get("text/x-n").body == "n6"); }
  std::vector<std::string> got = e.bench.messages(queue);
  e.bench.look();  // the newest value is queued by the next scan
  for (std::string& message : e.bench.messages(queue)) got.push_back(std::move(message));
  CHECK(got == expected);
}

TEST_CASE("each value that is kept reaches a queue, also if a GET finds it", "[engine][R0.12][delivery]") {
  Encoded e(8);
  e.publish(1);
  const Channel queue = e.bench.open("/arm/p?accept=application/json&queueLength=100");
  (void)e.bench.pushes();
  for (int n = 2; n <= 4; ++n) e.value->publish(n);
  CHECK(e.get("application/json").body == "4");
  e.bench.look();
  CHECK(e.bench.messages(queue) == std::vector<std::string>{"2", "3", "4"});
}

TEST_CASE("an encoder that fails: 500, and the other variants go on", "[engine][R0.6][R0.17]") {
  Encoded e;
  e.publish(-1);
  CHECK(e.get("text/x-n").status == 500);
  CHECK(e.get("text/x-other").status == 200);
  CHECK(e.get("text/turtle").status == 200);
  CHECK_FALSE(e.get("text/turtle").says("x-n"));
}

TEST_CASE("If-Match takes the tag of an encoded variant, and no other value's", "[engine][R0.11][R0.17]") {
  Encoded e;
  e.publish(1);
  const std::string tag = e.get("text/x-n").tag();
  const auto put = [&](const std::string& field, int n) {
    return e.bench.ask("PUT /arm/p\nContent-Type: application/json\n" + field + "\n\n" + std::to_string(n)).status;
  };
  CHECK(put("If-None-Match: " + tag, 2) == 412);
  CHECK(put("If-Match: \"of nothing\"", 2) == 412);
  CHECK(put("If-Match: " + tag, 2) == 204);
  CHECK(put("If-Match: " + tag, 3) == 412);
  e.publish(1);
  CHECK(put("If-Match: " + tag, 2) == 204);  // the encoder has not run for this value yet
}
