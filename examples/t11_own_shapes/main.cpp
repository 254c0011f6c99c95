// SPDX-License-Identifier: Apache-2.0
// Your own SHACL shapes. They become part of the thing's Blueprint and validate what clients send, before any lambda is called.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  std::string name = "gripper 1";

  lrt::Thing gripper{"gripper"};
  gripper.property("name", [&] { return name; }).on_write([&](std::string wanted) { name = std::move(wanted); });
  // <#name> replaces the shape that lrt derives from std::string. The base is the Blueprint; a report refers to `#name`.
  gripper.shapes(R"(
    @prefix sh: <http://www.w3.org/ns/shacl#> .
    @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
    @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
    <#name> a sh:NodeShape ; sh:property <#nameText> .
    <#nameText> sh:path rdf:value ;
        sh:datatype xsd:string ; sh:minCount 1 ; sh:maxCount 1 ;
        sh:pattern "^[a-z]+ [0-9]+$" ; sh:message "a name is a word and a number" .)");

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(gripper)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.put("/gripper/name", "<> rdf:value \"left 2\" .");
    client.put("/gripper/name", "<> rdf:value \"Left!\" .");
    client.get("/gripper/blueprint");
  });
  server.run();
}

// Output:
// PUT /gripper/name
//   <> rdf:value "left 2" .
// 204 No Content
//
// PUT /gripper/name
//   <> rdf:value "Left!" .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/gripper/name> ;
//         sh:resultPath rdf:value ;
//         sh:value "Left!" ;
//         sh:sourceConstraintComponent sh:PatternConstraintComponent ;
//         sh:sourceShape <http://127.0.0.1:8080/gripper/blueprint#nameText> ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "a name is a word and a number"
//     ] .
//
// GET /gripper/blueprint
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/gripper/blueprint> a ldp:RDFSource .
//
// [] a sh:NodeShape ;
//     sh:targetNode <http://127.0.0.1:8080/gripper/name> ;
//     sh:or ( [
//             sh:property [
//                 sh:path rdf:value ;
//                 sh:maxCount 0
//             ] ;
//             sh:node [
//                 sh:property [
//                     sh:path lrt:error ;
//                     sh:minCount 1
//                 ]
//             ]
//         ] :name ) .
//
// :name a sh:NodeShape ;
//     sh:property :nameText .
//
// :nameText sh:path rdf:value ;
//     sh:datatype xsd:string ;
//     sh:minCount 1 ;
//     sh:maxCount 1 ;
//     sh:pattern "^[a-z]+ [0-9]+$" ;
//     sh:message "a name is a word and a number" .
