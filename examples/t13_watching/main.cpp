// SPDX-License-Identifier: Apache-2.0
// A client opens a WebSocket on the URI of a resource and is notified of each change. The robot's code needs nothing for it.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  lrt::Thing joint{"arm/joint"};
  auto angle = joint.property<double>("angle", lrt::unit::radian);  // pushed: subscribers are notified after publish()
  angle.publish(0);

  double temperature = 36.5;  // pulled: read ten times a second while it is observed, or at your own period ...
  auto motor = joint.property(
      "temperature", [&] { return temperature; }, lrt::unit::degree_celsius);
  motor.sample(std::chrono::milliseconds(0));  // ... here only when we call changed()

  joint.action("turn", [&](double to, lrt::Responder done) {
    for (int step = 1; step <= 4; ++step) angle.publish(to * step / 4), done.progress(step / 4.0);
    temperature += 0.25;
    motor.changed();
    done.succeed();
  });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(joint)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.only({"numericalValue", "hybrit:", "lrt:"});
    client.watch("/arm/joint/temperature");  // the first message is the representation that GET returns
    client.post("/arm/joint/actions/turn", "<> a maths:Scalar ; vom:numericalValue 1 .");
    client.watched();
    const std::string subscription = client.get("/arm/joint/subscriptions").body;  // the list of subscriptions
    const std::size_t at = subscription.find("ldp:contains <") + 14;
    client.remove(subscription.substr(at, subscription.find('>', at) - at));
    client.watched();
    // A client that cannot receive each change at once gets the newest one, or with a queue all of them.
    client.watch("/arm/joint/angle?queueLength=100&minimumInterval=0.01");
  });
  server.run();
}

// Output:
// WebSocket /arm/joint/temperature
// 101 Switching Protocols
// Location: http://127.0.0.1:8080/arm/joint/subscriptions/id-1
//
// message:
// <http://127.0.0.1:8080/arm/joint/temperature> a hybrit:Property, maths:Scalar ;
//     vom:numericalValue "36.5"^^xsd:double ;
//     lrt:datatype xsd:double ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joint/temperature"^^xsd:anyURI .
//
// POST /arm/joint/actions/turn
//   <> a maths:Scalar ; vom:numericalValue 1 .
// 204 No Content
// Location: http://127.0.0.1:8080/arm/joint/actions/turn/id-2
//
// message:
// <http://127.0.0.1:8080/arm/joint/temperature> a hybrit:Property, maths:Scalar ;
//     vom:numericalValue "36.75"^^xsd:double ;
//     lrt:datatype xsd:double ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joint/temperature"^^xsd:anyURI .
//
// GET /arm/joint/subscriptions
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/arm/joint/subscriptions/id-1> a hybrit:Subscription, hybrit:WebSocket ;
//     hybrit:onResource <http://127.0.0.1:8080/arm/joint/temperature> ;
//     hybrit:mediaType "text/turtle" ;
//
// DELETE /arm/joint/subscriptions/id-1
// 204 No Content
//
// message:
// closed with 1000
//
// WebSocket /arm/joint/angle?queueLength=100&minimumInterval=0.01
// 101 Switching Protocols
// Location: http://127.0.0.1:8080/arm/joint/subscriptions/id-3
//
// message:
// <http://127.0.0.1:8080/arm/joint/angle> a hybrit:Property, maths:Scalar ;
//     vom:numericalValue "1"^^xsd:double ;
//     lrt:datatype xsd:double ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joint/angle"^^xsd:anyURI .
