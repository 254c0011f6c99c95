// SPDX-License-Identifier: Apache-2.0
#include "src/engine/body_size.hpp"

#include <array>
#include <map>

#include <lrt/rdf/traits.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr std::size_t base = 16 * 1024;

template <class T>
std::optional<std::size_t> size_of(const Facets& facets = {}) {
  return engine::body_size(rdf::traits<T>::type(), facets, base);
}

/// The verdict on a request with `body_bytes`; nullopt: chunked.
engine::HeaderVerdict judge(Bench& bench, const std::string& text, std::optional<std::uint64_t> body_bytes) {
  RequestText request(text);
  return bench.engine.judge_header(request.get(), body_bytes, bench.clock.now());
}

int status(Bench& bench, const std::string& text, std::optional<std::uint64_t> body_bytes = 10) {
  const auto verdict = judge(bench, text, body_bytes);
  return verdict.response ? verdict.response->status : 0;
}

}  // namespace

TEST_CASE("a type of fixed size needs a body of a fixed size, others have no bound", "[engine][R0.5]") {
  CHECK(size_of<double>() == base + 1024);
  CHECK(size_of<bool>() == base + 1024);
  CHECK(size_of<std::optional<int>>() == base + 1024);
  CHECK(size_of<Mode>() == base + 1024 + 12 * 6);
  CHECK(size_of<std::array<double, 7>>() == base + 8 * 1024);
  CHECK(size_of<std::array<std::array<double, 3>, 3>>() == base + 13 * 1024);
  CHECK_FALSE(size_of<std::string>());
  CHECK(size_of<std::string>(Facets().length(0, 10)) == base + 1024 + 120);
  CHECK_FALSE(size_of<std::vector<double>>());
  CHECK_FALSE((size_of<std::map<std::string, double>>()));
  CHECK_FALSE(size_of<Pose>());  // one of its fields is a text
  CHECK_FALSE(engine::body_size(rdf::traits<double>::type(), {}, static_cast<std::size_t>(-1)));
}

TEST_CASE("a header section is judged without a body", "[engine][R0.5][R0.6]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const std::string turtle = "\nContent-Type: text/turtle";
  CHECK(status(bench, "PUT /arm/angle" + turtle) == 0);
  CHECK(status(bench, "PUT /arm/angle" + turtle + "\nHost: evil.example") == 421);
  CHECK(status(bench, "PUT /arm/nothing" + turtle) == 404);
  CHECK(status(bench, "PUT /arm/speed" + turtle) == 405);
  CHECK(status(bench, "BREW /arm/angle" + turtle) == 501);
  CHECK(status(bench, "PUT /arm/angle") == 415);
  CHECK(status(bench, "PUT /arm/angle\nContent-Type: image/png") == 415);
  CHECK(status(bench, "PUT /arm/angle\nContent-Type: text/turtle; charset=utf-16") == 415);
  CHECK(status(bench, "POST /arm/actions/home\nContent-Type: image/png") == 415);
  CHECK(status(bench, "GET /arm/angle\nAccept: image/png") == 406);
  CHECK(status(bench, "GET /arm/angle") == 0);
  CHECK(status(bench, "DELETE /arm/angle") == 405);
  CHECK(status(bench, "OPTIONS *") == 0);
  CHECK(robot.angle == 10);
}

TEST_CASE("what a chunked body may still turn out to be is not refused", "[engine][R0.5]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  CHECK(status(bench, "POST /arm/actions/home\nContent-Type: image/png", std::nullopt) == 0);  // it may be empty
  CHECK(status(bench, "PUT /arm/angle", std::nullopt) == 0);
  CHECK(status(bench, "PUT /arm/angle\nContent-Type: image/png", std::nullopt) == 415);
}

