// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/validator.hpp>

#include <cstdint>
#include <random>

#include "tests/shacl/support.hpp"

// Properties of validation on random shapes and data. The seeds are fixed, so a failure repeats.

namespace {

using lrt::rdf::Graph;
using lrt::rdf::TermId;
using lrt::rdf::TermView;
using lrt::shacl::Shapes;
using lrt::shacl::ValidateOptions;

class Generator {
 public:
  explicit Generator(std::uint32_t seed) : random_(seed) {}

  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  template <std::size_t N>
  std::string one_of(const char* const (&choices)[N]) {
    return choices[below(N)];
  }

  std::string node() { return one_of({"ex:a", "ex:b", "ex:c", "ex:d", "_:x", "_:y", "_:z"}); }
  std::string predicate() { return one_of({"ex:p", "ex:q", "ex:r"}); }
  std::string literal() {
    return one_of({"1", "2", "1.0", "\"abc\"", "\"ab\"@en", "\"xy\"@de", "\"5\"^^xsd:float", "\"fast\"^^xsd:float", "true",
                   "\"2024-01-01T00:00:00Z\"^^xsd:dateTime", "\"\""});
  }
  std::string value() { return below(2) ? node() : literal(); }

  std::string data() {
    std::string text;
    for (std::size_t i = 3 + below(25); i > 0; --i) text += node() + " " + predicate() + " " + value() + " .\n";
    for (std::size_t i = below(6); i > 0; --i) text += node() + " a " + one_of({"ex:C", "ex:D"}) + " .\n";
    if (below(3) == 0) text += "ex:D rdfs:subClassOf ex:C .\n";
    return text;
  }

  std::string path(std::size_t depth = 0) {
    switch (depth > 2 ? 7 : below(8)) {
      case 0: return "( " + path(depth + 1) + " " + predicate() + " )";
      case 1: return "[ sh:alternativePath ( " + predicate() + " " + path(depth + 1) + " ) ]";
      case 2: return "[ sh:inversePath " + path(depth + 1) + " ]";
      case 3: return "[ " + one_of({"sh:zeroOrMorePath ", "sh:oneOrMorePath ", "sh:zeroOrOnePath "}) + path(depth + 1) + " ]";
      default: return predicate();
    }
  }

  /// The predicates and objects of a shape.
  std::string constraints(std::size_t depth, bool property) {
    std::string text;
    for (std::size_t i = 1 + below(2); i > 0; --i) text += (text.empty() ? "" : " ; ") + constraint(depth, property, i);
    return text;
  }

  std::string shape(std::size_t depth) {
    return "[ " + (below(3) == 0 ? "sh:path " + any_path() + " ; " + constraints(depth, true) : constraints(depth, false)) + " ]";
  }
  std::string node_shape(std::size_t depth) { return "[ " + constraints(depth, false) + " ]"; }
  std::string property_shape(std::size_t depth) { return "[ sh:path " + any_path() + " ; " + constraints(depth, true) + " ]"; }

 private:
  std::string any_path() {
    const std::string p = below(2) ? predicate() : path();
    return p;
  }

  std::string constraint(std::size_t depth, bool property, std::size_t slot) {
    // Parameters that may stand once only are split between the two slots.
    if (property && slot == 1 && below(3) == 0) {
      switch (below(5)) {
        case 0: return "sh:minCount " + std::to_string(below(3));
        case 1: return "sh:maxCount " + std::to_string(below(3));
        case 2: return "sh:uniqueLang true";
        case 3: return "sh:lessThan " + predicate();
        default:
          return depth > 2 ? "sh:minCount 1"
                           : "sh:qualifiedValueShape " + shape(depth + 1) +
                                 " ; sh:qualifiedMinCount 1 ; sh:qualifiedMaxCount 2 ; sh:qualifiedValueShapesDisjoint true";
      }
    }
    if (depth < 3 && below(3) == 0) {
      switch (below(6)) {
        case 0: return "sh:not " + shape(depth + 1);
        case 1: return "sh:and ( " + shape(depth + 1) + " " + shape(depth + 1) + " )";
        case 2: return "sh:or ( " + shape(depth + 1) + " " + shape(depth + 1) + " )";
        case 3: return "sh:xone ( " + shape(depth + 1) + " " + shape(depth + 1) + " )";
        case 4: return "sh:node " + node_shape(depth + 1);
        default: return "sh:property " + property_shape(depth + 1);
      }
    }
    if (slot == 1) {
      switch (below(5)) {
        case 0: return "sh:datatype " + one_of({"xsd:integer", "xsd:float", "rdf:langString", "xsd:string"});
        case 1: return "sh:minInclusive " + literal();
        case 2: return "sh:maxExclusive " + literal();
        case 3: return "sh:pattern " + one_of({"\"a\"", "\"^[a-z]*$\"", "\"\\\\d+\""});
        default: return "sh:nodeKind " + one_of({"sh:IRI", "sh:Literal", "sh:BlankNodeOrIRI", "sh:BlankNode"});
      }
    }
    switch (below(8)) {
      case 0: return "sh:class ex:C";
      case 1: return "sh:minLength " + std::to_string(below(4));
      case 2: return "sh:languageIn ( \"en\" )";
      case 3: return "sh:equals " + predicate();
      case 4: return "sh:disjoint " + predicate();
      case 5: return "sh:hasValue " + one_of({"ex:a", "1", "\"abc\""});
      case 6: return "sh:in ( ex:a ex:b 1 1.0 \"abc\" )";
      default: return "sh:maxLength " + std::to_string(below(30));
    }
  }

