// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/session.hpp>

#include <tuple>

#include "src/transport/body_buffer.hpp"
#include "tests/support/catch.hpp"
#include "tests/transport/framing_cases.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using transport::Session;

namespace {

/// A session whose output is taken at once.
struct Run {
  explicit Run(transport::Limits given = {}) : limits(given) {
    context.handler = &handler;
    context.websockets = true;
  }
  void receive(std::string_view bytes) {
    session.receive(bytes, clock.now());
    drain();
  }
  void drain() {
    for (auto output = session.output(); !output.empty(); output = session.output()) {
      written.append(output.first).append(output.second);
      session.sent(output.first.size() + output.second.size(), clock.now());
    }
  }
  void complete(std::string body) {
    handler.complete(handler.open.back(), std::move(body));
    session.reply(*handler.next_reply(clock.now()), clock.now());
    drain();
  }
  bool is_over() const { return session.phase() == Session::Phase::lingering || session.phase() == Session::Phase::closed; }

  transport::Limits limits;
  HandClock clock;
  TestHandler handler;
  transport::SessionContext context{limits};
  Session session{context, "192.0.2.1"};
  std::string written;
};

transport::Limits small_body() {
  transport::Limits limits;
  limits.max_body_bytes = 1'000'000;
  return limits;
}

}  // namespace

TEST_CASE("framing has one meaning however the bytes are split", "[transport][R0.1]") {
  for (const auto& item : framing_cases()) {
    INFO(item.name);
    {
      Run run(small_body());
      run.receive(item.bytes);
      CHECK(statuses(parse_answers(run.written)) == item.statuses);
      CHECK(run.is_over() == item.closes);
    }
    {
      Run run(small_body());
      for (const char& byte : item.bytes) run.receive({&byte, 1});
      CHECK(statuses(parse_answers(run.written)) == item.statuses);
      CHECK(run.is_over() == item.closes);
    }
    const std::size_t step = item.bytes.size() > 1000 ? 997 : 1;
    for (std::size_t at = 1; at < item.bytes.size(); at += step) {
      Run run(small_body());
      const auto bytes = std::string_view(item.bytes);
      run.receive(bytes.substr(0, at));
      run.receive(bytes.substr(at));
      if (statuses(parse_answers(run.written)) != item.statuses || run.is_over() != item.closes) {
        INFO("split at " << at);
        CHECK(statuses(parse_answers(run.written)) == item.statuses);
        CHECK(run.is_over() == item.closes);
      }
    }
  }
}

TEST_CASE("a refusal has problem details and ends the connection", "[transport][R0.1][R0.6]") {
  Run run;
  run.receive("GET / HTTP/1.1\r\nHost: a\r\nX : b\r\n\r\n");
  const auto answers = parse_answers(run.written);
  REQUIRE(answers.size() == 1);
  CHECK(contains(answers[0].head, "\r\nContent-Type: application/problem+json\r\n"));
  CHECK(contains(answers[0].head, "\r\nConnection: close\r\n"));
  CHECK(contains(answers[0].body, "\"status\":400"));
  CHECK(run.handler.requests == 0);
}

