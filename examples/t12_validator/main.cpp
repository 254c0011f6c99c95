// SPDX-License-Identifier: Apache-2.0
// The SHACL engine alone: no server, no robot.
#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/validator.hpp>

#include <cstdio>

int main() {
  const lrt::rdf::ReadOptions base{"http://example.org/"};
  const auto shapes_graph = lrt::rdf::read(R"(
    @prefix sh: <http://www.w3.org/ns/shacl#> .
    @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
    @prefix ex: <http://example.org/#> .
    ex:JointShape a sh:NodeShape ;
        sh:targetClass ex:Joint ;
        sh:property [ sh:path ex:limit ; sh:datatype xsd:decimal ; sh:minExclusive 0 ; sh:minCount 1 ] ;
        sh:property [ sh:path ex:next ; sh:class ex:Joint ; sh:maxCount 1 ] .)",
                                           lrt::rdf::Syntax::turtle, base);
  const auto shapes = lrt::shacl::Shapes::compile(shapes_graph.value()).value();  // once

  for (const char* robot : {"ex:j1 a ex:Joint ; ex:limit 2.5 ; ex:next ex:j2 . ex:j2 a ex:Joint ; ex:limit 1.5 .",
                            "ex:j1 a ex:Joint ; ex:limit -2.5 ; ex:next ex:table . ex:j2 a ex:Joint ."}) {
    const auto data = lrt::rdf::read("@prefix ex: <http://example.org/#> . " + std::string(robot), lrt::rdf::Syntax::turtle, base);
    const auto report = lrt::shacl::validate(shapes, data.value()).value();  // often
    std::printf("%s\n%s\n", report.conforms() ? "conforms" : "does not conform:", report.to_text().c_str());
  }
}

// Output:
// conforms
//
// does not conform:
// <http://example.org/#j1> <http://example.org/#limit>: expected more than 0, found -2.5 [sh:MinExclusiveConstraintComponent]
// <http://example.org/#j1> <http://example.org/#next>: expected an instance of <http://example.org/#Joint>, found <http://example.org/#table> [sh:ClassConstraintComponent]
// <http://example.org/#j2> <http://example.org/#limit>: expected at least 1 value, found none [sh:MinCountConstraintComponent]
