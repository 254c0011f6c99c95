#include <lrt/transport/loopback.hpp>

#include <thread>

#include "tests/support/catch.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

http::Request request(std::string_view method, std::string_view target, std::vector<http::Field> fields = {{"Host", "robot"}}) {
  http::Request result;
  result.method = method;
  result.target = target;
  result.fields = std::move(fields);
  return result;
}

}  // namespace

TEST_CASE("loopback answers at once, or from poll when the answer is deferred", "[transport][threads]") {
  TestHandler handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  std::vector<std::string> answers;
  const auto done = [&](http::Response response) { answers.emplace_back(response.content()); };

  loopback.submit(request("GET", "/"), done);
  CHECK(answers == std::vector<std::string>{"hello"});
  loopback.submit(request("GET", "/defer"), done);
  loopback.poll({}, {});
  CHECK(answers.size() == 1);

  std::thread other([&, waker = loopback.waker()] {
    handler.complete(handler.open[0], "late");
    waker->wake();
  });
  loopback.poll({}, std::chrono::seconds(10));
  other.join();
  CHECK(answers.size() == 2);
  CHECK(answers.back() == "late");
}

TEST_CASE("loopback checks heads as a socket would", "[transport][R0.1]") {
  TestHandler handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  int status = 0;
  const auto done = [&](const http::Response& response) { status = response.status; };
  loopback.submit(request("GET", "/", {}), done);
  CHECK(status == 400);
  loopback.submit(request("TRACE", "/"), done);
  CHECK(status == 501);
  const std::string body(2'000'000, 'x');
  auto large = request("POST", "/");
  large.body = body;
  loopback.submit(large, done);
  CHECK(status == 413);
  CHECK(handler.requests == 0);
}

TEST_CASE("what loopback still owes when it stops is 503, and the ticket is abandoned", "[transport]") {
  TestHandler handler;
  transport::TransportOptions options;
  options.limits.stop_timeout = std::chrono::milliseconds(1);
  transport::Loopback loopback(options);
  int status = 0;
  const auto done = [&](const http::Response& response) { status = response.status; };
  loopback.submit(request("GET", "/"), done);
  CHECK(status == 503);

  REQUIRE(loopback.start(handler));
  CHECK_FALSE(loopback.start(handler));
  loopback.submit(request("GET", "/defer"), done);
  status = 0;
  loopback.stop();
  CHECK(status == 503);
  CHECK(handler.abandoned == handler.open);
}

TEST_CASE("loopback leaves answers that its budget does not cover to the next poll, which does not wait", "[transport]") {
  TestHandler handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  int answers = 0;
  for (int i = 0; i < 3; ++i) loopback.submit(request("GET", "/defer"), [&](const http::Response&) { ++answers; });
  for (const auto ticket : handler.open) handler.complete(ticket, "done");
  loopback.waker()->wake();
  for (int n = 1; n <= 3; ++n) {
    CHECK(loopback.poll(std::chrono::microseconds(0), std::chrono::minutes(10)) == std::chrono::milliseconds(0));
    CHECK(answers == n);
  }
  CHECK(loopback.poll(std::chrono::microseconds(0), std::chrono::minutes(10)) == std::chrono::milliseconds::max());
}

TEST_CASE("loopback has the handler look for news, which web callbacks wait for", "[transport][loopback][R0.13]") {
  struct Looking final : TestHandler {
    std::optional<engine::Channel> next_ready(TimePoint) override { return looks++ < 3 ? std::optional(engine::Channel{1}) : std::nullopt; }
    int looks = 0;
  } handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  loopback.poll(std::chrono::milliseconds(1), std::chrono::milliseconds(0));
  CHECK(handler.looks == 4);
}
