// SPDX-License-Identifier: Apache-2.0
// Things with values and resources of all kinds, whose documents merging_test.py merges.
//
//   merging_robot [VOCABULARY]      the namespace of its terms
//
// The Thing `switch` has properties that change the robot: `present` (the Things `guest` and `spare` are there), `available` (an action of `guest` and one of
// `rig` can be invoked), `published` (the pushed values are there).
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#ifdef MERGING_ROBOT_HAS_QUERY
#include <lrt/query.hpp>
#endif

enum class Gear { first, second, reverse };

struct Point {
  double x = 0, y = 0;  // [m]
};

struct Leg {
  std::string name;
  Point from, to;
  std::vector<Point> way;
  std::optional<double> speed;  // [m/s]
  std::optional<Point> stop;
  std::chrono::milliseconds pause{0};
};

struct Plan {
  Gear gear = Gear::first;
  std::vector<Leg> legs;
};

struct Estimate {
  double length = 0;           // [m]
  std::vector<double> angles;  // [rad]
  Point end;
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
struct traits<Leg> : Record<Leg> {
  static void describe(Record& r) {
    r.field("name", &Leg::name).length(1, 20);
    r.field("from", &Leg::from);
    r.field("to", &Leg::to);
    r.field("way", &Leg::way);
    r.field("speed", &Leg::speed).unit(unit::metre_per_second).above(0);
    r.field("stop", &Leg::stop);
    r.field("pause", &Leg::pause);
  }
};
template <>
struct traits<Plan> : Record<Plan> {
  static void describe(Record& r) {
    r.field("gear", &Plan::gear);
    r.field("legs", &Plan::legs);
  }
};
template <>
struct traits<Estimate> : Record<Estimate> {
  static void describe(Record& r) {
    r.field("length", &Estimate::length).unit(unit::metre);
    r.field("angles", &Estimate::angles).unit(unit::radian);
    r.field("end", &Estimate::end);
  }
};
}  // namespace lrt::rdf