TEST_CASE("a refusal of a field that frames the body says what was found and where", "[transport][R0.1]") {
  const std::string huge = "18446744073709551621";
  const std::pair<std::string, std::string> cases[] = {
      {"Content-Length: +5", "Content-Length: expected 1 to 19 digits, found \"+5\""},
      {"Content-Length: -5", "Content-Length: expected 1 to 19 digits, found \"-5\""},
      {"Content-Length: 0x5", "Content-Length: expected 1 to 19 digits, found \"0x5\""},
      {"Content-Length: 5 5", "Content-Length: expected 1 to 19 digits, found \"5 5\""},
      {"Content-Length:", "Content-Length: expected 1 to 19 digits, found \"\""},
      {"Content-Length: 5.0", "Content-Length: expected 1 to 19 digits, found \"5.0\""},
      {"Content-Length: 5;x", "Content-Length: expected 1 to 19 digits, found \"5;x\""},
      {"Content-Length: 5, 5", "Content-Length: expected 1 to 19 digits, found \"5, 5\""},
      {"Content-Length: " + huge, "Content-Length: expected 1 to 19 digits, found \"" + huge + "\""},
      {"Content-Length: 5\r\nContent-Length: 6", "Content-Length: expected at most one, found 2: \"5\", \"6\""},
      {"Content-Length: 5\r\nTransfer-Encoding: chunked", "Content-Length: found \"5\" beside Transfer-Encoding \"chunked\""},
      {"Transfer-Encoding: chunked\r\nContent-Length: 5", "Content-Length: found \"5\" beside Transfer-Encoding \"chunked\""},
      {"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked", "Transfer-Encoding: expected at most one, found 2: \"chunked\", \"chunked\""},
      {"Transfer-Encoding: gzip, chunked", "Transfer-Encoding: expected exactly \"chunked\", found \"gzip, chunked\""},
  };
  for (const auto& [fields, reason] : cases) {
    INFO(fields);
    Run run;
    run.receive("POST / HTTP/1.1\r\nHost: a\r\nX: \tb \r\n" + fields + "\r\n\r\nhello");
    const auto answers = parse_answers(run.written);
    REQUIRE(answers.size() == 1);
    std::string quoted;  // as JSON has it
    for (const char c : reason) quoted += c == '"' ? "\\\"" : std::string(1, c);
    CHECK_THAT(answers[0].body, Catch::Matchers::ContainsSubstring(quoted));
    CHECK(run.handler.requests == 0);
  }
}

TEST_CASE("the time of the first header section runs from the beginning, that of later ones from their first byte", "[transport]") {
  Run run;
  CHECK(run.session.timed_phase() == Session::Phase::header);
  const auto begin = run.session.epoch();
  run.receive("\r\nGET / HTTP/1.1\r\n");
  CHECK(run.session.timed_phase() == Session::Phase::header);
  CHECK(run.session.epoch() == begin);
  run.receive("Host: a\r\n\r\n");
  CHECK(run.session.timed_phase() == Session::Phase::idle);
  const auto idle = run.session.epoch();
  run.receive("GET");
  CHECK(run.session.timed_phase() == Session::Phase::header);
  CHECK(run.session.epoch() != idle);
}

TEST_CASE("the handler sees the fields in order, without those that framed the body", "[transport][R0.1]") {
  const std::string request = "POST /head?q HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\nAccept:  text/turtle \t\r\nX-Empty:\r\nx-y: 1\r\n\r\nabc";
  for (std::size_t at = 0; at < request.size(); ++at) {
    Run run;
    run.receive(std::string_view(request).substr(0, at));
    run.receive(std::string_view(request).substr(at));
    const auto answers = parse_answers(run.written);
    REQUIRE(answers.size() == 1);
    CHECK(answers[0].body == "POST /head?q\nHost=a\nAccept=text/turtle\nX-Empty=\nx-y=1\n");
    CHECK(run.handler.peer == "192.0.2.1");
  }
}

TEST_CASE("a chunked body arrives without its coding", "[transport][R0.1]") {
  const std::string request =
      "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5;x=\"\\\"\"\r\nhello\r\n7\r\n, robot\r\n0\r\nX: "
      "y\r\n\r\n";
  for (std::size_t at = 0; at < request.size(); ++at) {
    Run run;
    run.receive(std::string_view(request).substr(0, at));
    run.receive(std::string_view(request).substr(at));
    const auto answers = parse_answers(run.written);
    REQUIRE(answers.size() == 1);
    CHECK(answers[0].body == "hello, robot");
  }
}

TEST_CASE("100 Continue is sent once, and only when the body is waited for", "[transport][R0.1]") {
  const std::string head = "POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n";
  {
    Run run;
    run.receive(head);
    CHECK(run.written == "HTTP/1.1 100 Continue\r\n\r\n");
    run.receive("hi");
    CHECK(contains(run.written, "\r\n\r\nHTTP/1.1 200 OK\r\n"));
  }
  {
    Run run;
    run.receive(head + "h");
    CHECK(run.written.empty());
    run.receive("i");
    CHECK(statuses(parse_answers(run.written)) == std::vector{200});
  }
  {
    Run run;  // RFC 9110 10.1.1: not for HTTP/1.0
    run.receive("POST / HTTP/1.0\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n");
    CHECK(run.written.empty());
  }
  {
    Run run;
    run.receive("POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 2000000\r\n\r\n");
    CHECK_FALSE(contains(run.written, "100 Continue"));
    CHECK(statuses(parse_answers(run.written)) == std::vector{413});
  }
}

