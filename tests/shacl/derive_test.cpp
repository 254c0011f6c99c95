// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/derive.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "tests/shacl/support.hpp"

// rdf::read_value() and the shape derived from the same type and facets accept the same values, after rdf::completed().

namespace test {
enum class Mode { slow, fast };
struct Pose {
  double x = 0;
  float angle = 0;
  std::optional<std::string> frame;
  std::vector<std::int8_t> tags;
};
struct Task {
  Mode mode = Mode::slow;
  Pose pose;
  std::array<double, 2> range{};
  std::vector<Pose> way;
};
}  // namespace test

template <>
struct lrt::rdf::traits<test::Mode> : lrt::rdf::Enumeration<test::Mode> {
  static void describe(Enumeration<test::Mode>& e) { e.name(test::Mode::slow, "slow").name(test::Mode::fast, "fast"); }
};
template <>
struct lrt::rdf::traits<test::Pose> : lrt::rdf::Record<test::Pose> {
  static void describe(Record<test::Pose>& r) {
    r.is(Iri{"http://example.org/ns#Pose"});
    r.field(Iri{"http://example.org/ns#x"}, &test::Pose::x);
    r.field("angle", &test::Pose::angle).unit(lrt::unit::degree).at_least(0).below(360);
    r.field("frame", &test::Pose::frame).length(1, 3);
    r.field("tags", &test::Pose::tags).at_least(-5);
  }
};
template <>
struct lrt::rdf::traits<test::Task> : lrt::rdf::Record<test::Task> {
  static void describe(Record<test::Task>& r) {
    r.field("mode", &test::Task::mode);
    r.field("pose", &test::Task::pose);
    r.field("range", &test::Task::range).unit(lrt::unit::metre);
    r.field("way", &test::Task::way);
  }
};

