// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/shapes.hpp>

#include "tests/shacl/support.hpp"

namespace {

using lrt::Errc;
using lrt::shacl::CompileOptions;
using lrt::shacl::Shapes;

struct Case {
  const char* rule;  ///< the syntax rule of SHACL, by its name there
  const char* shapes;
  const char* said;  ///< part of the message
};

const Case cases[] = {
    {"multiple-parameters", "ex:S sh:nodeKind sh:IRI, sh:Literal .", "sh:nodeKind sh:Literal: expected one value only"},
    {"path-maxCount", "ex:S sh:path ex:p, ex:q ; sh:minCount 1 .", "sh:path <http://example.org/ns#q>: expected one path only"},
    {"path-node: a literal", "ex:S sh:property [ sh:path \"p\" ] .", "sh:path \"p\": expected a property path"},
    {"path-node: rdf:nil", "ex:S sh:property [ sh:path () ] .", "sh:path rdf:nil: expected a property path"},
    {"path-sequence: one member", "ex:S sh:property [ sh:path ( ex:p ) ] .", "at least two paths"},
    {"path-sequence: no list", "ex:S sh:property [ sh:path [ rdf:first ex:p ] ] .", "at least two paths"},
    {"path-alternative: one member", "ex:S sh:property [ sh:path [ sh:alternativePath ( ex:p ) ] ] .",
     "sh:alternativePath with a list of at least two paths"},
    {"path: two forms at once", "ex:S sh:property [ sh:path [ sh:inversePath ex:p ; sh:zeroOrMorePath ex:q ] ] .", "exactly one triple"},
    {"path: none of the forms", "ex:S sh:property [ sh:path [ ex:p ex:q ] ] .", "expected a property path"},
    {"path: nothing at all", "ex:S sh:property [ sh:path [] ] .", "exactly one triple"},
    {"path-non-recursive", "ex:S sh:property [ sh:path _:p ] . _:p sh:inversePath _:p .", "does not contain itself"},
    {"NodeShape-path-maxCount", "ex:S a sh:NodeShape ; sh:path ex:p .", "expected no path in a sh:NodeShape"},
    {"PropertyShape-path-minCount", "ex:S a sh:PropertyShape ; sh:class ex:C .", "expected a sh:path"},
    {"property-node", "ex:S sh:property ex:T . ex:T sh:class ex:C .", "sh:property <http://example.org/ns#T>: expected a property shape"},
    {"property-node: a literal", "ex:S sh:property 1 .", "sh:property 1: expected a shape"},
    {"node-node", "ex:S sh:node ex:T . ex:T sh:path ex:p .", "expected a node shape"},
    {"targetNode-nodeKind", "ex:S sh:targetNode [] .", "sh:targetNode _:"},
    {"targetClass-nodeKind", "ex:S sh:targetClass \"C\" .", "sh:targetClass \"C\": expected an IRI"},
    {"targetSubjectsOf-nodeKind", "ex:S sh:targetSubjectsOf [] .", "sh:targetSubjectsOf"},
    {"targetObjectsOf-nodeKind", "ex:S sh:targetObjectsOf 1 .", "sh:targetObjectsOf"},
    {"implicit-targetClass-nodeKind", "[] a rdfs:Class, sh:NodeShape .", "is a class and a shape: expected an IRI"},
    {"severity-maxCount", "ex:S a sh:NodeShape ; sh:severity sh:Info, sh:Warning .", "sh:severity sh:Warning: expected one value only"},
    {"severity-nodeKind", "ex:S a sh:NodeShape ; sh:severity \"high\" .", "sh:severity \"high\": expected an IRI"},
    {"message-datatype", "ex:S a sh:NodeShape ; sh:message 1 .", "sh:message 1: expected an xsd:string"},
    {"deactivated-datatype", "ex:S a sh:NodeShape ; sh:deactivated \"yes\" .", "sh:deactivated \"yes\": expected true or false"},
    {"deactivated-maxCount", "ex:S a sh:NodeShape ; sh:deactivated true, false .", "sh:deactivated false: expected one value only"},
    {"class-nodeKind", "ex:S sh:class \"C\" .", "sh:class \"C\": expected an IRI"},
    {"datatype-nodeKind", "ex:S sh:datatype \"xsd:float\" .", "sh:datatype \"xsd:float\": expected an IRI"},
    {"datatype-maxCount", "ex:S sh:datatype xsd:float, xsd:double .", "one value only"},
    {"nodeKind-in", "ex:S sh:nodeKind sh:Iri .", "sh:nodeKind sh:Iri: expected one of the six node kinds"},
    {"minCount-scope", "ex:S a sh:NodeShape ; sh:minCount 1 .", "in property shapes only"},
    {"minCount-datatype", "ex:S sh:path ex:p ; sh:minCount \"1\" .", "sh:minCount \"1\": expected an xsd:integer"},
    {"minCount-datatype, ill-typed", "ex:S sh:path ex:p ; sh:minCount \"one\"^^xsd:integer .", "expected an xsd:integer"},
    {"maxCount-scope", "ex:S a sh:NodeShape ; sh:maxCount 1 .", "in property shapes only"},
    {"maxCount-maxCount", "ex:S sh:path ex:p ; sh:maxCount 1, 2 .", "one value only"},
    {"maxCount-datatype", "ex:S sh:path ex:p ; sh:maxCount 1.0 .", "expected an xsd:integer"},
    {"minExclusive-nodeKind", "ex:S sh:minExclusive ex:a .", "expected a literal"},
    {"minInclusive-nodeKind", "ex:S sh:minInclusive [] .", "expected a literal"},
    {"maxExclusive-nodeKind", "ex:S sh:maxExclusive ex:a .", "expected a literal"},
    {"maxInclusive-maxCount", "ex:S sh:maxInclusive 1, 2 .", "one value only"},
    {"minLength-datatype", "ex:S sh:minLength \"x\" .", "expected an xsd:integer"},
    {"maxLength-datatype", "ex:S sh:maxLength 1.5 .", "expected an xsd:integer"},
    {"pattern-datatype", "ex:S sh:pattern \"a\"@en .", "sh:pattern \"a\"@en: expected an xsd:string"},
    {"pattern-regex", "ex:S sh:pattern \"(\" .", "sh:pattern \"(\": expected a regular expression: missing closing parenthesis"},
    {"pattern-regex: a class without end", "ex:S sh:pattern \"[a-\" .", "a class without ]"},
    {"pattern-regex: commands of PCRE", "ex:S sh:pattern \"(*NO_JIT)a\" .", "a quantifier without an atom"},
    {"flags", "ex:S sh:pattern \"a\" ; sh:flags \"g\" .", "sh:flags \"g\": expected a regular expression: unknown flag 'g'"},
    {"languageIn-node", "ex:S sh:languageIn \"en\" .", "expected a well-formed RDF list"},
    {"languageIn-members-datatype", "ex:S sh:languageIn ( \"en\" ex:de ) .", "expected a list of xsd:string"},
    {"uniqueLang-scope", "ex:S a sh:NodeShape ; sh:uniqueLang true .", "in property shapes only"},
    {"uniqueLang-datatype", "ex:S sh:path ex:p ; sh:uniqueLang \"true\" .", "expected an xsd:boolean"},
    {"equals-nodeKind", "ex:S sh:equals \"p\" .", "expected an IRI"},
    {"disjoint-nodeKind", "ex:S sh:disjoint [] .", "expected an IRI"},
    {"lessThan-scope", "ex:S a sh:NodeShape ; sh:lessThan ex:p .", "in property shapes only"},
    {"lessThan-nodeKind", "ex:S sh:path ex:p ; sh:lessThan 1 .", "expected an IRI"},
    {"lessThanOrEquals-scope", "ex:S a sh:NodeShape ; sh:lessThanOrEquals ex:p .", "in property shapes only"},
    {"not-node", "ex:S sh:not 1 .", "expected a shape"},
    {"and-node", "ex:S sh:and ex:T .", "expected a well-formed RDF list of shapes"},
    {"or-members-node", "ex:S sh:or ( [ sh:class ex:C ] 1 ) .", "expected a list of shapes"},
    {"xone-node: an endless list", "ex:S sh:xone _:l . _:l rdf:first ex:T ; rdf:rest _:l .", "expected a well-formed RDF list of shapes"},
    {"qualifiedValueShape-scope", "ex:S a sh:NodeShape ; sh:qualifiedValueShape [ sh:class ex:C ] ; sh:qualifiedMinCount 1 .",
     "in property shapes only"},
    {"qualifiedMinCount-datatype", "ex:S sh:path ex:p ; sh:qualifiedValueShape [ sh:class ex:C ] ; sh:qualifiedMinCount \"1\" .",
     "expected an xsd:integer"},
    {"qualifiedValueShape-multiple", "ex:S sh:path ex:p ; sh:qualifiedValueShape [ sh:class ex:C ], [ sh:class ex:D ] ; sh:qualifiedMinCount 1 .",
     "one value only"},
    {"qualifiedValueShapesDisjoint-datatype", "ex:S sh:path ex:p ; sh:qualifiedValueShape [ sh:class ex:C ] ; sh:qualifiedValueShapesDisjoint 1 .",
     "expected an xsd:boolean"},
    {"closed-datatype", "ex:S sh:closed \"true\" .", "expected an xsd:boolean"},
    {"ignoredProperties-node", "ex:S sh:closed true ; sh:ignoredProperties ex:p .", "expected a well-formed RDF list"},
    {"ignoredProperties-members-nodeKind", "ex:S sh:closed true ; sh:ignoredProperties ( \"p\" ) .", "expected a list of IRIs"},
    {"in-node", "ex:S sh:in ex:a .", "expected a well-formed RDF list"},
    {"in-maxCount", "ex:S sh:in ( 1 ), ( 2 ) .", "one value only"},
    {"also where nothing uses the shape", "[] sh:minLength ex:a .", "expected an xsd:integer"},
};

}  // namespace

