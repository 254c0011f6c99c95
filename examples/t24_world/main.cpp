// SPDX-License-Identifier: Apache-2.0
// What the robot knows of its surroundings: a World holds named graphs, each a resource that clients read and watch. Code changes a graph in one step,
// clients may write where the robot allows it, and SHACL validates both. The control loop publishes where things are without waiting for anybody.
#include <cstdio>
#include <string>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

struct Position {
  double x = 0, y = 0;
};

template <>
struct lrt::rdf::traits<Position> : lrt::rdf::Record<Position> {
  static void describe(Record<Position>& r) {
    r.is(vocab::maths::Vector2D);
    r.field(vocab::maths::x, &Position::x);
    r.field(vocab::maths::y, &Position::y);
  }
};

int main() {
  constexpr lrt::Iri position{"http://example.org/position"};
  lrt::World world("world");
  lrt::WorldGraph objects = world.graph("objects");
  lrt::GraphOptions options;
  options.clients_may_write = true;
  options.max_triples = 1000;
  options.shapes = R"(
    @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix schema: <http://schema.org/> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
    <#Task> a sh:NodeShape, rdfs:Class ; rdfs:label "task" ; sh:property [ sh:path schema:object ; sh:minCount 1 ] .)";
  lrt::WorldGraph tasks = world.graph("tasks", options);

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(world)).value();

  // A camera sees a cup. Readers see both triples or none.
  objects
      .update([](lrt::GraphUpdate& u) {
        u.add("#cup", lrt::vocab::rdf_::type, lrt::Iri("http://schema.org/Product"));
        u.add("#cup", lrt::vocab::rdfs::label, "the red cup");
      })
      .value();
  // The loop says where it is: no lock, no allocation.
  auto cup = objects.published<Position>("cup", position, lrt::unit::metre);
  cup.publish({0.5, -0.25});

  const lrt::Result<void> refused = tasks.update([](lrt::GraphUpdate& u) { u.add("#1", lrt::vocab::rdf_::type, lrt::Iri("blueprint#Task")); });

  lesson::Visitor visitor(server, [&refused](lesson::Client& client) {
    std::printf("%.*s\n\n", static_cast<int>(refused.error().message.find(": <")), refused.error().message.c_str());
    const std::string schema = "PREFIX schema: <http://schema.org/> ";
    client.only({"ldp:contains", "/world/objects>,", "/world/tasks>", "World", "Graph"});
    client.get("/world");
    client.only({});  // everything
    client.get("/world/objects");
    client.put("/world/objects", "<#cup> rdfs:label \"mine\" .");
    client.patch("/world/tasks", schema + "INSERT DATA { <#1> a <blueprint#Task> ; schema:object </world/objects#cup> ; rdfs:label \"bring it\" }");
    client.patch("/world/tasks", schema + "DELETE DATA { <#1> schema:object </world/objects#cup> }");
    client.patch("/world/tasks", "DELETE WHERE { ?task ?has ?anything }");
    client.get("/world?default");
  });
  server.run();
}

// Output:
// graph "world/tasks": it would not conform to its shapes
//
// GET /world
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/world> a hybrit:RoboticThing, lrt:World, ldp:BasicContainer, ldp:Container, ldp:RDFSource, <http://127.0.0.1:8080/blueprints/world-74e0b2bf> ;
//     lrt:allGraphs <http://127.0.0.1:8080/world?default> ;
//     ldp:contains <http://127.0.0.1:8080/world/objects>,
//         <http://127.0.0.1:8080/world/tasks> ;
// <http://127.0.0.1:8080/world/objects> a lrt:WorldGraph, ldp:RDFSource ;
// <http://127.0.0.1:8080/world/tasks> a lrt:WorldGraph, ldp:RDFSource ;
//
// GET /world/objects
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/world/objects#cup> a <http://schema.org/Product> ;
//     rdfs:label "the red cup" ;
//     <http://example.org/position> <http://127.0.0.1:8080/world/objects/cup> .
//
// <http://127.0.0.1:8080/world/objects/cup> a hybrit:Property, maths:Vector2D ;
//     rdfs:seeAlso <http://127.0.0.1:8080/world> ;
//     maths:x "0.5"^^xsd:double ;
//     maths:y "-0.25"^^xsd:double ;
//     qudt:hasUnit unit:M ;
//     qudt:hasQuantityKind quantitykind:Length ;
//     dcterms:modified "<time>"^^xsd:dateTime .
//
// PUT /world/objects
//   <#cup> rdfs:label "mine" .
// 405 Method Not Allowed
// Content-Type: application/problem+json
// Allow: GET, HEAD, OPTIONS
// {"type":"about:blank","title":"Method Not Allowed","status":405,"detail":"PUT is not allowed for this resource, only GET, HEAD, OPTIONS"}
//
// PATCH /world/tasks
// Content-Type: application/sparql-update
//   PREFIX schema: <http://schema.org/> INSERT DATA { <#1> a <blueprint#Task> ; schema:object </world/objects#cup> ; rdfs:label "bring it" }
// 204 No Content
//
// PATCH /world/tasks
// Content-Type: application/sparql-update
//   PREFIX schema: <http://schema.org/> DELETE DATA { <#1> schema:object </world/objects#cup> }
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/world/tasks#1> ;
//         sh:resultPath <http://schema.org/object> ;
//         sh:sourceConstraintComponent sh:MinCountConstraintComponent ;
//         sh:sourceShape [] ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected at least 1 value, found none"
//     ] .
//
// PATCH /world/tasks
// Content-Type: application/sparql-update
//   DELETE WHERE { ?task ?has ?anything }
// 422 Unprocessable Content
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Unprocessable Content","status":422,"detail":"body: line 25, column 8: DELETE WHERE is not supported, only INSERT DATA and DELETE DATA"}
//
// GET /world?default
// 200 OK
// Content-Type: text/turtle
// :cup a <http://schema.org/Product> ;
//     rdfs:label "the red cup" ;
//     <http://example.org/position> <http://127.0.0.1:8080/world/objects/cup> .
//
// <http://127.0.0.1:8080/world/objects/cup> a hybrit:Property, maths:Vector2D ;
//     rdfs:seeAlso <http://127.0.0.1:8080/world> ;
//     maths:x "0.5"^^xsd:double ;
//     maths:y "-0.25"^^xsd:double ;
//     qudt:hasUnit unit:M ;
//     qudt:hasQuantityKind quantitykind:Length ;
//     dcterms:modified "<time>"^^xsd:dateTime .
//
// <http://127.0.0.1:8080/world/tasks#1> a <http://127.0.0.1:8080/world/blueprint#Task> ;
//     <http://schema.org/object> :cup ;
//     rdfs:label "bring it" .
