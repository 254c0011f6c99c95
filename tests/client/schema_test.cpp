// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/schema.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/rdf/plain.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/skip.hpp"

namespace schema_test {
enum class Gear { park, drive };
struct Point {
  double x = 0, y = 0;
};
struct Inner {
  float angle = 0;
  std::optional<std::string> label;
  std::vector<std::int8_t> tags;
};
struct Outer {
  Gear gear = Gear::park;
  Inner inner;
  std::array<double, 2> range{};
  std::vector<Inner> way;
  std::map<std::string, double> gains;
  std::chrono::milliseconds after{};
  std::chrono::system_clock::time_point when{};
  std::optional<Point> goal;
  bool on = false;
  std::uint64_t count = 0;
};
struct Odd {
  std::string name;
  int space = 0;
  double x = 0, y = 0;
};
struct Parts {
  std::optional<double> a;
  std::optional<int> b;
};
}  // namespace schema_test

namespace lrt::rdf {
template <>
struct traits<schema_test::Gear> : Enumeration<schema_test::Gear> {
  static void describe(Enumeration<schema_test::Gear>& e) {
    e.name(schema_test::Gear::park, "park").name(schema_test::Gear::drive, "drive \"fast\"");
  }
};
template <>
struct traits<schema_test::Point> : Record<schema_test::Point> {
  static void describe(Record<schema_test::Point>& r) {
    r.is(vocab::maths::Vector2D);
    r.field(vocab::maths::x, &schema_test::Point::x);
    r.field(vocab::maths::y, &schema_test::Point::y);
  }
};
template <>
struct traits<schema_test::Inner> : Record<schema_test::Inner> {
  static void describe(Record<schema_test::Inner>& r) {
    r.field("angle", &schema_test::Inner::angle).unit(unit::degree).at_least(0).below(360);
    r.field("label", &schema_test::Inner::label).length(1, 30);
    r.field("tags", &schema_test::Inner::tags).at_least(-5);
  }
};
template <>
struct traits<schema_test::Outer> : Record<schema_test::Outer> {
  static void describe(Record<schema_test::Outer>& r) {
    using T = schema_test::Outer;
    r.field("gear", &T::gear);
    r.field("inner", &T::inner);
    r.field("range", &T::range).unit(unit::metre).between(-1, 1);
    r.field("way", &T::way);
    r.field("gains", &T::gains);
    r.field("after", &T::after);
    r.field("when", &T::when);
    r.field("goal", &T::goal).unit(unit::metre);
    r.field("on", &T::on);
    r.field("count", &T::count);
  }
};
template <>
struct traits<schema_test::Odd> : Record<schema_test::Odd> {
  static void describe(Record<schema_test::Odd>& r) {
    r.field("full name", &schema_test::Odd::name);
    r.field("per cent %/s", &schema_test::Odd::space);
    r.field(Iri{"http://example.org/a#x"}, &schema_test::Odd::x);
    r.field(Iri{"http://example.org/b#x"}, &schema_test::Odd::y);
  }
};
template <>
struct traits<schema_test::Parts> : Record<schema_test::Parts> {
  static void describe(Record<schema_test::Parts>& r) {
    r.field("a", &schema_test::Parts::a);
    r.field("b", &schema_test::Parts::b);
  }
};
}  // namespace lrt::rdf

