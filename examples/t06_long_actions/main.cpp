// SPDX-License-Identifier: Apache-2.0
// Actions that take longer: keep the Responder, set the progress, and call succeed() at the end. A client watches the invocation, waits for it
// or cancels it with DELETE. A policy defines what happens to a second command. The gripper shows an existing API with a completion callback: the
// callback holds the Responder.
#include <chrono>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

/// An existing class that does not depend on lrt. It calls `on_done` once: at once if it does not close, else when it is closed.
class Gripper {
 public:
  void close(std::function<void(bool)> on_done) {
    if (closed_) return on_done(false);
    on_done_ = std::move(on_done);
    steps_ = 50;
  }
  void step() {
    if (steps_ == 0 || --steps_ > 0) return;
    closed_ = true;
    std::exchange(on_done_, nullptr)(true);
  }

 private:
  bool closed_ = false;
  int steps_ = 0;
  std::function<void(bool)> on_done_;
};

int main() {
  Gripper gripper;
  int position = 0, target = 0;  // [mm]
  std::optional<lrt::Responder> move;

  lrt::Thing axis{"axis"};
  axis.action("moveTo",
              [&](int to, lrt::Responder done) {
                target = to;
                done.on_cancel([&] { target = position; });  // before a later command starts, which preempts this one
                move = std::move(done);
              })
      .unit(lrt::unit::millimetre)
      .between(0, 1'000'000)
      .policy(lrt::ActionPolicy::preempt());  // others: queue(n), reject(), parallel(n)

  axis.action("grip", [&](lrt::Responder done) {
    gripper.close([done](bool ok) { ok ? done.succeed() : done.fail({lrt::Errc::refused, "the gripper is closed"}); });
  });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(axis)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    const std::string far = "<> vom:numericalValue 1000000 ; qudt:hasUnit unit:MilliM .";
    const std::string near = "<> vom:numericalValue 0 ; qudt:hasUnit unit:MilliM .";
    client.only({"lrt:status", "lrt:progress"});
    const std::string first = client.post("/axis/actions/moveTo", far).field("Location");  // the robot has accepted it; the move continues
    client.get_until(first, "0.25");
    const std::string second = client.post("/axis/actions/moveTo", far).field("Location");
    client.get(first);  // preempted
    client.get_until(second, "0.25");
    client.remove(second);
    client.get(second);
    client.post("/axis/actions/moveTo", near, "Prefer: wait=30, return=representation\r\n");
    client.get_until(client.post("/axis/actions/grip").field("Location"), "succeeded");
    client.post("/axis/actions/grip");
  });

  while (visitor.is_here()) {
    server.poll();
    gripper.step();
    if (position != target) position += position < target ? 1 : -1;
    if (move && move->cancelled()) move.reset();
    if (move && position == target) {
      move->succeed();
      move.reset();
    } else if (move) {
      move->progress(0.25);  // optional
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

// Output:
// POST /axis/actions/moveTo
//   <> vom:numericalValue 1000000 ; qudt:hasUnit unit:MilliM .
// 204 No Content
// Location: http://127.0.0.1:8080/axis/actions/moveTo/id-1
//
// GET /axis/actions/moveTo/id-1
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:running ;
//     lrt:progress "0.25"^^xsd:double ;
//
// POST /axis/actions/moveTo
//   <> vom:numericalValue 1000000 ; qudt:hasUnit unit:MilliM .
// 204 No Content
// Location: http://127.0.0.1:8080/axis/actions/moveTo/id-2
//
// GET /axis/actions/moveTo/id-1
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:cancelled ;
//     lrt:progress "0.25"^^xsd:double ;
//
// GET /axis/actions/moveTo/id-2
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:running ;
//     lrt:progress "0.25"^^xsd:double ;
//
// DELETE /axis/actions/moveTo/id-2
// 204 No Content
//
// GET /axis/actions/moveTo/id-2
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:cancelled ;
//     lrt:progress "0.25"^^xsd:double ;
//
// POST /axis/actions/moveTo
// Prefer: wait=30, return=representation
//   <> vom:numericalValue 0 ; qudt:hasUnit unit:MilliM .
// 200 OK
// Content-Type: text/turtle
// Location: http://127.0.0.1:8080/axis/actions/moveTo/id-3
//     lrt:status lrt:succeeded ;
//     lrt:progress "1"^^xsd:double ;
//
// POST /axis/actions/grip
// 204 No Content
// Location: http://127.0.0.1:8080/axis/actions/grip/id-4
//
// GET /axis/actions/grip/id-4
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:succeeded ;
//     lrt:progress "1"^^xsd:double ;
//
// POST /axis/actions/grip
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Conflict","status":409,"detail":"action \"/axis/actions/grip\" failed: the gripper is closed"}
