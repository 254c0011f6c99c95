// SPDX-License-Identifier: Apache-2.0
// Your own structs and enums: list the fields of a struct, name the values of an enum. Clients that know a vocabulary understand a field with
// a term of it. A field with a name of your own is documented by the Blueprint.
#include <optional>
#include <string>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

enum class Mode { idle, holding, fault };

struct Position {
  double x = 0, y = 0, z = 0;  // [m]
};

struct Grip {
  Mode mode = Mode::idle;
  double width = 0;                 // [mm]
  std::optional<std::string> item;  // absent: no triple
  Position where;
};

template <>
struct lrt::rdf::traits<Mode> : lrt::rdf::Enumeration<Mode> {
  static void describe(Enumeration<Mode>& e) { e.name(Mode::idle, "idle").name(Mode::holding, "holding").name(Mode::fault, "fault"); }
};

template <>
struct lrt::rdf::traits<Position> : lrt::rdf::Record<Position> {
  static void describe(Record<Position>& r) {
    r.is(vocab::maths::Vector3D);
    r.field(vocab::maths::x, &Position::x);
    r.field(vocab::maths::y, &Position::y);
    r.field(vocab::maths::z, &Position::z);
  }
};

template <>
struct lrt::rdf::traits<Grip> : lrt::rdf::Record<Grip> {
  static void describe(Record<Grip>& r) {
    r.field("mode", &Grip::mode);
    r.field("width", &Grip::width).unit(unit::millimetre).between(0, 100);
    r.field("item", &Grip::item);
    r.field("where", &Grip::where);
  }
};

int main() {
  Grip grip{Mode::holding, 42, "cup", {0.5, 0, 0.25}};

  lrt::Thing gripper{"gripper"};
  gripper.property("grip", [&] { return grip; }).on_write([&](const Grip& wanted) { grip = wanted; });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(gripper)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    const std::string width = "</ns/vocabulary#Grip/width> [ vom:numericalValue 80 ; qudt:hasUnit unit:MilliM ]";
    const std::string where = "</ns/vocabulary#Grip/where> [ maths:x 0.5 ; maths:y 0 ; maths:z 0.25 ]";
    client.get("/gripper/grip");
    client.put("/gripper/grip", "<> </ns/vocabulary#Grip/mode> \"idle\" ; " + width + " ; " + where + " .");
    client.put("/gripper/grip", "<> </ns/vocabulary#Grip/mode> \"asleep\" ; " + width + " ; " + where + " .");
    client.put("/gripper/grip", "<> </ns/vocabulary#Grip/mode> \"fault\" ; " + where + " .");
    client.get("/gripper/grip");
  });
  server.run();
}

// Output:
// GET /gripper/grip
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/gripper/grip> a hybrit:Property, <http://127.0.0.1:8080/ns/vocabulary#Grip> ;
//     rdfs:seeAlso <http://127.0.0.1:8080/gripper> ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/mode> "holding" ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/width> :width ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/item> "cup" ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/where> :where ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/gripper/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/gripper/grip"^^xsd:anyURI ;
//     hybrit:binding [
//         a http-core:Request ;
//         http-core:mthd http-methods:PUT ;
//         http-core:requestURI <http://127.0.0.1:8080/gripper/grip> ;
//         http-core:body [
//             a <http://127.0.0.1:8080/ns/vocabulary#Grip> ;
//             dcterms:conformsTo <http://127.0.0.1:8080/blueprints/gripper-7fcb3444#grip>
//         ]
//     ] .
//
// :width a maths:Scalar ;
//     vom:numericalValue "42"^^xsd:double ;
//     qudt:hasUnit unit:MilliM .
//
// :where a maths:Vector3D ;
//     maths:x "0.5"^^xsd:double ;
//     maths:y "0"^^xsd:double ;
//     maths:z "0.25"^^xsd:double .
//
// PUT /gripper/grip
//   <> </ns/vocabulary#Grip/mode> "idle" ; </ns/vocabulary#Grip/width> [ vom:numericalValue 80 ; qudt:hasUnit unit:MilliM ] ; </ns/vocabulary#Grip/where> [ maths:x 0.5 ; maths:y 0 ; maths:z 0.25 ] .
// 204 No Content
//
// PUT /gripper/grip
//   <> </ns/vocabulary#Grip/mode> "asleep" ; </ns/vocabulary#Grip/width> [ vom:numericalValue 80 ; qudt:hasUnit unit:MilliM ] ; </ns/vocabulary#Grip/where> [ maths:x 0.5 ; maths:y 0 ; maths:z 0.25 ] .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/gripper/grip> ;
//         sh:resultPath <http://127.0.0.1:8080/ns/vocabulary#Grip/mode> ;
//         sh:value "asleep" ;
//         sh:sourceConstraintComponent sh:InConstraintComponent ;
//         sh:sourceShape [] ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected one of \"idle\", \"holding\", \"fault\", found \"asleep\""
//     ] .
//
// PUT /gripper/grip
//   <> </ns/vocabulary#Grip/mode> "fault" ; </ns/vocabulary#Grip/where> [ maths:x 0.5 ; maths:y 0 ; maths:z 0.25 ] .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/gripper/grip> ;
//         sh:resultPath <http://127.0.0.1:8080/ns/vocabulary#Grip/width> ;
//         sh:sourceConstraintComponent sh:MinCountConstraintComponent ;
//         sh:sourceShape [] ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected a number for \"width\", found none"
//     ] .
//
// GET /gripper/grip
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/gripper/grip> a hybrit:Property, <http://127.0.0.1:8080/ns/vocabulary#Grip> ;
//     rdfs:seeAlso <http://127.0.0.1:8080/gripper> ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/mode> "idle" ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/width> :width ;
//     <http://127.0.0.1:8080/ns/vocabulary#Grip/where> :where ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/gripper/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/gripper/grip"^^xsd:anyURI ;
//     hybrit:binding [
//         a http-core:Request ;
//         http-core:mthd http-methods:PUT ;
//         http-core:requestURI <http://127.0.0.1:8080/gripper/grip> ;
//         http-core:body [
//             a <http://127.0.0.1:8080/ns/vocabulary#Grip> ;
//             dcterms:conformsTo <http://127.0.0.1:8080/blueprints/gripper-7fcb3444#grip>
//         ]
//     ] .
//
// :width a maths:Scalar ;
//     vom:numericalValue "80"^^xsd:double ;
//     qudt:hasUnit unit:MilliM .
//
// :where a maths:Vector3D ;
//     maths:x "0.5"^^xsd:double ;
//     maths:y "0"^^xsd:double ;
//     maths:z "0.25"^^xsd:double .
