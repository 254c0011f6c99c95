// SPDX-License-Identifier: Apache-2.0
// One joint of a robot on the web: a property with its angle and an action that moves it.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"  // only for the lesson, which ends by itself

int main() {
  double angle = 0.5;  // [rad], owned by this thread

  lrt::Thing joint{"baxter/right_s1"};
  joint.property(
      "rotation", [&] { return angle; }, lrt::unit::radian);
  joint
      .action("rotate",
              [&](double target, lrt::Responder done) {
                angle = target;
                done.succeed();
              })
      .unit(lrt::unit::radian);

  lrt::Options options;                                       // http://127.0.0.1:8080/, for this machine only
  options.listen.port = lesson::port();                       // with --serve: 8080
  lrt::Server server = lrt::Server::create(options).value();  // value() throws what a Result has instead of a value
  server.add(std::move(joint)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {                                               // lesson
    client.get("/baxter/right_s1/rotation");                                                                 // lesson
    client.post("/baxter/right_s1/actions/rotate", "<> vom:numericalValue 0.75 ; vom:unit maths:Radian .");  // lesson
    client.get_until("/baxter/right_s1/rotation", "0.75");                                                   // lesson
  });                                                                                                        // lesson
  server.run();  // or, in a control loop: server.poll(), which never waits
}

// Output:
// GET /baxter/right_s1/rotation
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/baxter/right_s1/rotation> a hybrit:Property, maths:Scalar ;
//     rdfs:seeAlso <http://127.0.0.1:8080/baxter/right_s1> ;
//     vom:numericalValue "0.5"^^xsd:double ;
//     vom:unit maths:Radian ;
//     qudt:hasUnit unit:RAD ;
//     lrt:datatype xsd:double ;
//     qudt:hasQuantityKind quantitykind:Angle ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/baxter/right_s1/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/baxter/right_s1/rotation"^^xsd:anyURI .
//
// POST /baxter/right_s1/actions/rotate
//   <> vom:numericalValue 0.75 ; vom:unit maths:Radian .
// 204 No Content
// Location: http://127.0.0.1:8080/baxter/right_s1/actions/rotate/id-1
//
// GET /baxter/right_s1/rotation
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/baxter/right_s1/rotation> a hybrit:Property, maths:Scalar ;
//     rdfs:seeAlso <http://127.0.0.1:8080/baxter/right_s1> ;
//     vom:numericalValue "0.75"^^xsd:double ;
//     vom:unit maths:Radian ;
//     qudt:hasUnit unit:RAD ;
//     lrt:datatype xsd:double ;
//     qudt:hasQuantityKind quantitykind:Angle ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/baxter/right_s1/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/baxter/right_s1/rotation"^^xsd:anyURI .
