// SPDX-License-Identifier: Apache-2.0
// Actions that end when their lambda returns: without input or output, with both, and one that the robot refuses. Each POST creates an
// invocation. Location is its URI, and clients can read it afterwards.
#include <cmath>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  double height = 0.5;  // [m]
  bool homed = false;

  lrt::Thing lift{"lift"};
  lift.action("home", [&] {
    height = 0;
    homed = true;
  });
  lift.action("moveTo",
              [&](double target) -> lrt::Result<void> {
                if (!homed) return lrt::unexpected(lrt::Errc::refused, "the lift does not know its height yet: invoke home first");
                height = target;
                return {};
              })
      .unit(lrt::unit::metre)
      .between(0, 1.25);
  lift.action("timeTo", [&](double target) { return std::abs(target - height) / 0.25; })
      .unit(lrt::unit::metre)
      .produces(lrt::Facets{lrt::unit::second});

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(lift)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    const std::string one_metre = "<> vom:numericalValue 1 ; qudt:hasUnit unit:M .";
    client.post("/lift/actions/moveTo", one_metre);
    client.post("/lift/actions/home");
    client.post("/lift/actions/moveTo", "<> vom:numericalValue 5 ; qudt:hasUnit unit:M .");
    const lesson::Response moved = client.post("/lift/actions/moveTo", one_metre);
    client.only({"lrt:", "vom:", "prov:"});
    client.get(moved.field("Location"));
    client.post("/lift/actions/timeTo", "<> vom:numericalValue 0.5 ; qudt:hasUnit unit:M .");
  });
  server.run();
}

// Output:
// POST /lift/actions/moveTo
//   <> vom:numericalValue 1 ; qudt:hasUnit unit:M .
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Conflict","status":409,"detail":"action \"/lift/actions/moveTo\" failed: the lift does not know its height yet: invoke home first"}
//
// POST /lift/actions/home
// 204 No Content
// Location: http://127.0.0.1:8080/lift/actions/home/id-1
//
// POST /lift/actions/moveTo
//   <> vom:numericalValue 5 ; qudt:hasUnit unit:M .
// 422 Unprocessable Content
// Content-Type: text/turtle
// [] a sh:ValidationReport ;
//     sh:conforms false ;
//     sh:result [
//         a sh:ValidationResult ;
//         sh:focusNode <http://127.0.0.1:8080/lift/actions/moveTo> ;
//         sh:resultPath vom:numericalValue ;
//         sh:value "5"^^xsd:double ;
//         sh:sourceConstraintComponent sh:MaxInclusiveConstraintComponent ;
//         sh:sourceShape <http://127.0.0.1:8080/blueprints/lift-0b775c91-eb4eaf17#actions/moveTo/input.1> ;
//         sh:resultSeverity sh:Violation ;
//         sh:resultMessage "expected at most 1.25, found 5"
//     ] .
//
// POST /lift/actions/moveTo
//   <> vom:numericalValue 1 ; qudt:hasUnit unit:M .
// 204 No Content
// Location: http://127.0.0.1:8080/lift/actions/moveTo/id-2
//
// GET /lift/actions/moveTo/id-2
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/lift/actions/moveTo/id-2> a lrt:Invocation, prov:Activity ;
//     lrt:invocationOf <http://127.0.0.1:8080/lift/actions/moveTo> ;
//     lrt:status lrt:succeeded ;
//     lrt:progress "1"^^xsd:double ;
//     prov:startedAtTime "<time>"^^xsd:dateTime ;
//     prov:endedAtTime "<time>"^^xsd:dateTime ;
//     lrt:input :input ;
//     vom:numericalValue "1"^^xsd:double ;
//
// POST /lift/actions/timeTo
//   <> vom:numericalValue 0.5 ; qudt:hasUnit unit:M .
// 200 OK
// Content-Type: text/turtle
// Location: http://127.0.0.1:8080/lift/actions/timeTo/id-3
//     vom:numericalValue "2"^^xsd:double ;