namespace {

using lrt::client::Schema;
using lrt::client::SchemaOptions;
using lrt::rdf::Facets;
using lrt::rdf::Graph;
using lrt::rdf::Plain;
using lrt::rdf::TermId;
using lrt::rdf::traits;
using lrt::rdf::Type;
using lrt::rdf::Value;
namespace unit = lrt::unit;
namespace vocab = lrt::vocab;
using Kind = Type::Kind;

const lrt::MediaType json{"application", "json", {}};
const std::string names = "http://example.org/vocabulary#", shape_iri = "http://example.org/shape", focus_iri = "http://example.org/focus";

Graph parse(const std::string& text) {
  static const std::string prefixes =
      "@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
      "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . "
      "@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> . @prefix qudt: <http://qudt.org/schema/qudt/> . "
      "@prefix unit: <http://qudt.org/vocab/unit/> . @prefix schema: <http://schema.org/> .\n";
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/";
  options.max_triples = 1'000'000;
  const auto graph = lrt::rdf::read(prefixes + text, lrt::rdf::Syntax::turtle, options);
  INFO(text.substr(0, 1000));
  if (!graph) FAIL(graph.error().message);
  return *graph;
}
lrt::Result<Schema> read(const std::string& text, const SchemaOptions& options = {}) {
  return Schema::read(parse(text), lrt::rdf::iri("http://example.org/ns#S"), options);
}
std::string all(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& l : lines) text += l + "\n";
  return text;
}
bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// The derived shape gives a Schema that reads and writes what the C++ type does.
void check_round_trip(const Type& type, const Facets& facets, const std::vector<Value>& values, bool required = true) {
  for (const bool input : {true, false}) {
    CAPTURE(input);
    Graph shapes;
    const TermId shape = shapes.intern(lrt::rdf::iri(shape_iri));
    shapes.add(shape, shapes.intern(vocab::rdf_::type), shapes.intern(vocab::sh::NodeShape));
    lrt::shacl::derive(shapes, shape, type, facets, names, {required, input});
    // Over the wire.
    const auto text = lrt::rdf::write(shapes, lrt::rdf::Syntax::turtle);
    REQUIRE(text);
    const Graph received = *lrt::rdf::read(*text, lrt::rdf::Syntax::turtle, {});
    INFO(*text);
    const auto schema = Schema::read(received, lrt::rdf::iri(shape_iri));
    if (!schema) FAIL(schema.error().message);
    INFO(all(schema->warnings()));
    REQUIRE(schema->usable());
    CHECK(schema->warnings().empty());
    const auto compiled = lrt::shacl::Shapes::compile(received);
    REQUIRE(compiled);
    for (const Value& value : values) {
      Graph written;
      const TermId focus = written.intern(lrt::rdf::iri(focus_iri));
      lrt::rdf::write_value(written, focus, type, facets, value, names);
      std::vector<lrt::rdf::Mismatch> mismatches;
      const auto read_back = schema->read_value(written, focus, &mismatches);
      if (!read_back) FAIL_CHECK(read_back.error().message);
      else {
        CHECK(lrt::rdf::same(*read_back, value));
        for (const Plain format : lrt::rdf::all_plain) {
          const auto expected = lrt::rdf::write_plain(type, facets, value, format);
          const auto found = lrt::rdf::write_plain(schema->type(), schema->facets(), *read_back, format);
          REQUIRE(expected);
          REQUIRE(found);
          CHECK(*found == *expected);
          // And from that format back.
          if (format == Plain::text && value.is_null()) continue;
          Graph from_plain;
          const TermId again = from_plain.intern(lrt::rdf::iri(focus_iri));
          if (const auto r = schema->write_plain_value(from_plain, again, *found, lrt::MediaType::parse(lrt::rdf::media_type(format)).value()); !r)
            FAIL_CHECK(r.error().message);
          else if (!contains(*found, "NaN") && !contains(*found, "INF")) CHECK(lrt::rdf::isomorphic(from_plain, written));
        }
        Graph rewritten;
        schema->write_value(rewritten, rewritten.intern(lrt::rdf::iri(focus_iri)), *read_back);
        CHECK(lrt::rdf::isomorphic(rewritten, written));
        const auto report = lrt::shacl::validate(*compiled, rewritten, lrt::rdf::iri(focus_iri), schema->shape());
        REQUIRE(report);
        CHECK(report->to_text() == "");
      }
    }
  }
}
template <class T>
void check_round_trip(const std::vector<T>& values, const Facets& facets = {}, bool required = true) {
  CAPTURE(lrt::rdf::detail::type_name<T>());
  std::vector<Value> encoded;
  for (const T& v : values) encoded.push_back(traits<T>::encode(v));
  check_round_trip(traits<T>::type(), facets, encoded, required);
}

}  // namespace

