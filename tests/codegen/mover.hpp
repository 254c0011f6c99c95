// Made by `lrt generate` of the Blueprints of a robot. Changes are lost when it is made again; `lrt generate --check` tells whether the
// robot still has these Blueprints.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/rdf/traits.hpp>

namespace made {

/// ~/ns/vocabulary#MoveTo
struct MoveTo {
  double x = 0;  ///< [m], at least -5, at most 5
  double y = 0;  ///< [m], at least -5, at most 5
  std::optional<double> speed;  ///< may be absent, above 0
};

enum class Grip {
  open,  ///< "open"
  closed,  ///< "closed"
};

/// ~/ns/vocabulary#Target
/// One of:
///   "moveTo": MoveTo
///   "grip": Grip
///   "height": double, [m], at least 0, at most 2
///   "hold": std::monostate
using Target = std::variant<MoveTo, Grip, double, std::monostate>;

/// ~/ns/vocabulary#Job
struct Job {
  std::string name;
  Target target;
};

/// ~/ns/vocabulary#Limit
/// One of:
///   "number": double
///   "text": std::string
struct Limit : std::variant<double, std::string> {
  using std::variant<double, std::string>::variant;
};

/// ~/ns/vocabulary#Number-or-Text
/// One of:
///   "number": double
///   "text": std::string
struct NumberOrText : std::variant<double, std::string> {
  using std::variant<double, std::string>::variant;
};

}  // namespace made

template <>
struct lrt::rdf::traits<::made::MoveTo> : lrt::rdf::Record<::made::MoveTo> {
  static void describe(Record<::made::MoveTo>& r) {
    r.is(lrt::Iri{"#MoveTo"});
    r.field(lrt::Iri{"#MoveTo/x"}, &::made::MoveTo::x).unit(lrt::unit::metre).at_least(-5).at_most(5);
    r.field(lrt::Iri{"#MoveTo/y"}, &::made::MoveTo::y).unit(lrt::unit::metre).at_least(-5).at_most(5);
    r.field(lrt::Iri{"#MoveTo/speed"}, &::made::MoveTo::speed).above(0);
  }
};

template <>
struct lrt::rdf::traits<::made::Grip> : lrt::rdf::Enumeration<::made::Grip> {
  static void describe(Enumeration<::made::Grip>& e) {
    e.name(::made::Grip::open, "open");
    e.name(::made::Grip::closed, "closed");
  }
};

template <>
struct lrt::rdf::traits<::made::Target> : lrt::rdf::Variant<::made::Target> {
  static void describe(Variant<::made::Target>& v) {
    v.named("Target");
    v.is(lrt::Iri{"#Target"});
    v.alternative<0>(lrt::Iri{"#Target/moveTo"});
    v.alternative<1>(lrt::Iri{"#Target/grip"});
    v.alternative<2>(lrt::Iri{"#Target/height"}).unit(lrt::unit::metre).at_least(0).at_most(2);
    v.alternative<3>(lrt::Iri{"#Target/hold"});
  }
};

template <>
struct lrt::rdf::traits<::made::Job> : lrt::rdf::Record<::made::Job> {
  static void describe(Record<::made::Job>& r) {
    r.is(lrt::Iri{"#Job"});
    r.field(lrt::Iri{"#Job/name"}, &::made::Job::name);
    r.field(lrt::Iri{"#Job/target"}, &::made::Job::target);
  }
};

template <>
struct lrt::rdf::traits<::made::Limit> : lrt::rdf::Variant<::made::Limit> {
  static void describe(Variant<::made::Limit>& v) {
    v.named("Limit");
    v.is(lrt::Iri{"#Limit"});
    v.alternative<0>(lrt::Iri{"#Limit/number"});
    v.alternative<1>(lrt::Iri{"#Limit/text"});
  }
};

template <>
struct lrt::rdf::traits<::made::NumberOrText> : lrt::rdf::Variant<::made::NumberOrText> {
  static void describe(Variant<::made::NumberOrText>& v) {
    v.named("NumberOrText");
    v.is(lrt::Iri{"#Number-or-Text"});
    v.alternative<0>(lrt::Iri{"#Number-or-Text/number"}).allow_non_finite();
    v.alternative<1>(lrt::Iri{"#Number-or-Text/text"});
  }
  static const Type& type() {
    static const lrt::Immortal<Type> changed([] {
      Type t = Variant<::made::NumberOrText>::type();
      t.fields[0].predicate = "#Number-or-Text/number";
      t.fields[1].predicate = "#Number-or-Text/text";
      return t;
    }());
    return *changed;
  }
};

namespace made {

/// mover.
class Mover {
 public:
  /// Takes a Thing of this kind, which has the classes, properties and actions.
  /// @par Errors  expected_value: it is of another kind
  static lrt::Result<Mover> of(lrt::client::Thing thing) {
    lrt::client::Members members(std::move(thing), "Mover", {});
    Mover made(members);
    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());
    return made;
  }
  /// All Things of this kind that a robot has.
  static std::vector<Mover> all(const lrt::client::Robot& robot) { return lrt::client::all_of<Mover>(robot); }

  lrt::client::Thing thing;
  /// job.
  lrt::client::Writable<Job> job;
  /// limit.
  lrt::client::Writable<Limit> limit;
  /// next: may be absent.
  lrt::client::Writable<std::optional<Target>> next;
  /// plan.
  lrt::client::Writable<std::vector<Target>> plan;
  /// target.
  lrt::client::Writable<Target> target;
  /// go.
  lrt::client::TypedAction<Target, NumberOrText> go;

