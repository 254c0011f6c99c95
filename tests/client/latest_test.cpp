// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/latest.hpp>

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include <lrt/rdf/vocab.hpp>
#include <lrt/rdf/lexical.hpp>

#include "tests/client/watch_support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/watchdog.hpp"

namespace lrt {
namespace {

using client::Change;
using client::Latest;
using client::OnChange;
using client::Via;
using client::Watch;
using client::Watches;
using test::by;
using test::http_client;
using test::PushingRobot;

/// As the code of Client does it with rdf::traits.
Result<double> decode(const Change& change) {
  Result<rdf::Graph> graph = change.graph();
  if (!graph) return unexpected(std::move(graph).error());
  const auto value = graph->object(rdf::iri(change.url), vocab::vom::numericalValue);
  const auto number = value ? rdf::lexical::parse_double(value->text) : std::nullopt;
  if (!number) return unexpected(Errc::expected_value, "no number");
  return *number;
}

TEST_CASE("a loop takes the newest value once, and sees its age, gaps and the connection", "[client][R0.14]") {
  const test::Watchdog watchdog("latest");
  auto robot = std::make_unique<PushingRobot>();
  const std::uint16_t port = robot->server->port();
  robot->angle.publish(1.25);
  Watches watches(http_client(client::Options()));
  Latest<double> latest =
      Latest<double>::follow(
          [&](OnChange on_change) { return watches.watch(robot->url(), by(Via::websocket), std::move(on_change), Watches::Delivery::at_once); },
          decode)
          .value();
  double value = 0;
  CHECK(latest.age() == std::chrono::nanoseconds::max());
  while (!latest.take(value)) std::this_thread::yield();
  CHECK(value == 1.25);
  CHECK_FALSE(latest.take(value));
  CHECK(latest.age() < std::chrono::hours(1));
  CHECK(latest.is_connected());
  robot->angle.publish(2.5);
  while (!latest.take(value)) std::this_thread::yield();
  CHECK(value == 2.5);
  robot.reset();
  while (latest.is_connected()) std::this_thread::yield();
  robot = std::make_unique<PushingRobot>("", port);
  robot->angle.publish(3.5);
  while (value != 3.5) latest.take(value);
  CHECK(latest.counts().gaps == 1);
  CHECK(latest.counts().values >= 3);
  CHECK(latest.counts().unreadable == 0);
  CHECK_FALSE(latest.has_ended());
  latest.stop();
  CHECK_FALSE(latest.is_connected());
}

/// A watch without a network: a test gives it changes.
struct Given {
  Latest<int> follow() {
    return Latest<int>::follow(
               [this](OnChange on_change) {
                 report = std::move(on_change);
                 return Result<Watch>(Watch());
               },
               [](const Change& change) -> Result<int> {
                 if (*change.body == "x") return unexpected(Errc::expected_value, "x");
                 return std::stoi(*change.body);
               })
        .value();
  }
  void value(const std::string& text) const {
    Change change;
    change.body = std::make_shared<const std::string>(text);
    report(change);
  }
  void kind(Change::Kind kind) const {
    Change change;
    change.kind = kind;
    report(change);
  }
  OnChange report;
};

TEST_CASE("values that do not fit, gaps and the end are counted", "[client]") {
  Given given;
  Latest<int> latest = given.follow();
  given.value("1");
  given.value("2");
  given.value("x");
  given.kind(Change::Kind::gap);
  int value = 0;
  CHECK(latest.take(value));
  CHECK(value == 2);
  CHECK(latest.counts().values == 2);
  CHECK(latest.counts().unreadable == 1);
  CHECK(latest.counts().gaps == 1);
  CHECK_FALSE(latest.has_ended());
  given.kind(Change::Kind::ended);
  CHECK(latest.has_ended());
  Latest<int> moved = std::move(latest);
  CHECK_FALSE(latest.take(value));
  given.value("3");
  CHECK(moved.take(value));
  CHECK(value == 3);
  Latest<int> empty;
  CHECK_FALSE(empty.take(value));
  CHECK_FALSE(empty.is_connected());
  CHECK(empty.age() == std::chrono::nanoseconds::max());
}

TEST_CASE("a loop and a decoder on two threads never see half a value", "[client][threads]") {
  struct Pair {
    std::uint64_t a = 0, b = 0;
  };
  OnChange report;
  Latest<Pair> latest = Latest<Pair>::follow(
                            [&](OnChange on_change) {
                              report = std::move(on_change);
                              return Result<Watch>(Watch());
                            },
                            [](const Change& change) -> Result<Pair> {
                              return Pair{change.dropped, ~change.dropped};
                            })
                            .value();
  constexpr std::uint64_t last = 200'000;
  std::thread decoder([&] {
    Change change;
    for (change.dropped = 1; change.dropped <= last; ++change.dropped) report(change);
  });
  Pair pair{0, ~std::uint64_t{0}};
  std::uint64_t before = 0;
  bool is_whole = true, is_newer = true;
  while (pair.a != last) {
    if (!latest.take(pair)) continue;
    is_whole = is_whole && pair.b == ~pair.a;
    is_newer = is_newer && pair.a > before;
    before = pair.a;
  }
  decoder.join();
  CHECK(is_whole);
  CHECK(is_newer);
}

}  // namespace
}  // namespace lrt
