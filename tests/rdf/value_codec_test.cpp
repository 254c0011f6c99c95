// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/value_codec.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace unit = lrt::unit;
namespace vocab = lrt::vocab;

namespace {

const std::string vocabulary = "http://robot/ns/vocabulary#";

Value list(std::vector<Value> members) { return Value(Value::Sequence(std::move(members))); }
Value text(const char* content) { return Value(std::string(content)); }
Value integer(std::int64_t number) { return Value(number); }

template <class T>
bool fits(const Facets& facets, const Value& value) {
  return within(traits<T>::type(), facets, value);
}

}  // namespace

TEST_CASE("a term is an absolute IRI, or a name in the vocabulary of the server", "[rdf]") {
  CHECK(term_iri("#Step", vocabulary) == "http://robot/ns/vocabulary#Step");
  CHECK(term_iri("#Step/x", vocabulary) == "http://robot/ns/vocabulary#Step/x");
  CHECK(term_iri("#", vocabulary) == vocabulary);
  CHECK(term_iri("http://e/v#Step", vocabulary) == "http://e/v#Step");
  CHECK(term_iri("urn:step", vocabulary) == "urn:step");
  CHECK(term_iri("", vocabulary).empty());
  CHECK(term_iri("#Step", "") == "Step");
}

TEST_CASE("nodes of numbers are scalars, those of records have their first class", "[rdf]") {
  const std::string scalar(vocab::maths::Scalar.text);
  CHECK(target_class(traits<int>::type(), vocabulary) == scalar);
  CHECK(target_class(traits<std::optional<float>>::type(), vocabulary) == scalar);
  CHECK(target_class(traits<std::string>::type(), vocabulary).empty());
  CHECK(target_class(traits<bool>::type(), vocabulary).empty());
  CHECK(target_class(traits<std::vector<double>>::type(), vocabulary).empty());
  Type record;
  record.kind = Type::Kind::record;
  CHECK(target_class(record, vocabulary).empty());
  record.classes = {"#Step", "http://e/Thing"};
  CHECK(target_class(record, vocabulary) == vocabulary + "Step");
  Type present;
  present.kind = Type::Kind::optional;
  present.element = &record;
  CHECK(target_class(present, vocabulary) == vocabulary + "Step");
}

TEST_CASE("a number is within its bounds, which may be allowed themselves or not", "[rdf]") {
  const Facets closed = Facets().between(-1, 2), open = Facets().above(-1).below(2);
  for (const std::int64_t number : {-1, 0, 2}) CHECK(fits<int>(closed, integer(number)));
  for (const std::int64_t number : {-2, 3}) CHECK_FALSE(fits<int>(closed, integer(number)));
  CHECK(fits<int>(open, integer(1)));
  for (const std::int64_t number : {-1, 2}) CHECK_FALSE(fits<int>(open, integer(number)));
  CHECK(fits<double>(open, Value(std::nextafter(2.0, 0.0))));
  CHECK_FALSE(fits<double>(open, Value(2.0)));
  CHECK(fits<double>(closed, Value(2.0)));
  CHECK_FALSE(fits<double>(closed, Value(std::nextafter(2.0, 3.0))));
  CHECK(fits<double>(Facets(unit::volt), Value(-1e308)));
}

TEST_CASE("an integer above the range of int64 is compared as it is", "[rdf]") {
  const std::uint64_t largest = std::numeric_limits<std::uint64_t>::max();
  CHECK(fits<std::uint64_t>(Facets(), Value(largest)));
  CHECK(fits<std::uint64_t>(Facets().at_least(1e19), Value(largest)));
  CHECK_FALSE(fits<std::uint64_t>(Facets().at_most(1e19), Value(largest)));
  CHECK(fits<std::uint64_t>(Facets().at_most(18446744073709551616.0), Value(largest)));  // 2^64
  CHECK_FALSE(fits<std::uint64_t>(Facets().at_least(18446744073709551616.0), Value(largest)));
  CHECK_FALSE(fits<std::int64_t>(Facets().at_least(9223372036854775808.0), integer(std::numeric_limits<std::int64_t>::max())));  // 2^63
}

TEST_CASE("a number that is not finite is within the facets only if they allow it", "[rdf]") {
  for (const double number :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    CHECK_FALSE(fits<double>(Facets(), Value(number)));
    CHECK_FALSE(fits<float>(Facets().at_least(0), Value(number)));
    CHECK(fits<double>(Facets().allow_non_finite(), Value(number)));
  }
}