TEST_CASE("ill-formed shapes are refused with the triple", "[shacl]") {
  for (const Case& test : cases) {
    DYNAMIC_SECTION(test.rule) {
      const auto shapes = Shapes::compile(shacl_test::parse(test.shapes));
      REQUIRE_FALSE(shapes);
      CHECK((shapes.error().code == Errc::expected_value || shapes.error().code == Errc::limit_exceeded));
      INFO(shapes.error().message);
      CHECK(shapes.error().message.find("ill-formed shape: ") == 0);
      CHECK(shapes.error().message.find(test.said) != std::string::npos);
    }
  }
}

TEST_CASE("features beyond SHACL Core are refused unless they are ignored by option", "[shacl]") {
  for (const char* text : {"ex:S a sh:NodeShape ; sh:sparql [ sh:select \"SELECT $this WHERE {}\" ] .", "ex:S a sh:NodeShape ; sh:js [] .",
                           "ex:S a sh:NodeShape ; sh:target [] .", "<> sh:entailment <http://www.w3.org/ns/entailment/RDFS> .",
                           "ex:C a sh:ConstraintComponent ; sh:parameter [ sh:path ex:most ] . ex:S a sh:NodeShape ; ex:most 1 ."}) {
    INFO(text);
    const auto graph = shacl_test::parse(text);
    const auto refused = Shapes::compile(graph);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::unsupported_syntax);
    CHECK(refused.error().message.find("not part of SHACL Core") != std::string::npos);
    CompileOptions options;
    options.ignore_unsupported = true;
    CHECK(Shapes::compile(graph, options));
  }
}