TEST_CASE("a body is limited by what its resource takes", "[engine][R0.5]") {
  engine::EngineOptions options;
  options.max_scalar_body_bytes = 1000;
  Bench bench(options);
  Thing thing{"arm"};
  const auto write = [](const auto&) {};
  thing.property("number", [] { return 1.0; }).on_write(write);
  thing.property("text", [] { return std::string(); }).on_write(write);
  thing.property("short", [] { return std::string(); }).on_write(write).max_body_bytes(50);
  thing.property("large", [] { return 1.0; }).on_write(write).max_body_bytes(5'000'000);
  thing.action("home", [] {});
  thing.action("say", [](const std::string&) {});
  thing.action("turn", [](double) {}).max_body_bytes(10);
  thing.collection<double>("all").on_create(write).max_body_bytes(20);
  bench.add(std::move(thing));
  const auto limit = [&](const std::string& request) {
    const auto verdict = judge(bench, request + "\nContent-Type: application/json", std::nullopt);
    REQUIRE_FALSE(verdict.response);
    return verdict.max_body_bytes;
  };
  const std::size_t none = std::numeric_limits<std::size_t>::max();
  CHECK(limit("PUT /arm/number") == 2024);
  CHECK(limit("PUT /arm/text") == none);
  CHECK(limit("PUT /arm/short") == 50);
  CHECK(limit("PUT /arm/large") == 5'000'000);
  CHECK(limit("POST /arm/actions/home") == 2024);
  CHECK(limit("POST /arm/actions/say") == none);
  CHECK(limit("POST /arm/actions/turn") == 10);
  CHECK(limit("POST /arm/all") == 20);
  CHECK(limit("GET /arm") == 1000);

  const std::string number = "PUT /arm/number\nContent-Type: application/json";
  CHECK(status(bench, number, 2024) == 0);
  const auto refused = judge(bench, number, 2025);
  REQUIRE(refused.response);
  CHECK(refused.response->status == 413);
  CHECK(Answer(*refused.response).says("the body has 2025 bytes; 2024 are allowed for this resource"));
  // A body that came with its header section is judged in the same way.
  CHECK(bench.ask(number + "\n\n1" + std::string(2023, ' ')).status == 204);
  CHECK(bench.ask(number + "\n\n1" + std::string(2024, ' ')).status == 413);
  CHECK(bench.ask("GET /arm\n\n" + std::string(1001, ' ')).status == 413);
}

TEST_CASE("a precondition fails without the body where the present entity tag is known", "[engine][R0.11]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const std::string turtle = "\nContent-Type: text/turtle";
  const std::string tag = bench.get("/arm/angle").tag();
  CHECK(status(bench, "PUT /arm/angle" + turtle + "\nIf-Match: " + tag) == 0);
  CHECK(status(bench, "PUT /arm/angle" + turtle + "\nIf-Match: \"other\"") == 412);
  CHECK(status(bench, "PUT /arm/angle" + turtle + "\nIf-None-Match: *") == 412);
  robot.angle_handle->publish(11);
  CHECK(status(bench, "PUT /arm/angle" + turtle + "\nIf-Match: " + tag) == 412);
  CHECK(status(bench, "POST /arm/waypoints" + turtle + "\nIf-Match: \"other\"") == 412);
  // A pulled value is known when its lambda has run.
  CHECK(status(bench, "PUT /arm/count" + turtle + "\nIf-Match: \"other\"") == 0);
  CHECK(bench.ask("PUT /arm/count\nContent-Type: application/json\nIf-Match: \"other\"\n\n1").status == 412);
}

TEST_CASE("the authorizer judges a request once, by its header section", "[engine][R0.2]") {
  int calls = 0;
  bool saw_body = false;
  engine::EngineOptions options;
  options.authorize = [&](const http::Request& request) {
    ++calls;
    saw_body |= !request.body.empty();
    return request.find("Authorization") ? engine::Access::granted : engine::Access::unauthenticated;
  };
  SampleRobot robot;
  Bench bench(options);
  bench.add(robot.arm());
  CHECK(status(bench, "PUT /arm/nothing\nContent-Type: image/png", 1'000'000) == 401);
  CHECK(calls == 1);

  RequestText request("PUT /arm/name\nAuthorization: me\nContent-Type: application/json\n\n\"new\"");
  const engine::HeaderVerdict verdict = judge(bench, "PUT /arm/name\nAuthorization: me\nContent-Type: application/json", 5);
  CHECK_FALSE(verdict.response);
  CHECK(calls == 2);
  request.get().judged = verdict.judged;
  bench.sent(bench.engine.handle(request.get(), bench.clock.now()));
  bench.run();
  CHECK(robot.name == "new");
  CHECK(calls == 2);

  request.get().judged = nullptr;  // the body came along
  bench.sent(bench.engine.handle(request.get(), bench.clock.now()));
  CHECK(calls == 3);
  CHECK_FALSE(saw_body);
}
