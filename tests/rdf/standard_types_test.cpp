// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/standard_types.hpp>

#include <array>
#include <atomic>
#include <bitset>
#include <complex>
#include <cstdint>
#include <cstring>
#include <deque>
#include <filesystem>
#include <forward_list>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <lrt/rdf/macros.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/rdf/plain.hpp"
#include "src/rdf/plain_schema.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace vocab = lrt::vocab;

namespace standard_types_test {
enum class Side { left, right };
struct Gains {
  double p = 0, i = 0;
};
LRT_RECORD(Gains, p, i)

struct Held {
  double matrix[3][3] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  char labels[2][4] = {"ab", "c"};
  std::byte raw[3] = {std::byte{1}, std::byte{2}, std::byte{255}};
  std::atomic<int> count{3};
  std::unique_ptr<Gains> own;
  std::shared_ptr<const Gains> shared = std::make_shared<Gains>(Gains{1, 2});

  Held() = default;
  Held(Held&& other) noexcept : count(other.count.load()), own(std::move(other.own)), shared(std::move(other.shared)) {
    std::memcpy(matrix, other.matrix, sizeof matrix);
    std::memcpy(labels, other.labels, sizeof labels);
    std::memcpy(raw, other.raw, sizeof raw);
  }
};
LRT_RECORD(Held, matrix, labels, raw, count, own, shared)

struct Node {
  std::unique_ptr<Node> next;
  std::vector<std::pair<int, Node>> children;
};
LRT_RECORD(Node, next, children)

double somewhere = 2.5;
struct Referring {
  std::reference_wrapper<double> to = somewhere;
};
LRT_RECORD(Referring, to)
}  // namespace standard_types_test

namespace {

using standard_types_test::Gains;
using standard_types_test::Side;

constexpr std::string_view focus = "http://example.org/focus", names = "http://example.org/vocabulary#";

/// What the shape of the type says of the triples; empty: they conform.
std::string findings(const Graph& data, const Type& type) {
  Graph graph;
  const TermId shape = graph.intern(iri("http://example.org/shape"));
  graph.add(shape, graph.intern(vocab::rdf_::type), graph.intern(vocab::sh::NodeShape));
  lrt::shacl::derive(graph, shape, type, {}, names, {type.kind != Type::Kind::optional});
  return lrt::shacl::validate(lrt::shacl::Shapes::compile(graph).value(), data, iri(focus), iri("http://example.org/shape")).value().to_text();
}

/// What is read from a body; an error message if it is refused by the shape or where it is read.
template <class T>
lrt::Result<T> read(std::string_view body, Plain format) {
  const Type& type = traits<T>::type();
  Graph graph;
  const TermId node = graph.intern(iri(focus));
  if (auto r = read_plain(body, format, type, {}, names, 1000, graph, node); !r) return lrt::unexpected(r.error());
  if (const std::string text = findings(graph, type); !text.empty()) return lrt::unexpected(lrt::Errc::expected_value, text);
  std::vector<Mismatch> mismatches;
  const lrt::Result<Value> value = read_value(graph, node, type, {}, names, mismatches);
  if (!value) return lrt::unexpected(value.error());
  return traits<T>::decode(*value);
}
template <class T>
std::string json_of(const T& value) {
  return write_plain(traits<T>::type(), {}, traits<T>::encode(value), Plain::json).value();
}

/// Each format gives the value back, and its triples conform to the shape.
template <class T>
void comes_back(const T& value, const std::string& json) {
  const Type& type = traits<T>::type();
  INFO(json);
  CHECK(json_of(value) == json);
  for (const Plain format : {Plain::json, Plain::cbor, Plain::text}) {
    const lrt::Result<T> back = read<T>(write_plain(type, {}, traits<T>::encode(value), format).value(), format);
    if (!back) FAIL(back.error().message);
    CHECK(traits<T>::same(*back, value));
  }
  Graph graph;
  write_value(graph, graph.intern(iri(focus)), type, {}, traits<T>::encode(value), names);
  CHECK(findings(graph, type) == "");
}
template <class T>
bool refuses(std::string_view body) {
  return !read<T>(body, Plain::json);
}
template <class T>
std::string schema() {
  return write_schema(traits<T>::type(), {}, nullptr);
}

}  // namespace

TEST_CASE("containers are lists, sets in the order of their members", "[rdf]") {
  comes_back(std::deque<double>{1, 2.5}, "[1,2.5]");
  comes_back(std::list<std::string>{"b", "a"}, R"(["b","a"])");
  comes_back(std::forward_list<int>{3, 1, 2}, "[3,1,2]");
  comes_back(std::set<int>{3, 1, 2}, "[1,2,3]");
  comes_back(std::unordered_set<std::string>{"b", "a", "c"}, R"(["a","b","c"])");
  comes_back(std::multiset<int>{2, 1, 2}, "[1,2,2]");
  comes_back(std::set<Side>{Side::right}, R"(["right"])");
  comes_back(std::vector<bool>{true, false}, "[true,false]");
  comes_back(std::bitset<4>(9), "[true,false,false,true]");
  comes_back(std::complex<double>(1, -2), "[1,-2]");
  comes_back(std::deque<std::set<int>>{{1}, {}}, "[[1],[]]");
  comes_back(std::optional<bool>(false), "false");
  CHECK(traits<std::unordered_set<int>>::same({1, 2, 3}, {3, 2, 1}));
  CHECK_FALSE(traits<std::unordered_set<int>>::same({1, 2, 3}, {3, 2, 4}));
  CHECK_FALSE(traits<std::forward_list<int>>::same({1, 2}, {1}));
}

