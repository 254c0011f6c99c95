// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/traits.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using rdf::Facets;
using rdf::traits;
using rdf::Type;
using rdf::Value;

namespace {

enum class Gear { park, drive };
struct Wheel {
  float radius_m = 0;
  std::optional<int> spokes;
};
struct Car {
  std::string name;
  Gear gear = Gear::park;
  std::array<Wheel, 2> wheels;
  std::vector<std::vector<std::int16_t>> matrix;
  std::chrono::milliseconds age{0};
  std::optional<Wheel> spare;
};

/// C++ to graph to text to graph to C++.
template <class T>
Result<T> round_trip(const T& value, const Facets& facets = {}, rdf::Syntax syntax = rdf::Syntax::turtle) {
  rdf::Graph graph;
  const rdf::TermId focus = graph.intern(rdf::iri("http://localhost/x"));
  rdf::write_value(graph, focus, traits<T>::type(), facets, traits<T>::encode(value), "http://localhost/blueprint");
  const std::string text = rdf::write(graph, syntax).value();
  rdf::ReadOptions options;
  options.base = "http://localhost/";
  const rdf::Graph back = rdf::read(text, syntax, options).value();
  const auto found = back.find(rdf::iri("http://localhost/x"));
  std::vector<rdf::Mismatch> mismatches;
  if (!found) return traits<T>::decode(Value());
  Result<Value> read = rdf::read_value(back, *found, traits<T>::type(), facets, "http://localhost/blueprint", mismatches);
  if (!read) return Unexpected{read.error()};
  return traits<T>::decode(*read);
}

template <class T>
bool survives(const T& value, const Facets& facets = {}) {
  for (const rdf::Syntax syntax : rdf::available_syntaxes()) {
    const Result<T> back = round_trip(value, facets, syntax);
    if (!back) UNSCOPED_INFO(back.error().message);
    if (!back || !traits<T>::same(*back, value)) return false;
  }
  return traits<T>::same(value, value);
}

}  // namespace

template <>
struct lrt::rdf::traits<Gear> : lrt::rdf::Enumeration<Gear> {
  static void describe(Enumeration<Gear>& e) { e.name(Gear::park, "park").name(Gear::drive, "drive"); }
};
template <>
struct lrt::rdf::traits<Wheel> : lrt::rdf::Record<Wheel> {
  static void describe(Record<Wheel>& r) {
    r.field("radius", &Wheel::radius_m).unit(lrt::unit::metre).above(0);
    r.field(Iri{"http://example.org/spokes"}, &Wheel::spokes).at_least(3);
  }
};
template <>
struct lrt::rdf::traits<Car> : lrt::rdf::Record<Car> {
  static void describe(Record<Car>& r) {
    r.is(Iri{"http://example.org/Car"});
    r.field("name", &Car::name).length(1, 10);
    r.field("gear", &Car::gear);
    r.field("wheels", &Car::wheels);
    r.field("matrix", &Car::matrix);
    r.field("age", &Car::age);
    r.field("spare", &Car::spare);
  }
};

TEST_CASE("type() returns the same object at every call", "[model]") {
  CHECK(&traits<double>::type() == &traits<double>::type());
  CHECK(&traits<std::vector<double>>::type() == &traits<std::vector<double>>::type());
  CHECK(&traits<Car>::type() == &traits<Car>::type());
  CHECK(traits<Car>::type().fields.size() == 6);
  CHECK(traits<Car>::type().fields[2].type->element == &traits<Wheel>::type());
}

TEST_CASE("C++ types have their XML Schema datatypes", "[model][R1.5]") {
  CHECK(traits<bool>::type().datatype == vocab::xsd::boolean);
  CHECK(traits<float>::type().datatype == vocab::xsd::float_);
  CHECK(traits<double>::type().datatype == vocab::xsd::double_);
  CHECK(traits<std::string>::type().datatype == vocab::xsd::string);
  CHECK(traits<std::int8_t>::type().datatype == vocab::xsd::byte_);
  CHECK(traits<std::uint8_t>::type().datatype == vocab::xsd::unsignedByte);
  CHECK(traits<std::int16_t>::type().datatype == vocab::xsd::short_);
  CHECK(traits<std::uint16_t>::type().datatype == vocab::xsd::unsignedShort);
  CHECK(traits<std::int32_t>::type().datatype == vocab::xsd::int_);
  CHECK(traits<std::uint32_t>::type().datatype == vocab::xsd::unsignedInt);
  CHECK(traits<std::int64_t>::type().datatype == vocab::xsd::long_);
  CHECK(traits<long long>::type().datatype == vocab::xsd::long_);
  CHECK(traits<std::uint64_t>::type().datatype == vocab::xsd::unsignedLong);
  CHECK(traits<std::chrono::seconds>::type().datatype == vocab::xsd::dayTimeDuration);
  CHECK(traits<std::chrono::system_clock::time_point>::type().datatype == vocab::xsd::dateTime);
  CHECK(traits<Gear>::type().datatype == vocab::xsd::string);
}

