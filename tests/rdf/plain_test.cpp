// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/plain.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>
#include <lrt/shacl/validator.hpp>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lrt::Errc;
namespace unit = lrt::unit;
namespace vocab = lrt::vocab;

namespace plain_test {
enum class Mode { slow, fast };
struct Step {
  double x = 0;
  Mode mode = Mode::slow;
};
struct Move {
  float angle = 0;
  std::optional<std::string> label;
  Step step;
  std::vector<Step> way;
  std::array<double, 2> range{};
};
struct Twins {
  double a = 0, b = 0, c = 0, d = 0;
};
struct Reading {
  double value = 0;
};
struct Nothing {
  std::optional<int> count;
};
}  // namespace plain_test

namespace lrt::rdf {
template <>
struct traits<plain_test::Mode> : Enumeration<plain_test::Mode> {
  static void describe(Enumeration<plain_test::Mode>& e) { e.name(plain_test::Mode::slow, "slow").name(plain_test::Mode::fast, "fast"); }
};
template <>
struct traits<plain_test::Step> : Record<plain_test::Step> {
  static void describe(Record<plain_test::Step>& r) {
    r.is(Iri{"http://example.org/ns#Step"});
    r.field("x", &plain_test::Step::x);
    r.field("mode", &plain_test::Step::mode);
  }
};
template <>
struct traits<plain_test::Move> : Record<plain_test::Move> {
  static void describe(Record<plain_test::Move>& r) {
    r.field("angle", &plain_test::Move::angle).unit(lrt::unit::degree).below(360);
    r.field("label", &plain_test::Move::label);
    r.field("step", &plain_test::Move::step).unit(lrt::unit::metre);
    r.field("way", &plain_test::Move::way);
    r.field("range", &plain_test::Move::range).unit(lrt::unit::metre);
  }
};
template <>
struct traits<plain_test::Twins> : Record<plain_test::Twins> {
  static void describe(Record<plain_test::Twins>& r) {
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#x"}, &plain_test::Twins::a);
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#x"}, &plain_test::Twins::b);
    r.field(lrt::Iri{"http://example.org/x"}, &plain_test::Twins::c);
    r.field("y", &plain_test::Twins::d);
  }
};
template <>
struct traits<plain_test::Reading> : Record<plain_test::Reading> {
  static void describe(Record<plain_test::Reading>& r) { r.field("value", &plain_test::Reading::value).unit(lrt::unit::volt); }
};
template <>
struct traits<plain_test::Nothing> : Record<plain_test::Nothing> {
  static void describe(Record<plain_test::Nothing>& r) { r.field("count", &plain_test::Nothing::count); }
};
}  // namespace lrt::rdf

namespace {

using plain_test::Mode;
using plain_test::Move;
using plain_test::Step;

constexpr std::string_view focus = "http://example.org/focus", names = "http://example.org/vocabulary#";
constexpr std::size_t many = 10'000;

std::string hex(std::string_view bytes) {
  std::string out;
  for (const char c : bytes) {
    out += "0123456789abcdef"[static_cast<unsigned char>(c) >> 4];
    out += "0123456789abcdef"[static_cast<unsigned char>(c) & 15];
  }
  return out;
}
std::string unhex(std::string_view digits) {
  const auto nibble = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::string out;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) out += static_cast<char>(nibble(digits[i]) * 16 + nibble(digits[i + 1]));
  return out;
}

/// The triples that a body adds to the focus node.
lrt::Result<Graph> said(std::string_view body, Plain format, const Type& type, const Facets& facets = {}, std::size_t max_values = many) {
  Graph graph;
  const TermId node = graph.intern(lrt::rdf::iri(focus));
  if (auto r = read_plain(body, format, type, facets, names, max_values, graph, node); !r) return lrt::unexpected(r.error());
  return graph;
}
template <class T>
lrt::Result<Graph> said(std::string_view body, Plain format = Plain::json, const Facets& facets = {}) {
  return said(body, format, traits<T>::type(), facets);
}

Graph written(const Type& type, const Facets& facets, const Value& value) {
  Graph graph;
  write_value(graph, graph.intern(lrt::rdf::iri(focus)), type, facets, value, names);
  return graph;
}

std::string n_triples(const Graph& graph) { return write(graph, Syntax::n_triples).value(); }

template <class T>
lrt::Error refusal(std::string_view body, Plain format = Plain::json, const Facets& facets = {}) {
  const auto graph = said<T>(body, format, facets);
  INFO((format == Plain::json || format == Plain::text ? std::string(body.substr(0, 100)) : hex(body.substr(0, 100))));
  if (graph) FAIL("accepted: " << n_triples(*graph));
  CHECK(graph.error().message.size() < 600);
  return graph.error();
}

/// The only literal that a body adds.
template <class T>
std::string literal_in(std::string_view body, Plain format = Plain::json, const Facets& facets = {}) {
  const auto graph = said<T>(body, format, facets);
  if (!graph) return graph.error().message;
  std::string found;
  for (const Triple& t : graph->triples())
    if (const TermView term = graph->term(t.object); term.is_literal())
      found += (found.empty() ? "" : " ") + std::string(term.text) + "^^" + abbreviate(term.datatype);
  return found;
}

/// The results of the shape that is derived from the type.
std::string findings(const Graph& data, const Type& type, const Facets& facets = {}) {
  Graph graph;
  const TermId shape = graph.intern(lrt::rdf::iri("http://example.org/shape"));
  graph.add(shape, graph.intern(vocab::rdf_::type), graph.intern(vocab::sh::NodeShape));
  lrt::shacl::derive(graph, shape, type, facets, names, {type.kind != Type::Kind::optional});
  const auto report =
      lrt::shacl::validate(lrt::shacl::Shapes::compile(graph).value(), data, lrt::rdf::iri(focus), lrt::rdf::iri("http://example.org/shape"));
  return report.value().to_text();
}

struct Row {
  const Type* type;
  Facets facets;
  Value value;
  std::string json, with_units, text, cbor;
  std::optional<std::string> octets;
};

template <class T>
Row row(const T& value, std::string json, std::string cbor, std::optional<std::string> octets = std::nullopt) {
  return {&traits<T>::type(), {}, traits<T>::encode(value), json, json, json, std::move(cbor), std::move(octets)};
}
Row text(Row r, std::string text) { return r.text = std::move(text), r; }
Row units(Row r, const Facets& facets, std::string with_units) { return r.facets = facets, r.with_units = std::move(with_units), r; }

