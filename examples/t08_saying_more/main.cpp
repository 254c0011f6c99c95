// SPDX-License-Identifier: Apache-2.0
// Describing more: types and predicates of your domain, a title, any triple in C++ or in Turtle, and a thing within a thing. This is optional.
// It lets clients find out what the thing is.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  using lrt::Iri;
  using lrt::Object;
  double level = 0.75;

  lrt::Thing rover{"rover"};
  rover.type(Iri{"http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#PhysicalAgent"})
      .title("The rover in the lab", "en")  // for people, in each language that they read
      .title("Der Rover im Labor", "de")
      .add(Iri{"http://schema.org/serialNumber"}, "R-0042")
      .add(lrt::vocab::rdfs::label, Object::tagged("Rover", "en"))
      .add(lrt::vocab::rdfs::label, Object::tagged("Roboter", "de"))
      .add(lrt::vocab::rdfs::seeAlso, Object::resource("rover/battery"))  // a resource of this server, by its path
      .add_turtle("@prefix schema: <http://schema.org/> . <> schema:weight [ schema:value 12.5 ; schema:unitCode \"KGM\" ] .");

  lrt::Thing battery{"rover/battery"};  // a thing below a thing, by its path
  battery
      .property(
          "charge", [&] { return level; }, lrt::unit::one)
      .predicate(Iri{"http://example.org/rover#charge"})
      .type(Iri{"http://www.w3.org/ns/sosa/ObservableProperty"})
      .add(lrt::vocab::rdfs::comment, "Measured at rest; drops by a tenth under load.");

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(rover)).value();
  server.add(std::move(battery)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.show("Link");
    client.get("/rover");
    client.get("/rover/battery/state");
  });
  server.run();
}

// Output:
// GET /rover
// 200 OK
// Content-Type: text/turtle
// Link:
//     <http://www.w3.org/ns/ldp#Resource>; rel="type"
//     <http://www.w3.org/ns/ldp#RDFSource>; rel="type"
//     <http://127.0.0.1:8080/>; rel="up"
//     <http://127.0.0.1:8080/blueprints/PhysicalAgent-857d20fd>; rel="describedby"
//     <http://127.0.0.1:8080/rover/state>; rel="related"
//     <http://127.0.0.1:8080/blueprints/PhysicalAgent-857d20fd>; rel="related"
//     <http://127.0.0.1:8080/rover/subscriptions>; rel="related"
//     <http://127.0.0.1:8080/rover/all>; rel="related"
//     <http://127.0.0.1:8080/rover/all>; rel="https://w3id.org/lrt/ns#all"
//     <http://127.0.0.1:8080/rover/battery>; rel="related"
//     <http://127.0.0.1:8080/rover?accept=text/turtle>; rel="alternate"; type="text/turtle"
//     <http://127.0.0.1:8080/rover?accept=application/n-triples>; rel="alternate"; type="application/n-triples"
//     <http://127.0.0.1:8080/rover?accept=application/rdf+xml>; rel="alternate"; type="application/rdf+xml"
//     <http://127.0.0.1:8080/rover?accept=application/ld+json>; rel="alternate"; type="application/ld+json"
//     <http://127.0.0.1:8080/rover?accept=application/trig>; rel="alternate"; type="application/trig"
//     <http://127.0.0.1:8080/rover?accept=application/n-quads>; rel="alternate"; type="application/n-quads"
//     <http://127.0.0.1:8080/rover?accept=application/json>; rel="alternate"; type="application/json"
// <http://127.0.0.1:8080/rover> a hybrit:RoboticThing, <http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#PhysicalAgent>, <http://127.0.0.1:8080/blueprints/PhysicalAgent-857d20fd> ;
//     dcterms:title "The rover in the lab"@en,
//         "Der Rover im Labor"@de ;
//     hybrit:blueprint <http://127.0.0.1:8080/blueprints/PhysicalAgent-857d20fd> ;
//     hybrit:subscriptions <http://127.0.0.1:8080/rover/subscriptions> ;
//     lrt:state <http://127.0.0.1:8080/rover/state> ;
//     lrt:all <http://127.0.0.1:8080/rover/all> ;
//     dcterms:hasPart <http://127.0.0.1:8080/rover/battery> ;
//     <http://schema.org/serialNumber> "R-0042" ;
//     rdfs:label "Rover"@en,
//         "Roboter"@de ;
//     rdfs:seeAlso <http://127.0.0.1:8080/rover/battery> ;
//     <http://schema.org/weight> :_b0 ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/rover"^^xsd:anyURI .
//
// :_b0 <http://schema.org/value> 12.5 ;
//     <http://schema.org/unitCode> "KGM" .
//
// <http://127.0.0.1:8080/rover/battery> a hybrit:RoboticThing .
//
// GET /rover/battery/state
// 200 OK
// Content-Type: text/turtle
// Link:
//     <http://www.w3.org/ns/ldp#Resource>; rel="type"
//     <http://www.w3.org/ns/ldp#RDFSource>; rel="type"
//     <http://127.0.0.1:8080/rover/battery>; rel="up"
//     <http://127.0.0.1:8080/blueprints/battery-d5340b37>; rel="describedby"
//     <http://127.0.0.1:8080/rover/battery/charge>; rel="related"
//     <http://127.0.0.1:8080/rover/battery/state?accept=text/turtle>; rel="alternate"; type="text/turtle"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/n-triples>; rel="alternate"; type="application/n-triples"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/rdf+xml>; rel="alternate"; type="application/rdf+xml"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/ld+json>; rel="alternate"; type="application/ld+json"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/trig>; rel="alternate"; type="application/trig"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/n-quads>; rel="alternate"; type="application/n-quads"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/json>; rel="alternate"; type="application/json"
//     <http://127.0.0.1:8080/rover/battery/state?accept=text/plain>; rel="alternate"; type="text/plain"
//     <http://127.0.0.1:8080/rover/battery/state?accept=application/cbor>; rel="alternate"; type="application/cbor"
// <http://127.0.0.1:8080/rover/battery/state> a ldp:RDFSource ;
//     hybrit:subscriptions <http://127.0.0.1:8080/rover/battery/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/rover/battery/state"^^xsd:anyURI .
//
// <http://127.0.0.1:8080/rover/battery> a hybrit:RoboticThing, <http://127.0.0.1:8080/blueprints/battery-d5340b37> ;
//     dcterms:title "battery" ;
//     hybrit:blueprint <http://127.0.0.1:8080/blueprints/battery-d5340b37> ;
//     hybrit:subscriptions <http://127.0.0.1:8080/rover/battery/subscriptions> ;
//     lrt:state <http://127.0.0.1:8080/rover/battery/state> ;
//     dcterms:isPartOf <http://127.0.0.1:8080/rover> ;
//     hybrit:property <http://127.0.0.1:8080/rover/battery/charge> ;
//     <http://example.org/rover#charge> <http://127.0.0.1:8080/rover/battery/charge> .
//
// <http://127.0.0.1:8080/rover/battery/charge> a hybrit:Property, maths:Scalar, sosa:ObservableProperty ;
//     rdfs:seeAlso <http://127.0.0.1:8080/rover/battery> ;
//     vom:numericalValue "0.75"^^xsd:double ;
//     qudt:hasUnit unit:UNITLESS ;
//     lrt:datatype xsd:double ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     rdfs:comment "Measured at rest; drops by a tenth under load." .
//
// <http://127.0.0.1:8080/rover> a hybrit:RoboticThing, <http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#PhysicalAgent> .
