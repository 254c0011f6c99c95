// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/variant.hpp>

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "tests/support/catch.hpp"

using lrt::rdf::traits;
using lrt::rdf::Type;
using lrt::rdf::Value;

namespace {

struct MoveJ {
  double speed = 0;
};
struct PIDGains {
  double p = 0;
};
struct LED {};
enum class Pace { slow, fast };
template <class T>
struct Box {
  T content{};
};
struct Motion : std::variant<MoveJ, LED> {
  using variant::variant;
};
struct Plain : std::variant<MoveJ, LED> {};
using Target = std::variant<double, double, std::string>;
using Renamed = std::variant<MoveJ, int>;
using Twice = std::variant<int, bool>;
using Same = std::variant<int, bool, double>;
using Terms = std::variant<double, bool>;

/// Without a default constructor and without assignment.
struct Fixed {
  explicit Fixed(int its) : n(its) {}
  const int n;
};

template <class V>
std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const auto& field : traits<V>::type().fields) all.push_back(field.name);
  return all;
}
template <class V>
void check_round_trip(const V& v) {
  const Value value = traits<V>::encode(v);
  REQUIRE(value.sequence());
  CHECK(value.sequence()->size() == traits<V>::type().fields.size());
  const auto back = traits<V>::decode(value);
  REQUIRE(back);
  CHECK(back->index() == v.index());
  CHECK(traits<V>::same(*back, v));
}

}  // namespace

namespace lrt::rdf {
template <>
struct traits<MoveJ> : Record<MoveJ> {
  static void describe(Record& r) { r.field("speed", &MoveJ::speed); }
};
template <>
struct traits<PIDGains> : Record<PIDGains> {
  static void describe(Record& r) { r.field("p", &PIDGains::p); }
};
template <>
struct traits<LED> : Record<LED> {
  static void describe(Record&) {}
};
template <>
struct traits<Pace> : Enumeration<Pace> {
  static void describe(Enumeration& e) { e.name(Pace::slow, "slow").name(Pace::fast, "fast"); }
};
template <class T>
struct traits<Box<T>> : Record<Box<T>> {
  static void describe(Record<Box<T>>& r) { r.field("content", &Box<T>::content); }
};
template <>
struct traits<Fixed> {
  static const Type& type() { return traits<int>::type(); }
  static Value encode(const Fixed& v) { return traits<int>::encode(v.n); }
  static Result<Fixed> decode(const Value& v) {
    const Result<int> n = traits<int>::decode(v);
    if (!n) return Unexpected{n.error()};
    return Fixed(*n);
  }
  static bool same(const Fixed& a, const Fixed& b) noexcept { return a.n == b.n; }
};
template <>
struct traits<Motion> : Variant<Motion> {
  static void describe(Variant&) {}
};
template <>
struct traits<Plain> : Variant<Plain> {
  static void describe(Variant&) {}
};
template <>
struct traits<Target> : Variant<Target> {
  static void describe(Variant& v) {
    Facets& angle = v.alternative<0>("angle");
    v.alternative<1>("height");
    v.alternative<std::string>("place");
    angle.between(-3, 3);  // it stays where it is
  }
};
template <>
struct traits<Renamed> : Variant<Renamed> {
  static void describe(Variant& v) { v.named("Command").alternative<int>("stop"); }
};
template <>
struct traits<Twice> : Variant<Twice> {
  static void describe(Variant& v) { v.alternative<0>("a"), v.alternative<int>("b"); }
};
template <>
struct traits<Same> : Variant<Same> {
  static void describe(Variant& v) { v.alternative<0>("boolean"); }
};
template <>
struct traits<Terms> : Variant<Terms> {
  static void describe(Variant& v) {
    v.is(Iri("http://example.org/x#Command"));
    v.alternative<0>(Iri("http://example.org/x#speed"));
    v.alternative<1>(Iri("http://example.org/x#stop"));
  }
};
}  // namespace lrt::rdf

