// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/loopback.hpp>

#include <thread>

#include "tests/support/catch.hpp"
#include "tests/transport/harness.hpp"
#include "tests/transport/stream_handler.hpp"

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

/// Keeps what the client of a stream gets.
struct Watcher {
  transport::Loopback::StreamClient client() {
    return {[this](http::Response response, bool streamed) { status = response.status, streams = streamed, body = response.content(); },
            [this](std::shared_ptr<const std::string> message) {
              messages.push_back(*message);
              if (on_message) on_message();
              return messages.size() % pause_after != 0;
            },
            [this] { ++ends; }};
  }
  int status = 0;
  bool streams = false;
  std::string body;
  std::vector<std::string> messages;
  std::size_t pause_after = 1'000'000;
  std::function<void()> on_message;
  int ends = 0;
};

}  // namespace

TEST_CASE("loopback responds at once, or from poll when the response is deferred", "[transport][threads]") {
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

TEST_CASE("loopback checks header sections as a socket would", "[transport][R0.1]") {
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

TEST_CASE("loopback leaves responses that its budget does not cover to the next poll, which does not wait", "[transport]") {
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

TEST_CASE("loopback makes the handler scan for changes, which web callbacks wait for", "[transport][loopback][R0.13]") {
  struct Looking final : TestHandler {
    std::optional<engine::Channel> next_ready(TimePoint) override { return looks++ < 3 ? std::optional(engine::Channel{1}) : std::nullopt; }
    int looks = 0;
  } handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  loopback.poll(std::chrono::milliseconds(1), std::chrono::milliseconds(0));
  CHECK(handler.looks == 4);
}

TEST_CASE("loopback carries an event stream to whoever submits a request for one", "[transport][loopback][stream]") {
  StreamHandler handler;
  transport::Loopback loopback;
  Watcher watcher;
  loopback.submit(request("GET", "/stream"), watcher.client());
  CHECK(watcher.status == 503);
  REQUIRE(loopback.start(handler));

  int status = 0;
  loopback.submit(request("GET", "/stream"), [&](const http::Response& response) { status = response.status; });
  CHECK(status == 200);  // no stream
  CHECK_FALSE(handler.could_stream);
  loopback.submit(request("GET", "/forced"), [&](const http::Response& response) { status = response.status; });
  CHECK(status == 500);
  CHECK(handler.open.empty());
  loopback.submit(request("GET", "/"), watcher.client());
  CHECK(watcher.body == "hello");
  CHECK_FALSE(watcher.streams);
  loopback.submit(request("TRACE", "/"), watcher.client());
  CHECK(watcher.status == 501);

  loopback.submit(request("GET", "/stream"), watcher.client());
  CHECK(watcher.status == 200);
  CHECK(watcher.streams);
  handler.push(handler.channels.back(), "a");
  handler.push(handler.channels.back(), "b");
  loopback.poll({}, {});
  CHECK(watcher.messages == std::vector<std::string>{"a", "b"});
  handler.push(handler.channels.back(), StreamHandler::end());
  loopback.poll({}, {});
  CHECK(watcher.ends == 1);
  CHECK(handler.open.empty());

  Watcher later;
  loopback.submit(request("GET", "/later"), later.client());
  handler.push(handler.accept(0), "late");
  loopback.poll({}, {});
  CHECK(later.streams);
  CHECK(later.messages == std::vector<std::string>{"late"});
  loopback.stop();
  CHECK(later.ends == 1);
  CHECK(handler.open.empty());
  CHECK(handler.wrong == "");
}

TEST_CASE("a client of loopback that takes no more messages gets them when it resumes", "[transport][loopback][stream]") {
  StreamHandler handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  Watcher watcher;
  watcher.pause_after = 2;
  const auto id = loopback.submit(request("GET", "/stream"), watcher.client());
  for (int i = 0; i < 5; ++i) handler.push(handler.channels.back(), std::to_string(i));
  loopback.poll(std::chrono::milliseconds(1), {});
  loopback.poll(std::chrono::milliseconds(1), {});
  CHECK(watcher.messages.size() == 2);
  loopback.resume(id);
  CHECK(watcher.messages.size() == 4);
  watcher.on_message = [&] { loopback.resume(id); };  // from within: the next one comes
  handler.push(handler.channels.back(), "5");
  loopback.resume(id);
  CHECK(watcher.messages == std::vector<std::string>{"0", "1", "2", "3", "4", "5"});
  CHECK(handler.wrong == "");
}

TEST_CASE("an endless event stream on loopback leaves the others their turn", "[transport][loopback][stream]") {
  StreamHandler handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  Watcher greedy, other;
  loopback.submit(request("GET", "/stream"), greedy.client());
  handler.open.at(handler.channels.back()).endless = 10;
  handler.push(handler.channels.back(), "go");
  loopback.submit(request("GET", "/stream"), other.client());
  handler.push(handler.channels.back(), "a");
  loopback.waker()->wake();
  CHECK(loopback.poll(std::chrono::microseconds(0), std::chrono::minutes(10)) == std::chrono::milliseconds(0));
  for (int i = 0; i < 5; ++i) loopback.poll(std::chrono::microseconds(0), std::chrono::minutes(10));
  CHECK(greedy.messages.size() >= 8);
  CHECK(other.messages.size() == 1);
  CHECK(handler.wrong == "");
}

TEST_CASE("a cancelled stream of loopback hears nothing more, and its ticket or channel is over", "[transport][loopback][stream]") {
  StreamHandler handler;
  transport::Loopback loopback;
  REQUIRE(loopback.start(handler));
  Watcher watcher, waiting;
  const auto id = loopback.submit(request("GET", "/stream"), watcher.client());
  watcher.on_message = [&] { loopback.cancel(id); };
  handler.push(handler.channels.back(), "a");
  handler.push(handler.channels.back(), "b");
  loopback.poll(std::chrono::milliseconds(1), {});
  CHECK(watcher.messages.size() == 1);
  CHECK(watcher.ends == 0);
  CHECK(handler.open.empty());
  const auto deferred = loopback.submit(request("GET", "/later"), waiting.client());
  loopback.cancel(deferred);
  CHECK(handler.abandoned == handler.tickets);
  handler.accept(0);
  loopback.poll(std::chrono::milliseconds(1), {});
  CHECK(waiting.status == 0);
  CHECK(handler.open.empty());
  loopback.cancel(deferred);
  loopback.resume(id);
  CHECK(handler.wrong == "");
}
