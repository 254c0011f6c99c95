// SPDX-License-Identifier: Apache-2.0
// An emergency stop that works while everything else is busy: a long action runs, and the host computes and does not poll. The lambda of the
// stop runs on the thread of lrt (Action::stop). It only sets an atomic flag, which the control loop obeys in its next period. The flag is also the
// state of the stop: each client sees that the base is stopped, since when and by whom, and what moves is unavailable until the release. A stop is also
// served when connections and waiting requests are at their limits, and the page for people has a button for it.
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

void sleep_one_period() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }

int main() {
  std::atomic<bool> stopped{false};
  std::atomic<bool> on{true}, planning{true};
  std::atomic<double> target{0}, speed{0};  // [m/s]
  std::thread motors([&] {
    for (; on; sleep_one_period()) speed = stopped ? 0.0 : target.load();
  });

  std::optional<lrt::Responder> driving;
  lrt::Thing base{"base"};
  base.action("drive",
              [&](double to, lrt::Responder done) {
                target = to;
                driving = done;
              })
      .unit(lrt::unit::metre_per_second)
      .between(-1, 1);
  base.action("plan",
              [&] {  // takes long, in the host's thread
                for (int i = 0; i < 10'000 && planning; ++i) sleep_one_period();
              })
      .harmless();  // it moves nothing, so it goes on
  lrt::Action release = base.action("release", [&] {
    target = 0;
    stopped = false;
  });
  base.action("stop", [&] { stopped = true; }).stop([&] { return stopped.load(); }, release);
  base.property(
          "speed", [&] { return speed.load(); }, lrt::unit::metre_per_second)
      .dispatch(lrt::Dispatch::io_thread);
  base.property("battery", [] { return 87; });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(base)).value();

  lesson::Visitor visitor(server, [&](lesson::Client& client) {
    client.only({"vom:numericalValue", "lrt:status", "lrt:error", "lrt:stopped"});
    const std::string fast = "<> vom:numericalValue 0.5 ; qudt:hasUnit unit:M-PER-SEC .";
    const std::string started = client.post("/base/actions/drive", fast).field("Location");
    client.get_until("/base/speed", "\"0.5\"");
    const std::string plan = client.post("/base/actions/plan", {}, "Prefer: respond-async\r\n").field("Location");
    client.get_until(plan, "running");
    client.get("/base/battery");  // waits for the host, in vain
    client.post("/base/actions/stop");
    client.get_until("/base/speed", "\"0\"");
    client.get("/base/stopped");
    client.get(started);
    client.post("/base/actions/drive", fast);
    planning = false;
    client.post("/base/actions/release", {}, client.valid_for(std::chrono::seconds(10)));
    client.get("/base/stopped");
    client.post("/base/actions/drive", fast);
  });

  while (visitor.is_here()) {
    server.poll();
    if (driving && driving->cancelled()) driving.reset();  // by the stop
    sleep_one_period();
  }
  on = false;
  motors.join();
}

// Output:
// POST /base/actions/drive
//   <> vom:numericalValue 0.5 ; qudt:hasUnit unit:M-PER-SEC .
// 204 No Content
// Location: http://127.0.0.1:8080/base/actions/drive/id-1
//
// GET /base/speed
// 200 OK
// Content-Type: text/turtle
//     vom:numericalValue "0.5"^^xsd:double ;
//
// POST /base/actions/plan
// Prefer: respond-async
// 202 Accepted
// Location: http://127.0.0.1:8080/base/actions/plan/id-2
//
// GET /base/actions/plan/id-2
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:running ;
//
// GET /base/battery
// 503 Service Unavailable
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Service Unavailable","status":503,"detail":"the robot's program did not process the request in time; the request was cancelled, try again later"}
//
// POST /base/actions/stop
// 204 No Content
// Location: http://127.0.0.1:8080/base/actions/stop/id-3
//
// GET /base/speed
// 200 OK
// Content-Type: text/turtle
//     vom:numericalValue "0"^^xsd:double ;
//
// GET /base/stopped
// 200 OK
// Content-Type: text/turtle
//     lrt:stopped true ;
//     lrt:stoppedSince "<time>"^^xsd:dateTime ;
//     lrt:stoppedBy "somebody" ;
//
// GET /base/actions/drive/id-1
// 200 OK
// Content-Type: text/turtle
//     lrt:status lrt:failed ;
//     lrt:error "the robot was stopped" ;
//     vom:numericalValue "0.5"^^xsd:double ;
//
// POST /base/actions/drive
//   <> vom:numericalValue 0.5 ; qudt:hasUnit unit:M-PER-SEC .
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"https://w3id.org/lrt/ns#Stopped","title":"Conflict","status":409,"detail":"this was not carried out: the robot is stopped since <time> by somebody; see http://127.0.0.1:8080/base/stopped; what ends the stop is http://127.0.0.1:8080/base/actions/release"}
//
// POST /base/actions/release
// Valid-Until: <time>
// 204 No Content
// Location: http://127.0.0.1:8080/base/actions/release/id-4
//
// GET /base/stopped
// 200 OK
// Content-Type: text/turtle
//     lrt:stopped false ;
//
// POST /base/actions/drive
//   <> vom:numericalValue 0.5 ; qudt:hasUnit unit:M-PER-SEC .
// 204 No Content
// Location: http://127.0.0.1:8080/base/actions/drive/id-5