namespace {

using lrt::rdf::Facets;

constexpr lrt::Iri axis{"http://example.org/robots#Axis"};

template <class T>
auto shown(lrt::Thing& thing, const char* name, T value, const Facets& facets = {}) {
  return thing.property(name, [value] { return value; }).facets(facets);
}

/// A value of each kind.
lrt::Thing make_rig() {
  const Leg leg{"out", {0.5, 1}, {2, 3}, {{1, 1}, {1, 2}, {1, 1}}, 0.25, std::nullopt, std::chrono::milliseconds(1500)};
  const Leg back{"back", {2, 3}, {0.5, 1}, {}, std::nullopt, Point{1, 1}, {}};

  lrt::Thing rig{"rig"};
  rig.title("a rig").add_turtle(R"(
    @prefix schema: <http://schema.org/> . @prefix robots: <http://example.org/robots#> .
    <> robots:weight [ schema:value 12.5 ; schema:unitCode "KGM" ] ;
       schema:knows ( <left> "right" [ schema:name "nobody" ; robots:weight [ schema:value 0 ] ] ) .)");
  shown<bool>(rig, "on", true);
  shown<Gear>(rig, "gear", Gear::reverse);
  shown<std::string>(rig, "name", "rig 1");
  shown<std::chrono::milliseconds>(rig, "period", std::chrono::milliseconds(20));
  shown<std::vector<std::int32_t>>(rig, "numbers", {1, 2, 2, 1});
  shown<std::vector<std::int32_t>>(rig, "noNumbers", {});
  shown<std::vector<Point>>(rig, "points", {{1, 2}, {3, 4}, {1, 2}});
  shown<std::vector<std::vector<double>>>(rig, "table", {{1, 2}, {}, {3}});
  shown<std::array<double, 3>>(rig, "three", {1, 0.5, 1}, Facets().unit(lrt::unit::degree).between(-90, 90));
  shown<std::map<std::string, double>>(rig, "named", {{"a", 1}, {"b", 1}});
  shown<std::map<std::string, Point>>(rig, "places", {{"dock", {1, 1}}, {"shelf", {2, 2}}});
  shown<std::optional<double>>(rig, "maybe", std::nullopt, Facets().unit(lrt::unit::radian));
  shown<std::optional<double>>(rig, "surely", 0.5, Facets().unit(lrt::unit::radian));
  shown<std::optional<Point>>(rig, "maybePoint", std::nullopt);
  shown<std::vector<double>>(rig, "many", std::vector<double>(5'000, 0.5)).octets();  // more than max_value_members: the RDF describes the octets
  rig.property("plan", [plan = Plan{Gear::second, {leg, back}}]() mutable { return plan; }).on_write([](const Plan&) {});
  rig.property(
         "speed", [] { return 0.5; }, lrt::unit::metre_per_second)
      .between(-1, 1)
      .on_write([](double) {});
  rig.property<double>("neverPublished", lrt::unit::radian);
  rig.property("unread", []() -> double { throw std::runtime_error("no voltage"); });
  rig.property("unreadPlan", []() -> Plan { throw 7; });
  rig.property("unreadMaybe", []() -> std::optional<Point> { throw 7; });
  rig.property("manyValues", [] { return std::vector<double>(5'000, 0.5); });  // more than max_value_members
  rig.property<Plan>("noPlan");
  rig.action("estimate", [](const Plan& plan) { return Estimate{1.5 * double(plan.legs.size()), {0, 0.5}, {1, 1}}; });
  rig.action("choose", [](const std::optional<Gear>&) {});
  rig.action("stop", [] {}).stop();
  rig.collection<Leg>("legs").on_create([](Leg) {}).on_remove([](const std::string&) {});
  rig.shapes(R"(
    @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
    @prefix schema: <http://schema.org/> . @prefix robots: <http://example.org/robots#> .
    @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
    <#name> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:datatype xsd:string ; sh:minCount 1 ; sh:maxCount 1 ; sh:pattern "^rig [0-9]+$" ] .
    <#weight> a sh:NodeShape ; sh:targetObjectsOf robots:weight ; sh:property [ sh:path schema:value ; sh:minCount 1 ; sh:maxCount 1 ] .)");
  return rig;
}

/// One of two Things of a kind, whose bounds differ.
lrt::Thing make_axis(const char* path, double lower, double upper) {
  lrt::Thing thing{path};
  thing.type(axis);
  auto position = thing.property(
      "position", [middle = (lower + upper) / 2] { return middle; }, lrt::unit::radian);
  position.between(lower, upper).on_write([](double) {});
  thing.action("move", [](double) {}).unit(lrt::unit::radian).between(lower, upper).effect(position, lrt::from_input);
  return thing;
}

}  // namespace

int main(int argc, char** argv) {
  lrt::Options options;
  options.listen.port = 0;
  options.limits.max_value_members = 1'000;
  if (argc > 1) options.vocabulary = argv[1];
#ifdef MERGING_ROBOT_HAS_QUERY
  options.query = lrt::query::endpoint();
#endif
  auto created = lrt::Server::create(options);
  if (!created) return std::fprintf(stderr, "%s\n", created.error().message.c_str()), 1;
  lrt::Server& server = *created;

  lrt::Thing rig = make_rig();
  auto pushed = rig.property<double>("pushed", lrt::unit::radian);
  auto points = rig.property<std::vector<Point>>("pushedPoints");
  lrt::Action calibrate = rig.action("calibrate", [] {});
  lrt::Action greet;
  const auto make_other = [&greet](const std::string& path) {
    if (path == "rig/spare") return make_axis("rig/spare", -3, 0);  // of the kind of `left` and `right`
    lrt::Thing guest{path};
    shown<Point>(guest, "place", {1, 2});
    greet = guest.action("greet", [](const std::string&) {});
    guest.shapes(R"(
      @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
      @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
      <#actions/greet/input> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:datatype xsd:string ; sh:minCount 1 ; sh:pattern "^[A-Z]" ] .)");
    return guest;
  };

  bool present = true, available = true, published = false;
  lrt::Thing control{"switch"};
  control.property("present", [&] { return present; }).on_write([&](bool wanted) -> lrt::Result<void> {
    if (wanted == present) return {};
    present = wanted;
    for (const char* path : {"rig/guest", "rig/spare"})
      if (auto done = wanted ? server.add(make_other(path)) : server.remove(path); !done) return done;
    return {};
  });
  control.property("available", [&] { return available; }).on_write([&](bool wanted) {
    available = wanted;
    calibrate.available(wanted, "it is withdrawn");
    greet.available(wanted, "it is withdrawn");
  });
  control.property("published", [&] { return published; }).on_write([&](bool wanted) -> lrt::Result<void> {
    if (!wanted) return lrt::unexpected(lrt::Errc::refused, "what is published stays");
    published = true;
    pushed.publish(0.25);
    points.publish({{1, 2}, {3, 4}});
    return {};
  });

  std::vector<lrt::Thing> things;
  things.push_back(std::move(rig));
  things.push_back(make_axis("rig/left", -1, 1));
  things.push_back(make_axis("rig/right", -2, 2.5));
  for (const char* path : {"rig/guest", "rig/spare"}) things.push_back(make_other(path));
  things.push_back(std::move(control));
  if (auto added = server.add(std::move(things)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  server.run();
}