TEST_CASE("integers read back at their limits, and values out of range are refused", "[model][R0.5]") {
  CHECK(survives(std::numeric_limits<std::int8_t>::min()));
  CHECK(survives(std::numeric_limits<std::uint8_t>::max()));
  CHECK(survives(std::numeric_limits<std::int16_t>::min()));
  CHECK(survives(std::numeric_limits<std::uint32_t>::max()));
  CHECK(survives(std::numeric_limits<std::int64_t>::min()));
  CHECK(survives(std::numeric_limits<std::int64_t>::max()));
  CHECK(survives(std::numeric_limits<std::uint64_t>::max()));
  CHECK(survives(std::uint64_t{0}));
  CHECK(survives(-0));
  CHECK_FALSE(traits<std::int8_t>::decode(Value(std::int64_t{128})));
  CHECK_FALSE(traits<std::uint8_t>::decode(Value(std::int64_t{-1})));
  CHECK_FALSE(traits<std::int64_t>::decode(Value(std::numeric_limits<std::uint64_t>::max())));
  CHECK_FALSE(traits<int>::decode(Value(1.0)));
  CHECK_FALSE(traits<int>::decode(Value()));
  CHECK_FALSE(traits<bool>::decode(Value(std::int64_t{1})));
  CHECK_FALSE(traits<std::string>::decode(Value(1.0)));
  CHECK_FALSE(traits<double>::decode(Value(std::string("1"))));
}

TEST_CASE("every finite double and float reads back bit-identically", "[model][R0.5]") {
  std::mt19937_64 random(20261121);
  for (int i = 0; i < 20'000; ++i) {
    const std::uint64_t bits = random();
    double d = 0;
    std::memcpy(&d, &bits, sizeof d);
    float f = 0;
    std::memcpy(&f, &bits, sizeof f);
    const auto through = [](auto v) {
      using T = decltype(v);
      rdf::Graph graph;
      const rdf::TermId focus = graph.intern(rdf::iri("http://localhost/x"));
      rdf::write_value(graph, focus, traits<T>::type(), {}, traits<T>::encode(v), {});
      std::vector<rdf::Mismatch> mismatches;
      const Result<Value> back = rdf::read_value(graph, focus, traits<T>::type(), {}, {}, mismatches);
      return back && traits<T>::same(traits<T>::decode(*back).value(), v);
    };
    if (std::isfinite(d) && !through(d)) FAIL(d);
    if (std::isfinite(f) && !through(f)) FAIL(f);
  }
  for (const double d : {0.0, -0.0, 0.1, 1e308, 5e-324, std::numeric_limits<double>::max(), std::numeric_limits<double>::min(), 1.0 / 3})
    CHECK(survives(d));
  for (const float f : {0.0F, -0.0F, 0.1F, 1e-45F, std::numeric_limits<float>::max(), 16777217.0F}) CHECK(survives(f));
}

TEST_CASE("NaN and infinity are accepted only if the facets allow them", "[model][R0.5]") {
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK_FALSE(round_trip(std::nan("")));
  CHECK_FALSE(round_trip(infinity));
  CHECK_FALSE(round_trip(-std::numeric_limits<float>::infinity()));
  const Facets any = Facets{}.allow_non_finite();
  CHECK(survives(infinity, any));
  CHECK(survives(-infinity, any));
  CHECK(std::isnan(round_trip(std::nan(""), any).value()));
}

TEST_CASE("same compares bits", "[model][R0.11]") {
  CHECK_FALSE(traits<double>::same(0.0, -0.0));
  CHECK(traits<double>::same(std::nan(""), std::nan("")));
  CHECK(rdf::same(Value(std::nan("")), Value(std::nan(""))));
  CHECK_FALSE(rdf::same(Value(0.0), Value(-0.0)));
  CHECK_FALSE(rdf::same(Value(1.0), Value(std::int64_t{1})));
  CHECK_FALSE(rdf::same(Value(), Value(false)));
  CHECK(rdf::same(Value(), Value()));
  CHECK(rdf::same(Value(Value::Sequence{Value(1.0), Value()}), Value(Value::Sequence{Value(1.0), Value()})));
  CHECK_FALSE(rdf::same(Value(Value::Sequence{Value(1.0)}), Value(Value::Sequence{Value(1.0), Value()})));
  Car a, b;
  CHECK(traits<Car>::same(a, b));
  b.wheels[1].spokes = 5;
  CHECK_FALSE(traits<Car>::same(a, b));
  a.wheels[1].spokes = 5;
  a.matrix = {{1}};
  CHECK_FALSE(traits<Car>::same(a, b));
}

