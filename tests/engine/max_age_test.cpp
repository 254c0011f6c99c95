// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <chrono>

#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

Thing arm() {
  Thing thing{"arm"};
  thing.property("battery", [] { return 0.5; }).max_age(seconds(5), seconds(10));
  thing.property("fast", [] { return 1.0; }).max_age(milliseconds(2'900));
  thing.property("faster", [] { return 1.0; }).max_age(milliseconds(999), seconds(10));
  thing.property("angle", [] { return 2.0; });
  thing.max_age(seconds(1));
  return thing;
}

std::string cache_control(Bench& bench, const std::string& request) { return std::string(bench.ask(request).field("Cache-Control")); }

}  // namespace

TEST_CASE("a stated age is in Cache-Control of 200 and 304, in whole seconds", "[engine][R0.11]") {
  Bench bench;
  bench.add(arm());
  CHECK(cache_control(bench, "GET /arm/battery") == "max-age=5, stale-while-revalidate=10");
  CHECK(cache_control(bench, "GET /arm/battery\nAccept: application/json") == "max-age=5, stale-while-revalidate=10");
  CHECK(cache_control(bench, "HEAD /arm/fast") == "max-age=2");
  CHECK(cache_control(bench, "GET /arm/faster") == "no-cache");
  CHECK(cache_control(bench, "GET /arm/angle") == "no-cache");
  CHECK(cache_control(bench, "GET /arm") == "max-age=1");
  CHECK(cache_control(bench, "GET /arm/state") == "max-age=1");
  CHECK(cache_control(bench, "GET /") == "no-cache");
  const Answer first = bench.ask("GET /arm/battery");
  const Answer again = bench.ask("GET /arm/battery\nIf-None-Match: " + first.tag());
  CHECK(again.status == 304);
  CHECK(again.field("Cache-Control") == "max-age=5, stale-while-revalidate=10");
  CHECK(first.field("Vary") == "Accept");
}

TEST_CASE("an age is private where reading needs a right or an authorizer was asked", "[engine]") {
  engine::EngineOptions options;
  auto granted = engine::Caller();
  options.authorize = [&](const http::Request&) { return granted; };
  options.everybody_reads = false;
  SECTION("an authorizer") {}
  SECTION("rights") {
    options.everybody_reads = true;
    auto policy = security::Policy::create({{"/", security::Scope::tree, {}, security::Right::read}}).value();
    granted.view = policy->view(nullptr);
  }
  Bench bench(std::move(options));
  bench.add(arm());
  CHECK(cache_control(bench, "GET /arm/battery") == "private, max-age=5, stale-while-revalidate=10");
  const Answer first = bench.ask("GET /arm/battery");
  CHECK(cache_control(bench, "GET /arm/battery\nIf-None-Match: " + first.tag()) == "private, max-age=5, stale-while-revalidate=10");
}

TEST_CASE("an age is public where nobody is refused", "[engine]") {
  engine::EngineOptions options;
  options.authorize = [](const http::Request&) { return engine::Caller(); };
  options.everybody_reads = true;
  Bench bench(std::move(options));
  bench.add(arm());
  CHECK(cache_control(bench, "GET /arm/battery") == "max-age=5, stale-while-revalidate=10");
}