TEST_CASE("the length of a text is counted in code points", "[rdf]") {
  const Facets facets = Facets().length(2, 3);
  CHECK_FALSE(fits<std::string>(facets, text("a")));
  CHECK(fits<std::string>(facets, text("ab")));
  CHECK(fits<std::string>(facets, text("\xF0\x9F\xA4\x96\xE2\x82\xAC\xC3\xB6")));
  CHECK_FALSE(fits<std::string>(facets, text("\xF0\x9F\xA4\x96")));
  CHECK_FALSE(fits<std::string>(facets, text("abcd")));
  CHECK(fits<std::string>(Facets(), text("")));
}

TEST_CASE("bounds apply to each number of a list and of a map, and to a value that is present", "[rdf]") {
  const Facets facets = Facets().between(0, 9);
  CHECK(fits<std::vector<int>>(facets, list({})));
  CHECK(fits<std::vector<int>>(facets, list({integer(0), integer(9)})));
  CHECK_FALSE(fits<std::vector<int>>(facets, list({integer(0), integer(10), integer(9)})));
  using Map = std::map<std::string, int>;
  CHECK(fits<Map>(facets, list({list({text("a"), integer(9)})})));
  CHECK_FALSE(fits<Map>(facets, list({list({text("a"), integer(9)}), list({text("b"), integer(-1)})})));
  CHECK(fits<std::optional<int>>(facets, Value()));
  CHECK(fits<std::optional<int>>(facets, integer(9)));
  CHECK_FALSE(fits<std::optional<int>>(facets, integer(10)));
}

TEST_CASE("the fields of a record have facets of their own", "[rdf]") {
  const Type number = traits<int>::type();
  Type record;
  record.kind = Type::Kind::record;
  record.fields.push_back({"low", "#R/low", &number, Facets().at_most(3), false, false});
  record.fields.push_back({"any", "#R/any", &number, Facets(), false, false});
  CHECK(within(record, Facets(), list({integer(3), integer(100)})));
  CHECK(within(record, Facets().at_most(1), list({integer(3), integer(100)})));
  CHECK_FALSE(within(record, Facets(), list({integer(4), integer(0)})));
  CHECK_FALSE(within(record, Facets(), list({integer(3)})));
  CHECK_FALSE(within(record, Facets(), list({integer(3), integer(0), integer(0)})));
}

TEST_CASE("a value of another kind is not within the facets", "[rdf]") {
  for (const Value& value : {Value(), Value(true), text("1")}) {
    CHECK_FALSE(fits<int>(Facets(), value));
    CHECK_FALSE(fits<double>(Facets(), value));
    CHECK_FALSE(fits<std::vector<int>>(Facets(), value));
    CHECK_FALSE(fits<std::map<std::string, int>>(Facets(), value));
    CHECK_FALSE(fits<std::vector<int>>(Facets(), list({value})));
  }
  CHECK_FALSE(fits<std::string>(Facets(), integer(1)));
  CHECK_FALSE(fits<int>(Facets(), Value(1.0)));
  CHECK_FALSE(fits<bool>(Facets(), Value()));
  using Map = std::map<std::string, int>;
  CHECK_FALSE(fits<Map>(Facets(), list({list({text("a")})})));
  CHECK_FALSE(fits<Map>(Facets(), list({list({text("a"), integer(1), integer(2)})})));
}

TEST_CASE("nodes inside a value at a node with an IRI have names, fragments of it", "[rdf][SPEC 3.19]") {
  Type step;
  step.kind = Type::Kind::record;
  step.fields = {{"way x", "http://e/x", &traits<double>::type(), Facets{unit::metre}},
                 {"tags", "http://e/tags", &traits<std::vector<int>>::type(), {}}};
  const Value value = list({Value(1.5), list({integer(7), integer(8)})});
  const auto written = [&](const TermView& focus) {
    Graph graph;
    write_value(graph, graph.intern(focus), step, {}, value, vocabulary);
    return graph;
  };
  const auto names = [](const Graph& graph) {
    std::set<std::string> all;
    for (const Triple& t : graph.triples()) all.emplace(graph.term(t.subject).text);
    return all;
  };
  CHECK(names(written(iri("http://r/s"))) == std::set<std::string>{"http://r/s", "http://r/s#way%20x", "http://r/s#tags-0", "http://r/s#tags-1"});
  CHECK(names(written(iri("http://r/s#in"))) ==
        std::set<std::string>{"http://r/s#in", "http://r/s#in.way%20x", "http://r/s#in.tags-0", "http://r/s#in.tags-1"});
  const Graph blank_focus = written(blank("f"));
  for (const Triple& t : blank_focus.triples()) CHECK(blank_focus.term(t.subject).is_blank());
  CHECK(isomorphic(blank_focus, written(blank("g"))));
}