TEST_CASE("the alternatives of a variant have plain names", "[rdf][variant]") {
  using All = std::variant<std::monostate, MoveJ, PIDGains, LED, Pace, int, double, bool, std::string, std::vector<int>, std::map<std::string, int>,
                           std::chrono::seconds, std::chrono::system_clock::time_point, Box<int>, Motion>;
  CHECK(names<All>() == std::vector<std::string>{"none", "moveJ", "pidGains", "led", "pace", "integer", "number", "boolean", "text", "list", "map",
                                                 "duration", "instant", "box", "motion"});
  CHECK(traits<All>::type().fault.empty());
  CHECK(traits<std::variant<MoveJ, double>>::type().name == "MoveJ-or-Number");
  CHECK(traits<std::variant<MoveJ, double>>::type().classes == std::vector<std::string>{"#MoveJ-or-Number"});
  CHECK(traits<Motion>::type().name == "Motion");
  CHECK(traits<Motion>::type().fields[1].predicate == "#Motion/led");
  CHECK(names<Renamed>() == std::vector<std::string>{"moveJ", "stop"});
  CHECK(traits<Renamed>::type().fields[0].predicate == "#Command/moveJ");
  CHECK(names<Target>() == std::vector<std::string>{"angle", "height", "place"});
  CHECK(traits<Target>::type().fields[0].facets.max() == 3.0);
  CHECK(names<Terms>() == std::vector<std::string>{"speed", "stop"});
  CHECK(traits<Terms>::type().name.empty());  // no terms of its own
}

TEST_CASE("names that do not tell alternatives apart are a fault of the type", "[rdf][variant]") {
  CHECK(traits<std::variant<int, float, double>>::type().fault.find("alternatives 1 and 2 of a variant have the same name \"number\"") == 4);
  CHECK(traits<std::variant<std::variant<int>, bool>>::type().fault.find("alternative 0 of a variant has no name") == 4);
  CHECK(traits<std::variant<Box<int>, Box<bool>>>::type().fault.find("have the same name \"box\"") != std::string::npos);
  CHECK(traits<Twice>::type().fault.find("\"a\" and \"b\"") != std::string::npos);
  CHECK(traits<Same>::type().fault.find("have the same name \"boolean\"") != std::string::npos);
}

TEST_CASE("a variant goes to a value and back", "[rdf][variant]") {
  CHECK(traits<std::variant<std::monostate, int>>::type().has_fields());
  CHECK_FALSE(traits<int>::type().has_fields());
  check_round_trip(Motion(MoveJ{1}));
  check_round_trip(Motion(LED{}));
  check_round_trip(Plain{std::variant<MoveJ, LED>(MoveJ{1})});
  for (std::size_t i : {0, 1}) check_round_trip(i == 0 ? Target(std::in_place_index<0>, 1) : Target(std::in_place_index<1>, 1));
  CHECK_FALSE(traits<Target>::same(Target(std::in_place_index<0>, 1), Target(std::in_place_index<1>, 1)));
  check_round_trip(std::variant<std::monostate, Motion>(Motion(LED{})));
  check_round_trip(std::variant<std::monostate, Motion>());
  check_round_trip(std::variant<const int, bool>(std::in_place_index<0>, 4));
  check_round_trip(std::variant<Fixed, bool>(Fixed(4)));
  check_round_trip(std::variant<bool, std::vector<Target>>(std::vector<Target>{Target("x")}));
  CHECK_FALSE(traits<Motion>::runs_user_code());
  CHECK(traits<std::variant<Fixed, bool>>::runs_user_code());
  CHECK_FALSE(traits<std::vector<Target>>::runs_user_code());
}

TEST_CASE("a value that is not exactly one alternative is refused", "[rdf][variant]") {
  const auto decode = [](Value::Sequence members) { return traits<Twice>::decode(Value(std::move(members))); };
  CHECK(decode({Value(std::int64_t{1}), Value()}));
  CHECK_FALSE(decode({Value(), Value()}));
  CHECK_FALSE(decode({Value(std::int64_t{1}), Value(true)}));
  CHECK_FALSE(decode({Value(std::int64_t{1})}));
  CHECK_FALSE(decode({Value(), Value(std::int64_t{1})}));  // no boolean
  CHECK_FALSE(traits<Twice>::decode(Value(true)));
  CHECK_FALSE(traits<Twice>::decode(Value()));
}
