// SPDX-License-Identifier: Apache-2.0
// Action::stop(): what is served when nothing else is.

#include <optional>
#include <string>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using lrt::test::Answer;
using lrt::test::Bench;
using lrt::test::missing;

TEST_CASE("a stop is served though no request may wait, and whatever its body", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.max_waiting_requests = 0;
  Bench bench(options);
  int stops = 0;
  Thing thing{"arm"};
  thing.property("angle", [] { return 1; });
  thing.action("plain", [] {}).dispatch(Dispatch::io_thread);
  thing.action("stop", [&] { ++stops; }).stop();
  bench.add(std::move(thing));
  CHECK(bench.ask("GET /arm/angle").status == 503);
  CHECK(bench.ask("POST /arm/actions/plain").status == 503);
  CHECK(bench.ask("POST /arm/actions/stop").status == 204);
  CHECK(stops == 1);
  for (const char* field : {"Content-Type: image/png", "Content-Type: application/json", "Content-Type: text/turtle", "Content-Encoding: gzip"}) {
    CAPTURE(field);
    CHECK(bench.ask("POST /arm/actions/stop\n" + std::string(field) + "\n\nnonsense").status == 204);
  }
  CHECK(stops == 5);
  CHECK(bench.ask("GET /arm/actions/stop").status == 200);
}

TEST_CASE("a stop that is under way is not queued and not refused: beyond its policy the oldest is cancelled", "[engine][R0.6]") {
  Bench bench;
  std::vector<Responder> open;
  Thing thing{"arm"};
  thing.action("stop", [&](Responder done) { open.push_back(std::move(done)); }).stop().policy(ActionPolicy::parallel(2));
  bench.add(std::move(thing));
  for (int i = 1; i <= 5; ++i) CHECK(bench.ask("POST /arm/actions/stop").status == 204);
  CHECK(open.size() == 5);
  const auto status = [&](int n) { return bench.get("/arm/actions/stop/i" + std::to_string(n)); };
  for (const int n : {1, 2, 3}) CHECK(status(n).says("lrt:cancelled"));
  for (const int n : {4, 5}) CHECK(status(n).says("lrt:running"));
}

TEST_CASE("the job of a stop names itself, so that it precedes others", "[engine]") {
  Bench bench;
  Thing thing{"arm"};
  thing.action("plain", [] {}).dispatch(Dispatch::io_thread);
  thing.action("stop", [] {}).stop();
  bench.add(std::move(thing));
  (void)bench.send("POST /arm/actions/plain");
  (void)bench.send("POST /arm/actions/stop");
  const auto jobs = bench.take_jobs();
  REQUIRE(jobs.size() == 2);
  CHECK_FALSE(jobs[0].is_stop);
  CHECK(jobs[1].is_stop);
  CHECK(jobs[1].where == Dispatch::io_thread);
}

TEST_CASE("clients find stops from the root and from their Thing, in RDF and in JSON", "[engine][R0.4][R1.10]") {
  Bench bench;
  Action stop;
  for (const char* path : {"base", "base/arm"}) {
    Thing thing{path};
    thing.action("go", [] {});
    stop = thing.action("stop", [] {}).stop();
    bench.add(std::move(thing));
  }
  CHECK(missing(bench.get("/"), "</> lrt:stop <base/actions/stop> , <base/arm/actions/stop> . <base/actions/stop> a lrt:StopAction .") == "");
  CHECK(missing(bench.get("/base"), "<base> lrt:stop <base/actions/stop> . <base/actions/stop> a hybrit:Action , lrt:StopAction .") == "");
  CHECK(missing(bench.get("/base/actions/stop"), "<base/actions/stop> a lrt:StopAction ; lrt:policy \"parallel\" .") == "");
  CHECK_FALSE(bench.get("/base/actions/go").says("StopAction"));
  const std::string root = bench.ask("GET /\nAccept: application/json").body;
  CHECK(root.find(R"("stops":[{"href":"http://localhost/base/actions/stop","kind":"action")") != std::string::npos);
  CHECK(bench.ask("GET /base\nAccept: application/json").body.find(R"("stop":true)") != std::string::npos);
  CHECK(bench.ask("GET /base/actions/go\nAccept: application/json").body.find(R"("stop":)") == std::string::npos);
}

TEST_CASE("which requests are stops is known by their header section", "[engine]") {
  Bench bench;
  Thing thing{"arm"};
  thing.action("go", [] {});
  thing.action("stop", [] {}).stop();
  bench.add(std::move(thing));
  const auto is_stop = [&](const std::string& text) {
    lrt::test::RequestText request(text);
    return bench.engine.is_stop(request.get());
  };
  CHECK(is_stop("POST /arm/actions/stop"));
  CHECK(is_stop("POST /arm/actions/s%74op"));
  CHECK(is_stop("POST http://localhost/arm/actions/stop"));
  CHECK_FALSE(is_stop("GET /arm/actions/stop"));
  CHECK_FALSE(is_stop("POST /arm/actions/go"));
  CHECK_FALSE(is_stop("POST /arm"));
  CHECK_FALSE(is_stop("POST /nowhere"));
  CHECK_FALSE(is_stop("POST *"));
}

TEST_CASE("a stop that would wait or takes an input is an error of add()", "[engine]") {
  const auto error_of = [](auto set_up) {
    Thing thing{"arm"};
    set_up(thing);
    Bench bench;
    const auto added = bench.engine.add(std::move(thing));
    return added ? std::string() : added.error().message;
  };
  CHECK(error_of([](Thing& t) { t.action("stop", [] {}).stop().dispatch(Dispatch::executor); }).empty());
  CHECK(error_of([](Thing& t) { t.action("stop", [](double) {}).stop(); }).find("takes no input") != std::string::npos);
  for (const Dispatch where : {Dispatch::in_poll, Dispatch::as_server})
    CHECK(error_of([&](Thing& t) { t.action("stop", [] {}).stop().dispatch(where); }).find("Server::poll") != std::string::npos);
  for (const ActionPolicy policy : {ActionPolicy::queue(3), ActionPolicy::reject(), ActionPolicy::preempt(), ActionPolicy::parallel(0)})
    CHECK(error_of([&](Thing& t) { t.action("stop", [] {}).stop().policy(policy); }).find("ActionPolicy::parallel") != std::string::npos);
}

}  // namespace