TEST_CASE("texts, enumerations, durations and instants read back", "[model][R0.5]") {
  using namespace std::chrono;
  for (const char* text : {"", " ", "a\"b\\c\n\r\t", "\u00e9\U0001F916", "<x> ]] > &amp;", "'''\"\"\""}) CHECK(survives(std::string(text)));
  CHECK(survives(true));
  CHECK(survives(false));
  CHECK(survives(Gear::park));
  CHECK(survives(Gear::drive));
  CHECK(survives(nanoseconds(1)));
  CHECK(survives(milliseconds(-1500)));
  CHECK(survives(hours(100000)));
  CHECK(survives(seconds(0)));
  CHECK(survives(system_clock::time_point(nanoseconds(1))));
  CHECK(survives(system_clock::time_point(nanoseconds(-1))));
  CHECK(survives(time_point<std::chrono::system_clock, seconds>(seconds(1795257519))));
  // Ill-formed bytes are replaced by U+FFFD.
  CHECK(round_trip(std::string("a\xff")).value() == "a\xEF\xBF\xBD");
  CHECK(round_trip(std::string("a\0b\xff\0", 5)).value() ==
        "a\xEF\xBF\xBD"
        "b\xEF\xBF\xBD\xEF\xBF\xBD");
  CHECK_FALSE(traits<Gear>::decode(Value(std::string("reverse"))));
  CHECK(*traits<Gear>::encode(static_cast<Gear>(7)).text() == "");  // which no name is
}

TEST_CASE("lists, arrays, optionals and nested records read back", "[model][R0.5]") {
  CHECK(survives(std::vector<double>{}));
  CHECK(survives(std::vector<double>{1, 1, 2}));
  CHECK(survives(std::array<int, 3>{1, 2, 3}));
  CHECK(survives(std::vector<std::vector<std::string>>{{"a"}, {}, {"b", "c"}}));
  CHECK(survives(std::optional<double>{}));
  CHECK(survives(std::optional<double>{1.5}));
  CHECK(survives(std::optional<std::string>{"x"}));
  Car car;
  car.name = "Herbie";
  car.gear = Gear::drive;
  car.wheels[0] = {0.3F, 5};
  car.wheels[1] = {0.4F, {}};
  car.matrix = {{1, -2}, {}};
  car.age = std::chrono::milliseconds(123);
  CHECK(survives(car));
  car.spare = Wheel{0.2F, 3};
  CHECK(survives(car));
  // The length of an array is part of its type, and U+0000 is no character of a text.
  std::vector<rdf::Mismatch> mismatches;
  const rdf::Graph text = test::turtle("<x> rdf:value \"a\\u0000b\" .");
  CHECK_FALSE(rdf::read_value(text, *text.find(rdf::iri("http://localhost/x")), traits<std::string>::type(), {}, {}, mismatches));
  const rdf::Graph graph = test::turtle("<x> rdf:value ( 1 2 ) .");
  CHECK_FALSE(rdf::read_value(graph, *graph.find(rdf::iri("http://localhost/x")), traits<std::array<int, 3>>::type(), {}, {}, mismatches));
}

TEST_CASE("facets of fields are checked", "[model][R0.6]") {
  Car car;
  car.name = "Herbie";
  car.wheels[0] = car.wheels[1] = {0.3F, 5};
  const auto fails = [](const Car& c) { return !round_trip(c); };
  CHECK_FALSE(fails(car));
  Car bad = car;
  bad.name = "";
  CHECK(fails(bad));
  bad.name = "\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9";  // ten characters, twenty bytes
  CHECK_FALSE(fails(bad));
  bad.name += "x";
  CHECK(fails(bad));
  bad = car;
  bad.wheels[1].radius_m = 0;
  CHECK(fails(bad));
  bad = car;
  bad.wheels[1].spokes = 2;
  CHECK(fails(bad));
}

TEST_CASE("mismatches have the path and what was expected and found", "[model][R0.6]") {
  const rdf::Graph graph = test::turtle(
      "<x> a <http://example.org/Car> ; <http://localhost/b#Car/name> 7 ; <http://localhost/b#Car/gear> \"up\" ; <http://localhost/b#Car/age> "
      "\"P1Y\"^^xsd:duration ;"
      " <http://localhost/b#Car/matrix> () ; <http://localhost/b#Car/wheels> ( 1 2 ) .");
  std::vector<rdf::Mismatch> mismatches;
  CHECK_FALSE(rdf::read_value(graph, *graph.find(rdf::iri("http://localhost/x")), traits<Car>::type(), {}, "http://localhost/b#", mismatches));
  REQUIRE(mismatches.size() >= 4);
  for (const rdf::Mismatch& m : mismatches) {
    CHECK_FALSE(m.path.empty());
    CHECK(m.message.find("expected ") == 0);
    CHECK(m.message.find("found ") != std::string::npos);
  }
  CHECK(mismatches[0].path == "<http://localhost/b#Car/name>");
}

TEST_CASE("reading any record ends", "[model][R0.6]") {
  const rdf::Graph graph = test::turtle("<x> rdf:value _:l . _:l rdf:first _:l ; rdf:rest rdf:nil .");
  std::vector<rdf::Mismatch> mismatches;
  using Nested = std::vector<std::vector<std::vector<double>>>;
  CHECK_FALSE(rdf::read_value(graph, *graph.find(rdf::iri("http://localhost/x")), traits<Nested>::type(), {}, {}, mismatches));
}
