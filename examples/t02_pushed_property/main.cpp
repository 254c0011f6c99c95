// SPDX-License-Identifier: Apache-2.0
// A control loop of 1 kHz publishes its position. publish() does not lock or allocate. lrt's own thread answers requests with the last value,
// so the loop does not handle requests and does not call poll().
#include <chrono>
#include <thread>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  lrt::Thing joint{"joint"};
  lrt::PushedProperty<double> position = joint.property<double>("position", lrt::unit::radian);

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(joint)).value();  // the handle remains valid for publish()

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    const lesson::Response arrived = client.get_until("/joint/position", "\"0.1\"");
    client.get("/joint/position", "If-None-Match: " + arrived.field("ETag") + "\r\n");  // publishing the same value is not a change
  });

  double angle = 0;
  for (auto next = std::chrono::steady_clock::now(); visitor.is_here();) {
    if (angle < 0.1) angle += 1.0 / 1024;
    if (angle > 0.1) angle = 0.1;
    position.publish(angle);
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
}

// Output:
// GET /joint/position
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/joint/position> a hybrit:Property, maths:Scalar ;
//     rdfs:seeAlso <http://127.0.0.1:8080/joint> ;
//     vom:numericalValue "0.1"^^xsd:double ;
//     vom:unit maths:Radian ;
//     qudt:hasUnit unit:RAD ;
//     lrt:datatype xsd:double ;
//     qudt:hasQuantityKind quantitykind:Angle ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/joint/position"^^xsd:anyURI .
//
// GET /joint/position
// If-None-Match: <tag>
// 304 Not Modified