TEST_CASE("the shape derived from a C++ type gives a schema that reads and writes the same values", "[client][R1.6][R1.11]") {
  using namespace schema_test;
  check_round_trip<bool>({true, false});
  check_round_trip<std::int8_t>({-128, 127});
  check_round_trip<std::uint8_t>({0, 255});
  check_round_trip<std::int16_t>({-32768, 5});
  check_round_trip<std::uint16_t>({65535});
  check_round_trip<std::int32_t>({-7, 7}, Facets(unit::second).between(-10, 10));
  check_round_trip<std::uint32_t>({7}, Facets().at_least(3));
  check_round_trip<std::int64_t>({INT64_MIN, INT64_MAX});
  check_round_trip<std::uint64_t>({0, UINT64_MAX});
  check_round_trip<float>({0.1F, -3.4e38F}, {});
  check_round_trip<double>({0.1, 5e-324, -0.0});
  check_round_trip<double>({0.1, 359}, Facets(unit::degree).at_least(0).below(360));
  check_round_trip<double>({0.75}, Facets(unit::metre).above(0.5));
  check_round_trip<double>({std::nan(""), HUGE_VAL, 3}, Facets().allow_non_finite().at_most(10));
  check_round_trip<double>({std::nan(""), -HUGE_VAL, 3}, Facets().allow_non_finite().between(-10, 10));
  check_round_trip<double>({1.0}, Facets(unit::percent));
  check_round_trip<std::string>({"", "a \"text\"\n"});
  check_round_trip<std::string>({"abc"}, Facets().length(2, 4));
  check_round_trip<std::chrono::nanoseconds>({std::chrono::nanoseconds(-1), std::chrono::nanoseconds(1'500'000'000)});
  check_round_trip<std::chrono::system_clock::time_point>({std::chrono::system_clock::time_point(std::chrono::milliseconds(1))});
  check_round_trip<Gear>({Gear::park, Gear::drive});
  check_round_trip<lrt::test::Mode>({lrt::test::Mode::idle});
  check_round_trip<Point>({{1, 2}}, Facets(unit::metre));
  check_round_trip<lrt::test::Pose>({{}, {1, 2, "arm", 0.5}});
  check_round_trip<Inner>({{}, {90, "a", {1, -5}}});
  check_round_trip<Outer>({{},
                           {Gear::drive,
                            {1, "x", {2}},
                            {0.5, -0.5},
                            {{}, {1, "y", {}}},
                            {{"left", 1}, {"right", 2}},
                            std::chrono::milliseconds(5),
                            {},
                            Point{1, 2},
                            true,
                            7}});
  check_round_trip<Odd>({{"a", 1, 2, 3}});
  check_round_trip<std::vector<double>>({{}, {1, 2, 3}});
  check_round_trip<std::vector<double>>({{}, {1, 2}}, Facets(unit::radian).between(-4, 4));
  check_round_trip<std::array<float, 3>>({{1, 2, 3}});
  check_round_trip<std::array<std::array<double, 2>, 3>>({{}});
  check_round_trip<std::vector<std::vector<std::string>>>({{{"a"}, {}, {"b", "c"}}});
  check_round_trip<std::vector<Point>>({{{1, 2}, {3, 4}}}, Facets(unit::metre));
  check_round_trip<std::vector<Gear>>({{Gear::drive, Gear::drive}});
  check_round_trip<std::map<std::string, double>>({{}, {{"a", 1}, {"b", 2}}}, Facets(unit::volt));
  check_round_trip<std::map<std::string, Point>>({{{"a", {1, 2}}}});
  check_round_trip<std::map<std::string, std::vector<int>>>({{{"a", {1, 2}}, {"", {}}}});
  check_round_trip<std::vector<std::map<std::string, int>>>({{{{"a", 1}}, {}}});
}

TEST_CASE("random values survive the schema of their type", "[client][R1.6]") {
  using namespace schema_test;
  std::mt19937_64 random(11);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  const auto number = [&] { return std::ldexp(static_cast<double>(static_cast<std::int64_t>(random())), static_cast<int>(below(80)) - 100); };
  const auto text = [&] {
    static const char* const pieces[] = {"a", "\"", "\\", "\n", "\xC3\xA9", " ", "<", "1"};
    std::string out = "x";
    for (std::uint64_t i = below(10); i > 0; --i) out += pieces[below(8)];
    return out;
  };
  const auto inner = [&] {
    Inner v;
    v.angle = static_cast<float>(below(3'600)) / 10;
    if (below(2) == 0) v.label = text();
    for (std::uint64_t i = below(4); i > 0; --i) v.tags.push_back(static_cast<std::int8_t>(static_cast<int>(below(100)) - 5));
    return v;
  };
  std::vector<Outer> values;
  for (int i = 0; i < 200; ++i) {
    Outer v;
    v.gear = below(2) == 0 ? Gear::park : Gear::drive;
    v.inner = inner();
    v.range = {static_cast<double>(below(1'000)) / 1'000, -static_cast<double>(below(1'000)) / 1'000};
    for (std::uint64_t n = below(4); n > 0; --n) v.way.push_back(inner());
    for (std::uint64_t n = below(4); n > 0; --n) v.gains[text()] = number();
    v.after = std::chrono::milliseconds(static_cast<std::int64_t>(below(1'000'000)) - 500'000);
    v.when = std::chrono::system_clock::time_point(std::chrono::milliseconds(static_cast<std::int64_t>(below(4'000'000'000'000))));
    if (below(2) == 0) v.goal = Point{number(), number()};
    v.on = below(2) == 0;
    v.count = random();
    values.push_back(std::move(v));
  }
  check_round_trip<Outer>(values);
}

TEST_CASE("values that may be absent are optional in the schema", "[client][R1.6]") {
  using namespace schema_test;
  check_round_trip<std::optional<double>>({std::nullopt, 1.5});
  check_round_trip<std::optional<double>>({std::nullopt, 1.5}, Facets(unit::degree).between(0, 10));
  check_round_trip<std::optional<int>>({std::nullopt, 3});
  check_round_trip<std::optional<std::string>>({std::nullopt, "a"});
  check_round_trip<std::optional<Gear>>({std::nullopt, Gear::drive});
  check_round_trip<std::optional<std::vector<double>>>({std::nullopt, std::vector<double>{1}});
  check_round_trip<std::optional<Inner>>({std::nullopt, Inner{1, "a", {}}});
  check_round_trip<Parts>({{}, {1.0, std::nullopt}, {1.0, 2}});
}

TEST_CASE("a quantity whose coordinates are at another node keeps that node", "[client][R1.6]") {
  Type vector, quantity;
  vector.kind = quantity.kind = Kind::record;
  quantity.classes = {std::string(vocab::spatial::Translation3D.text)};
  quantity.value_predicate = vocab::vom::quantityValue.text;
  quantity.value_classes = {std::string(vocab::maths::Vector3D.text)};
  for (const lrt::Iri p : {vocab::maths::x, vocab::maths::y, vocab::maths::z})
    quantity.fields.push_back({std::string(1, p.text.back()), std::string(p.text), &traits<double>::type(), {}});
  check_round_trip(quantity, Facets(unit::metre), {Value(Value::Sequence{Value(1.0), Value(2.0), Value(3.0)})});
  quantity.value_classes.clear();
  check_round_trip(quantity, {}, {Value(Value::Sequence{Value(1.0), Value(2.0), Value(3.0)})});
  Type pose;
  pose.kind = Kind::record;
  pose.classes = {std::string(vocab::spatial::SpatialRelationship.text)};
  pose.fields.push_back({"translation", std::string(vocab::spatial::translation.text), &quantity, Facets(unit::metre)});
  pose.fields.push_back({"matrix", std::string(vocab::lrt_::matrix.text), &traits<std::array<std::array<double, 2>, 2>>::type(), {}});
  const Value row(Value::Sequence{Value(1.0), Value(2.0)});
  check_round_trip(pose, {}, {Value(Value::Sequence{Value(Value::Sequence{Value(1.0), Value(2.0), Value(3.0)}), Value(Value::Sequence{row, row})})});
}

TEST_CASE("the input of Figure 5a is a number of degrees", "[client][R1.6]") {
  std::ifstream file(LRT_SOURCE_DIR "/tests/conformance/figures/5a.ttl");
  std::stringstream text;
  text << file.rdbuf();
  lrt::rdf::ReadOptions options;
  options.base = "http://robot/baxter/";
  const auto graph = lrt::rdf::read(text.str(), lrt::rdf::Syntax::turtle, options);
  REQUIRE(graph);
  const auto shape = graph->object(lrt::rdf::iri("http://robot/baxter/right_s1/actions/rotate"), vocab::hybrit::consumes);
  REQUIRE(shape);
  const auto schema = Schema::read(*graph, *shape);
  REQUIRE(schema);
  REQUIRE(schema->usable());
  CHECK(schema->warnings().empty());
  CHECK(schema->type().kind == Kind::real);
  CHECK(schema->type().single);
  CHECK(schema->facets().unit() == unit::degree);
  CHECK(schema->facets().min() == Approx(-123.01));
  CHECK(schema->facets().max() == Approx(59.98));
  CHECK_FALSE(schema->facets().max_exclusive());
}

TEST_CASE("the Blueprint of Figure 2a has only links, and the schema says so", "[client][R1.6]") {
  std::ifstream file(LRT_SOURCE_DIR "/tests/conformance/figures/2a.ttl");
  std::stringstream text;
  text << file.rdbuf();
  lrt::rdf::ReadOptions options;
  options.base = "http://robot/";
  const auto graph = lrt::rdf::read(text.str(), lrt::rdf::Syntax::turtle, options);
  REQUIRE(graph);
  const auto schema = Schema::read(*graph, lrt::rdf::iri("http://robot/KIND"));
  REQUIRE(schema);
  REQUIRE(schema->usable());
  CHECK(schema->type().fields.size() >= 2);  // the two properties; of the links, those that have a class
  CHECK(schema->warnings().size() >= 4);
  CHECK(contains(all(schema->warnings()), "ros:rotation: the value is a hybrit:Property"));
}

TEST_CASE("a shape of another author gives a record with what a type can express", "[client][R1.6]") {
  const auto schema = read(R"(ex:S a sh:NodeShape ; sh:targetClass ex:Person ; sh:closed true ; sh:ignoredProperties ( rdf:type ) ;
    sh:property [ sh:path ex:ssn ; sh:maxCount 1 ; sh:datatype xsd:string ; sh:pattern "^\\d{3}-\\d{2}-\\d{4}$" ] ,
      [ sh:path ex:worksFor ; sh:class ex:Company ; sh:nodeKind sh:IRI ] ,
      [ sh:path ex:address ; sh:maxCount 1 ; sh:node ex:Address ] ,
      [ sh:path ex:age ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:integer ; sh:minInclusive 0 ; sh:maxInclusive 150 ] ,
      [ sh:path ex:height ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:decimal ; sh:order 1 ] ,
      [ sh:path ex:born ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:date ; sh:order 0.5 ] ,
      [ sh:path ex:home ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:anyURI ] ,
      [ sh:path [ sh:inversePath ex:parent ] ; sh:minCount 2 ] ,
      [ sh:path ex:status ; sh:minCount 1 ; sh:maxCount 1 ; sh:in ( "a" "b" ) ] ,
      [ sh:path ex:nick ; sh:datatype xsd:string ; sh:minLength 2 ] .
    ex:Address sh:property [ sh:path ex:city ; sh:minCount 1 ; sh:maxCount 1 ; sh:or ( [ sh:datatype xsd:string ] [ sh:datatype rdf:langString ] ) ] .)");
  REQUIRE(schema);
  REQUIRE(schema->usable());
  const Type& type = schema->type();
  INFO(all(schema->warnings()));
  CHECK(type.classes == std::vector<std::string>{"http://example.org/ns#Person"});
  std::string fields;
  for (const auto& f : type.fields) fields += f.name + " ";
  CHECK(fields == "ssn address age home status nick born height ");
  CHECK(type.fields[1].type->element->fields[0].name == "city");
  CHECK(type.fields[2].type->kind == Kind::integer);
  CHECK(type.fields[2].facets.max() == 150.0);
  for (const char* part : {"ex:ssn", "sh:pattern", "worksFor", "sh:closed", "more than one predicate", "more than one value"}) {
    CAPTURE(part);
    const bool found = contains(all(schema->warnings()), part) || (std::string(part) == "ex:ssn" && contains(all(schema->warnings()), "ns#ssn"));
    CHECK(found);
  }
  // What is written conforms, decimals and dates included.
  Graph data;
  const TermId focus = data.intern(lrt::rdf::iri(focus_iri));
  const auto written = schema->write_plain_value(
      data, focus, R"({"ssn":"123-45-6789","address":{"city":"Bonn"},"age":30,"home":"http://x/","status":"b","born":"1990-01-01","height":1.85})",
      json);
  if (!written) FAIL(written.error().message);
  const auto value = schema->read_value(data, focus);
  if (!value) FAIL(value.error().message);
  Graph again;
  schema->write_value(again, again.intern(lrt::rdf::iri(focus_iri)), *value);
  CHECK(lrt::rdf::isomorphic(again, data));
  // Other media types have no value.
  const auto refused = schema->write_plain_value(again, again.intern(lrt::rdf::iri(focus_iri)), "1", {"text", "csv", {}});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == lrt::Errc::unsupported_syntax);
  CHECK(contains(refused.error().message, "text/csv"));
}

TEST_CASE("reals of xsd:decimal are written without an exponent", "[client][R1.6]") {
  const auto schema =
      read("ex:S a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:decimal ] .");
  REQUIRE(schema);
  REQUIRE(schema->usable());
  for (const double number : {1e-7, 1e22, -0.5, 0.0, 123456789.25}) {
    Graph data;
    const TermId focus = data.intern(lrt::rdf::iri(focus_iri));
    schema->write_value(data, focus, Value(number));
    const auto literal = data.object(data.term(focus), vocab::vom::numericalValue);
    REQUIRE(literal);
    CAPTURE(std::string(literal->text));
    CHECK(lrt::rdf::lexical::is_decimal(literal->text));
    CHECK(lrt::rdf::lexical::parse_double(literal->text) == number);
    const auto back = schema->read_value(data, focus);
    REQUIRE(back);
    CHECK(*back->real() == number);
  }
  for (const char* body : {"1e3", "1000"}) {
    Graph data;
    const TermId focus = data.intern(lrt::rdf::iri(focus_iri));
    REQUIRE(schema->write_plain_value(data, focus, body, json));
    CHECK(data.object(data.term(focus), vocab::vom::numericalValue)->text == "1000");
  }
  // A body with an exponent cannot become a decimal by another datatype alone.
  Graph body = parse("<focus> vom:numericalValue 1e3 .");
  const TermId focus = *body.find(lrt::rdf::iri(focus_iri));
  const auto completed = lrt::rdf::completed(body, focus, schema->type(), schema->facets(), {});
  REQUIRE(completed);  // its class
  CHECK(completed->object(lrt::rdf::iri(focus_iri), vocab::vom::numericalValue)->datatype == vocab::xsd::double_.text);
}

TEST_CASE("units of both names of QUDT are read and written", "[client][R1.6]") {
  const auto schema = read(R"(ex:S a sh:NodeShape ; sh:property
      [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ] ,
      [ sh:path qudt:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:hasValue unit:KiloM ] .)");
  REQUIRE(schema);
  REQUIRE(schema->usable());
  CHECK(schema->warnings().empty());
  CHECK(schema->facets().unit().qudt.text == "http://qudt.org/vocab/unit/KiloM");
  Graph received = parse("<focus> a maths:Scalar ; vom:numericalValue 2.5e0 ; qudt:unit unit:KiloM .");
  const auto value = schema->read_value(received, *received.find(lrt::rdf::iri(focus_iri)));
  if (!value) FAIL(value.error().message);
  CHECK(*value->real() == 2.5);
  Graph written;
  schema->write_value(written, written.intern(lrt::rdf::iri(focus_iri)), *value);
  CHECK(written.contains(lrt::rdf::iri(focus_iri), vocab::qudt::unit, lrt::rdf::iri("http://qudt.org/vocab/unit/KiloM")));
  const auto several =
      read(R"(ex:S a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ] ,
      [ sh:path qudt:hasUnit ; sh:minCount 1 ; sh:maxCount 1 ; sh:in ( unit:M unit:MilliM ) ] .)");
  REQUIRE(several);
  CHECK(several->facets().unit() == unit::metre);
  CHECK(contains(all(several->warnings()), "several units"));
}

TEST_CASE("classes that a number must have are written", "[client][R1.6]") {
  const auto schema = read(
      "ex:S a sh:NodeShape ; sh:class ex:Speed ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] .");
  REQUIRE(schema);
  REQUIRE(schema->usable());
  CHECK(schema->type().kind == Kind::integer);
  Graph written;
  schema->write_value(written, written.intern(lrt::rdf::iri(focus_iri)), Value(std::int64_t{5}));
  CHECK(written.contains(lrt::rdf::iri(focus_iri), vocab::rdf_::type, lrt::rdf::iri("http://example.org/ns#Speed")));
}

TEST_CASE("what a type cannot express is a warning with the path and the constraint", "[client][R1.6]") {
  struct {
    const char *constraint, *expected;
  } const table[] = {
      {"sh:datatype xsd:string ; sh:languageIn ( \"de\" )", "sh:languageIn"},
      {"sh:datatype xsd:double ; sh:not [ sh:hasValue 5 ]", "sh:not"},
      {"sh:datatype xsd:double ; sh:lessThan ex:q", "sh:lessThan"},
      {"sh:datatype xsd:string ; sh:pattern \"a*\"", "sh:pattern \"a*\""},
      {"sh:datatype rdf:langString", "language"},
      {"sh:nodeKind sh:IRI", "is an IRI"},
      {"sh:in ( ex:a ex:b )", "are IRIs"},
      {"sh:in ( 1 2 )", "are not texts"},
      {"sh:hasValue 5", "is always"},
      {"sh:hasValue ex:a", "a type does not have"},
      {"sh:class ex:Part", "says nothing"},
      {"sh:minInclusive 3", "no datatype"},
      {"sh:minLength 3", "taken as a text"},
      {"sh:name \"p\"", "does not say what the value is"},
      {"sh:datatype xsd:date ; sh:minInclusive \"2000-01-01\"^^xsd:date", "bounds"},
      {"sh:datatype xsd:dateTime ; sh:minInclusive \"2000-01-01T00:00:00Z\"^^xsd:dateTime", "bounds of xsd:dateTime"},
      {"sh:or ( [ sh:datatype xsd:string ; sh:minLength 3 ] [ sh:nodeKind sh:IRI ] )", "first of 2 alternatives"},
      {"sh:qualifiedValueShape [ sh:class ex:A ] ; sh:qualifiedMinCount 1 ; sh:datatype xsd:int", "qualifiedValueShape"},
      {"sh:node ex:S", "contains itself"},
      {"sh:datatype xsd:double ; sh:minInclusive \"low\"", "is no number"},
  };
  for (const auto& row : table) {
    CAPTURE(row.constraint);
    const auto schema = read(
        "ex:S a sh:NodeShape ; sh:class ex:T ; sh:property [ sh:path ex:other ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:boolean ] , [ "
        "sh:path ex:p ; sh:minCount 1 ; sh:maxCount 1 ; " +
        std::string(row.constraint) + " ] .");
    if (!schema) FAIL(schema.error().message);
    CHECK(schema->usable());
    INFO(all(schema->warnings()));
    CHECK(contains(all(schema->warnings()), row.expected));
    CHECK(contains(all(schema->warnings()), "http://example.org/ns#p"));
  }
}

TEST_CASE("a shape that says nothing of a value gives a schema that says so", "[client][R1.6]") {
  for (const char* text :
       {"ex:S a sh:NodeShape .", "ex:S a sh:NodeShape ; sh:class ex:A .", "ex:S sh:datatype xsd:string .", "ex:S sh:property [ sh:path ex:p ] .",
        "ex:S sh:deactivated true ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] ."}) {
    CAPTURE(text);
    const auto schema = read(text);
    REQUIRE(schema);
    CHECK(!schema->usable());
    REQUIRE(!schema->warnings().empty());
    CHECK(contains(schema->warnings().back(), "says nothing of a value"));
  }
  CHECK(!read("ex:T a sh:NodeShape ."));
}

TEST_CASE("a shape within itself ends, and a mixin at two levels is no recursion", "[client][R1.6]") {
  const auto tree = read(
      "ex:S a sh:NodeShape ; sh:property [ sh:path ex:name ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ] , [ sh:path ex:child ; "
      "sh:maxCount 1 ; sh:node ex:S ] .");
  REQUIRE(tree);
  REQUIRE(tree->usable());
  CHECK(contains(all(tree->warnings()), "contains itself"));
  const auto mixin =
      read(R"(ex:S a sh:NodeShape ; sh:node ex:Named ; sh:property [ sh:path ex:part ; sh:minCount 1 ; sh:maxCount 1 ; sh:node ex:Part ] .
    ex:Part sh:node ex:Named ; sh:property [ sh:path ex:size ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] .
    ex:Named sh:property [ sh:path ex:name ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ] .)");
  REQUIRE(mixin);
  CHECK(mixin->warnings().empty());
  const auto loop = read(
      "ex:S a sh:NodeShape ; sh:node ex:A ; sh:property [ sh:path rdf:value ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ] . ex:A sh:and "
      "( ex:S ex:A ) .");
  REQUIRE(loop);
  CHECK(loop->usable());
}

TEST_CASE("an ill-formed shape is an error with its triple", "[client][R1.6]") {
  for (const char* text :
       {"ex:S sh:property \"x\" .", "ex:S sh:property [ sh:datatype xsd:int ] .", "ex:S sh:property [ sh:path \"p\" ] .", "ex:S sh:and ex:A .",
        "ex:S sh:property [ sh:path ex:p ; sh:minCount \"many\" ] .", "ex:S sh:property [ sh:path ex:p ; sh:maxCount -1 ] .",
        "ex:S sh:property [ sh:path ex:p ; sh:in ex:list ] .", "ex:S sh:property [ sh:path ex:p ; sh:datatype \"int\" ] .", "ex:S sh:node \"n\" .",
        "ex:S sh:or ( \"a\" ) .", "ex:S sh:class 5 .", "ex:S sh:property [ sh:path ex:p ; sh:minInclusive ex:low ] ."}) {
    CAPTURE(text);
    const auto schema = read(text);
    REQUIRE(!schema);
    CHECK(schema.error().code == lrt::Errc::expected_value);
    CHECK(contains(schema.error().message, "expected"));
  }
}

TEST_CASE("a hostile shapes graph ends at the limits", "[client][R1.6]") {
  SECTION("many properties") {
    std::string text = "ex:S a sh:NodeShape .\n";
    for (int i = 0; i < 100'000; ++i) text += "ex:S sh:property [ sh:path ex:p" + std::to_string(i) + " ; sh:maxCount 1 ; sh:datatype xsd:int ] .\n";
    const auto schema = read(text);
    REQUIRE(!schema);
    CHECK(schema.error().code == lrt::Errc::limit_exceeded);
    CHECK(contains(schema.error().message, "1000 properties"));
  }
  SECTION("nested shapes that double at each level") {
    std::string text = "ex:S a sh:NodeShape ; sh:node ex:N0 .\n";
    for (int i = 0; i < 20; ++i)
      for (const char* p : {"a", "b", "c"})
        text += "ex:N" + std::to_string(i) + " sh:property [ sh:path ex:" + p + " ; sh:maxCount 1 ; sh:node ex:N" + std::to_string(i + 1) + " ] .\n";
    const auto schema = read(text);
    REQUIRE(!schema);
    CHECK(schema.error().code == lrt::Errc::limit_exceeded);
  }
  SECTION("deep nesting by sh:node, by properties, by lists") {
    std::string nodes = "ex:S sh:node ex:N0 .\n", properties = "ex:S sh:property [ sh:path ex:p ; sh:node ex:N0 ] .\n",
                lists = "ex:S sh:property [ sh:path rdf:value ; sh:node ex:N0 ] .\n";
    for (int i = 0; i < 5'000; ++i) {
      const std::string next = "ex:N" + std::to_string(i + 1);
      nodes += "ex:N" + std::to_string(i) + " sh:node " + next + " .\n";
      properties += "ex:N" + std::to_string(i) + " sh:property [ sh:path ex:p ; sh:node " + next + " ] .\n";
      lists += "ex:N" + std::to_string(i) + " sh:property [ sh:path ( [ sh:zeroOrMorePath rdf:rest ] rdf:first ) ; sh:node " + next + " ] .\n";
    }
    for (const std::string& text : {nodes, properties, lists}) {
      const auto schema = read(text);
      REQUIRE(!schema);
      CHECK(schema.error().code == lrt::Errc::limit_exceeded);
    }
  }
  SECTION("names, texts and warnings") {
    std::string in = "ex:S sh:property [ sh:path rdf:value ; sh:maxCount 1 ; sh:in (";
    for (int i = 0; i < 1'001; ++i) in += " \"n" + std::to_string(i) + "\"";
    CHECK(read(in + " ) ] .").error().code == lrt::Errc::limit_exceeded);
    CHECK(read("ex:S sh:property [ sh:path rdf:value ; sh:maxCount 1 ; sh:in ( \"" + std::string(100'000, 'x') + "\" ) ] .").error().code ==
          lrt::Errc::limit_exceeded);
    std::string many = "ex:S sh:class ex:A .\n";
    for (int i = 0; i < 500; ++i) many += "ex:S sh:property [ sh:path ex:p" + std::to_string(i) + " ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] .\n";
    const auto schema = read(many);
    REQUIRE(schema);
    CHECK(schema->warnings().size() == 102);
    CHECK(contains(schema->warnings()[100], "400 more warnings"));
  }
}

TEST_CASE("units that strangers name are kept up to a limit for the process", "[client][R1.6]") {
  bool refused = false;
  for (int i = 0; i < 5'000 && !refused; ++i) {
    const auto schema = read(
        "ex:S sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] , [ sh:path qudt:hasUnit ; "
        "sh:hasValue <http://evil/u" +
        std::to_string(i) + "> ] .");
    REQUIRE(schema);
    refused = contains(all(schema->warnings()), "too many different units");
  }
  CHECK(refused);
  const auto known = read(
      "ex:S sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] , [ sh:path qudt:hasUnit ; sh:hasValue "
      "unit:M ] .");
  CHECK(known->facets().unit() == unit::metre);
}

namespace {
struct SuiteCount {
  std::size_t shapes = 0, usable = 0;
};
/// Reads each shape in the Turtle files below a folder: a schema, or an error with a message.
SuiteCount read_all_shapes(const std::string& folder) {
  SuiteCount count;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".ttl") continue;
    std::ifstream file(entry.path());
    std::stringstream text;
    text << file.rdbuf();
    lrt::rdf::ReadOptions options;
    options.base = "http://example.org/suite/";
    const auto graph = lrt::rdf::read(text.str(), lrt::rdf::Syntax::turtle, options);
    if (!graph) continue;
    for (const auto& s : graph->subjects(vocab::rdf_::type, vocab::sh::NodeShape)) {
      CAPTURE(entry.path().string(), std::string(s.text));
      const auto schema = Schema::read(*graph, s);
      ++count.shapes;
      if (!schema) {
        CHECK(!schema.error().message.empty());
        continue;
      }
      CHECK((schema->usable() || !schema->warnings().empty()));
      if (schema->usable()) ++count.usable;
    }
  }
  return count;
}
}  // namespace

TEST_CASE("every shape of the W3C suite gives a schema or an error, never more", "[client][R1.6]") {
  const std::string folder = LRT_SHARED_DIR "/suites/shacl";
  if (!std::filesystem::exists(folder)) {
    lrt::test::print_skip("no W3C suite in " + folder);
    return;
  }
  const SuiteCount count = read_all_shapes(folder);
  CHECK(count.shapes > 50);
  CHECK(count.usable > 20);
}

TEST_CASE("every shape of our own suite gives a schema or an error, never more", "[client][R1.6]") {
  const SuiteCount count = read_all_shapes(LRT_SOURCE_DIR "/tests/conformance/suites/shacl");
  CHECK(count.shapes == 2);
  CHECK(count.usable == 1);
}