TEST_CASE("a set refuses a member that occurs twice, however it is written", "[rdf]") {
  CHECK(read<std::set<int>>("[1,2,1]", Plain::json).error().message.find("expected each member once, found") != std::string::npos);
  CHECK(refuses<std::set<int>>("[1,1.0]"));
  CHECK(refuses<std::set<double>>("[1,1e0]"));
  CHECK(refuses<std::set<double>>("[0,-0.0]"));
  CHECK(refuses<std::unordered_set<std::string>>(R"(["a","a"])"));
  CHECK(refuses<std::set<Side>>(R"(["left","left"])"));
  CHECK(refuses<std::set<std::vector<int>>>("[[1,2],[3],[1,2]]"));
  CHECK_FALSE(refuses<std::set<std::vector<int>>>("[[1,2],[3],[2,1]]"));
  CHECK_FALSE(refuses<std::multiset<int>>("[1,1]"));
  CHECK(schema<std::set<int>>().find(R"("uniqueItems":true)") != std::string::npos);
  CHECK(schema<std::multiset<int>>().find("uniqueItems") == std::string::npos);
  const auto less = [](int a, int b) { return a / 10 < b / 10; };  // the set's own order says what is the same
  struct Tens {
    bool operator()(int a, int b) const { return a / 10 < b / 10; }
  };
  CHECK(less(9, 10));
  CHECK(refuses<std::set<int, Tens>>("[11,12]"));
}

TEST_CASE("maps have enumerators and integers as names", "[rdf]") {
  using BySide = std::map<Side, double>;
  comes_back(BySide{{Side::left, 1}, {Side::right, 2}}, R"({"left":1,"right":2})");
  CHECK(refuses<BySide>(R"({"middle":1})"));
  CHECK(schema<BySide>().find(R"("propertyNames":{"enum":["left","right"]})") != std::string::npos);
  using ByNumber = std::unordered_map<std::int8_t, std::string>;
  comes_back(ByNumber{{-5, "a"}, {100, "b"}, {7, "c"}}, R"({"-5":"a","100":"b","7":"c"})");
  for (const char* name : {"128", "-129", "1.0", "+1", "01", "-0", "", " 1", "1e0", "x", "18446744073709551616"})
    CHECK(refuses<ByNumber>(std::string("{\"") + name + "\":\"\"}"));
  using ByLarge = std::map<std::uint64_t, int>;
  comes_back(ByLarge{{UINT64_MAX, 1}, {0, 2}}, R"({"0":2,"18446744073709551615":1})");
  CHECK(refuses<ByLarge>(R"({"-1":1})"));
  CHECK(refuses<ByLarge>(R"({"18446744073709551616":1})"));
  CHECK(schema<ByLarge>().find(R"("propertyNames":{"pattern":"^(0|[1-9][0-9]*)$"})") != std::string::npos);
  comes_back(std::map<std::string, std::map<int, bool>>{{"a", {{1, true}}}}, R"({"a":{"1":true}})");
}

TEST_CASE("pairs and tuples are records of what they have", "[rdf]") {
  comes_back(std::pair<double, std::string>(1.5, "m"), R"({"first":1.5,"second":"m"})");
  comes_back(std::tuple<int, Side, std::vector<int>>(1, Side::right, {2}), R"({"0":1,"1":"right","2":[2]})");
  comes_back(std::vector<std::pair<double, double>>{{1, 2}, {3, 4}}, R"([{"first":1,"second":2},{"first":3,"second":4}])");
  comes_back(std::pair<int, std::optional<int>>(1, std::nullopt), R"({"first":1})");
  CHECK(traits<std::pair<int, int>>::type().fields[1].predicate == "http://www.w3.org/1999/02/22-rdf-syntax-ns#_2");
  CHECK(refuses<std::pair<int, int>>("[1,2]"));
  CHECK(refuses<std::pair<int, int>>(R"({"first":1})"));
}

TEST_CASE("pointers that own are values that may be absent", "[rdf]") {
  using Own = std::unique_ptr<Gains>;
  comes_back(Own(), "null");
  comes_back(std::make_unique<Gains>(Gains{1, 2}), R"({"p":1,"i":2})");
  comes_back(std::make_shared<const double>(2.5), "2.5");
  const auto one = std::make_shared<int>(1);
  CHECK(traits<std::shared_ptr<int>>::same(one, std::make_shared<int>(1)));
  CHECK_FALSE(traits<std::shared_ptr<int>>::same(one, nullptr));
  CHECK(traits<Own>::type().kind == Type::Kind::optional);
}

