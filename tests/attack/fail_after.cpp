// SPDX-License-Identifier: Apache-2.0
// Memory runs out once, at the n-th allocation of a request, for each n: the request gets a response, what it did is whole or undone, and the
// next request is served as if nothing had been.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

namespace {

/// Allocations of this thread until one fails; 0: none does.
thread_local std::size_t until_failure = 0;

bool fails_now() noexcept { return until_failure > 0 && --until_failure == 0; }

/// The n-th allocation of this thread fails, while this lives.
class FailAfter {
 public:
  explicit FailAfter(std::size_t n) { until_failure = n; }
  ~FailAfter() { until_failure = 0; }
  FailAfter(const FailAfter&) = delete;
  FailAfter& operator=(const FailAfter&) = delete;
  bool has_failed() const noexcept { return until_failure == 0; }
};

}  // namespace

#include "tests/attack/failing_new.hpp"  // calls fails_now()

using namespace lrt;
using namespace lrt::test;

namespace {

struct Robot {
  explicit Robot(bool body_jobs) : bench(options(body_jobs)) { bench.add(robot.arm()); }
  static engine::EngineOptions options(bool body_jobs) {
    engine::EngineOptions options;
    options.callbacks.allow = {"127.0.0.1"};
    options.body_jobs = body_jobs;
    options.small_body_bytes = 0;
    return options;
  }
  /// What a client can see of the robot's state.
  std::string state() {
    std::string all;
    for (const char* path : {"/arm/angle", "/arm/count", "/arm/pose", "/arm/waypoints", "/arm/subscriptions"}) {
      const Answer answer = bench.ask(std::string("GET ") + path + "\nAccept: application/json");
      if (answer.status != 200) return std::string(path) + ": " + std::to_string(answer.status) + " " + answer.body;
      all += answer.body;
    }
    return all;
  }
  SampleRobot robot;
  Bench bench;
};

const std::string pose = R"({"x": 1, "y": 2, "frame": "base"})";

/// Of the places, so many are passed over. LRT_ATTACK_STRIDE=1 tries each.
std::size_t stride() {
  const char* const text = std::getenv("LRT_ATTACK_STRIDE");
  return std::max<std::size_t>(1, text ? std::strtoul(text, nullptr, 10) : 7);
}

/// Requests that go all ways through the engine.
std::vector<std::string> requests() {
  return {
      "GET /",
      "GET /arm",
      "GET /arm/state\nAccept: application/ld+json",
      "GET /arm/angle\nAccept: application/json",
      "GET /arm/speed",
      "GET /arm\nAccept: text/html",
      "GET " + kind_of(Robot(false).bench, "/arm"),
      "GET /nowhere",
      "OPTIONS /arm/angle",
      "PUT /arm/angle\nContent-Type: application/json\nPrefer: return=representation\n\n43.5",
      "PUT /arm/angle\nContent-Type: application/json\nIf-Match: \"none\"\n\n43.5",
      Bench::turtle_request("PUT", "/arm/angle", number_body("43.5", "maths:Degree")),
      Bench::turtle_request("PUT", "/arm/angle", number_body("430", "maths:Degree")),
      Bench::turtle_request("PUT", "/arm/angle", "<> a <"),
      "PUT /arm/pose\nContent-Type: application/json\n\n" + pose,
      Bench::turtle_request("POST", "/arm/actions/turn", number_body("30", "maths:Degree")),
      "POST /arm/actions/home",
      "POST /arm/actions/refuse",
      "POST /arm/actions/grip\nPrefer: respond-async",
      "POST /arm/waypoints\nContent-Type: application/json\n\n" + pose,
      Bench::turtle_request("POST", "/arm/subscriptions",
                            "<> hybrit:onResource </arm/angle> ; hybrit:callbackURL \"http://127.0.0.1:9/x\"^^xsd:anyURI ."),
      "GET /arm/angle\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/x",
  };
}

/// Calls a function whose n-th allocation fails. False: it has fewer allocations.
template <class F>
bool runs_out(std::size_t n, F f) {
  const FailAfter fail(n);
  try {
    f();
  } catch (const std::bad_alloc&) {}
  return fail.has_failed();
}

/// Sends a request whose n-th allocation fails, with all that follows. False: it has fewer allocations.
bool fails_at(Robot& r, const std::string& text, std::size_t n, Answer& answer) {
  RequestText request(text);
  std::optional<engine::Outcome> outcome;
  bool failed = false;
  {
    const FailAfter fail(n);
    outcome = r.bench.engine.handle(request.get(), r.bench.clock.now());
    // Jobs too, and what takes their results.
    while (true) {
      auto bodies = r.bench.take_body_jobs();
      for (engine::BodyJob& job : bodies) job.run();
      auto jobs = r.bench.take_jobs();
      for (engine::Job& job : jobs) job.run();
      if (bodies.empty() && jobs.empty()) break;
      r.bench.look();
      if (auto ready = r.bench.engine.next_ready(r.bench.clock.now())) (void)ready;
    }
    failed = fail.has_failed();
  }
  Bench::Sent sent = r.bench.sent(std::move(*outcome));
  r.bench.run();
  if (!r.bench.answer(sent)) r.bench.clock.advance(std::chrono::seconds(3));  // the time limit of a request
  r.bench.run();
  const auto found = r.bench.answer(sent);
  REQUIRE(found);
  answer = *found;
  return failed;
}

}  // namespace

