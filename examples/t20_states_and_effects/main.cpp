// SPDX-License-Identifier: Apache-2.0
// What can be done now, and what it leads to. A gripper offers `grip` while it is open and `release` while it holds something: a client that follows
// links finds only what is possible. Each action states its effect, so a client that wants the gripper open finds the action that opens it.
#include <string>
#include <utility>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  bool holds = false;

  lrt::Thing gripper{"gripper"};
  auto state = gripper.property("state", [&] { return std::string(holds ? "closed" : "open"); });
  lrt::Action grip, release;
  const auto set = [&](bool now) {  // available() may also be called by the control loop: it neither locks nor allocates
    holds = now;
    grip.available(!holds, "the gripper holds something");
    release.available(holds, "the gripper is empty");
    state.changed();
  };
  grip = gripper.action("grip", [&] { set(true); }).effect(state, "closed");
  release = gripper.action("release", [&] { set(false); }).effect(state, "open");
  set(false);

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(gripper)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.only({"hybrit:action", "lrt:unavailable", "hybrit:produces", "sosa:forProperty", "sh:hasValue"});
    client.get("/gripper");
    client.get("/gripper/actions/grip");
    client.post("/gripper/actions/release");
    client.get("/gripper/actions/release");
    client.post("/gripper/actions/grip");
    client.get("/gripper");
  });
  server.run();
}

// Output:
// GET /gripper
// 200 OK
// Content-Type: text/turtle
//     hybrit:action <http://127.0.0.1:8080/gripper/actions/grip> ;
//
// GET /gripper/actions/grip
// 200 OK
// Content-Type: text/turtle
//     hybrit:produces :effect-1 ;
//     sosa:forProperty <http://127.0.0.1:8080/gripper/state> ;
//         sh:hasValue "closed"
//
// POST /gripper/actions/release
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Conflict","status":409,"detail":"action \"/gripper/actions/release\" is not available now: the gripper is empty"}
//
// GET /gripper/actions/release
// 200 OK
// Content-Type: text/turtle
//     lrt:unavailable "the gripper is empty" ;
//     hybrit:produces :effect-1 ;
//     sosa:forProperty <http://127.0.0.1:8080/gripper/state> ;
//         sh:hasValue "open"
//
// POST /gripper/actions/grip
// 204 No Content
// Location: http://127.0.0.1:8080/gripper/actions/grip/id-1
//
// GET /gripper
// 200 OK
// Content-Type: text/turtle
//     hybrit:action <http://127.0.0.1:8080/gripper/actions/release> ;