TEST_CASE("pipelined requests wait for a deferred response and come in order", "[transport][R0.1]") {
  Run run;
  run.receive(get("/") + get("/defer") + get("/head") + get("/defer") + get("/"));
  CHECK(statuses(parse_answers(run.written)) == std::vector{200});
  CHECK(run.session.phase() == Session::Phase::waiting);
  CHECK(run.handler.requests == 2);
  run.complete("first");
  CHECK(run.handler.requests == 4);
  run.complete("second");
  const auto answers = parse_answers(run.written);
  REQUIRE(statuses(answers) == std::vector{200, 200, 200, 200, 200});
  CHECK(answers[1].body == "first");
  CHECK(answers[3].body == "second");
  CHECK(run.session.phase() == Session::Phase::idle);
}

TEST_CASE("what is buffered behind a deferred response is bounded", "[transport]") {
  Run run;
  run.receive(get("/defer"));
  std::size_t taken = 0;
  while (run.session.wants_input() && taken < 10'000'000) {
    run.receive(std::string(4096, 'x'));
    taken += 4096;
  }
  CHECK(taken <= run.limits.max_header_bytes + 4096);
}

TEST_CASE("HEAD, 204 and 304 have no body, and 204 has no length", "[transport][R0.1]") {
  Run run;
  run.receive("HEAD / HTTP/1.1\r\nHost: a\r\n\r\n" + get("/none") + get("/same") + get("/"));
  const auto answers = parse_answers(run.written, {0});
  REQUIRE(statuses(answers) == std::vector{200, 204, 304, 200});
  CHECK(contains(answers[0].head, "\r\nContent-Length: 5\r\n"));
  CHECK_FALSE(contains(answers[1].head, "Content-Length"));
  CHECK(answers[3].body == "hello");
  for (const auto& answer : answers) CHECK(contains(answer.head, "\r\nDate: Sun, 06 Nov 1994 08:49:37 GMT\r\n"));
}

TEST_CASE("the response to the last request that a connection may carry has Connection: close", "[transport]") {
  transport::Limits limits;
  limits.max_requests_per_connection = 3;
  Run run(limits);
  for (int i = 0; i < 5; ++i) run.receive(get("/"));
  const auto answers = parse_answers(run.written);
  REQUIRE(answers.size() == 3);
  CHECK_FALSE(contains(answers[1].head, "Connection: close"));
  CHECK(contains(answers[2].head, "\r\nConnection: close\r\n"));
  CHECK(run.is_over());
}

TEST_CASE("a request cut off by the end of input is refused, a whole one is handled", "[transport][R0.1]") {
  const auto cut = [](std::string_view bytes) {
    Run run;
    run.receive(bytes);
    run.session.end_of_input(run.clock.now());
    run.drain();
    CHECK(run.session.phase() == Session::Phase::closed);
    return statuses(parse_answers(run.written));
  };
  CHECK(cut("") == std::vector<int>{});
  CHECK(cut("\r") == std::vector<int>{});
  CHECK(cut("GET / HT") == std::vector{400});
  CHECK(cut("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhell") == std::vector{400});
  CHECK(cut("POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n") == std::vector{400});
  CHECK(cut(get("/")) == std::vector{200});
  CHECK(cut(get("/") + "GET") == std::vector{200, 400});
}

TEST_CASE("the end of input does not cancel a deferred response", "[transport]") {
  Run run;
  run.receive(get("/defer") + get("/"));
  run.session.end_of_input(run.clock.now());
  CHECK(run.session.phase() == Session::Phase::waiting);
  run.complete("late");
  CHECK(statuses(parse_answers(run.written)) == std::vector{200, 200});
  CHECK(run.session.phase() == Session::Phase::closed);
}

TEST_CASE("an expired phase gets a response where the client waits for one", "[transport]") {
  const auto expire = [](std::string_view bytes, Session::Phase phase) {
    Run run;
    run.receive(bytes);
    CHECK(run.session.phase() == phase);
    run.session.expire(run.clock.now());
    run.drain();
    CHECK(run.is_over());
    return statuses(parse_answers(run.written));
  };
  CHECK(expire("", Session::Phase::idle) == std::vector<int>{});
  CHECK(expire("GET /", Session::Phase::header) == std::vector{408});
  CHECK(expire("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nh", Session::Phase::body) == std::vector{408});
}