namespace {

using lrt::rdf::Facets;
using lrt::rdf::Graph;
using lrt::rdf::traits;
using lrt::rdf::Type;
namespace unit = lrt::unit;

const std::string focus = "http://example.org/focus", names = "http://example.org/vocabulary#", shape_iri = "http://example.org/shape";

struct Table {
  const char* name;
  const Type* type;
  Facets facets;
  std::vector<lrt::rdf::Value> values;  ///< written by write_value: must conform
  std::vector<const char*> good, bad;   ///< triples about <focus>; those of test::Pose and test::Task as pose:name and task:name
};

std::vector<Table> tables() {
  using V = lrt::rdf::Value;
  const auto value = [](const auto& v) { return traits<std::decay_t<decltype(v)>>::encode(v); };
  const double infinity = std::numeric_limits<double>::infinity();
  test::Pose pose{1.5, 90.f, "arm", {1, -5, 1}};
  test::Pose bare{-2, 0.f, std::nullopt, {}};
  return {
      {"bool",
       &traits<bool>::type(),
       {},
       {value(true), value(false)},
       {"<focus> rdf:value true", "<focus> rdf:value \"1\"^^xsd:boolean ; ex:more 1"},
       {"<focus> ex:p 1", "<focus> rdf:value 1", "<focus> rdf:value \"yes\"^^xsd:boolean", "<focus> rdf:value true, false",
        "<focus> rdf:value \"true\"", "<focus> rdf:value ex:true"}},
      {"float with unit and range",
       &traits<float>::type(),
       Facets().unit(unit::degree).at_least(0).below(360),
       {V(43.6f), V(0.0), V(359.99f)},
       {"<focus> vom:numericalValue \"43.6\"^^xsd:float ; vom:unit maths:Degree", "<focus> vom:numericalValue 43.6 ; qudt:hasUnit unit:DEG",
        "<focus> vom:numericalValue 43 ; qudt:hasUnit unit:DEG ; vom:unit maths:Degree", "<focus> vom:numericalValue 4.36e1 ; vom:unit maths:Degree",
        "<focus> vom:numericalValue \"7\"^^xsd:unsignedByte ; vom:unit maths:Degree"},
       {"<focus> vom:numericalValue \"360\"^^xsd:float ; vom:unit maths:Degree", "<focus> vom:numericalValue -1 ; vom:unit maths:Degree",
        "<focus> vom:numericalValue \"fast\" ; vom:unit maths:Degree", "<focus> vom:numericalValue \"fast\"^^xsd:float ; vom:unit maths:Degree",
        "<focus> vom:numericalValue 1, 2 ; vom:unit maths:Degree", "<focus> vom:numericalValue 1", "<focus> vom:unit maths:Degree",
        "<focus> vom:numericalValue 1 ; vom:unit maths:Radian", "<focus> vom:numericalValue 1 ; vom:unit maths:Degree ; qudt:hasUnit unit:RAD",
        "<focus> vom:numericalValue 1 ; vom:unit maths:Degree, maths:Radian", "<focus> vom:numericalValue \"NaN\"^^xsd:float ; vom:unit maths:Degree",
        "<focus> vom:numericalValue \"300\"^^xsd:byte ; vom:unit maths:Degree", "<focus> vom:numericalValue true ; vom:unit maths:Degree",
        "<focus> ex:p 1"}},
      {"double without facets",
       &traits<double>::type(),
       {},
       {V(0.0), V(-1e308), V(5e-324), V(std::numeric_limits<double>::max())},
       {"<focus> vom:numericalValue 1e308", "<focus> vom:numericalValue 12345678901234567890123456789", "<focus> vom:numericalValue -0.0"},
       {"<focus> vom:numericalValue \"INF\"^^xsd:double", "<focus> vom:numericalValue \"-INF\"^^xsd:float",
        "<focus> vom:numericalValue \"NaN\"^^xsd:double", "<focus> rdf:value 1.0", "<focus> vom:numericalValue ex:a",
        "<focus> vom:numericalValue \"1\"^^ex:number"}},
      {"float without facets",
       &traits<float>::type(),
       {},
       {V(1.0), V(static_cast<double>(std::numeric_limits<float>::max())), V(static_cast<double>(-std::numeric_limits<float>::max()))},
       {"<focus> vom:numericalValue 3.4e38", "<focus> vom:numericalValue 1e-45"},
       {"<focus> vom:numericalValue 1e-60", "<focus> vom:numericalValue 3.5e38", "<focus> vom:numericalValue -1e39",
        "<focus> vom:numericalValue \"INF\"^^xsd:float"}},
      {"double that may be infinite",
       &traits<double>::type(),
       Facets().allow_non_finite().at_most(10),
       {V(infinity), V(-infinity), V(std::nan("")), V(10.0)},
       {"<focus> vom:numericalValue \"INF\"^^xsd:float", "<focus> vom:numericalValue \"+INF\"^^xsd:double",
        "<focus> vom:numericalValue \"NaN\"^^xsd:double", "<focus> vom:numericalValue 9"},
       {"<focus> vom:numericalValue 11", "<focus> vom:numericalValue 1e400", "<focus> vom:numericalValue \"INF\"^^xsd:decimal",
        "<focus> vom:numericalValue \"INF\"", "<focus> ex:p 1"}},
      {"double above, with a unit of one name",
       &traits<double>::type(),
       Facets().unit(unit::metre).above(0.5),
       {V(0.75)},
       {"<focus> vom:numericalValue 0.51 ; qudt:hasUnit unit:M"},
       {"<focus> vom:numericalValue 0.5 ; qudt:hasUnit unit:M", "<focus> vom:numericalValue 1",
        "<focus> vom:numericalValue 1 ; qudt:hasUnit unit:MilliM", "<focus> vom:numericalValue 1 ; qudt:hasUnit unit:M ; vom:unit maths:Metre"}},
      {"int8",
       &traits<std::int8_t>::type(),
       {},
       {value(std::int8_t{-128}), value(std::int8_t{127})},
       {"<focus> vom:numericalValue 5", "<focus> vom:numericalValue \"5\"^^xsd:long", "<focus> vom:numericalValue \"+005\"^^xsd:positiveInteger",
        "<focus> vom:numericalValue 5.0", "<focus> vom:numericalValue 5e0"},
       {"<focus> vom:numericalValue 128", "<focus> vom:numericalValue -129", "<focus> vom:numericalValue 5.5", "<focus> vom:numericalValue 128e0",
        "<focus> vom:numericalValue \"5\"", "<focus> vom:numericalValue \"-1\"^^xsd:unsignedInt", "<focus> vom:numericalValue 1, 2"}},
      {"uint64",
       &traits<std::uint64_t>::type(),
       {},
       {value(std::numeric_limits<std::uint64_t>::max()), value(std::uint64_t{0})},
       {"<focus> vom:numericalValue 18446744073709551615", "<focus> vom:numericalValue \"-0\"^^xsd:integer"},
       {"<focus> vom:numericalValue 18446744073709551616", "<focus> vom:numericalValue -1"}},
      {"int64 with bounds",
       &traits<std::int64_t>::type(),
       Facets().at_least(-9.5).below(9007199254740994.0),
       {value(std::int64_t{-9}), value(std::int64_t{9007199254740993})},
       {"<focus> vom:numericalValue 9007199254740993"},
       {"<focus> vom:numericalValue 9007199254740994", "<focus> vom:numericalValue -10"}},
      {"int16 with a bound beyond the type",
       &traits<std::int16_t>::type(),
       Facets().at_most(1e9),
       {value(std::int16_t{32767})},
       {},
       {"<focus> vom:numericalValue 32768", "<focus> vom:numericalValue -32769"}},
      {"text",
       &traits<std::string>::type(),
       Facets().length(2, 4),
       {value(std::string("äöüß")), value(std::string("ab"))},
       {"<focus> rdf:value \"abc\""},
       {"<focus> rdf:value \"a\"", "<focus> rdf:value \"äöüßx\"", "<focus> rdf:value \"abc\"@en", "<focus> rdf:value 123",
        "<focus> rdf:value ex:abc"}},
      {"enumeration",
       &traits<test::Mode>::type(),
       {},
       {value(test::Mode::slow), value(test::Mode::fast)},
       {},
       {"<focus> rdf:value \"medium\"", "<focus> rdf:value \"slow\"@en", "<focus> rdf:value ex:slow", "<focus> rdf:value \"slow\", \"fast\"",
        "<focus> ex:p 1"}},
      {"duration",
       &traits<std::chrono::nanoseconds>::type(),
       {},
       {value(std::chrono::nanoseconds(1'500'000'000)), value(std::chrono::nanoseconds(-1))},
       {"<focus> rdf:value \"PT90M\"^^xsd:dayTimeDuration", "<focus> rdf:value \"P1DT1M\"^^xsd:duration"},
       {"<focus> rdf:value \"P1M\"^^xsd:duration", "<focus> rdf:value \"P1Y\"^^xsd:yearMonthDuration",
        "<focus> rdf:value \"1.5\"^^xsd:dayTimeDuration", "<focus> rdf:value \"PT1S\""}},
      {"instant",
       &traits<std::chrono::system_clock::time_point>::type(),
       {},
       {value(std::chrono::system_clock::time_point(std::chrono::seconds(1'700'000'000)))},
       {"<focus> rdf:value \"2024-02-29T12:00:00.5+05:30\"^^xsd:dateTime"},
       {"<focus> rdf:value \"2024-02-29T12:00:00\"^^xsd:dateTime", "<focus> rdf:value \"2023-02-29T12:00:00Z\"^^xsd:dateTime",
        "<focus> rdf:value \"2024-02-29\"^^xsd:date", "<focus> rdf:value \"9999-01-01T00:00:00Z\"^^xsd:dateTime",
        "<focus> rdf:value \"1000-01-01T00:00:00Z\"^^xsd:dateTime"}},
      {"array",
       &traits<std::array<double, 3>>::type(),
       Facets().at_most(10),
       {value(std::array<double, 3>{1, 1, 1})},
       {"<focus> rdf:value ( 1 2.5 1e0 )"},
       {"<focus> rdf:value ( 1 2 )", "<focus> rdf:value ( 1 2 3 4 )", "<focus> rdf:value ( 1 2 11 )", "<focus> rdf:value ( 1 2 \"x\" )",
        "<focus> rdf:value ()", "<focus> rdf:value 1", "<focus> rdf:value [ rdf:first 1 ; rdf:rest [ rdf:first 2 ; rdf:rest [ rdf:first 3 ] ] ]",
        "<focus> rdf:value [ rdf:first 1, 2 ; rdf:rest ( 2 3 ) ]", "<focus> rdf:value _:l . _:l rdf:first 1 ; rdf:rest _:l",
        "<focus> rdf:value [ rdf:first 1 ; rdf:rest ( 2 3 ), ( 4 5 ) ]", "<focus> rdf:value [ rdf:rest ( 2 3 ) ]",
        "<focus> rdf:value ( 1 2 3 ), ( 1 2 3 )"}},
      {"vector with unit",
       &traits<std::vector<float>>::type(),
       Facets().unit(unit::radian),
       {value(std::vector<float>{}), value(std::vector<float>{1, 2, 1})},
       {"<focus> rdf:value ( [ vom:numericalValue 1 ; vom:unit maths:Radian ] )", "<focus> rdf:value ()"},
       {"<focus> rdf:value ( 1 )", "<focus> rdf:value ( [ vom:numericalValue 1 ] )",
        "<focus> rdf:value ( [ vom:numericalValue 1 ; vom:unit maths:Degree ] )", "<focus> rdf:value ( [ vom:unit maths:Radian ] )",
        "<focus> rdf:value \"x\"", "<focus> ex:p 1"}},
      {"optional text",
       &traits<std::optional<std::string>>::type(),
       {},
       {V(), value(std::string("x"))},
       {"<focus> ex:p 1", "<focus> rdf:value \"x\""},
       {"<focus> rdf:value 1", "<focus> rdf:value \"x\", \"y\""}},
      {"optional number",
       &traits<std::optional<double>>::type(),
       Facets().unit(unit::radian),
       {V(), V(1.0)},
       {"<focus> ex:p 1", "<focus> vom:unit maths:Degree", "<focus> vom:numericalValue 1 ; vom:unit maths:Radian"},
       {"<focus> vom:numericalValue 1 ; vom:unit maths:Degree", "<focus> vom:numericalValue 1",
        "<focus> vom:numericalValue \"x\" ; vom:unit maths:Radian"}},
      {"record",
       &traits<test::Pose>::type(),
       {},
       {value(pose), value(bare)},
       {"<focus> ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags ()",
        "<focus> ex:x 1.5 ; pose:angle ex:node ; pose:tags ( 1 \"-5\"^^xsd:byte ) ; pose:frame \"abc\" . ex:node vom:numericalValue 5 ; qudt:hasUnit "
        "unit:DEG"},
       {"<focus> pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags ()", "<focus> ex:x 1 ; pose:angle 5 ; pose:tags ()",
        "<focus> ex:x 1 ; pose:angle [ vom:numericalValue 360 ; vom:unit maths:Degree ] ; pose:tags ()",
        "<focus> ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ]",
        "<focus> ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags ( -6 )",
        "<focus> ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags () ; pose:frame \"\"",
        "<focus> ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags () ; pose:frame \"ab\", \"cd\"",
        "<focus> ex:x \"far\" ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags ()"}},
      {"optional record",
       &traits<std::optional<test::Pose>>::type(),
       {},
       {V(), value(pose)},
       {"<focus> ex:more 1", "<focus> ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags ()"},
       {"<focus> ex:x 1", "<focus> pose:tags ()",
        "<focus> ex:x \"far\" ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags ()"}},
      {"map",
       &traits<std::map<std::string, int>>::type(),
       Facets().at_most(9),
       {value(std::map<std::string, int>{}), value(std::map<std::string, int>{{"a", 1}, {"b", -2}})},
       {"<focus> rdf:value ()", "<focus> rdf:value ( [ <http://schema.org/name> \"a\" ; <http://schema.org/value> 1 ] )"},
       {"<focus> ex:p 1", "<focus> rdf:value 1", "<focus> rdf:value ( 1 )", "<focus> rdf:value ( [ <http://schema.org/name> \"a\" ] )",
        "<focus> rdf:value ( [ <http://schema.org/value> 1 ] )", "<focus> rdf:value ( [ <http://schema.org/name> 1 ; <http://schema.org/value> 1 ] )",
        "<focus> rdf:value ( [ <http://schema.org/name> \"a\", \"b\" ; <http://schema.org/value> 1 ] )",
        "<focus> rdf:value ( [ <http://schema.org/name> \"a\" ; <http://schema.org/value> 10 ] )",
        "<focus> rdf:value ( [ <http://schema.org/name> \"a\" ; <http://schema.org/value> 1, 2 ] )"}},
      {"map with unit",
       &traits<std::map<std::string, double>>::type(),
       Facets().unit(unit::radian),
       {value(std::map<std::string, double>{{"a", 1}})},
       {"<focus> rdf:value ( [ <http://schema.org/name> \"a\" ; <http://schema.org/value> [ vom:numericalValue 1 ; vom:unit maths:Radian ] ] )"},
       {"<focus> rdf:value ( [ <http://schema.org/name> \"a\" ; <http://schema.org/value> 1 ] )"}},
      {"record in record",
       &traits<test::Task>::type(),
       {},
       {value(test::Task{test::Mode::fast, pose, {1, 2}, {bare, pose, bare}})},
       {"<focus> task:mode \"slow\" ; task:pose [ ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags () ] ; task:way "
        "() ; "
        "task:range ( [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] )"},
       {"<focus> task:mode \"slow\" ; task:pose \"here\" ; task:way () ; task:range ( [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] [ "
        "vom:numericalValue 2 ; qudt:hasUnit unit:M ] )",
        "<focus> task:mode \"slow\" ; task:pose [ ex:x 1 ; pose:tags () ] ; task:way () ; task:range ( [ vom:numericalValue 1 ; qudt:hasUnit unit:M "
        "] [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] )",
        "<focus> task:mode \"slow\" ; task:pose [ ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags () ] ; task:way ( "
        "[ ex:x 1 ] ) ; task:range ( [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] )",
        "<focus> task:mode \"slow\" ; task:pose [ ex:x 1 ; pose:angle [ vom:numericalValue 5 ; vom:unit maths:Degree ] ; pose:tags () ] ; task:way "
        "() ; task:range ( 1 2 )"}},
  };
}

lrt::shacl::Shapes shape_of(const Type& type, const Facets& facets, bool required = true) {
  Graph graph;
  const auto shape = graph.intern(lrt::rdf::iri(shape_iri));
  graph.add(shape, graph.intern(lrt::vocab::rdf_::type), graph.intern(lrt::vocab::sh::NodeShape));
  lrt::shacl::derive(graph, shape, type, facets, names, {required});
  auto shapes = lrt::shacl::Shapes::compile(graph);
  if (!shapes) FAIL(shapes.error().message);
  // The Blueprint is served as text: a client reads the same graph.
  const auto text = lrt::rdf::write(graph, lrt::rdf::Syntax::turtle);
  REQUIRE(text);
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/";
  const auto back = lrt::rdf::read(*text, lrt::rdf::Syntax::turtle, options);
  REQUIRE(back);
  auto again = lrt::shacl::Shapes::compile(*back);
  if (!again) FAIL(again.error().message << "\n" << *text);
  return *std::move(again);
}

std::string findings(const lrt::shacl::Shapes& shapes, const Graph& data) {
  const auto report = lrt::shacl::validate(shapes, data, lrt::rdf::iri(focus), lrt::rdf::iri(shape_iri));
  if (!report) FAIL(report.error().message);
  return report->to_text();
}

Graph completed(const Graph& data, const Type& type, const Facets& facets) {
  const auto id = data.find(lrt::rdf::iri(focus));
  std::optional<Graph> out;
  if (id) out = lrt::rdf::completed(data, *id, type, facets, names);
  return out ? *out : data;
}

bool readable(const Graph& data, const Table& t) {
  Graph copy = data;
  std::vector<lrt::rdf::Mismatch> mismatches;
  const auto id = copy.intern(lrt::rdf::iri(focus));
  return static_cast<bool>(lrt::rdf::read_value(copy, id, *t.type, t.facets, names, mismatches));
}

}  // namespace

TEST_CASE("what write_value writes conforms to the derived shape", "[shacl][rdf][R1.11]") {
  for (const Table& t : tables()) {
    DYNAMIC_SECTION(t.name) {
      const auto shapes = shape_of(*t.type, t.facets);
      for (const auto& value : t.values) {
        Graph data;
        const auto id = data.intern(lrt::rdf::iri(focus));
        lrt::rdf::write_value(data, id, *t.type, t.facets, value, names);
        INFO(*lrt::rdf::write(data, lrt::rdf::Syntax::turtle));
        CHECK(findings(shapes, data) == "");
        CHECK(readable(data, t));
      }
    }
  }
}

TEST_CASE("read_value and the derived shape accept and refuse the same", "[shacl][rdf][R1.11]") {
  for (const Table& t : tables()) {
    DYNAMIC_SECTION(t.name) {
      const auto shapes = shape_of(*t.type, t.facets);
      const auto graph = [](const char* triples) {
        return shacl_test::parse("@prefix pose: <" + names + "Pose/> . @prefix task: <" + names + "Task/> . " + triples + " .");
      };
      for (const char* triples : t.good) {
        INFO(triples);
        const Graph body = completed(graph(triples), *t.type, t.facets);
        CHECK(readable(body, t));
        CHECK(findings(shapes, body) == "");
      }
      for (const char* triples : t.bad) {
        INFO(triples);
        const Graph body = completed(graph(triples), *t.type, t.facets);
        CHECK_FALSE(readable(body, t));
        CHECK(findings(shapes, body) != "");
      }
    }
  }
}

TEST_CASE("a derived shape refuses with the right component", "[shacl][R1.11]") {
  const auto shapes = shape_of(traits<float>::type(), Facets().unit(unit::degree).at_least(0).below(360));
  const auto components = [&](const std::string& triples) {
    const Graph body = completed(shacl_test::parse("<focus> " + triples + " ."), traits<float>::type(), Facets().unit(unit::degree));
    const auto report = lrt::shacl::validate(shapes, body, lrt::rdf::iri(focus), lrt::rdf::iri(shape_iri));
    REQUIRE(report);
    std::vector<std::string> found;
    for (const auto& r : report->results()) found.push_back(shacl_test::line(r).substr(focus.size() + 1));
    std::sort(found.begin(), found.end());
    return found;
  };
  using Lines = std::vector<std::string>;
  CHECK(components("vom:numericalValue 43.6 ; vom:unit maths:Degree").empty());
  CHECK(components("vom:numericalValue 360 ; vom:unit maths:Degree") == Lines{"vom:numericalValue \"360\" MaxExclusive"});
  CHECK(components("vom:numericalValue -1 ; vom:unit maths:Degree") == Lines{"vom:numericalValue \"-1\" MinInclusive"});
  CHECK(components("vom:numericalValue 1, 2 ; vom:unit maths:Degree") == Lines{"vom:numericalValue - MaxCount"});
  CHECK(components("vom:numericalValue 1") == Lines{"vom:unit - HasValue", "vom:unit - MinCount"});
  CHECK(components("vom:numericalValue 1 ; vom:unit maths:Radian") == Lines{"vom:unit - HasValue"});
  CHECK(components("vom:unit maths:Degree") == Lines{"vom:numericalValue - MinCount"});
  const auto fast = components("vom:numericalValue \"fast\" ; vom:unit maths:Degree");
  CHECK(std::find(fast.begin(), fast.end(), "vom:numericalValue \"fast\" Datatype") != fast.end());
}

TEST_CASE("a value that is not required may be missing but not wrong", "[shacl][R1.11]") {
  const auto shapes = shape_of(traits<double>::type(), Facets().unit(unit::radian), false);
  CHECK(findings(shapes, shacl_test::parse("<focus> ex:p 1 .")) == "");
  CHECK(findings(shapes, shacl_test::parse("<focus> a maths:Scalar ; vom:numericalValue 1e0 ; vom:unit maths:Radian .")) == "");
  CHECK(findings(shapes, shacl_test::parse("<focus> a maths:Scalar ; vom:numericalValue \"x\" ; vom:unit maths:Radian .")) != "");
}

TEST_CASE("bounds are written in their short form", "[shacl][R1.11]") {
  Graph graph;
  const auto shape = graph.intern(lrt::rdf::iri(shape_iri));
  lrt::shacl::derive(graph, shape, traits<float>::type(), Facets().at_least(-0.5).below(360), names);
  const auto bound = [&](lrt::Iri predicate) {
    const lrt::rdf::TermView p = predicate;
    return lrt::rdf::to_string(graph.term(graph.match(nullptr, &p, nullptr).begin()->object));
  };
  CHECK(bound(lrt::vocab::sh::minInclusive) == "\"-0.5\"^^<http://www.w3.org/2001/XMLSchema#decimal>");
  CHECK(bound(lrt::vocab::sh::maxExclusive) == "\"360\"^^<http://www.w3.org/2001/XMLSchema#integer>");
}

TEST_CASE("a shape has only the bounds that were given, and one datatype", "[shacl][R1.11]") {
  const auto triples_of = [](const Type& type, const Facets& facets) {
    Graph graph;
    lrt::shacl::derive(graph, graph.intern(lrt::rdf::iri(shape_iri)), type, facets, names);
    return graph;
  };
  const auto counts = [](const Graph& graph, lrt::Iri predicate) {
    const lrt::rdf::TermView p = predicate;
    const auto found = graph.match(nullptr, &p, nullptr);
    return std::distance(found.begin(), found.end());
  };
  for (const Type* type : {&traits<double>::type(), &traits<float>::type(), &traits<std::int8_t>::type()}) {
    const Graph graph = triples_of(*type, {});
    CHECK(counts(graph, lrt::vocab::sh::datatype) == 1);
    CHECK(counts(graph, lrt::vocab::sh::or_) == 0);
    for (const lrt::Iri bound :
         {lrt::vocab::sh::minInclusive, lrt::vocab::sh::maxInclusive, lrt::vocab::sh::minExclusive, lrt::vocab::sh::maxExclusive})
      CHECK(counts(graph, bound) == 0);
  }
  CHECK(counts(triples_of(traits<double>::type(), Facets().between(0, 1)), lrt::vocab::sh::pattern) == 0);
  CHECK(counts(triples_of(traits<double>::type(), Facets().at_least(0)), lrt::vocab::sh::pattern) == 1);
}

TEST_CASE("a number that its datatype cannot hold conforms to the shape, and is refused when it is read", "[shacl][rdf]") {
  for (const auto& [type, number] : {std::pair(&traits<double>::type(), "1e400"), std::pair(&traits<float>::type(), "\"1e39\"^^xsd:float")}) {
    const Table table{"", type, {}, {}, {}, {}};
    const Graph body = completed(shacl_test::parse(std::string("<focus> vom:numericalValue ") + number + " ."), *type, {});
    CHECK(findings(shape_of(*type, {}), body) == "");
    CHECK_FALSE(readable(body, table));
  }
}

TEST_CASE("a node of another class is refused", "[shacl][R1.11]") {
  const auto shapes = shape_of(traits<double>::type(), {});
  const auto with = [&](const std::string& type) {
    return findings(shapes, completed(shacl_test::parse("<focus> " + type + " vom:numericalValue 1 ."), traits<double>::type(), {}));
  };
  CHECK(with("") == "");
  CHECK(with("a maths:Scalar , ex:Angle ;") == "");
  CHECK(with("a maths:Vector3D ;") != "");
}

TEST_CASE("the shape of absence conforms if there is no value, whatever else is said of the node", "[shacl][SPEC 3.12]") {
  const auto absent = [](const Type& type, const std::string& data) {
    Graph graph;
    const lrt::rdf::TermId shape = graph.intern(lrt::rdf::iri(shape_iri));
    graph.add(shape, graph.intern(lrt::vocab::rdf_::type), graph.intern(lrt::vocab::sh::NodeShape));
    lrt::shacl::derive_absence(graph, shape, type, names);
    return findings(lrt::shacl::Shapes::compile(std::move(graph)).value(), shacl_test::parse(data)) == "";
  };
  CHECK(absent(traits<double>::type(), "<focus> a maths:Scalar ; qudt:hasUnit unit:M ."));
  CHECK_FALSE(absent(traits<double>::type(), "<focus> vom:numericalValue 1 ."));
  CHECK_FALSE(absent(traits<std::optional<double>>::type(), "<focus> vom:numericalValue 1 ."));
  CHECK(absent(traits<std::string>::type(), "<focus> ex:p 1 ."));
  CHECK_FALSE(absent(traits<std::string>::type(), "<focus> rdf:value \"a\" ."));
  CHECK_FALSE(absent(traits<std::vector<int>>::type(), "<focus> rdf:value () ."));
  CHECK(absent(traits<test::Pose>::type(), "<focus> a ex:Pose ."));
  CHECK_FALSE(absent(traits<test::Pose>::type(), "<focus> ex:x 1 ."));
}

TEST_CASE("a shape that stands in several documents has names for its nodes, and judges as the one without", "[shacl][SPEC 3.19]") {
  const auto derived = [](bool named) {
    Graph graph;
    lrt::shacl::DeriveOptions options;
    options.named = named;
    lrt::shacl::derive(graph, graph.intern(lrt::rdf::iri(shape_iri)), traits<test::Mode>::type(), {}, names, options);
    return graph;
  };
  const Graph named = derived(true), blank = derived(false);
  CHECK(named.size() == blank.size());
  for (const lrt::rdf::Triple& t : named.triples()) {
    CHECK_FALSE(named.term(t.subject).is_blank());
    CHECK_FALSE(named.term(t.object).is_blank());
  }
  Graph twice = named;
  twice.merge(derived(true));
  CHECK(twice.size() == named.size());
}