  std::mt19937 random_;
};

constexpr const char* targets = "sh:targetSubjectsOf ex:p ; sh:targetObjectsOf ex:q ; sh:targetClass ex:C ; sh:targetNode ex:a, 1 ; ";

Graph relabelled(const Graph& graph) {
  Graph out;
  const auto term = [&](TermId id) {
    const TermView t = graph.term(id);
    return t.is_blank() ? out.intern(lrt::rdf::blank("other-" + std::string(t.text))) : out.intern(t);
  };
  for (const auto& t : graph.triples()) out.add(term(t.subject), term(t.predicate), term(t.object));
  return out;
}

Graph shuffled(const Graph& graph, std::uint32_t seed) {
  auto triples = graph.triples();
  std::shuffle(triples.begin(), triples.end(), std::mt19937(seed));
  Graph out;
  for (const auto& t : triples) out.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
  return out;
}

std::optional<std::vector<std::string>> results(const Graph& shapes, const Graph& data) {
  const auto compiled = Shapes::compile(shapes);
  if (!compiled) FAIL(compiled.error().message);
  ValidateOptions options;
  options.max_results = 100'000;
  options.details = false;
  const auto report = lrt::shacl::validate(*compiled, data, options);
  if (!report) return std::nullopt;
  return shacl_test::lines(*report);
}

constexpr std::uint32_t rounds = 400;

}  // namespace

TEST_CASE("labels of blank nodes, the order of triples and unrelated triples do not change a report", "[shacl]") {
  std::size_t judged = 0, violated = 0;
  for (std::uint32_t seed = 1; seed <= rounds; ++seed) {
    Generator generator(seed);
    const std::string shapes_text =
        std::string("ex:S ") + targets + generator.constraints(0, false) + " ; sh:property " + generator.property_shape(1) + " .";
    const std::string data_text = generator.data();
    INFO("seed " << seed << "\n" << shapes_text << "\n" << data_text);
    const Graph shapes = shacl_test::parse(shapes_text), data = shacl_test::parse(data_text);
    const auto expected = results(shapes, data);
    REQUIRE(expected);
    ++judged;
    violated += !expected->empty();
    CHECK(results(relabelled(shapes), data) == expected);
    CHECK(results(shapes, relabelled(data)) == expected);
    CHECK(results(shuffled(shapes, seed), data) == expected);
    CHECK(results(shapes, shuffled(data, seed)) == expected);
    Graph more = data;
    more.add(lrt::rdf::iri("http://example.org/unrelated"), lrt::rdf::iri("http://example.org/unrelated"), lrt::rdf::literal("x"));
    CHECK(results(shapes, more) == expected);
  }
  CHECK(judged == rounds);
  CHECK(violated > rounds / 4);  // the generator must make violations
  CHECK(violated < rounds);
}

TEST_CASE("sh:not of a shape holds exactly where the shape does not", "[shacl]") {
  std::size_t both[2] = {0, 0};
  for (std::uint32_t seed = 1; seed <= rounds; ++seed) {
    Generator generator(seed + 10'000);
    const std::string constraints = generator.constraints(0, false), data_text = generator.data();
    INFO("seed " << seed << "\n" << constraints << "\n" << data_text);
    const Shapes shapes = shacl_test::compile("ex:S a sh:NodeShape ; " + constraints +
                                              " . ex:N sh:not ex:S . ex:NN sh:not ex:N . ex:X sh:xone ( ex:S ex:N ) . ex:A "
                                              "sh:and ( ex:S ex:N ) . ex:O sh:or ( ex:S ex:N ) .");
    const Graph data = shacl_test::parse(data_text);
    for (const char* focus : {"a", "b", "c"}) {
      const auto conforms = [&](const char* shape) {
        const auto report = lrt::shacl::validate(shapes, data, lrt::rdf::iri(shacl_test::ex + focus), lrt::rdf::iri(shacl_test::ex + shape));
        if (!report) FAIL(report.error().message);
        return report->conforms();
      };
      const bool holds = conforms("S");
      ++both[holds];
      CHECK(conforms("N") != holds);
      CHECK(conforms("NN") == holds);
      CHECK(conforms("X"));
      CHECK_FALSE(conforms("A"));
      CHECK(conforms("O"));
    }
  }
  CHECK(both[0] > rounds / 2);
  CHECK(both[1] > rounds / 8);
}

TEST_CASE("an incomplete report is the beginning of the complete one", "[shacl]") {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    Generator generator(seed + 20'000);
    const std::string text =
        std::string("ex:S ") + targets + generator.constraints(0, false) + " ; sh:property " + generator.property_shape(1) + " .";
    const Shapes shapes = shacl_test::compile(text);
    const Graph data = shacl_test::parse(generator.data());
    ValidateOptions options;
    options.details = false;
    const auto whole = lrt::shacl::validate(shapes, data, options);
    REQUIRE(whole);
    options.max_results = whole->results().size() / 2;
    const auto cut = lrt::shacl::validate(shapes, data, options);
    REQUIRE(cut);
    REQUIRE(cut->results().size() == options.max_results);
    for (std::size_t i = 0; i < cut->results().size(); ++i) CHECK(shacl_test::line(cut->results()[i]) == shacl_test::line(whole->results()[i]));
  }
}
