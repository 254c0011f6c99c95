// SPDX-License-Identifier: Apache-2.0
// A Thing with an input of each kind that the examples have not. Run by random_bodies_test.py.
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/lrt.hpp>

enum class Gear { first, second, reverse };

struct Point {
  float x = 0, y = 0;
};

struct Job {
  std::string name;
  bool urgent = false;
  std::int32_t repeats = 0;
  std::optional<double> speed;
  std::optional<Point> start;
  std::vector<Point> way;
  std::array<std::uint8_t, 3> colour{};
  std::optional<std::chrono::milliseconds> pause;
};

/// Its initialisers are never used: a field that a client leaves out has the default that describe() declares.
struct Span {
  double low = 90, high = 91;
};
struct Tuning {
  double gain = 92, limit = 93;
  std::int32_t count = 94;
  std::string name = "initialiser";
  Gear gear = Gear::reverse;
  bool active = true;
  std::optional<double> offset = 95;
  std::vector<std::int32_t> steps{96};
  Span limits;
  std::map<std::string, double> extra{{"initialiser", 97}};
};

namespace lrt::rdf {
template <>
struct traits<Gear> : Enumeration<Gear> {
  static void describe(Enumeration& e) { e.name(Gear::first, "first").name(Gear::second, "second").name(Gear::reverse, "reverse"); }
};
template <>
struct traits<Point> : Record<Point> {
  static void describe(Record& r) {
    r.field("x", &Point::x).unit(unit::metre).between(-10, 10);
    r.field("y", &Point::y).unit(unit::metre);
  }
};
template <>
struct traits<Job> : Record<Job> {
  static void describe(Record& r) {
    r.field("name", &Job::name).length(1, 8);
    r.field("urgent", &Job::urgent);
    r.field("repeats", &Job::repeats).between(0, 20);
    r.field("speed", &Job::speed).unit(unit::metre_per_second).above(0).below(2);
    r.field("start", &Job::start);
    r.field("way", &Job::way);
    r.field("colour", &Job::colour);
    r.field("pause", &Job::pause);
  }
};
template <>
struct traits<Span> : Record<Span> {
  static void describe(Record& r) {
    r.field("low", &Span::low).value_if_absent(-1).between(-100, 0);
    r.field("high", &Span::high);
  }
};
template <>
struct traits<Tuning> : Record<Tuning> {
  static void describe(Record& r) {
    r.field("gain", &Tuning::gain).unit(unit::metre).between(0, 10).value_if_absent(1.5);
    r.field("limit", &Tuning::limit);
    r.field("count", &Tuning::count).value_if_absent(3).at_least(0);
    r.field("name", &Tuning::name).value_if_absent("none").length(0, 8);
    r.field("gear", &Tuning::gear).value_if_absent(Gear::second);
    r.field("active", &Tuning::active).value_if_absent(false);
    r.field("offset", &Tuning::offset).at_most(50);
    r.field("steps", &Tuning::steps).value_if_absent({4, 5});
    r.field("limits", &Tuning::limits).value_if_absent({-2, 2});
    r.field("extra", &Tuning::extra).value_if_absent({});
  }
};
}  // namespace lrt::rdf

template <class T>
void add(lrt::Thing& thing, const char* name, const lrt::rdf::Facets& facets = {}) {
  auto value = std::make_shared<T>();
  thing.property(name, [value] { return *value; }).on_write([value](const T& wanted) { *value = wanted; }).facets(facets);
}

int main() {
  using lrt::rdf::Facets;
  lrt::Thing thing{"machine"};
  thing.dispatch(lrt::Dispatch::io_thread);
  add<bool>(thing, "on");
  add<std::int64_t>(thing, "count");
  add<std::uint64_t>(thing, "large");
  add<std::int8_t>(thing, "small", Facets().between(-5, 5));
  add<std::uint16_t>(thing, "steps", Facets().unit(lrt::unit::metre));
  add<float>(thing, "single");
  add<float>(thing, "any", Facets().allow_non_finite());
  add<double>(thing, "boundOrNone", Facets().at_least(0).allow_non_finite());
  add<double>(thing, "below", Facets().unit(lrt::unit::radian).at_most(3));
  add<std::string>(thing, "text");
  add<Gear>(thing, "gear");
  add<std::chrono::nanoseconds>(thing, "period");
  add<std::chrono::system_clock::time_point>(thing, "since");
  add<std::vector<std::int32_t>>(thing, "numbers");
  add<std::vector<std::vector<double>>>(thing, "table");
  add<std::array<double, 3>>(thing, "three", Facets().unit(lrt::unit::degree).between(-90, 90));
  add<std::map<std::string, double>>(thing, "named");
  add<std::optional<double>>(thing, "maybe", Facets().unit(lrt::unit::radian));
  add<std::optional<std::int32_t>>(thing, "maybeCount");
  add<std::optional<Point>>(thing, "maybePoint");
  add<Job>(thing, "job");
  add<Tuning>(thing, "tuning");
  add<Tuning>(thing, "twin");
  thing.action("work", [](const Job&) {});
  thing.action("shift", [](const std::optional<Gear>&) {});
  thing.action("turn", [](const std::optional<double>&) {}).unit(lrt::unit::radian).between(-1, 1);

  lrt::Options options;
  options.listen.port = 0;
  auto server = lrt::Server::create(options);
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(thing)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("%s\n", server->url().c_str());
  std::fflush(stdout);
  server->run();
}
