// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

engine::EngineOptions with_jobs(std::size_t small = 200) {
  engine::EngineOptions options;
  options.body_jobs = true;
  options.small_body_bytes = small;
  return options;
}

struct Robot {
  explicit Robot(engine::EngineOptions options = with_jobs()) : bench(std::move(options)) { bench.add(robot.arm()); }
  /// PUT of a number of degrees in JSON, with white space up to that size.
  static std::string degrees(const std::string& number, std::size_t bytes = 0, const std::string& fields = {}) {
    std::string body = number;
    if (body.size() < bytes) body.insert(0, bytes - body.size(), ' ');
    return "PUT /arm/angle\nContent-Type: application/json\n" + fields + "\n" + body;
  }
  /// Judges what waits, without the lambdas that follow; how many.
  std::size_t judge() {
    auto jobs = bench.take_body_jobs();
    for (engine::BodyJob& job : jobs) job.run();
    return jobs.size();
  }
  int status(const Bench::Sent& sent) {
    const auto answer = bench.answer(sent);
    return answer ? answer->status : 0;
  }
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("a large body is judged by a job, and small requests overtake it", "[engine][body][R0.5]") {
  Robot r;
  const auto large = r.bench.send(Robot::degrees("20", 1000));
  REQUIRE(large.ticket);
  CHECK(r.bench.take_jobs().empty());  // the host is not asked before the body is judged
  CHECK(r.bench.send("GET /arm/angle").answer.status == 200);
  const auto small = r.bench.send(Robot::degrees("30"));
  auto jobs = r.bench.take_jobs();
  REQUIRE(jobs.size() == 1);
  jobs[0].run();
  CHECK(r.status(small) == 204);
  CHECK(r.robot.angle == 30);
  CHECK(r.status(large) == 0);
  CHECK(r.judge() == 1);
  r.bench.run();
  CHECK(r.status(large) == 204);
  CHECK(r.robot.angle == 20);
}

TEST_CASE("a refused large body gets the response of a small one", "[engine][body][R0.6]") {
  Robot jobs, at_once(engine::EngineOptions{});
  const std::vector<std::string> requests = {
      Robot::degrees("91", 1000),
      Robot::degrees("\"fast\"", 1000),
      Robot::degrees("[", 1000),
      Bench::turtle_request("PUT", "/arm/angle", number_body("99", "maths:Degree")),
      Bench::turtle_request("PUT", "/arm/angle", number_body("\"fast\"", "maths:Degree"), "Accept: application/json\n"),
      Bench::turtle_request("PUT", "/arm/angle", "<> a <", "Accept: text/turtle\n"),
      Bench::turtle_request("PUT", "/arm/angle", "[] a maths:Scalar . [] a maths:Scalar ."),
      Bench::turtle_request("POST", "/arm/actions/turn", number_body("400", "maths:Degree")),
      Bench::turtle_request("POST", "/arm/actions/home", "<> a <"),
      Bench::turtle_request("POST", "/arm/waypoints", "<> a maths:Vector3D ; maths:x 1 ."),
      Bench::turtle_request("POST", "/arm/subscriptions", "<> a hybrit:WebSocket ; hybrit:onResource </arm/angle> ."),
      "PUT /arm/angle\nContent-Type: application/json;charset=koi8-r\n\n" + std::string(1000, ' ') + "1",
      "PUT /arm/angle\nContent-Type: application/json;charset=utf-16\n\n" + std::string(1000, ' '),
  };
  for (const std::string& request : requests) {
    CAPTURE(request);
    const Answer expected = at_once.bench.ask(request), answer = jobs.bench.ask(request);
    CHECK(expected.status >= 400);
    CHECK(answer.status == expected.status);
    CHECK(answer.body == expected.body);
    CHECK(answer.fields.block() == expected.fields.block());
  }
  CHECK(jobs.robot.angle == 10);
}

TEST_CASE("what goes while a body is judged", "[engine][body][R0.6]") {
  Robot r;
  SECTION("the client: nothing happens") {
    const auto sent = r.bench.send(Robot::degrees("20", 1000));
    r.bench.engine.abandon(*sent.ticket);
    CHECK(r.judge() == 1);
    CHECK(r.bench.run() == 0);
    CHECK(r.robot.angle == 10);
  }
  SECTION("the resource: 404") {
    const auto sent = r.bench.send(Robot::degrees("20", 1000));
    REQUIRE(r.bench.engine.remove("arm"));
    CHECK(r.judge() == 1);
    CHECK(r.status(sent) == 404);
  }
  SECTION("the time: 503, and it is not carried out later") {
    const auto sent = r.bench.send(Robot::degrees("20", 1000));
    r.bench.clock.advance(std::chrono::seconds(3));
    CHECK(r.status(sent) == 503);
    CHECK(r.bench.answer(sent)->has("Retry-After"));
    CHECK(r.judge() == 1);
    CHECK(r.bench.run() == 0);
    CHECK(r.robot.angle == 10);
  }
  SECTION("the time of the host, which begins after the judgement") {
    const auto sent = r.bench.send(Robot::degrees("20", 1000));
    r.bench.clock.advance(std::chrono::milliseconds(1500));
    CHECK(r.judge() == 1);
    r.bench.clock.advance(std::chrono::milliseconds(1500));
    r.bench.collect();
    CHECK(r.status(sent) == 0);
    r.bench.run();
    CHECK(r.status(sent) == 204);
  }
  SECTION("the server: 503") {
    const auto sent = r.bench.send(Robot::degrees("20", 1000));
    r.bench.engine.stop();
    CHECK(r.status(sent) == 503);
    CHECK(r.judge() == 1);
    CHECK(r.bench.run() == 0);
  }
  SECTION("the state: preconditions are judged after it") {
    const std::string tag = r.bench.ask("GET /arm/angle").tag();
    const auto sent = r.bench.send(Robot::degrees("20", 1000, "If-Match: " + tag + "\n"));
    CHECK(r.bench.ask(Robot::degrees("30")).status == 204);
    r.bench.run();
    CHECK(r.status(sent) == 412);
    CHECK(r.robot.angle == 30);
  }
}

TEST_CASE("bodies that wait are limited, and those of one address", "[engine][body][limits]") {
  engine::EngineOptions options = with_jobs();
  options.max_waiting_body_bytes = 4000;
  Robot r(std::move(options));
  const auto send_from = [&](const char* peer, std::size_t bytes) {
    RequestText request(Robot::degrees("20", bytes));
    request.get().peer = peer;
    return r.bench.sent(r.bench.engine.handle(request.get(), r.bench.clock.now()));
  };
  const auto first = send_from("10.0.0.1", 1000);
  CHECK(first.ticket);
  const auto refused = send_from("10.0.0.1", 300);
  CHECK(refused.answer.status == 503);
  CHECK(refused.answer.has("Retry-After"));
  std::vector<Bench::Sent> others;
  for (const char* peer : {"10.0.0.2", "10.0.0.3", "10.0.0.4"}) others.push_back(send_from(peer, 1000));
  for (const auto& sent : others) CHECK(sent.ticket);
  CHECK(send_from("10.0.0.5", 300).answer.status == 503);
  CHECK(send_from("10.0.0.5", 100).ticket);  // a small one is judged at once
  CHECK(r.judge() == 4);
  r.bench.run();
  CHECK(r.status(first) == 204);
  CHECK(send_from("10.0.0.1", 1000).ticket);  // what has been judged does not count
  // One host of IPv6 has a whole /64.
  CHECK(send_from("2001:db8::1", 1000).ticket);
  CHECK(send_from("2001:db8::2", 300).answer.status == 503);
  CHECK(send_from("2001:db8:0:1::2", 1000).ticket);
}