 private:
  explicit Mover(lrt::client::Members& members)
      : thing(members.thing()),
        job(members.property("", "job", true), lrt::rdf::traits<Job>::type(), lrt::unit::none),
        limit(members.property("", "limit", true), lrt::rdf::traits<Limit>::type(), lrt::unit::none),
        next(members.property("", "next", true), lrt::rdf::traits<std::optional<Target>>::type(), lrt::unit::none),
        plan(members.property("", "plan", true), lrt::rdf::traits<std::vector<Target>>::type(), lrt::unit::none),
        target(members.property("", "target", true), lrt::rdf::traits<Target>::type(), lrt::unit::none),
        go(members.action("", "go", true), {lrt::rdf::traits<Target>::type(), lrt::unit::none}, {lrt::rdf::traits<NumberOrText>::type(), lrt::unit::none}) {}
};

}  // namespace made

// Made of:
//   Mover |  |  | no class
//   Mover | action go | by | synchronous
//   Mover | input of action go |  | one of ~/ns/vocabulary#Target
//   Mover | input of action go | ~/ns/vocabulary#Target/grip | one of "open" "closed"
//   Mover | input of action go | ~/ns/vocabulary#Target/height | xsd:double [m unit:M], at least 0, at most 2
//   Mover | input of action go | ~/ns/vocabulary#Target/hold | record
//   Mover | input of action go | ~/ns/vocabulary#Target/moveTo | record ~/ns/vocabulary#MoveTo
//   Mover | input of action go | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/speed | optional xsd:double, above 0
//   Mover | input of action go | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/x | xsd:double [m unit:M], at least -5, at most 5
//   Mover | input of action go | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/y | xsd:double [m unit:M], at least -5, at most 5
//   Mover | output of action go |  | one of ~/ns/vocabulary#Number-or-Text
//   Mover | output of action go | ~/ns/vocabulary#Number-or-Text/number | xsd:double
//   Mover | output of action go | ~/ns/vocabulary#Number-or-Text/text | xsd:string
//   Mover | property job |  | record ~/ns/vocabulary#Job
//   Mover | property job | by | writable ~/ns/vocabulary#Thing/job
//   Mover | property job | ~/ns/vocabulary#Job/name | xsd:string
//   Mover | property job | ~/ns/vocabulary#Job/target | one of ~/ns/vocabulary#Target
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/grip | one of "open" "closed"
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/height | xsd:double [m unit:M], at least 0, at most 2
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/hold | record
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/moveTo | record ~/ns/vocabulary#MoveTo
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/speed | optional xsd:double, above 0
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/x | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property job | ~/ns/vocabulary#Job/target ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/y | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property limit |  | one of ~/ns/vocabulary#Limit
//   Mover | property limit | by | writable ~/ns/vocabulary#Thing/limit
//   Mover | property limit | ~/ns/vocabulary#Limit/number | xsd:double
//   Mover | property limit | ~/ns/vocabulary#Limit/text | xsd:string
//   Mover | property next |  | optional one of
//   Mover | property next | by | writable ~/ns/vocabulary#Thing/next
//   Mover | property next | ~/ns/vocabulary#Target/grip | one of "open" "closed"
//   Mover | property next | ~/ns/vocabulary#Target/height | xsd:double [m unit:M], at least 0, at most 2
//   Mover | property next | ~/ns/vocabulary#Target/hold | record
//   Mover | property next | ~/ns/vocabulary#Target/moveTo | record ~/ns/vocabulary#MoveTo
//   Mover | property next | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/speed | optional xsd:double, above 0
//   Mover | property next | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/x | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property next | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/y | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property plan |  | list of one of ~/ns/vocabulary#Target
//   Mover | property plan | by | writable ~/ns/vocabulary#Thing/plan
//   Mover | property plan | ~/ns/vocabulary#Target/grip | one of "open" "closed"
//   Mover | property plan | ~/ns/vocabulary#Target/height | xsd:double [m unit:M], at least 0, at most 2
//   Mover | property plan | ~/ns/vocabulary#Target/hold | record
//   Mover | property plan | ~/ns/vocabulary#Target/moveTo | record ~/ns/vocabulary#MoveTo
//   Mover | property plan | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/speed | optional xsd:double, above 0
//   Mover | property plan | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/x | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property plan | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/y | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property target |  | one of ~/ns/vocabulary#Target
//   Mover | property target | by | writable ~/ns/vocabulary#Thing/target
//   Mover | property target | ~/ns/vocabulary#Target/grip | one of "open" "closed"
//   Mover | property target | ~/ns/vocabulary#Target/height | xsd:double [m unit:M], at least 0, at most 2
//   Mover | property target | ~/ns/vocabulary#Target/hold | record
//   Mover | property target | ~/ns/vocabulary#Target/moveTo | record ~/ns/vocabulary#MoveTo
//   Mover | property target | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/speed | optional xsd:double, above 0
//   Mover | property target | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/x | xsd:double [m unit:M], at least -5, at most 5
//   Mover | property target | ~/ns/vocabulary#Target/moveTo ~/ns/vocabulary#MoveTo/y | xsd:double [m unit:M], at least -5, at most 5
// Digest: 31de475c2d52fea0
