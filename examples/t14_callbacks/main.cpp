// SPDX-License-Identifier: Apache-2.0
// A client that cannot keep a connection open gives a URL, and lrt posts notifications to it. The integrator defines the allowed receivers.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  lesson::Receiver receiver;  // another web server, on this machine

  lrt::Thing joint{"arm/joint"};
  auto angle = joint.property<double>("angle", lrt::unit::radian);
  angle.publish(0.5);
  joint.action("turn", [&](double to) { angle.publish(to); });

  lrt::Options options = lesson::options();
  auto& callbacks = options.callbacks;
  callbacks.allow = {"127.0.0.0/8"};  // networks, addresses, names; default: none
  callbacks.attempts = 3;             // failed attempts; then the subscription is suspended
  // options.callbacks.file = "subscriptions.ttl";  // to keep callbacks across restarts

  lrt::Server server = lrt::Server::create(options).value();
  server.add(std::move(joint)).value();

  lesson::Visitor visitor(server, [&](lesson::Client& client) {
    client.receiver(receiver);
    client.only({"numericalValue", "hybrit:", "lrt:"});
    client.get("/arm/joint/angle", "Upgrade: callback\r\nCallback: " + receiver.url() + "\r\n");
    client.notified(receiver);  // the first notification is sent at once
    client.post("/arm/joint/actions/turn", "<> a maths:Scalar ; vom:numericalValue 1.5 .");
    client.notified(receiver);

    // The same by POST to the container of subscriptions. With a secret each notification is signed.
    client.post("/arm/joint/subscriptions",
                "<> hybrit:onResource <../joint/angle> ; hybrit:callbackURL \"" + receiver.url() + "\"^^xsd:anyURI ; lrt:secret \"between us\" .");
    client.notified(receiver);
    client.get("/arm/joint/angle", "Upgrade: callback\r\nCallback: http://stranger.example/\r\n");
  });
  server.run();
}

// Output:
// GET /arm/joint/angle
// Upgrade: callback
// Callback: http://127.0.0.1:9000/receiver
// 201 Created
// Content-Type: text/turtle
// Location: http://127.0.0.1:8080/arm/joint/subscriptions/id-1
// <http://127.0.0.1:8080/arm/joint/subscriptions/id-1> a hybrit:Subscription, hybrit:WebCallback ;
//     hybrit:onResource <http://127.0.0.1:8080/arm/joint/angle> ;
//     hybrit:callbackURL "http://127.0.0.1:9000/receiver"^^xsd:anyURI ;
//     hybrit:mediaType "text/turtle" ;
//     dcterms:identifier "id-1" ;
//     dcterms:created "<time>"^^xsd:dateTime ;
//     lrt:delivery lrt:latest ;
//     lrt:delivered 0 ;
//     lrt:dropped 0 .
//
// posted to the receiver: POST /receiver
// Content-Type: text/turtle
// Link: <http://127.0.0.1:8080/arm/joint/angle>; rel="about", <http://127.0.0.1:8080/arm/joint/subscriptions/id-1>; rel="via"
// <http://127.0.0.1:8080/arm/joint/angle> a hybrit:Property, maths:Scalar ;
//     vom:numericalValue "0.5"^^xsd:double ;
//     lrt:datatype xsd:double ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joint/angle"^^xsd:anyURI .
//
// POST /arm/joint/actions/turn
//   <> a maths:Scalar ; vom:numericalValue 1.5 .
// 204 No Content
// Location: http://127.0.0.1:8080/arm/joint/actions/turn/id-2
//
// posted to the receiver: POST /receiver
// Content-Type: text/turtle
// Link: <http://127.0.0.1:8080/arm/joint/angle>; rel="about", <http://127.0.0.1:8080/arm/joint/subscriptions/id-1>; rel="via"
// <http://127.0.0.1:8080/arm/joint/angle> a hybrit:Property, maths:Scalar ;
//     vom:numericalValue "1.5"^^xsd:double ;
//     lrt:datatype xsd:double ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joint/angle"^^xsd:anyURI .
//
// POST /arm/joint/subscriptions
//   <> hybrit:onResource <../joint/angle> ; hybrit:callbackURL "http://127.0.0.1:9000/receiver"^^xsd:anyURI ; lrt:secret "between us" .
// 201 Created
// Content-Type: text/turtle
// Location: http://127.0.0.1:8080/arm/joint/subscriptions/id-3
// <http://127.0.0.1:8080/arm/joint/subscriptions/id-3> a hybrit:Subscription, hybrit:WebCallback ;
//     hybrit:onResource <http://127.0.0.1:8080/arm/joint/angle> ;
//     hybrit:callbackURL "http://127.0.0.1:9000/receiver"^^xsd:anyURI ;
//     hybrit:mediaType "text/turtle" ;
//     dcterms:identifier "id-3" ;
//     dcterms:created "<time>"^^xsd:dateTime ;
//     lrt:delivery lrt:latest ;
//     lrt:delivered 0 ;
//     lrt:dropped 0 .
//
// posted to the receiver: POST /receiver
// Content-Type: text/turtle
// Link: <http://127.0.0.1:8080/arm/joint/angle>; rel="about", <http://127.0.0.1:8080/arm/joint/subscriptions/id-3>; rel="via"
// X-Hub-Signature: sha256=<hmac of the body>
// <http://127.0.0.1:8080/arm/joint/angle> a hybrit:Property, maths:Scalar ;
//     vom:numericalValue "1.5"^^xsd:double ;
//     lrt:datatype xsd:double ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/joint/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joint/angle"^^xsd:anyURI .
//
// GET /arm/joint/angle
// Upgrade: callback
// Callback: http://stranger.example/
// 403 Forbidden
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Forbidden","status":403,"detail":"callback URL: this server may not call stranger.example"}