std::vector<Row> rows() {
  using std::chrono::nanoseconds;
  using std::chrono::system_clock;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Facets any = Facets().allow_non_finite();
  const Facets degrees{unit::degree};
  return {
      row(true, "true", "f5"),
      row(false, "false", "f4"),
      row(std::int8_t{-128}, "-128", "387f", "80"),
      row(std::uint8_t{255}, "255", "18ff", "ff"),
      row(std::int16_t{-2}, "-2", "21", "feff"),
      row(std::uint16_t{65535}, "65535", "19ffff", "ffff"),
      row(std::int32_t{-100000}, "-100000", "3a0001869f", "6079feff"),
      row(std::uint32_t{23}, "23", "17", "17000000"),
      row(std::numeric_limits<std::int64_t>::min(), "-9223372036854775808", "3b7fffffffffffffff", "0000000000000080"),
      row(std::numeric_limits<std::uint64_t>::max(), "18446744073709551615", "1bffffffffffffffff", "ffffffffffffffff"),
      row(43.6F, "43.6", "fa422e6666", "66662e42"),
      row(0.1, "0.1", "fb3fb999999999999a", "9a9999999999b93f"),
      row(1.0, "1", "fb3ff0000000000000", "000000000000f03f"),
      row(-0.0, "-0", "fb8000000000000000", "0000000000000080"),
      row(1e21, "1e+21", "fb444b1ae4d6e2ef50", "50efe2d6e41a4b44"),
      row(5e-324, "5e-324", "fb0000000000000001", "0100000000000000"),
      row(std::numeric_limits<float>::max(), "3.4028235e+38", "fa7f7fffff", "ffff7f7f"),
      units(text(row(std::nan(""), "\"NaN\"", "fb7ff8000000000000", "000000000000f87f"), "NaN"), any, "\"NaN\""),
      units(text(row(static_cast<float>(-infinity), "\"-INF\"", "faff800000", "000080ff"), "-INF"), any, "\"-INF\""),
      text(row(std::string("fast"), "\"fast\"", "6466617374"), "fast"),
      text(row(std::string(), "\"\"", "60"), ""),
      text(row(std::string(" a\"b\\c\n\t\x01 "), "\" a\\\"b\\\\c\\n\\t\\u0001 \"", "6a206122625c630a090120"), " a\"b\\c\n\t\x01 "),
      text(row(std::string("grüß 🤖"), "\"grüß 🤖\"", "6b6772c3bcc39f20f09fa496"), "grüß 🤖"),
      text(row(Mode::fast, "\"fast\"", "6466617374"), "fast"),
      text(row(nanoseconds(1'500'000'000), "\"PT1.5S\"", "665054312e3553"), "PT1.5S"),
      text(row(system_clock::time_point(std::chrono::seconds(0)), "\"1970-01-01T00:00:00Z\"", "74" + hex("1970-01-01T00:00:00Z")),
           "1970-01-01T00:00:00Z"),
      row(std::array<double, 2>{0.5, -2}, "[0.5,-2]", "82fb3fe0000000000000fbc000000000000000", "000000000000e03f00000000000000c0"),
      row(std::vector<std::int16_t>{}, "[]", "80", ""),
      row(std::vector<std::int16_t>{1, -1, 256}, "[1,-1,256]", "830120190100", "0100ffff0001"),
      row(std::vector<std::array<float, 2>>{{{1, 2}}, {{3, 4}}}, "[[1,2],[3,4]]", "8282fa3f800000fa4000000082fa40400000fa40800000",
          "0000803f000000400000404000008040"),
      row(std::array<std::vector<std::int16_t>, 2>{{{1, 2, 3}, {4, 5, 6}}}, "[[1,2,3],[4,5,6]]", "828301020383040506", "010002000300040005000600"),
      row(std::array<std::vector<double>, 2>{}, "[[],[]]", "828080", ""),
      row(std::vector<std::vector<std::string>>{{"a"}, {}}, "[[\"a\"],[]]", "8281616180"),
      row(std::vector<bool>(24, true),
          "[true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true,true]",
          "9818f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5f5"),
      row(std::optional<int>(5), "5", "05", "05000000"),
      text(row(std::optional<int>(), "null", "f6"), ""),
      row(Step{1, Mode::fast}, "{\"x\":1,\"mode\":\"fast\"}", "a26178fb3ff0000000000000646d6f64656466617374"),
      row(plain_test::Nothing{}, "{}", "a0"),
      row(std::optional<plain_test::Nothing>(plain_test::Nothing{}), "{}", "a0"),
      row(std::optional<plain_test::Nothing>(plain_test::Nothing{5}), "{\"count\":5}",
          "a1"
          "65" +
              hex("count") + "05"),
      text(row(std::optional<plain_test::Nothing>(), "null", "f6"), ""),
      row(std::map<std::string, int>{}, "{}", "a0"),
      row(std::map<std::string, int>{{"b", 1}, {"", 2}, {"a \"b", 3}}, "{\"\":2,\"a \\\"b\":3,\"b\":1}",
          "a3"
          "60"
          "02"
          "64" +
              hex("a \"b") +
              "03"
              "6162"
              "01"),
      row(std::unordered_map<std::string, int>{{"b", 1}, {"a", 2}}, "{\"a\":2,\"b\":1}",
          "a2"
          "6161"
          "02"
          "6162"
          "01"),
      row(std::map<std::string, Step>{{"value", {1, Mode::fast}}}, "{\"value\":{\"x\":1,\"mode\":\"fast\"}}",
          "a1"
          "65" +
              hex("value") + "a26178fb3ff0000000000000646d6f64656466617374"),
      units(row(std::map<std::string, float>{{"unit", 1}, {"value", 2}}, "{\"unit\":1,\"value\":2}",
                "a2"
                "64" +
                    hex("unit") +
                    "fa3f800000"
                    "65" +
                    hex("value") + "fa40000000"),
            degrees, "{\"unit\":{\"value\":1,\"unit\":\"deg\"},\"value\":{\"value\":2,\"unit\":\"deg\"}}"),
      units(row(std::vector<std::map<std::string, float>>{{{"a", 1}}, {}}, "[{\"a\":1},{}]",
                "82a1"
                "6161"
                "fa3f800000"
                "a0"),
            degrees, "[{\"a\":{\"value\":1,\"unit\":\"deg\"}},{}]"),
      units(row(std::map<std::string, std::vector<float>>{{"a", {1, 2}}}, "{\"a\":[1,2]}",
                "a1"
                "6161"
                "82fa3f800000fa40000000"),
            degrees, "{\"a\":{\"value\":[1,2],\"unit\":\"deg\"}}"),
      row(std::map<std::string, std::map<std::string, bool>>{{"a", {{"b", true}}}}, "{\"a\":{\"b\":true}}",
          "a1"
          "6161"
          "a1"
          "6162"
          "f5"),
      row(plain_test::Twins{1, 2, 3, 4}, "{\"maths:x\":1,\"spatial:x\":2,\"http://example.org/x\":3,\"y\":4}",
          "a4"
          "67" +
              hex("maths:x") +
              "fb3ff0000000000000"
              "69" +
              hex("spatial:x") +
              "fb4000000000000000"
              "74" +
              hex("http://example.org/x") +
              "fb4008000000000000"
              "6179"
              "fb4010000000000000"),
      units(row(43.6F, "43.6", "fa422e6666", "66662e42"), degrees, "{\"value\":43.6,\"unit\":\"deg\"}"),
      units(row(std::array<std::uint8_t, 2>{1, 2}, "[1,2]", "820102", "0102"), degrees, "{\"value\":[1,2],\"unit\":\"deg\"}"),
      units(row(Step{1, Mode::slow}, "{\"x\":1,\"mode\":\"slow\"}", "a26178fb3ff0000000000000646d6f646564736c6f77"), degrees,
            "{\"value\":{\"x\":1,\"mode\":\"slow\"},\"unit\":\"deg\"}"),
      units(row(plain_test::Reading{5}, "{\"value\":5}", "a16576616c7565fb4014000000000000"), degrees, "{\"value\":{\"value\":5,\"unit\":\"V\"}}"),
      units(row(Move{90, std::nullopt, {}, {{1, Mode::fast}}, {{1, 2}}},
                "{\"angle\":90,\"step\":{\"x\":0,\"mode\":\"slow\"},\"way\":[{\"x\":1,\"mode\":\"fast\"}],\"range\":[1,2]}",
                "a465616e676c65fa42b400006473746570a26178fb0000000000000000646d6f646564736c6f776377617981a26178fb3ff0000000000000646d6f646564"
                "666173746572616e676582fb3ff0000000000000fb4000000000000000"),
            {},
            "{\"angle\":{\"value\":90,\"unit\":\"deg\"},\"step\":{\"value\":{\"x\":0,\"mode\":\"slow\"},\"unit\":\"m\"},"
            "\"way\":[{\"x\":1,\"mode\":\"fast\"}],\"range\":{\"value\":[1,2],\"unit\":\"m\"}}"),
  };
}

}  // namespace

TEST_CASE("every kind of value is written in every format, and read into the triples of write_value", "[rdf][R1.2]") {
  for (const Row& r : rows()) {
    INFO(r.json);
    const auto check = [&](Plain format, const std::string& expected, bool binary) {
      INFO(media_type(format));
      const auto body = write_plain(*r.type, r.facets, r.value, format);
      REQUIRE(body);
      CHECK((binary ? hex(*body) : *body) == expected);
      const auto graph = said(*body, format, *r.type, r.facets);
      if (!graph) FAIL(graph.error().message);
      const Graph wanted = written(*r.type, r.facets, r.value);
      INFO(n_triples(*graph) << "wanted\n" << n_triples(wanted));
      CHECK(isomorphic(*graph, wanted));
      CHECK(n_triples(*graph) == n_triples(wanted));
      Graph copy = *graph;
      std::vector<Mismatch> mismatches;
      const auto value = read_value(copy, copy.intern(lrt::rdf::iri(focus)), *r.type, r.facets, names, mismatches);
      if (!value) FAIL(value.error().message);
      CHECK(same(*value, r.value));
      CHECK(findings(*graph, *r.type, r.facets).empty());
    };
    check(Plain::json, r.json, false);
    check(Plain::json_with_units, r.with_units, false);
    check(Plain::text, r.text, false);
    check(Plain::cbor, r.cbor, true);
    if (r.octets) check(Plain::octets, *r.octets, true);
    CHECK((r.octets || !octets_of(*r.type) || r.value.is_null()));
  }
}

TEST_CASE("a record with a field \"value\" is not read as a value with its unit", "[rdf]") {
  const auto& type = traits<plain_test::Reading>::type();
  const Facets degrees{unit::degree};
  const Value value = traits<plain_test::Reading>::encode({5});
  const std::string body = write_plain(type, degrees, value, Plain::json_with_units).value();
  CHECK(body == "{\"value\":{\"value\":5,\"unit\":\"V\"}}");
  CHECK(isomorphic(said(body, Plain::json, type, degrees).value(), written(type, degrees, value)));
  CHECK(isomorphic(said("{\"value\":5}", Plain::json, type, degrees).value(), written(type, degrees, value)));
  CHECK(refusal<plain_test::Reading>("{\"value\":{\"value\":5},\"unit\":\"deg\"}", Plain::json, degrees).message ==
        "at \"/unit\": expected one of \"value\", found \"unit\"");
}

TEST_CASE("invalid UTF-8 is replaced by U+FFFD in every format", "[rdf]") {
  const auto& type = traits<std::string>::type();
  const Value value(
      std::string("a\xFF"
                  "b"));
  CHECK(write_plain(type, {}, value, Plain::json).value() ==
        "\"a\xEF\xBF\xBD"
        "b\"");
  CHECK(write_plain(type, {}, value, Plain::text).value() ==
        "a\xEF\xBF\xBD"
        "b");
  CHECK(write_plain(type, {}, value, Plain::cbor).value() ==
        "\x65"
        "a\xEF\xBF\xBD"
        "b");
}

TEST_CASE("absent members of a list are left out, as in a graph", "[rdf]") {
  const auto& type = traits<std::vector<std::optional<int>>>::type();
  const Value value = traits<std::vector<std::optional<int>>>::encode({std::nullopt, 1, std::nullopt, 2});
  CHECK(write_plain(type, {}, value, Plain::json).value() == "[1,2]");
  CHECK(hex(write_plain(type, {}, value, Plain::cbor).value()) == "820102");
  CHECK(write_plain(type, {}, traits<std::vector<std::optional<int>>>::encode({std::nullopt}), Plain::json).value() == "[]");
  CHECK(write_plain(type, {}, value, Plain::octets).error().code == Errc::unsupported_syntax);
}

TEST_CASE("media types and formats correspond, independent of parameters", "[rdf][R1.2]") {
  for (const Plain format : all_plain) {
    const auto back = plain_of(lrt::MediaType::parse(media_type(format)).value());
    CHECK(back == (format == Plain::json_with_units ? Plain::json : format));
  }
  CHECK(plain_of(lrt::MediaType::parse(media_type(Plain::octets)).value()) == Plain::octets);
  CHECK(plain_of(lrt::MediaType::parse("Text/Plain; charset=utf-8").value()) == Plain::text);
  for (const char* other : {"text/turtle", "application/ld+json", "text/json", "audio/cbor"})
    CHECK_FALSE(plain_of(lrt::MediaType::parse(other).value()));
}

TEST_CASE("numbers keep their digits, and get another datatype if they do not fit", "[rdf]") {
  CHECK(literal_in<double>("43.60") == "43.60^^xsd:double");
  CHECK(literal_in<double>("0.1000000000000000055511151231257827") == "0.1000000000000000055511151231257827^^xsd:double");
  CHECK(literal_in<double>("12345678901234567890123") == "12345678901234567890123^^xsd:double");
  CHECK(literal_in<double>("-0") == "-0^^xsd:double");
  CHECK(literal_in<float>("1E2") == "1E2^^xsd:float");
  CHECK(literal_in<std::uint8_t>("300") == "300^^xsd:integer");
  CHECK(literal_in<std::uint64_t>("18446744073709551616") == "18446744073709551616^^xsd:integer");
  CHECK(literal_in<int>("5.5") == "5.5^^xsd:double");
  CHECK(literal_in<int>("5e-1") == "5e-1^^xsd:double");
  CHECK(literal_in<int>("\"5\"") == "5^^xsd:string");
  CHECK(literal_in<int>("\"NaN\"") == "NaN^^xsd:string");
  CHECK(literal_in<int>("true") == "true^^xsd:boolean");
  CHECK(literal_in<double>("\"fast\"") == "fast^^xsd:string");
  CHECK(literal_in<double>("\"43.6\"") == "43.6^^xsd:string");
  CHECK(literal_in<float>("\"NaN\"") == "NaN^^xsd:float");
  CHECK(literal_in<double>("\"INF\"") == "INF^^xsd:double");
  CHECK(literal_in<double>("\"-INF\"") == "-INF^^xsd:double");
  CHECK(literal_in<double>("[1, \"x\"]") == "1^^xsd:double x^^xsd:string");
  CHECK(literal_in<bool>("1") == "1^^xsd:integer");
  CHECK(literal_in<bool>("\"true\"") == "true^^xsd:string");
  CHECK(literal_in<std::string>("1") == "1^^xsd:integer");
  CHECK(literal_in<std::string>("1.5") == "1.5^^xsd:double");
  CHECK(literal_in<std::string>("false") == "false^^xsd:boolean");
  CHECK(literal_in<Mode>("\"medium\"") == "medium^^xsd:string");
  CHECK(literal_in<std::chrono::seconds>("\"PT90M\"") == "PT90M^^xsd:dayTimeDuration");
  CHECK(literal_in<std::chrono::seconds>("90") == "90^^xsd:integer");
  CHECK(literal_in<std::vector<int>>("5") == "5^^xsd:integer");
  CHECK(literal_in<std::vector<int>>("\"5\"") == "5^^xsd:string");
  CHECK(literal_in<Move>("{\"step\": \"here\"}") == "here^^xsd:string");
}

TEST_CASE("an integer may be written with a point or an exponent", "[rdf]") {
  for (const char* five : {"5", "5.0", "5e0", "5E+0", "50e-1", "0.5e1"}) {
    CAPTURE(five);
    CHECK(literal_in<int>(five) == "5^^xsd:int");
    CHECK(literal_in<std::uint8_t>(five) == "5^^xsd:unsignedByte");
    CHECK(literal_in<std::vector<int>>(std::string("[") + five + "]") == "5^^xsd:int");
    CHECK(literal_in<int>(five, Plain::text) == "5^^xsd:int");
  }
  CHECK(literal_in<int>("-0.0") == "0^^xsd:int");
  CHECK(literal_in<std::uint64_t>("18446744073709551615.0") == "18446744073709551615^^xsd:unsignedLong");
  CHECK(literal_in<std::int64_t>("9007199254740993.0") == "9007199254740993^^xsd:long");
  CHECK(literal_in<std::int64_t>("-9.223372036854775808e18") == "-9223372036854775808^^xsd:long");
  CHECK(literal_in<std::int64_t>("9.223372036854775808e18") == "9223372036854775808^^xsd:integer");
  CHECK(literal_in<std::uint8_t>("300.0") == "300^^xsd:integer");
  CHECK(literal_in<std::uint8_t>("-1.0") == "-1^^xsd:integer");
  CHECK(literal_in<int>("1e300") == "1e300^^xsd:double");
  CHECK(literal_in<int>("1e-300") == "1e-300^^xsd:double");
  CHECK(literal_in<bool>("1.0") == "1.0^^xsd:double");
  CHECK(literal_in<std::string>("1.0") == "1.0^^xsd:double");
  CHECK(literal_in<int>(unhex("f94500"), Plain::cbor) == "5^^xsd:int");
  CHECK(literal_in<int>(unhex("fac0a00000"), Plain::cbor) == "-5^^xsd:int");
  CHECK(literal_in<int>(unhex("fb4014000000000000"), Plain::cbor) == "5^^xsd:int");
  CHECK(literal_in<int>(unhex("fb8000000000000000"), Plain::cbor) == "0^^xsd:int");
  CHECK(literal_in<std::uint64_t>(unhex("fb43e0000000000000"), Plain::cbor) == "9223372036854775808^^xsd:unsignedLong");  // 2^63
  CHECK(literal_in<std::int64_t>(unhex("fb43e0000000000000"), Plain::cbor) == "9223372036854775808^^xsd:integer");
  CHECK(literal_in<int>(unhex("fb7ff0000000000000"), Plain::cbor) == "INF^^xsd:double");
}

TEST_CASE("numbers in CBOR get the type's datatype", "[rdf]") {
  CHECK(literal_in<float>(unhex("fa3dcccccd"), Plain::cbor) == "0.1^^xsd:float");
  CHECK(literal_in<double>(unhex("fa3dcccccd"), Plain::cbor) == "0.10000000149011612^^xsd:double");  // what the client has
  CHECK(literal_in<float>(unhex("fb3fb999999999999a"), Plain::cbor) == "0.1^^xsd:float");
  const std::string beyond = literal_in<float>(unhex("fb7fefffffffffffff"), Plain::cbor);  // exact, and refused by the shape
  CHECK(beyond.find("17976931348623157") == 0);
  CHECK(beyond.size() == 309 + std::string_view("^^xsd:float").size());
  CHECK(literal_in<double>(unhex("f93e00"), Plain::cbor) == "1.5^^xsd:double");
  CHECK(literal_in<double>(unhex("f90001"), Plain::cbor) == "5.960464477539063e-08^^xsd:double");
  CHECK(literal_in<double>(unhex("f98000"), Plain::cbor) == "-0^^xsd:double");
  CHECK(literal_in<double>(unhex("f9fc00"), Plain::cbor) == "-INF^^xsd:double");
  CHECK(literal_in<double>(unhex("f97e00"), Plain::cbor) == "NaN^^xsd:double");
  CHECK(literal_in<float>(unhex("fa7fc00000"), Plain::cbor) == "NaN^^xsd:float");
  CHECK(literal_in<double>("\x05", Plain::cbor) == "5^^xsd:double");
  CHECK(literal_in<int>(unhex("fb7ff8000000000000"), Plain::cbor) == "NaN^^xsd:double");
  CHECK(literal_in<std::int64_t>(unhex("3bffffffffffffffff"), Plain::cbor) == "-18446744073709551616^^xsd:integer");
  CHECK(literal_in<std::int64_t>(unhex("3b8000000000000000"), Plain::cbor) == "-9223372036854775809^^xsd:integer");
  CHECK(literal_in<std::string>(unhex("7f6161606162ff"), Plain::cbor) == "ab^^xsd:string");
  CHECK(literal_in<std::vector<int>>(unhex("9f0102ff"), Plain::cbor) == "1^^xsd:int 2^^xsd:int");
  CHECK(literal_in<Step>(unhex("bf617801ff"), Plain::cbor) == "1^^xsd:double");
}

TEST_CASE("text is read by lexical form, without the white space around it", "[rdf]") {
  CHECK(literal_in<double>(" 43.6\r\n", Plain::text) == "43.6^^xsd:double");
  CHECK(literal_in<double>("fast", Plain::text) == "fast^^xsd:string");
  CHECK(literal_in<double>("", Plain::text) == "^^xsd:string");
  CHECK(literal_in<double>(" \n", Plain::text) == "^^xsd:string");
  CHECK(literal_in<double>("NaN", Plain::text) == "NaN^^xsd:double");
  CHECK(literal_in<float>("-INF\n", Plain::text) == "-INF^^xsd:float");
  CHECK(literal_in<double>("{\"value\": 1}", Plain::text) == "{\"value\": 1}^^xsd:string");
  CHECK(literal_in<int>("+5", Plain::text) == "+5^^xsd:int");
  CHECK(literal_in<int>("5.5", Plain::text) == "5.5^^xsd:double");
  CHECK(literal_in<int>("five", Plain::text) == "five^^xsd:string");
  CHECK(literal_in<bool>("true\n", Plain::text) == "true^^xsd:boolean");
  CHECK(literal_in<bool>("yes", Plain::text) == "yes^^xsd:string");
  CHECK(literal_in<Mode>("fast\n", Plain::text) == "fast^^xsd:string");
  CHECK(literal_in<std::string>(" fast\n", Plain::text) == " fast\n^^xsd:string");
  CHECK(literal_in<std::chrono::seconds>("\tPT1S ", Plain::text) == "PT1S^^xsd:dayTimeDuration");
  CHECK(literal_in<std::vector<double>>(" [1, 2.5] ", Plain::text) == "1^^xsd:double 2.5^^xsd:double");
  CHECK(said<std::optional<double>>(" \n", Plain::text).value().empty());
  CHECK(said<std::optional<std::string>>("", Plain::text).value().empty());
  CHECK(literal_in<std::optional<std::string>>(" ", Plain::text) == " ^^xsd:string");
}

TEST_CASE("a plain value may begin with a byte order mark, and a text with U+FEFF stays what it is", "[rdf]") {
  const std::string mark = "\xEF\xBB\xBF";
  CHECK(literal_in<double>(mark + "43.6\r\n", Plain::text) == "43.6^^xsd:double");
  CHECK(literal_in<int>(mark + " 5", Plain::text) == "5^^xsd:int");
  CHECK(literal_in<bool>(mark + "true", Plain::text) == "true^^xsd:boolean");
  CHECK(literal_in<Mode>(mark + "fast\n", Plain::text) == "fast^^xsd:string");
  CHECK(literal_in<std::string>(mark + "fast\n", Plain::text) == "fast\n^^xsd:string");
  CHECK(literal_in<std::string>("a" + mark, Plain::text) == "a" + mark + "^^xsd:string");
  CHECK(literal_in<std::vector<double>>(mark + "[1, 2.5]", Plain::text) == "1^^xsd:double 2.5^^xsd:double");
  CHECK(literal_in<double>(mark + "43.6", Plain::json) == "43.6^^xsd:double");
  CHECK(said<std::optional<double>>(mark, Plain::text).value().empty());
  for (const std::string& text : {std::string(), std::string("a"), mark, mark + "a", mark + mark, "a" + mark})
    for (const Plain format : {Plain::text, Plain::json, Plain::cbor}) {
      const std::string body = write_plain(traits<std::string>::type(), {}, traits<std::string>::encode(text), format).value();
      CHECK(literal_in<std::string>(body, format) == text + "^^xsd:string");
    }
}

TEST_CASE("null adds no triple", "[rdf]") {
  for (const Plain format : {Plain::json, Plain::cbor}) {
    const std::string_view body = format == Plain::json ? "null" : "\xF6";
    CHECK(said<double>(body, format).value().empty());
    CHECK(said<std::optional<double>>(body, format).value().empty());
    CHECK(said<Step>(body, format).value().empty());
  }
  CHECK(said<double>("{\"value\": null, \"unit\": \"deg\"}", Plain::json, Facets{unit::degree}).value().empty());
  CHECK(said<Step>("{\"x\": null}").value().size() == 1);  // its class
}

TEST_CASE("a value may have the declared unit and no other", "[rdf][R1.5]") {
  const Facets degrees{unit::degree}, code_less{lrt::Unit{vocab::unit_::DEG, {}, {}}}, only_vom{lrt::Unit{{}, vocab::maths::Degree, {}}};
  const auto same_graph = [](const auto& a, const auto& b) { return a && b && isomorphic(*a, *b); };
  CHECK(same_graph(said<double>("{\"value\": 43.6, \"unit\": \"deg\"}", Plain::json, degrees), said<double>("43.6", Plain::json, degrees)));
  CHECK(same_graph(said<double>("{\"unit\": \"deg\", \"value\": 43.6}", Plain::json, degrees), said<double>("43.6", Plain::json, degrees)));
  CHECK(same_graph(said<double>("{\"value\": 43.6}", Plain::json, degrees), said<double>("43.6", Plain::json, degrees)));
  CHECK(same_graph(said<double>("{\"value\": 43.6}"), said<double>("43.6")));
  CHECK(same_graph(said<std::string>("{\"value\": \"a\"}"), said<std::string>("\"a\"")));
  CHECK(same_graph(said<double>("{\"value\": 1, \"unit\": \"http://qudt.org/vocab/unit/DEG\"}", Plain::json, code_less),
                   said<double>("1", Plain::json, code_less)));
  CHECK(same_graph(said<double>("{\"value\": 1, \"unit\": \"" + std::string(vocab::maths::Degree.text) + "\"}", Plain::json, only_vom),
                   said<double>("1", Plain::json, only_vom)));
  CHECK(same_graph(said<std::vector<double>>("{\"value\": [1, {\"value\": 2, \"unit\": \"deg\"}], \"unit\": \"deg\"}", Plain::json, degrees),
                   said<std::vector<double>>("[1, 2]", Plain::json, degrees)));
  CHECK(same_graph(said<Step>("{\"value\": {\"x\": {\"value\": 2}}}"), said<Step>("{\"x\": 2}")));
  CHECK(same_graph(said<double>(unhex("a26576616c756505"
                                      "64756e6974"
                                      "63646567"),
                                Plain::cbor, degrees),
                   said<double>("5", Plain::json, degrees)));

  CHECK(refusal<double>("{\"value\": 1, \"unit\": \"rad\"}", Plain::json, degrees).message == "at \"/unit\": expected \"deg\", found \"rad\"");
  CHECK(refusal<double>("{\"value\": 1, \"unit\": \"http://qudt.org/vocab/unit/DEG\"}", Plain::json, degrees).code == Errc::expected_value);
  CHECK(refusal<double>("{\"value\": 1, \"unit\": 5}", Plain::json, degrees).message == "at \"/unit\": expected \"deg\", found 5");
  CHECK(refusal<double>("{\"value\": 1, \"unit\": \"deg\"}").message == "at \"/unit\": expected no unit, because none is declared, found \"deg\"");
  CHECK(refusal<std::string>("{\"value\": \"a\", \"unit\": \"deg\"}", Plain::json, degrees).message.find("expected no unit") != std::string::npos);
  CHECK(refusal<double>("{\"value\": 1, \"units\": \"deg\"}", Plain::json, degrees).message ==
        "at \"/units\": expected nothing beside \"value\" and \"unit\", found \"deg\"");
  CHECK(refusal<double>("{\"unit\": \"deg\"}", Plain::json, degrees).message ==
        "expected a number, or {\"value\": ..., \"unit\": ...}, found an object");
  CHECK(refusal<double>("{\"value\": {\"value\": 1}}", Plain::json, degrees).message ==
        "at \"/value\": expected a number, or {\"value\": ..., \"unit\": ...}, found an object");
  CHECK(refusal<Step>("{\"value\": {\"x\": 2}, \"mode\": \"fast\"}").message == "at \"/value\": expected one of \"x\", \"mode\", found \"value\"");
  CHECK(refusal<Move>("{\"label\": {\"value\": \"a\"}}").message == "at \"/label\": expected a text, found an object");  // only at the top
  CHECK(refusal<Move>("{\"angle\": {\"value\": 1, \"unit\": \"m\"}}").message == "at \"/angle/unit\": expected \"deg\", found \"m\"");
  CHECK(refusal<Move>("{\"way\": {\"value\": []}}").message == "at \"/way\": expected an array, found an object");
}

TEST_CASE("a value that RDF cannot express is refused with its position", "[rdf]") {
  const auto wrong = [](const lrt::Error& error) {
    CHECK(error.code == Errc::expected_value);
    return error.message;
  };
  CHECK(wrong(refusal<Step>("{\"x\": 1, \"z\": 2}")) == "at \"/z\": expected one of \"x\", \"mode\", found \"z\"");
  CHECK(wrong(refusal<Move>("{\"way\": [{\"x\": 1}, {\"a/b\": 2}]}")) == "at \"/way/1/a~1b\": expected one of \"x\", \"mode\", found \"a/b\"");
  CHECK(wrong(refusal<std::vector<int>>("[1, null]")) == "at \"/1\": expected a number, or {\"value\": ..., \"unit\": ...}, found null");
  CHECK(wrong(refusal<std::vector<std::optional<int>>>("[null]")).substr(0, 5) == "at \"/");
  CHECK(wrong(refusal<double>("[1, [null]]")) == "at \"/1/0\": expected a number, or {\"value\": ..., \"unit\": ...}, found null");
  CHECK(wrong(refusal<bool>("{}")) == "expected true or false, found an object");
  CHECK(wrong(refusal<Mode>("{\"x\": 1}")) == "expected a text, found an object");
  CHECK(wrong(refusal<std::vector<int>>("{}")) == "expected an array, found an object");
  CHECK(wrong(refusal<Step>("5")) == "expected an object, found 5");
  CHECK(wrong(refusal<Step>("[]")) == "expected an object, found an array");
  CHECK(wrong(refusal<plain_test::Nothing>("\"\"")) == "expected an object, found \"\"");  // otherwise it would be an object without members
  CHECK(wrong(refusal<Move>("{\"step\": [1]}")) == "at \"/step\": expected an object, found an array");
  CHECK(wrong(refusal<Step>("{\"" + std::string(100'000, 'n') + "\": 2}")).find("(cut)") != std::string::npos);

  const auto none = [](const lrt::Error& error) {
    CHECK(error.code == Errc::expected_rdf);
    return error.message;
  };
  CHECK(none(refusal<double>("")).substr(0, 31) == "line 1, column 1: invalid JSON:");
  CHECK(none(refusal<double>("43.6 x")).substr(0, 17) == "line 1, column 6:");
  CHECK(none(refusal<double>("NaN")).substr(0, 17) == "line 1, column 1:");
  CHECK(none(refusal<double>("1e400")).find("beyond xsd:double") != std::string::npos);
  CHECK(none(refusal<std::string>("\"\xFF\"")) == "line 1, column 2: invalid UTF-8");
  CHECK(none(refusal<std::string>("a\xFF", Plain::text)) == "line 1, column 2: invalid UTF-8");
  CHECK(none(refusal<std::string>(std::string_view("\na\0", 3), Plain::text)) == "line 2, column 2: U+0000 is not accepted");
  CHECK(none(refusal<std::string>("\"\\u0000\"")) == "at \"\": U+0000 is not accepted");
  CHECK(none(refusal<Step>("{\"x\": 1, \"x\": 2}")) == "at \"/x\": a second member of this name");
}

TEST_CASE("a map is an object with values of one type", "[rdf]") {
  using Gains = std::map<std::string, double>;
  CHECK(refusal<Gains>("[1]").message.find("expected an object") != std::string::npos);
  CHECK(refusal<Gains>("{\"p\": null}").message.find("at \"/p\"") != std::string::npos);
  CHECK(refusal<Gains>("{\"p\": 1, \"p\": 2}").code == lrt::Errc::expected_rdf);
  CHECK(refusal<Gains>("{\"p\": {\"value\": 1, \"unit\": \"V\"}}").message.find("none is declared") != std::string::npos);
  CHECK(findings(said<Gains>("{\"p\": \"high\"}").value(), traits<Gains>::type()) != "");
  CHECK(findings(said<Gains>("5").value(), traits<Gains>::type()) != "");
  CHECK(findings(said<Gains>("{\"p\": 5}").value(), traits<Gains>::type()) == "");
}

TEST_CASE("an optional record without members is not an absent one", "[rdf]") {
  using Maybe = std::optional<plain_test::Nothing>;
  const auto read = [](const Graph& graph) {
    Graph copy = graph;
    std::vector<Mismatch> mismatches;
    return traits<Maybe>::decode(read_value(copy, copy.intern(lrt::rdf::iri(focus)), traits<Maybe>::type(), {}, names, mismatches).value()).value();
  };
  CHECK(read(said<Maybe>("{}").value()).has_value());
  CHECK(read(said<Maybe>("{\"count\":3}").value())->count == 3);
  CHECK_FALSE(read(said<Maybe>("null").value()).has_value());
  CHECK_FALSE(read(Graph()).has_value());
  CHECK(read(said<Maybe>("\xa0", Plain::cbor).value()).has_value());
}

TEST_CASE("invalid CBOR, and CBOR that JSON cannot express, are refused with the position", "[rdf]") {
  const auto none = [](std::string_view digits) {
    INFO(digits);
    const lrt::Error error = refusal<std::string>(unhex(digits), Plain::cbor);
    CHECK(error.code == Errc::expected_rdf);
    CHECK(error.offset.has_value());
    return error.message;
  };
  CHECK(none("") == "byte 0: expected CBOR, found the end of the body");
  CHECK(none("6261") == "byte 2: expected CBOR, found the end of the body");
  CHECK(none("820161") == "byte 3: expected CBOR, found the end of the body");
  CHECK(none("1b00") == "byte 2: expected CBOR, found the end of the body");
  CHECK(none("0505") == "byte 1: expected CBOR, found more after the value");
  CHECK(none("815f6101ff") == "byte 2: expected CBOR, found a chunk of a byte string that is not a byte string of definite length");
  CHECK(none("c074") == "byte 0: expected CBOR, found a tag, which JSON does not have");
  CHECK(none("d9d9f700") == "byte 0: expected CBOR, found a tag, which JSON does not have");
  CHECK(none("f7") == "byte 0: expected CBOR, found simple value 23, which JSON does not have");
  CHECK(none("f8ff") == "byte 0: expected CBOR, found simple value 255, which JSON does not have");
  CHECK(none("1c") == "byte 0: expected CBOR, found an initial byte that has no meaning");
  CHECK(none("1f") == "byte 0: expected CBOR, found an initial byte that has no meaning");
  CHECK(none("ff") == "byte 0: expected CBOR, found a break outside an item of indefinite length");
  CHECK(none("81ff") == "byte 1: expected CBOR, found a break outside an item of indefinite length");
  CHECK(none("bf6161ff") == "byte 3: expected CBOR, found a break outside an item of indefinite length");
  CHECK(none("9f01") == "byte 2: expected CBOR, found the end of the body");
  CHECK(none("a10101") == "byte 1: expected CBOR, found a member name that is not a text");
  CHECK(none("6261ff") == "byte 2: expected CBOR, found invalid UTF-8");
  CHECK(none("7f61c361bcff") == "byte 2: expected CBOR, found invalid UTF-8");  // each part is to be UTF-8
  CHECK(none("7f4161ff") == "byte 1: expected CBOR, found a chunk of a text that is not a text of definite length");
  CHECK(none("7f7f6161ffff") == "byte 1: expected CBOR, found a chunk of a text that is not a text of definite length");
  CHECK(none("9bffffffffffffffff") == "byte 9: expected CBOR, found the end of the body");
  CHECK(none("9bffffffffffffffffff") == "byte 9: expected CBOR, found a break outside an item of indefinite length");
  CHECK(none("bbffffffffffffffff") == "byte 9: expected CBOR, found the end of the body");
  CHECK(none("7bffffffffffffffff") == "byte 9: expected CBOR, found the end of the body");
  CHECK(none("5bffffffffffffffff") == "byte 9: expected CBOR, found the end of the body");
  const auto at = [](std::string_view digits) { return refusal<Step>(unhex(digits), Plain::cbor).message; };
  CHECK(at("a2617801617802") == "at \"/x\": a second member of this name");
  CHECK(at("a1646d6f64656100") == "at \"\": U+0000 is not accepted");
}

TEST_CASE("a hostile body ends at a limit", "[rdf]") {
  constexpr std::size_t mega = 1 << 20;
  const auto beyond = [](const std::string& body, Plain format) {
    const lrt::Error error = refusal<std::vector<double>>(body, format);
    CHECK(error.code == Errc::limit_exceeded);
    return error.message;
  };
  const std::string depth = "objects and arrays nested more than 64 deep";
  CHECK(beyond(std::string(mega, '['), Plain::json) == depth);
  CHECK(beyond(std::string(mega, '['), Plain::text) == depth);
  CHECK(beyond(std::string(mega, '\x81'), Plain::cbor) == depth);
  CHECK(beyond(std::string(mega, '\x9F'), Plain::cbor) == depth);
  std::string maps;
  while (maps.size() < mega) maps += "\xBF\x60";
  CHECK(beyond(maps, Plain::cbor) == depth);
  CHECK(refusal<double>(std::string(mega, '\x7F'), Plain::cbor).code == Errc::expected_rdf);
  CHECK(refusal<double>(std::string(mega, '\x5F'), Plain::cbor).code == Errc::expected_rdf);
  CHECK(refusal<double>(std::string(mega, '\xC1'), Plain::cbor).code == Errc::expected_rdf);

  std::string list = "[0";
  for (std::size_t i = 1; i < many; ++i) list += ",0";
  CHECK(beyond(list + "]", Plain::json) == "more than 10000 JSON values");
  CHECK(beyond("\x9A\xFF\xFF\xFF\xFF" + std::string(mega, '\0'), Plain::cbor) == "more than 10000 JSON values");
  CHECK(beyond(std::string(8 * (many + 1), '\0'), Plain::octets) == "more than 10000 numbers");
  CHECK(said<std::vector<double>>(std::string(8 * 5000, '\0'), Plain::octets));

  const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
  CHECK(said<double>(nested(64)));
  CHECK_FALSE(said<double>(nested(65)));
}

TEST_CASE("octets are numbers of one shape", "[rdf]") {
  using Shape = std::vector<std::size_t>;
  const auto is = [](const std::optional<Octets>& o, lrt::Iri datatype, std::size_t bytes, const Shape& shape) {
    return o && o->datatype == datatype && o->bytes == bytes && o->shape == shape;
  };
  CHECK(is(octets_of(traits<double>::type()), vocab::xsd::double_, 8, {}));
  CHECK(is(octets_of(traits<float>::type()), vocab::xsd::float_, 4, {}));
  CHECK(is(octets_of(traits<std::int8_t>::type()), vocab::xsd::byte_, 1, {}));
  CHECK(is(octets_of(traits<std::optional<std::uint16_t>>::type()), vocab::xsd::unsignedShort, 2, {}));
  CHECK(is(octets_of(traits<std::vector<std::uint32_t>>::type()), vocab::xsd::unsignedInt, 4, {0}));
  CHECK(is(octets_of(traits<std::array<std::array<std::int64_t, 3>, 2>>::type()), vocab::xsd::long_, 8, {2, 3}));
  CHECK(is(octets_of(traits<std::vector<std::array<double, 3>>>::type()), vocab::xsd::double_, 8, {0, 3}));
  CHECK(is(octets_of(traits<std::array<std::vector<double>, 2>>::type()), vocab::xsd::double_, 8, {2, 0}));
  CHECK(is(octets_of(traits<std::vector<std::vector<float>>>::type()), vocab::xsd::float_, 4, {0, 0}));
  for (const Type* none : {&traits<std::string>::type(), &traits<bool>::type(), &traits<Step>::type(),
                           &traits<std::vector<std::vector<bool>>>::type(), &traits<std::vector<std::optional<double>>>::type(),
                           &traits<std::vector<std::optional<std::vector<double>>>>::type(), &traits<std::chrono::seconds>::type()}) {
    CHECK_FALSE(octets_of(*none));
    CHECK_FALSE(reads_octets(*none));
    CHECK(octets_of(*none, Value(Value::Sequence{})).error().code == Errc::unsupported_syntax);
    CHECK(write_plain(*none, {}, Value(Value::Sequence{}), Plain::octets).error().code == Errc::unsupported_syntax);
    CHECK(said("", Plain::octets, *none).error().code == Errc::unsupported_syntax);
  }
  CHECK(write_plain(traits<std::optional<double>>::type(), {}, Value(), Plain::octets).error().code == Errc::unsupported_syntax);

  const auto length = [](const lrt::Error& error) {
    CHECK(error.code == Errc::expected_rdf);
    return error.message;
  };
  CHECK(length(refusal<double>("1234567", Plain::octets)) == "expected 8 octets (1 of xsd:double), found 7");
  CHECK(length(refusal<std::array<float, 7>>("", Plain::octets)) == "expected 28 octets (7 of xsd:float), found 0");
  CHECK(length(refusal<std::vector<std::array<std::int16_t, 3>>>("1234567", Plain::octets)) ==
        "expected a multiple of 6 octets (3 of xsd:short), found 7");
  CHECK(refusal<std::vector<std::array<std::int16_t, 3>>>("1234567", Plain::octets).offset == 6U);
  CHECK(length(refusal<std::array<std::vector<std::int16_t>, 3>>("12345678", Plain::octets)) ==
        "expected a multiple of 6 octets (3 of xsd:short), found 8");
  CHECK(findings(said<double>(unhex("000000000000f87f"), Plain::octets).value(), traits<double>::type()).find("vom:numericalValue") !=
        std::string::npos);
}

TEST_CASE("octets of lists of any length have the shape of the value, and there are none where lists differ", "[rdf]") {
  using Shape = std::vector<std::size_t>;
  using Matrix = std::vector<std::vector<std::int16_t>>;
  const auto shape = [](const auto& value) {
    using T = std::decay_t<decltype(value)>;
    const auto octets = octets_of(traits<T>::type(), traits<T>::encode(value));
    const auto body = write_plain(traits<T>::type(), {}, traits<T>::encode(value), Plain::octets);
    REQUIRE(octets);
    REQUIRE(body);
    CHECK(body->size() == octets->size());
    return octets->shape;
  };
  const auto none = [](const auto& value) {
    using T = std::decay_t<decltype(value)>;
    const auto octets = octets_of(traits<T>::type(), traits<T>::encode(value));
    REQUIRE_FALSE(octets);
    CHECK(octets.error().code == Errc::unsupported_syntax);
    CHECK(write_plain(traits<T>::type(), {}, traits<T>::encode(value), Plain::octets).error().message == octets.error().message);
    return octets.error().message;
  };
  CHECK(shape(5.0) == Shape{});
  CHECK(shape(std::vector<float>{1, 2}) == Shape{2});
  CHECK(shape(std::vector<float>{}) == Shape{0});
  CHECK(shape(std::vector<std::array<float, 3>>{{}, {}}) == Shape{2, 3});
  CHECK(shape(std::vector<std::array<float, 3>>{}) == Shape{0, 3});
  CHECK(shape(Matrix{{1, 2, 3}, {4, 5, 6}}) == Shape{2, 3});
  CHECK(shape(Matrix{{}, {}}) == Shape{2, 0});
  CHECK(shape(Matrix{}) == Shape{0, 0});
  CHECK(shape(std::vector<std::array<double, 0>>(4)) == Shape{4, 0});
  CHECK(shape(std::vector<Matrix>{{{1, 2}}, {{3, 4}}, {{5, 6}}}) == Shape{3, 1, 2});
  CHECK(shape(std::vector<Matrix>{{}, {}}) == Shape{2, 0, 0});
  CHECK(shape(std::vector<std::vector<std::array<float, 2>>>{{}, {}}) == Shape{2, 0, 2});
  CHECK(hex(write_plain(traits<Matrix>::type(), {}, traits<Matrix>::encode({{1, -1}, {2, 256}}), Plain::octets).value()) == "0100ffff02000001");

  CHECK(none(Matrix{{1, 2, 3}, {4, 5}}) == "expected lists of one length, found members 3 and 2 for octets");
  CHECK(none(Matrix{{}, {1}}) == "expected lists of one length, found members 0 and 1 for octets");
  CHECK(none(Matrix{{1}, {}}) == "expected lists of one length, found members 1 and 0 for octets");
  none(std::vector<Matrix>{{{1, 2}}, {{3, 4}, {5, 6}}});  // as many numbers as
  none(std::vector<Matrix>{{{1, 2}, {3, 4}}, {{5}, {6}}});
  none(std::array<std::vector<double>, 2>{{{1}, {1, 2}}});
  none(std::optional<double>());

  CHECK(reads_octets(traits<double>::type()));
  CHECK(reads_octets(traits<std::optional<std::vector<std::array<float, 3>>>>::type()));
  CHECK(reads_octets(traits<std::array<std::vector<float>, 3>>::type()));
  CHECK_FALSE(reads_octets(traits<Matrix>::type()));
  CHECK_FALSE(reads_octets(traits<std::vector<std::array<double, 0>>>::type()));
  CHECK(refusal<Matrix>("12", Plain::octets).code == Errc::unsupported_syntax);
  CHECK(refusal<Matrix>("", Plain::octets).code == Errc::unsupported_syntax);
}

TEST_CASE("the shape refuses values that do not fit, with their path", "[rdf][shacl]") {
  const auto report = [](const auto& graph, const Type& type, const Facets& facets = {}) {
    if (!graph) FAIL(graph.error().message);
    std::vector<Mismatch> mismatches;
    Graph copy = *graph;
    CHECK_FALSE(read_value(copy, copy.intern(lrt::rdf::iri(focus)), type, facets, names, mismatches));
    return findings(*graph, type, facets);
  };
  const Facets degrees = Facets{unit::degree}.at_least(0).below(360);
  const auto& number = traits<double>::type();
  for (const char* body : {"\"fast\"", "true", "[1, 2]", "\"NaN\"", "360", "-1", "[]"}) {
    INFO(body);
    CHECK(report(said<double>(body, Plain::json, degrees), number, degrees).find("vom:numericalValue") != std::string::npos);
  }
  CHECK(report(said<double>("fast", Plain::text, degrees), number, degrees).find("vom:numericalValue") != std::string::npos);
  CHECK(report(said<double>("", Plain::text, degrees), number, degrees).find("vom:numericalValue") != std::string::npos);
  CHECK(report(said<double>("null", Plain::json, degrees), number, degrees).find("vom:numericalValue") != std::string::npos);
  for (const char* body : {"1.5", "1e-1", "300", "300.0", "\"1\"", "-1", "-1.0"})
    CHECK_FALSE(report(said<std::uint8_t>(body), traits<std::uint8_t>::type()).empty());
  for (const char* body : {"1", "true", "[\"a\"]"})
    CHECK(report(said<std::string>(body), traits<std::string>::type()).find("rdf:value") != std::string::npos);
  for (const char* body : {"\"true\"", "1"}) CHECK(report(said<bool>(body), traits<bool>::type()).find("rdf:value") != std::string::npos);
  for (const char* body : {"\"medium\"", "0"}) CHECK(report(said<Mode>(body), traits<Mode>::type()).find("rdf:value") != std::string::npos);
  for (const char* body : {"\"soon\"", "90"})
    CHECK(report(said<std::chrono::seconds>(body), traits<std::chrono::seconds>::type()).find("rdf:value") != std::string::npos);
  using Pair = std::array<double, 2>;
  for (const char* body : {"[1]", "[1, 2, 3]", "5", "[1, \"x\"]", "[[1], 2]", "\"1 2\""}) {
    INFO(body);
    CHECK_FALSE(report(said<Pair>(body, Plain::json, degrees), traits<Pair>::type(), degrees).empty());
  }
  const std::string rest = ", \"way\": [], \"range\": [1, 2]}";
  const auto move = [&](const std::string& body) { return report(said<Move>(body), traits<Move>::type()); };
  CHECK(move("{\"angle\": \"fast\", \"step\": {\"x\": 1, \"mode\": \"slow\"}" + rest).find("vom:numericalValue") != std::string::npos);
  CHECK(move("{\"angle\": 1, \"step\": \"here\"" + rest).find("step") != std::string::npos);
  CHECK(move("{\"angle\": 1, \"step\": {\"x\": 1}" + rest).find("mode") != std::string::npos);
  CHECK(move("{\"step\": {\"x\": 1, \"mode\": \"slow\"}" + rest).find("angle") != std::string::npos);
  CHECK(move("{}").find("range") != std::string::npos);
}