TEST_CASE("a large body is shared, not copied, and leaves in any portions", "[transport]") {
  Run run;
  run.session.receive(get("/big?100000"), run.clock.now());
  CHECK(run.session.output().second.size() == 100'000);
  std::string written;
  for (auto output = run.session.output(); !output.empty(); output = run.session.output()) {
    const auto part = (output.first.empty() ? output.second : output.first).substr(0, 777);
    written += part;
    run.session.sent(part.size(), run.clock.now());
  }
  const auto answers = parse_answers(written);
  REQUIRE(statuses(answers) == std::vector{200});
  CHECK(answers[0].body == std::string(100'000, 'b'));
  CHECK(run.session.phase() == Session::Phase::idle);
}

TEST_CASE("a request is a view of its header section until the response, however the bytes are split", "[transport]") {
  const std::string request = "POST /head HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\nX-Long: " + std::string(100, 'x') + "\r\n\r\nabc";
  for (std::size_t at = 0; at < request.size(); ++at) {
    Run run;
    for (int i = 0; i < 2; ++i) {
      run.receive(std::string(request, 0, at));
      run.receive(std::string(request, at));
    }
    const auto answers = parse_answers(run.written);
    REQUIRE(statuses(answers) == std::vector{200, 200});
    for (const auto& answer : answers) CHECK(answer.body == "POST /head\nHost=a\nX-Long=" + std::string(100, 'x') + "\n");
  }
}

TEST_CASE("a line of the header section above the limit is refused at once, with its name", "[transport][R0.1]") {
  transport::Limits limits;
  limits.max_line_bytes = 100;
  limits.max_header_bytes = 1000;
  const auto path = [](std::size_t line) { return "/" + std::string(line - sizeof "GET / HTTP/1.1" + 1, 'a'); };
  const auto field = [](std::size_t line) { return "X: " + std::string(line - 3, 'b') + "\r\n"; };
  const std::tuple<std::string, int, std::string> cases[] = {
      {get(path(100)), 404, ""},
      {get(path(101)), 414, "the request line is longer than the 100 bytes allowed for a line"},
      {"GET " + path(300), 414, "the request line is longer than the 100 bytes allowed for a line"},
      {get("/", field(100) + field(100)), 200, ""},
      {get("/", "Y: 1\r\n" + field(101)), 431, "the field line at byte 35 of the header section is longer than the 100 bytes allowed for a line"},
      {get("/").substr(0, 29) + field(200).substr(0, 150), 431, "the field line at byte 29 of the header section"},
      {get("/").substr(0, 29) + field(100).substr(0, 100) + "\rx", 431, "the field line at byte 29 of the header section"},
      {get("/", field(100) + field(100) + field(100) + field(100) + field(100) + field(100) + field(100) + field(100) + field(100) + field(100)), 431,
       "the header section is longer than 1000 bytes"},
  };
  for (const auto& [bytes, status, reason] : cases) {
    for (std::size_t at = 0; at <= bytes.size(); ++at) {
      INFO(bytes << " split at " << at);
      Run run(limits);
      if (at == bytes.size()) {
        for (const char& byte : bytes) run.receive({&byte, 1});
      } else {
        run.receive(std::string_view(bytes).substr(0, at));
        run.receive(std::string_view(bytes).substr(at));
      }
      const auto answers = parse_answers(run.written);
      REQUIRE(statuses(answers) == std::vector{status});
      if (!reason.empty()) CHECK(contains(answers[0].body, reason));
      CHECK(run.is_over() == !reason.empty());
    }
  }
}

namespace {

struct JudgedRun : Run {
  explicit JudgedRun(std::optional<int> status = std::nullopt, transport::Limits given = {}) : Run(given) {
    judge.status = status;
    context.handler = &judge;
  }
  HeaderJudge judge;
};

}  // namespace

TEST_CASE("a request that is refused by its header section gets its response before 100 Continue and before its body", "[transport][R0.1]") {
  const std::string chunked = "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n";
  for (const std::string& header :
       {post_of(5, "Expect: 100-continue\r\n"), post_of(500'000), chunked + "\r\n", chunked + "Expect: 100-continue\r\n\r\n"}) {
    INFO(header);
    JudgedRun run(403);
    run.receive(header);
    CHECK_FALSE(contains(run.written, "100 Continue"));
    const auto answers = parse_answers(run.written);
    CHECK(statuses(answers) == std::vector{403});
    CHECK(contains(run.written, "Connection: close\r\n"));  // nothing but its end tells whether the body still comes
    CHECK(run.session.phase() == Session::Phase::lingering);
    run.receive("5\r\nhello\r\n0\r\n\r\n");
    CHECK(run.context.bodies().used() == 0);
    CHECK(run.judge.judged == 1);
    CHECK(run.judge.requests == 0);
  }
}

TEST_CASE("the short body of a refused request is discarded, and the connection is kept", "[transport][R0.1]") {
  JudgedRun run(404);
  run.receive(post_of(5));
  CHECK(run.written.empty());
  run.receive("he");
  CHECK(run.context.bodies().used() == 0);
  run.receive("llo" + get("/"));
  const auto answers = parse_answers(run.written);
  CHECK(statuses(answers) == std::vector{404, 200});
  CHECK_FALSE(contains(answers[0].head, "Connection: close"));
  CHECK(run.judge.requests == 1);  // the GET

  JudgedRun late(404);
  late.receive(post_of(5) + "he");
  late.clock.advance(late.limits.body_timeout);
  late.session.expire(late.clock.now());
  late.drain();
  CHECK(statuses(parse_answers(late.written)) == std::vector{404});
  CHECK(late.session.phase() == Session::Phase::lingering);
}

TEST_CASE("an admitted request is marked, and its body is limited by the verdict", "[transport][R0.1]") {
  JudgedRun run;
  run.receive(post_of(5, "Expect: 100-continue\r\n"));
  CHECK(run.written == "HTTP/1.1 100 Continue\r\n\r\n");
  CHECK(run.judge.declared == 5);
  run.receive("hello");
  CHECK(run.judge.was_judged);
  run.receive(post_of(5) + "robot");  // came as a whole: the handler judges all at once
  CHECK(run.judge.judged == 1);
  CHECK_FALSE(run.judge.was_judged);
  CHECK(statuses(parse_answers(run.written)) == std::vector{200, 200});

  JudgedRun sized;
  sized.judge.max_body_bytes = 100;
  sized.receive(post_of(101, "Expect: 100-continue\r\n"));
  CHECK_FALSE(contains(sized.written, "100 Continue"));
  CHECK(statuses(parse_answers(sized.written)) == std::vector{413});
  CHECK(contains(sized.written, "the body has 101 bytes; 100 are allowed"));

  JudgedRun chunked;
  chunked.judge.max_body_bytes = 100;
  chunked.receive("POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n");
  CHECK_FALSE(chunked.judge.declared);
  chunked.receive("64\r\n" + std::string(100, 'a') + "\r\n1\r\n");
  CHECK(statuses(parse_answers(chunked.written)) == std::vector{413});
  CHECK(contains(chunked.written, "more than 100 bytes"));
  CHECK(chunked.context.bodies().used() == 0);
}

TEST_CASE("the bodies of all sessions together are limited, and their memory is given back", "[transport][R0.1]") {
  transport::Limits limits;
  limits.max_total_body_bytes = 250'000;
  JudgedRun shared(std::nullopt, limits);
  const auto more = [&](Session& session, const std::string& bytes) {
    std::string written;
    session.receive(bytes, shared.clock.now());
    for (auto output = session.output(); !output.empty(); output = session.output()) {
      written.append(output.first).append(output.second);
      session.sent(output.first.size() + output.second.size(), shared.clock.now());
    }
    return statuses(parse_answers(written));
  };
  const std::string part(100'000, 'a');
  {
    Session first(shared.context, "192.0.2.1"), second(shared.context, "192.0.2.2"), third(shared.context, "192.0.2.3");
    CHECK(more(first, post_of(100'001) + part).empty());
    CHECK(more(second, post_of(100'001) + part).empty());
    CHECK(shared.context.bodies().used() == 2 * (100'000 - transport::BodyBudget::free_bytes));
    CHECK(more(third, "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n186a0\r\n" + part) == std::vector{503});
    CHECK(more(shared.session, post_of(5) + "hello") == std::vector{200});  // whole: it does not count
    CHECK(more(first, "a") == std::vector{200});
    CHECK(shared.context.bodies().used() == 100'000 - transport::BodyBudget::free_bytes);
  }
  CHECK(shared.context.bodies().used() == 0);
}

TEST_CASE("one client cannot use up what all bodies may", "[transport][R0.1]") {
  transport::Limits limits;
  limits.max_total_body_bytes = 400'000;
  JudgedRun shared(std::nullopt, limits);
  std::string written;
  const auto more = [&](Session& session, const std::string& bytes) {
    written.clear();
    session.receive(bytes, shared.clock.now());
    for (auto output = session.output(); !output.empty(); output = session.output()) {
      written.append(output.first).append(output.second);
      session.sent(output.first.size() + output.second.size(), shared.clock.now());
    }
    return statuses(parse_answers(written));
  };
  const std::string part(150'000, 'a');
  const auto counted = part.size() - transport::BodyBudget::free_bytes;
  const auto check = [&](const char* greedy_address, const char* same_client, const char* stranger) {
    Session greedy(shared.context, greedy_address), again(shared.context, same_client), other(shared.context, stranger);
    CHECK(more(greedy, post_of(150'001) + part).empty());
    CHECK(more(again, post_of(150'001) + part) == std::vector{503});  // half is 200'000
    CHECK(contains(written, "\r\nRetry-After: "));
    CHECK(shared.context.bodies().used() == counted);
    CHECK(more(other, post_of(150'001) + part).empty());
    CHECK(shared.context.bodies().used() == 2 * counted);
    Session small(shared.context, same_client);  // its first bytes do not count
    CHECK(more(small, post_of(5)).empty());
    CHECK(more(small, "hello") == std::vector{200});
    CHECK(more(greedy, "a") == std::vector{200});
    Session next(shared.context, same_client);
    CHECK(more(next, post_of(150'001) + part).empty());
  };
  check("192.0.2.1", "192.0.2.1", "192.0.2.2");
  CHECK(shared.context.bodies().used() == 0);
  check("2001:db8:1:2::1", "2001:db8:1:2:ffff::9", "2001:db8:1:3::1");  // a /64 network is one client

  Session first(shared.context, "127.0.0.1"), second(shared.context, "127.0.0.1");  // a proxy has one address for all its clients
  CHECK(more(first, post_of(150'001) + part).empty());
  CHECK(more(second, post_of(150'001) + part).empty());

  limits.max_total_body_bytes_per_address = 100'000;
  JudgedRun given(std::nullopt, limits);
  Session one(given.context, "192.0.2.1");
  CHECK(more(one, post_of(150'001) + part) == std::vector{503});
}

TEST_CASE("the bytes of a body that came in pieces last as long as their owner, and do not count", "[transport][R0.1]") {
  struct Keeper final : TestHandler {
    engine::Outcome handle(const http::Request& request, TimePoint now) override {
      kept = request.body;
      owner = request.body_owner;
      return TestHandler::handle(request, now);
    }
    std::string_view kept;
    std::shared_ptr<const void> owner;
  } keeper;
  JudgedRun run;
  run.context.handler = &keeper;
  const std::string body(100'000, 'a');
  run.receive(post_of(100'000) + body.substr(0, 50'000));
  CHECK(run.context.bodies().used() == 50'000 - transport::BodyBudget::free_bytes);
  run.receive(body.substr(50'000));
  CHECK(run.context.bodies().used() == 0);
  REQUIRE(keeper.owner);
  CHECK(keeper.owner.use_count() == 1);
  run.receive(post_of(100'001) + body);
  CHECK(keeper.kept == body);
  run.receive("b");
  CHECK(keeper.kept.size() == 100'001);
  run.receive(post_of(5) + "hello");  // whole: its bytes last as long as the call
  CHECK_FALSE(keeper.owner);
}

TEST_CASE("the rest of a large body, and what is discarded, is much", "[transport]") {
  JudgedRun run;
  CHECK_FALSE(run.session.expects_much());
  run.receive(post_of(16 * 1024));
  CHECK_FALSE(run.session.expects_much());
  run.receive(std::string(16 * 1024, 'a'));
  CHECK_FALSE(run.session.expects_much());
  run.receive(post_of(16 * 1024 + 1));
  CHECK(run.session.expects_much());
  run.receive(std::string(16 * 1024 + 1, 'a') + "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5000\r\n");
  CHECK_FALSE(run.session.expects_much());
  run.receive(std::string(0x4001, 'a'));
  CHECK(run.session.expects_much());

  JudgedRun refused(403);
  refused.receive(post_of(500'000));
  CHECK(refused.session.phase() == Session::Phase::lingering);
  CHECK(refused.session.expects_much());
}

TEST_CASE("requests of a secure session are marked, with the subject of the client's certificate", "[transport][R0.2]") {
  struct Recorder : TestHandler {
    engine::Outcome handle(const http::Request& request, TimePoint now) override {
      seen.emplace_back(request.secure, request.client_certificate);
      return TestHandler::handle(request, now);
    }
    std::vector<std::pair<bool, std::string>> seen;
  };
  const std::string request = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  Run run;
  Recorder handler;
  run.context.handler = &handler;
  run.receive(request);  // over plain TCP
  run.session.set_secure("CN=anna");
  run.receive(request + request.substr(0, 20));
  run.receive(request.substr(20));
  CHECK(handler.seen == std::vector<std::pair<bool, std::string>>{{false, ""}, {true, "CN=anna"}, {true, "CN=anna"}});
  CHECK(statuses(parse_answers(run.written)) == std::vector{200, 200, 200});

  Run other;  // a client without a certificate, and without the certificate of another session
  other.context.handler = &handler;
  other.session.set_secure("");
  other.receive(request);
  CHECK(handler.seen.back() == std::pair<bool, std::string>{true, ""});
  Run plain;
  plain.context.handler = &handler;
  plain.receive(request);
  CHECK(handler.seen.back() == std::pair<bool, std::string>{false, ""});
}

TEST_CASE("an absolute target of a secure session has the scheme https", "[transport][R0.1]") {
  for (const bool secure : {false, true})
    for (const std::string scheme : {"http", "https"}) {
      CAPTURE(secure, scheme);
      Run run;
      if (secure) run.session.set_secure("");
      run.receive("GET " + scheme + "://a/ HTTP/1.1\r\nHost: a\r\n\r\n");
      CHECK(statuses(parse_answers(run.written)) == std::vector{secure == (scheme == "https") ? 200 : 421});
    }
}

TEST_CASE("a session for stops serves one stop, and nothing behind it", "[transport]") {
  const std::string stop = "GET /stop HTTP/1.1\r\nHost: a\r\n\r\n", other = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  Run run;
  run.session.serve_only_stops();
  run.receive(stop + stop + other);
  const auto answers = parse_answers(run.written);
  CHECK(statuses(answers) == std::vector{200});
  CHECK(answers[0].body == "stopped");
  CHECK(contains(answers[0].head, "\r\nConnection: close\r\n"));
  CHECK(run.is_over());
  CHECK(run.handler.requests == 1);
}

TEST_CASE("a session for stops refuses all other requests by their header section", "[transport]") {
  for (const std::string request : {"GET / HTTP/1.1\r\nHost: a\r\n\r\n", "GET /stopped HTTP/1.1\r\nHost: a\r\n\r\n",
                                    "HEAD / HTTP/1.1\r\nHost: a\r\n\r\n", "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\n",
                                    "POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nTransfer-Encoding: chunked\r\n\r\n"}) {
    CAPTURE(request);
    Run run;
    run.session.serve_only_stops();
    run.receive(request + "GET /stop HTTP/1.1\r\nHost: a\r\n\r\n");
    CHECK(run.written.find("HTTP/1.1 503 Service Unavailable\r\n") == 0);
    CHECK(contains(run.written, "\r\nRetry-After: 1\r\n"));
    CHECK(contains(run.written, "\r\nConnection: close\r\n"));
    CHECK_FALSE(contains(run.written, "HTTP/1.1 100"));
    CHECK(run.is_over());
    CHECK(run.handler.requests == 0);
  }
}

TEST_CASE("a connection that has served others can be kept for a stop", "[transport]") {
  Run run;
  run.receive("GET / HTTP/1.1\r\nHost: a\r\n\r\nPOST /stop HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\n\r\n");
  run.session.serve_only_stops();  // while the body is received
  run.receive("go");
  CHECK(statuses(parse_answers(run.written)) == std::vector{200, 200});
  CHECK(run.is_over());
}