TEST_CASE("bytes are base64, and a byte string in CBOR", "[rdf]") {
  using Bytes = std::vector<std::byte>;
  const Bytes bytes = {std::byte{0}, std::byte{1}, std::byte{254}, std::byte{255}};
  comes_back(bytes, R"("AAH+/w==")");
  comes_back(Bytes(), R"("")");
  comes_back(std::array<std::byte, 2>{std::byte{1}, std::byte{2}}, R"("AQI=")");
  comes_back(std::byte{200}, "200");
  comes_back(std::vector<std::uint8_t>{1, 2}, "[1,2]");
  CHECK(write_plain(traits<Bytes>::type(), {}, traits<Bytes>::encode(bytes), Plain::cbor).value() == std::string("\x44\x00\x01\xfe\xff", 5));
  CHECK(read<Bytes>(std::string("\x5f\x42\x00\x01\x42\xfe\xff\xff", 8), Plain::cbor).value() == bytes);  // in chunks
  CHECK_FALSE(read<std::string>(std::string("\x41\x61", 2), Plain::cbor).has_value());
  CHECK_FALSE(read<std::vector<int>>(std::string("\x41\x61", 2), Plain::cbor).has_value());
  for (const char* text : {"A", "AA", "AA=", "AAA", "A===", "AB==", "AAB=", "====", "AA==AA==", "AA_-", "\xc3\xa4"})
    CHECK(refuses<Bytes>(std::string("\"") + text + '"'));
  CHECK(read<Bytes>("\"AAH+ /w==\"", Plain::json).value() == bytes);  // XML Schema allows spaces
  using Two = std::array<std::byte, 2>;
  CHECK(refuses<Two>("\"AQID\""));
  CHECK(refuses<Two>("\"AQ==\""));
  CHECK(schema<Two>() == R"({"type":"string","contentEncoding":"base64","minLength":4,"maxLength":4})");
  CHECK(within(traits<Bytes>::type(), Facets().length(0, 4), traits<Bytes>::encode(bytes)));
  CHECK_FALSE(within(traits<Bytes>::type(), Facets().length(0, 3), traits<Bytes>::encode(bytes)));
}

TEST_CASE("paths are texts", "[rdf]") {
  comes_back(std::filesystem::path("/var/lib/robot.cfg"), R"("/var/lib/robot.cfg")");
  CHECK(refuses<std::filesystem::path>(R"("a\u0000b")"));
}

TEST_CASE("a record holds nested arrays, bytes, atomics and pointers", "[rdf]") {
  using standard_types_test::Held;
  Held held;
  comes_back(held, R"({"matrix":[[1,2,3],[4,5,6],[7,8,9]],"labels":["ab","c"],"raw":"AQL/","count":3,"shared":{"p":1,"i":2}})");
  const lrt::Result<Held> read_back =
      read<Held>(R"({"matrix":[[9,8,7],[6,5,4],[3,2,1]],"labels":["xyz",""],"raw":"AAAA","count":4,"own":{"p":5,"i":6}})", Plain::json);
  REQUIRE(read_back);
  CHECK(read_back->matrix[2][0] == 3);
  CHECK(std::string(read_back->labels[0]) == "xyz");
  CHECK(read_back->raw[2] == std::byte{0});
  CHECK(read_back->count.load() == 4);
  CHECK(read_back->own->i == 6);
  CHECK_FALSE(read_back->shared);
  const std::string rest = R"("raw":"AAAA","count":4})";
  CHECK(refuses<Held>(R"({"matrix":[[9,8],[6,5,4],[3,2,1]],"labels":["",""],)" + rest));
  CHECK(refuses<Held>(R"({"matrix":[[9,8,7],[6,5,4],[3,2,1]],"labels":["four",""],)" + rest));
  CHECK_FALSE(refuses<Held>(R"({"matrix":[[9,8,7],[6,5,4],[3,2,1]],"labels":["fou",""],)" + rest));
}

TEST_CASE("a record that contains itself by a pointer or a pair is a fault, and no endless call", "[rdf]") {
  const Type& node = traits<standard_types_test::Node>::type();
  REQUIRE(node.fields.size() == 2);
  CHECK_FALSE(node.fields[0].type->element->fault.empty());
  CHECK_FALSE(node.fields[1].type->element->fields[1].type->fault.empty());
}

TEST_CASE("a reference within a record is read where it refers to, and not written", "[rdf]") {
  using standard_types_test::Referring;
  CHECK(json_of(Referring()) == R"({"to":2.5})");
  CHECK(traits<Referring>::type().fields[0].read_only);
  static_assert(std::is_same_v<detail::stored_t<std::reference_wrapper<const std::string>>, std::string>);
}