TEST_CASE("memory runs out once at any place of a request", "[attack][memory]") {
  for (const bool body_jobs : {false, true})
    for (const std::string& text : requests()) {
      CAPTURE(body_jobs, text);
      Robot untouched(body_jobs), carried_out(body_jobs);
      const std::string before = untouched.state();
      const Answer expected = carried_out.bench.ask(text);
      const std::string after = carried_out.state();
      for (std::size_t n = 1;; n += stride()) {
        CAPTURE(n);
        REQUIRE(n < 100'000);
        Robot r(body_jobs);
        REQUIRE(r.state() == before);  // also: what is cached is there, as it mostly is
        Answer answer;
        const bool failed = fails_at(r, text, n, answer);
        if (!failed) {
          CHECK(answer.status == expected.status);
          break;
        }
        CAPTURE(answer.status, answer.body);
        CHECK((answer.status == expected.status || answer.status == 500 || answer.status == 503 || answer.status == 202));
        const std::string now = r.state();
        const bool is_whole = now == before || now == after;
        CHECK(is_whole);
        if (!is_whole) CHECK(now == after);
        // The robot goes on.
        CHECK(r.bench.ask("PUT /arm/count\nContent-Type: application/json\n\n9").status == 204);
        CHECK(r.bench.ask("GET /arm/count\nAccept: application/json").body == "9");
      }
    }
}

TEST_CASE("memory runs out once while messages are taken", "[attack][memory]") {
  for (std::size_t n = 1;; ++n) {
    CAPTURE(n);
    REQUIRE(n < 1'000);
    Robot r(false);
    RequestText request("GET /arm/angle\nAccept: text/event-stream");
    auto stream = request.get();
    stream.can_stream = true;
    const engine::Outcome outcome = r.bench.engine.handle(stream, r.bench.clock.now());
    REQUIRE(std::holds_alternative<engine::Streamed>(outcome));
    r.bench.run();
    std::vector<engine::PushRequest> requests = {{std::get<engine::Streamed>(outcome).channel, 4, 1 << 20}};
    std::vector<engine::Push> pushes;
    const bool failed = runs_out(n, [&] { r.bench.engine.take_pushes(requests, pushes, r.bench.clock.now()); });
    CHECK(requests[0].given == pushes.size());  // what is counted is there
    if (!failed) {
      CHECK(requests[0].given > 0);
      break;
    }
  }
}

TEST_CASE("memory runs out once while an action is given up", "[attack][memory]") {
  for (std::size_t n = 1;; ++n) {
    CAPTURE(n);
    REQUIRE(n < 10'000);
    Robot r(false);
    RequestText request("POST /arm/actions/home");
    REQUIRE(std::holds_alternative<engine::Deferred>(r.bench.engine.handle(request.get(), r.bench.clock.now())));
    r.bench.clock.advance(std::chrono::seconds(3));  // its time limit; the host does not come
    bool responded = false;
    const bool failed = runs_out(n, [&] { responded = r.bench.engine.next_reply(r.bench.clock.now()).has_value(); });
    if (!failed) CHECK(responded);
    r.bench.run();
    CHECK(r.bench.ask("POST /arm/actions/home").status == 204);
    if (!failed) break;
  }
}
