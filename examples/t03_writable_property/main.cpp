// SPDX-License-Identifier: Apache-2.0
// A property that clients may write: on_write. The unit and the bounds are checked before the lambda is called. The lambda may refuse a value
// for reasons that only the robot knows.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  double speed = 0.2;
  bool emergency_stop = false;

  lrt::Thing arm{"arm"};
  arm.property(
         "speed", [&] { return speed; }, lrt::unit::metre_per_second)
      .between(0, 1.5)
      .on_write([&](double wanted) -> lrt::Result<void> {  // or void, if the robot accepts every value within the bounds
        if (emergency_stop) return lrt::unexpected(lrt::Errc::refused, "the emergency stop is pressed");
        speed = wanted;
        return {};
      });
  arm.property("emergencyStop", [&] { return emergency_stop; });  // without on_write: read-only
  arm.action("stop", [&] { emergency_stop = true; });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(arm)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.put("/arm/speed", "<> vom:numericalValue 0.5 ; qudt:hasUnit unit:M-PER-SEC .");
    client.get("/arm/speed");
    client.put("/arm/speed", "<> vom:numericalValue 2 ; qudt:hasUnit unit:M-PER-SEC .");
    client.put("/arm/speed", "<> vom:numericalValue 0.5 ; qudt:hasUnit unit:DEG .");
    client.put("/arm/speed", "<> vom:numericalValue \"fast\" .");
    client.put("/arm/emergencyStop", "<> rdf:value false .");
    client.post("/arm/actions/stop");
    client.put("/arm/speed", "<> vom:numericalValue 0.25 ; qudt:hasUnit unit:M-PER-SEC .");
  });
  server.run();
}

// Output:
// PUT /arm/speed
//   <> vom:numericalValue 0.5 ; qudt:hasUnit unit:M-PER-SEC .
// 204 No Content
//
// GET /arm/speed
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/arm/speed> a hybrit:Property, maths:Scalar ;
//     rdfs:seeAlso <http://127.0.0.1:8080/arm> ;
//     vom:numericalValue "0.5"^^xsd:double ;
//     qudt:hasUnit unit:M-PER-SEC ;
//     lrt:datatype xsd:double ;
//     qudt:hasQuantityKind quantitykind:Velocity ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/speed"^^xsd:anyURI ;
//     hybrit:binding [
//         a http-core:Request ;
//         http-core:mthd http-methods:PUT ;
//         http-core:requestURI <http://127.0.0.1:8080/arm/speed> ;
//         http-core:body [
//             a maths:Scalar ;
//             dcterms:conformsTo <http://127.0.0.1:8080/blueprints/arm-8da351c3-d6d969ac#speed>
//         ]
//     ] .
//
// PUT /arm/speed
//   <> vom:numericalValue 2 ; qudt:hasUnit unit:M-PER-SEC .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath vom:numericalValue ;
//         sh:value "2"^^xsd:double ;
//         sh:sourceConstraintComponent sh:MaxInclusiveConstraintComponent ;
//         sh:sourceShape [] ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected at most 1.5, found 2"
//     ] .
//
// PUT /arm/speed
//   <> vom:numericalValue 0.5 ; qudt:hasUnit unit:DEG .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath qudt:hasUnit ;
//         sh:sourceConstraintComponent sh:HasValueConstraintComponent ;
//         sh:sourceShape [] ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected the unit unit:M-PER-SEC, found unit:DEG"
//     ] .
//
// PUT /arm/speed
//   <> vom:numericalValue "fast" .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath vom:numericalValue ;
//         sh:value "fast" ;
//         sh:sourceConstraintComponent sh:DatatypeConstraintComponent ;
//         sh:sourceShape _:b2 ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected a number, found \"fast\""
//     ],
//         [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath vom:numericalValue ;
//         sh:value "fast" ;
//         sh:sourceConstraintComponent sh:MinInclusiveConstraintComponent ;
//         sh:sourceShape _:b2 ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected a number, found \"fast\""
//     ],
//         [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath vom:numericalValue ;
//         sh:value "fast" ;
//         sh:sourceConstraintComponent sh:MaxInclusiveConstraintComponent ;
//         sh:sourceShape _:b2 ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected a number, found \"fast\""
//     ],
//         [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath qudt:hasUnit ;
//         sh:sourceConstraintComponent sh:MinCountConstraintComponent ;
//         sh:sourceShape _:b6 ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected the unit unit:M-PER-SEC, found none"
//     ],
//         [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/arm/speed> ;
//         sh:resultPath qudt:hasUnit ;
//         sh:sourceConstraintComponent sh:HasValueConstraintComponent ;
//         sh:sourceShape _:b6 ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected the unit unit:M-PER-SEC, found none"
//     ] .
//
// PUT /arm/emergencyStop
//   <> rdf:value false .
// 405 Method Not Allowed
// Content-Type: application/problem+json
// Allow: GET, HEAD, OPTIONS
// {"type":"about:blank","title":"Method Not Allowed","status":405,"detail":"PUT is not allowed for this resource, only GET, HEAD, OPTIONS"}
//
// POST /arm/actions/stop
// 204 No Content
// Location: http://127.0.0.1:8080/arm/actions/stop/id-1
//
// PUT /arm/speed
//   <> vom:numericalValue 0.25 ; qudt:hasUnit unit:M-PER-SEC .
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Conflict","status":409,"detail":"property \"/arm/speed\" was not written: the emergency stop is pressed"}
