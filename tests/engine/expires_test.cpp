// SPDX-License-Identifier: Apache-2.0
// PropertyHandle::expires(): what clients read of it, and what is refused at set-up.

#include "src/engine/lapses.hpp"

#include <chrono>
#include <string>

#include <lrt/lrt.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using lrt::test::Answer;
using lrt::test::Bench;
using std::chrono::milliseconds;

TEST_CASE("the life of a written value is in the RDF and the JSON of the property, and in its Blueprint", "[engine]") {
  Bench bench;
  Thing thing{"base"};
  auto drive = thing.property<double>("drive", unit::metre_per_second);
  drive.on_write([](double) {});
  drive.expires(milliseconds(200), [] {});
  drive.publish(0);
  thing.property("speed", [] { return 0.0; });
  bench.add(std::move(thing));
  CHECK(lrt::test::missing(bench.get("/base/drive"), "<base/drive> lrt:expiresAfter \"0.2\"^^xsd:double .") == "");
  CHECK_FALSE(bench.get("/base/speed").says("expiresAfter"));
  CHECK(bench.ask("GET /base\nAccept: application/json").says("\"expiresAfter\":0.2"));
  const std::string thing_json = bench.ask("GET /base\nAccept: application/json").body;
  const std::size_t at = thing_json.find("/blueprints/");
  REQUIRE(at != std::string::npos);
  const Answer blueprint = bench.get(thing_json.substr(at, thing_json.find('"', at) - at));
  CHECK(blueprint.says("sh:path lrt:expiresAfter"));
  CHECK(blueprint.says("sh:hasValue \"0.2\"^^xsd:double"));
}

TEST_CASE("things that differ in the life of a value are of two kinds", "[engine]") {
  Bench bench;
  const auto kind_of = [&](const char* path, int ms) {
    Thing thing{path};
    auto drive = thing.property<double>("drive");
    drive.on_write([](double) {});
    if (ms > 0) drive.expires(milliseconds(ms), [] {});
    bench.add(std::move(thing));
    const std::string json = bench.ask("GET /" + std::string(path) + "\nAccept: application/json").body;
    const std::size_t at = json.find("/blueprints/");
    return json.substr(at, json.find('"', at) - at);
  };
  const std::string a = kind_of("a", 200), b = kind_of("b", 300), c = kind_of("c", 0);
  CHECK(a.substr(a.rfind('-')) != b.substr(b.rfind('-')));
  CHECK(a.substr(a.rfind('-')) != c.substr(c.rfind('-')));
}

TEST_CASE("a life needs on_write, and is 1 ms to 1 h", "[engine]") {
  const auto error_of = [](auto set_up) {
    Bench bench;
    Thing thing{"base"};
    auto drive = thing.property<double>("drive");
    set_up(drive);
    const Result<void> added = bench.engine.add(std::move(thing));
    return added ? std::string() : added.error().message;
  };
  CHECK(error_of([](auto& p) { p.expires(milliseconds(200), [] {}); }).find("needs on_write()") != std::string::npos);
  for (const int ms : {0, -5, 3'600'001})
    CHECK(error_of([&](auto& p) { p.on_write([](double) {}), p.expires(milliseconds(ms), [] {}); }).find("expected 1 ms to 1 h") !=
          std::string::npos);
  for (const int ms : {1, 3'600'000}) CHECK(error_of([&](auto& p) { p.on_write([](double) {}), p.expires(milliseconds(ms), [] {}); }).empty());
}

TEST_CASE("a queue gives each property whose life is over once, and knows when the next is due", "[engine]") {
  const auto make = [](int ms, int& lapses) {
    auto property = std::make_shared<model::PropertySpec>();
    property->life = std::make_unique<model::ValueLife>(milliseconds(ms), [&lapses] { ++lapses; });
    return property;
  };
  const auto start = engine::LapseQueue::Instant() + std::chrono::hours(1);
  int first = 0, second = 0;
  const auto a = make(100, first), b = make(200, second);
  engine::Lapses lapses;
  CHECK(lapses.host.next() == engine::LapseQueue::Instant::max());
  lapses.written(a, Dispatch::in_poll, start, true);
  lapses.written(b, Dispatch::in_poll, start, true);
  CHECK(lapses.host.next() == start + milliseconds(100));
  CHECK(lapses.host.take_due(start + milliseconds(99)) == nullptr);
  lapses.written(a, Dispatch::in_poll, start + milliseconds(50), true);
  CHECK(lapses.host.take_due(start + milliseconds(149)) == nullptr);
  CHECK(lapses.host.next() == start + milliseconds(150));
  CHECK(lapses.host.take_due(start + milliseconds(150)) == a);
  CHECK(a->life->take(start + milliseconds(150)));
  CHECK_FALSE(a->life->take(start + milliseconds(150)));
  CHECK(lapses.host.take_due(start + milliseconds(150)) == nullptr);
  CHECK(lapses.host.next() == start + milliseconds(200));
  b->life->end();
  CHECK(lapses.host.take_due(start + milliseconds(500)) == nullptr);
  CHECK(lapses.host.next() == engine::LapseQueue::Instant::max());
  // A write that threw begins a life, and does not renew one.
  lapses.written(a, Dispatch::io_thread, start, false);
  lapses.written(a, Dispatch::io_thread, start + milliseconds(90), false);
  CHECK(lapses.io.next() == start + milliseconds(100));
  CHECK(lapses.io.take_due(start + milliseconds(100)) == a);
  // Of an executor: the queue learns of it later.
  lapses.written(a, Dispatch::executor, start + milliseconds(900), true);
  CHECK(lapses.io.next() == engine::LapseQueue::Instant::max());
  lapses.collect();
  CHECK(lapses.io.next() == start + milliseconds(1000));
}

}  // namespace
