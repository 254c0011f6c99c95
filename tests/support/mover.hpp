// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/thing.hpp>

namespace lrt::test {

struct MoveTo {
  double x = 0, y = 0;
  std::optional<double> speed;
};
enum class Grip : std::uint8_t { open, closed };
/// Moves to a place, grips, takes a height, or holds still.
using Target = std::variant<MoveTo, Grip, double, std::monostate>;
struct Job {
  std::string name = "first";
  Target target;
};
/// With the names that lrt gives: "number" and "text".
using Answer = std::variant<double, std::string>;
/// The same alternatives, and another meaning.
struct Limit : std::variant<double, std::string> {
  using variant::variant;
};

/// A robot whose values are one of several alternatives. Its state is open to tests.
class Mover {
 public:
  Target target = MoveTo{1, 2, {}};  ///< writable
  std::optional<Target> next;        ///< writable
  std::vector<Target> plan;          ///< writable
  Job job;                           ///< writable, a record with a target
  Limit limit{std::string("soft")};  ///< writable
  std::vector<Target> went;          ///< by action go

  bool turns = false;  ///< at each reading the target is another alternative

  /// @param path  of the Thing
  Thing thing(const std::string& path = "mover");
};

}  // namespace lrt::test

template <>
struct lrt::rdf::traits<lrt::test::MoveTo> : lrt::rdf::Record<lrt::test::MoveTo> {
  static void describe(Record<test::MoveTo>& r) {
    r.field("x", &test::MoveTo::x).unit(unit::metre).between(-5, 5);
    r.field("y", &test::MoveTo::y).unit(unit::metre).between(-5, 5);
    r.field("speed", &test::MoveTo::speed).above(0);
  }
};
template <>
struct lrt::rdf::traits<lrt::test::Grip> : lrt::rdf::Enumeration<lrt::test::Grip> {
  static void describe(Enumeration<test::Grip>& e) { e.name(test::Grip::open, "open").name(test::Grip::closed, "closed"); }
};
template <>
struct lrt::rdf::traits<lrt::test::Target> : lrt::rdf::Variant<lrt::test::Target> {
  static void describe(Variant<test::Target>& v) {
    v.named("Target");
    v.alternative<test::MoveTo>("moveTo");
    v.alternative<test::Grip>("grip");
    v.alternative<double>("height").unit(unit::metre).between(0, 2);
    v.alternative<std::monostate>("hold");
  }
};
template <>
struct lrt::rdf::traits<lrt::test::Job> : lrt::rdf::Record<lrt::test::Job> {
  static void describe(Record<test::Job>& r) {
    r.field("name", &test::Job::name);
    r.field("target", &test::Job::target);
  }
};
template <>
struct lrt::rdf::traits<lrt::test::Limit> : lrt::rdf::Variant<lrt::test::Limit> {
  static void describe(Variant<test::Limit>&) {}
};

inline lrt::Thing lrt::test::Mover::thing(const std::string& path) {
  Thing made{path};
  made.property("target",
                [this] {
                  if (turns)
                    target = target.index() == 0   ? Target(Grip::open)
                             : target.index() == 1 ? Target(1.5)
                             : target.index() == 2 ? Target(std::monostate())
                                                   : Target(MoveTo{1, 2, 0.5});
                  return target;
                })
      .on_write([this](Target v) { target = std::move(v); });
  made.property("next", [this] { return next; }).on_write([this](std::optional<Target> v) { next = std::move(v); });
  made.property("plan", [this] { return plan; }).on_write([this](std::vector<Target> v) { plan = std::move(v); });
  made.property("job", [this] { return job; }).on_write([this](Job v) { job = std::move(v); });
  made.property("limit", [this] { return limit; }).on_write([this](Limit v) { limit = std::move(v); });
  made.action("go", [this](const Target& to) -> Answer {
    went.push_back(to);
    if (const MoveTo* place = std::get_if<MoveTo>(&to)) return place->x;
    return std::string("done");
  });
  return made;
}