TEST_CASE("patterns and paths beyond the limits are refused when shapes are compiled", "[shacl]") {
  CompileOptions options;
  options.max_pattern_length = 10;
  auto refused = Shapes::compile(shacl_test::parse("ex:S sh:pattern \"01234567890\" ."), options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::limit_exceeded);
  CHECK(Shapes::compile(shacl_test::parse("ex:S sh:pattern \"0123456789\" ."), options));
  refused = Shapes::compile(shacl_test::parse("ex:S sh:pattern \"((((((((((a{1,99}){1,99}){1,99}){1,99}){1,99}){1,99}){1,99}))))\" ."));
  CHECK_FALSE(refused);

  std::string doubling = "ex:S sh:property [ sh:path _:p0 ] .\n";  // small as a graph, 2^20 parts as a path
  for (int i = 0; i < 20; ++i)
    doubling += "_:p" + std::to_string(i) + " rdf:first _:p" + std::to_string(i + 1) + " ; rdf:rest [ rdf:first _:p" + std::to_string(i + 1) +
                " ; rdf:rest () ] .\n";
  doubling += "_:p20 sh:inversePath ex:p .";
  refused = Shapes::compile(shacl_test::parse(doubling));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::limit_exceeded);
}

TEST_CASE("a shapes graph is compiled once and lists its shapes", "[shacl]") {
  const Shapes shapes =
      shacl_test::compile("ex:S a sh:NodeShape ; sh:property [ sh:path ex:p ; sh:minCount 1 ] ; rdfs:label \"S\" . ex:a ex:b ex:c .");
  CHECK(shapes.size() == 2);
  CHECK(shapes.contains(lrt::rdf::iri(shacl_test::ex + "S")));
  CHECK_FALSE(shapes.contains(lrt::rdf::iri(shacl_test::ex + "a")));
  CHECK_FALSE(shapes.contains(lrt::rdf::iri("http://example.org/unknown")));
  const Shapes copy = shapes;
  CHECK(copy.plan() == shapes.plan());
}
