// SPDX-License-Identifier: Apache-2.0
#if LRT_HAS_LIBWEBSOCKETS

#include <lrt/transport/libwebsockets.hpp>

#include <libwebsockets.h>
#include <sys/resource.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/transport/http.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/tls.hpp"
#include "tests/transport/framing_cases.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

namespace {

constexpr std::chrono::seconds longest{30};

transport::TransportOptions local_options() {
  transport::TransportOptions options;
  options.port = 0;
  options.limits.max_body_bytes = 1'000'000;
  options.limits.linger_timeout = milliseconds(300);
  options.limits.stop_timeout = milliseconds(200);
  return options;
}

int on_host(lws*, lws_callback_reasons, void*, void*, std::size_t) { return 0; }

/// What a host that has an lws_context does: nothing but lws_service().
struct LwsHost {
  explicit LwsHost(std::uint64_t context_options = 0) {
    static const lws_protocols protocols[] = {{"host", &on_host, 0, 0, 0, nullptr, 0}, {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
    lws_set_log_level(0, nullptr);
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN;
    info.protocols = protocols;
    info.options = context_options;
    context = lws_create_context(&info);
    if (context == nullptr) throw std::runtime_error("no lws_context");
  }
  ~LwsHost() { end(); }
  void end() {
    if (context != nullptr) lws_context_destroy(std::exchange(context, nullptr));
  }
  lws_context* context;
};

/// A transport that only rounds of lws_service() drive: poll() of TestHost is such a round.
class Rounds final : public transport::Transport {
 public:
  explicit Rounds(transport::TransportOptions options) {
    options.turn = [this] {
      ++turns;
      if (throws) throw std::runtime_error("a turn");
      inner_->poll(budget_, milliseconds(0));
    };
    inner_ = transport::make_libwebsockets(std::move(options), host.context);
  }
  Result<void> start(engine::Handler& handler) override { return inner_->start(handler); }
  milliseconds poll(std::chrono::microseconds budget, milliseconds) override {
    budget_ = budget;
    lws_service(host.context, -1);
    return milliseconds(0);
  }
  std::shared_ptr<Waker> waker() const noexcept override { return inner_->waker(); }
  void stop() override { inner_->stop(); }
  transport::Capabilities capabilities() const noexcept override { return inner_->capabilities(); }
  Result<void> reload_tls() override { return inner_->reload_tls(); }
  std::uint16_t port() const noexcept override { return inner_->port(); }

  LwsHost host;
  int turns = 0;
  bool throws = false;

 private:
  std::chrono::microseconds budget_{0};
  std::unique_ptr<transport::Transport> inner_;
};

/// The ways in which a request reaches a robot.
const std::vector<std::string> ways{"http", "an lws_context of its own", "a host's lws_context"};

std::unique_ptr<transport::Transport> make(const std::string& way, transport::TransportOptions options) {
  if (way == ways[0]) return transport::make_http(std::move(options));
  if (way == ways[1]) return transport::make_libwebsockets(std::move(options));
  return std::make_unique<Rounds>(std::move(options));
}

/// All that a client gets for these bytes if it closes its side behind them. The date is that of the clock.
std::string talk(TestHost& host, std::string_view bytes) {
  auto client = host.client();
  client.send(bytes);
  if (!host.run({&client}, [&] { return client.all_sent() || client.ended || client.send_failed; })) throw std::runtime_error("not sent");
  client.half_close();
  if (!host.run_to_end(client)) throw std::runtime_error("no end");
  return client.received;
}

/// All beginnings of the names of fields and methods that libwebsockets knows, the names themselves too, each also in capitals.
std::set<std::string> beginnings() {
  std::set<std::string> all;
  for (int token = 0; token < WSI_TOKEN_COUNT; ++token) {
    const auto* const known = reinterpret_cast<const char*>(lws_token_to_string(static_cast<lws_token_indexes>(token)));
    std::string name(known != nullptr ? known : "");
    while (!name.empty() && (name.back() == ':' || name.back() == ' ')) name.pop_back();
    for (std::size_t size = 1; size <= name.size(); ++size) {
      std::string part = name.substr(0, size);
      if (!std::isalpha(static_cast<unsigned char>(part.back())) && part.back() != '-') break;  // a pseudo-field of HTTP/2, a version, an empty line
      all.insert(part);
      std::transform(part.begin(), part.end(), part.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
      all.insert(part);
    }
  }
  return all;
}

bool is_any_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::any_of(names.begin(), names.end(), [&](std::string_view other) { return http::iequals(name, other); });
}

}  // namespace

// ------------------------------------------------------------------------------------------------- one request, one meaning

TEST_CASE("a request has the same response on each transport", "[transport][libwebsockets][R0.1]") {
  HandClock clock;
  auto options = local_options();
  options.clock = &clock;
  std::vector<std::unique_ptr<TestHost>> hosts;
  for (const auto& way : ways) hosts.push_back(std::make_unique<TestHost>(make(way, options)));

  std::vector<std::pair<std::string, std::string>> requests;
  for (const auto& item : framing_cases()) requests.emplace_back(item.name, item.bytes);
  const std::string next = get("/head", "X-Next: 1\r\n");
  const auto add = [&](const std::string& request) { requests.emplace_back(request, request + next); };
  // What a parser that knows names by a table may take for another field, for the same one, or for two.
  for (const std::string_view target : {"/head", "/./head", "/a/../head", "//head", "/he%61d", "/head?a=%26&b;c=+", "/h%2Fead", "/%00", "/%4", "*"})
    for (const std::string_view method : {"GET", "POST", "PATCH", "BREW", "HEAD"})
      add(std::string(method) + " " + std::string(target) + " HTTP/1.1\r\nHost: a\r\n\r\n");
  for (const std::string_view field : {"Upgrade: callback\r\nConnection: upgrade\r\n",
                                       "Upgrade: h2c\r\nHTTP2-Settings: AAMAAABk\r\nConnection: upgrade\r\n",
                                       "X: 1\r\nX: 2\r\n",
                                       "X-Empty:\r\n",
                                       "Content-Length : 5\r\n",
                                       "Content-Length\t: 5\r\n",
                                       " Content-Length: 5\r\n",
                                       "X: a\r\n Content-Length: 5\r\n",
                                       "X: a\rContent-Length: 5\r\n",
                                       "X: a\nContent-Length: 5\r\n",
                                       "X\r\nContent-Length: 5\r\n",
                                       "X: a\r\r\nContent-Length: 5\r\n",
                                       "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n",
                                       "Transfer-Encoding:\r\n",
                                       "Transfer_Encoding: chunked\r\n",
                                       "Connection: Content-Length\r\n",
                                       "GET /x HTTP/1.1\r\n",
                                       "post /x\r\n",
                                       "Host: b\r\n",
                                       ": a\r\n",
                                       "Expect: a-pony\r\n"})
    for (const std::string_view method : {"GET", "POST"}) add(std::string(method) + " /head HTTP/1.1\r\nHost: a\r\n" + std::string(field) + "\r\n");

  std::size_t differ = 0;
  for (const auto& [name, bytes] : requests) {
    const auto expected = talk(*hosts[0], bytes);
    for (std::size_t i = 1; i < hosts.size(); ++i) {
      INFO(name << "\non " << ways[i]);
      const auto got = talk(*hosts[i], bytes);
      if (got != expected) ++differ;
      if (differ <= 3) CHECK(got == expected);
    }
  }
  CHECK(differ == 0);
  CHECK(requests.size() > 190);
}

TEST_CASE("a field whose name begins like a known one hides no other field", "[transport][libwebsockets][R0.1]") {
  TestHost host(transport::make_libwebsockets(local_options()));
  const auto all = beginnings();
  REQUIRE(all.size() > 500);
  CHECK(all.count("x") + all.count("O") + all.count("transfer-enc") == 3);
  std::size_t wrong = 0, tried = 0;
  std::string first_wrong;
  for (const auto& name : all) {
    // The names that frame a request, or that may be there once or in one form only.
    if (is_any_of(name, {"Host", "Content-Length", "Transfer-Encoding", "Expect", "Connection", "Upgrade", "Origin"})) continue;
    for (const bool before : {true, false}) {
      const auto fields = [&](const std::string& victim) {
        const std::string other = name + ": y\r\n";
        return before ? other + victim : victim + other;
      };
      const std::pair<std::string, std::string> requests[] = {
          {"POST / HTTP/1.1\r\nHost: a\r\n" + fields("Content-Length: 5\r\n") + "\r\nhello", "\r\n\r\nhello"},
          {"POST / HTTP/1.1\r\nHost: a\r\n" + fields("Transfer-Encoding: chunked\r\n") + "\r\n5\r\nhello\r\n0\r\n\r\n", "\r\n\r\nhello"},
          {get("/head", fields("Origin: http://foreign.example\r\n")), "\nOrigin=http://foreign.example\n"},
      };
      for (const auto& [bytes, part] : requests) {
        ++tried;
        // The next request is one, and not a part of the body before.
        const auto answers = parse_answers(talk(host, bytes + get("/head")));
        if (statuses(answers) == std::vector{200, 200} && contains(answers[0].head + answers[0].body, part)) continue;
        if (wrong++ == 0) first_wrong = bytes;
      }
    }
  }
  INFO("the first of them: " << first_wrong);
  CHECK(wrong == 0);
  CHECK(tried > 3000);
}

TEST_CASE("what decides about a write is seen on each transport, whatever stands before it", "[transport][libwebsockets][R0.1]") {
  const std::string name = GENERATE("http", "libwebsockets");
  Options options;
  options.listen.port = 0;
  options.threads.io = Io::in_poll;
  options.listen.transport = [&](transport::TransportOptions given) { return transport::make_named(name, std::move(given)); };
  std::string text = "before";
  Thing robot{"robot"};
  robot.property("text", [&] { return text; }).on_write([&](const std::string& value) { text = value; });
  auto server = Server::create(std::move(options)).value();
  REQUIRE(server.add(std::move(robot)));
  const auto put = [&](const std::string& fields, const std::string& body) {
    RawClient client(server.port());
    client.send("PUT /robot/text HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server.port()) + "\r\nContent-Type: application/json\r\n" + fields +
                "Connection: close\r\n\r\n" + body);
    for (const auto end = steady_clock::now() + longest; !client.ended && steady_clock::now() < end; server.poll()) client.step();
    const auto answers = parse_answers(client.received);
    return answers.size() == 1 ? answers[0].status : 0;
  };
  CHECK(put("X: y\r\nContent-Length: 7\r\n", "\"after\"") == 204);
  CHECK(text == "after");
  CHECK(put("T: x\r\nTransfer-Encoding: chunked\r\n", "6\r\n\"last\"\r\n0\r\n\r\n") == 204);
  CHECK(text == "last");
  CHECK(put("O: x\r\nOrigin: http://foreign.example\r\nContent-Length: 6\r\n", "\"evil\"") == 403);
  CHECK(put("Or: x\r\nOrigin: http://foreign.example\r\nContent-Length: 6\r\n", "\"evil\"") == 403);
  CHECK(text == "last");
}

// ----------------------------------------------------------------------------------------------------------- a host's context

TEST_CASE("on a host's lws_context only lws_service() serves, from start() to stop(), and again", "[transport][libwebsockets]") {
  auto made = std::make_unique<Rounds>(local_options());
  auto& rounds = *made;
  CHECK(rounds.capabilities().on_host_loop);
  TestHost host(std::move(made));
  auto client = host.client();
  client.send(get("/") + get("/defer"));
  REQUIRE(host.run_to_answers(client, 1));
  REQUIRE(host.run_until_handled(client, 2));
  const int before = rounds.turns;
  host.complete(0, "later");  // wakes
  REQUIRE(host.run_to_answers(client, 2));
  CHECK(rounds.turns > before);

  rounds.throws = true;  // is logged, not passed to libwebsockets
  client.send(get("/"));
  host.settle();
  rounds.throws = false;
  REQUIRE(host.run_to_answers(client, 3));

  for (int time = 0; time < 3; ++time) {
    const auto port = host.server->port();
    auto deferred = host.client();
    deferred.send(get("/defer"));
    const auto open = host.handler.open.size();
    REQUIRE(host.run({&deferred}, [&] { return host.handler.open.size() > open; }));
    host.server->stop();
    CHECK(host.server->port() == 0);
    CHECK_THROWS(RawClient(port));  // at once: libwebsockets has no listener that it would have to close
    REQUIRE(host.run({&deferred}, [&] { return deferred.ended; }));
    CHECK(statuses(parse_answers(deferred.received)) == std::vector{503});
    const int turns = rounds.turns;
    host.server->waker()->wake();
    if (time != 1) host.settle();  // it may also start before libwebsockets has freed what it had
    CHECK(rounds.turns == turns);
    REQUIRE(host.server->start(host.handler));
    CHECK(host.is_well());
  }
}

TEST_CASE("an lws_context that sleeps is woken by requests, by deadlines and by the waker", "[transport][libwebsockets]") {
  auto options = local_options();
  options.limits.body_timeout = milliseconds(30);
  auto made = std::make_unique<Rounds>(options);
  auto& rounds = *made;
  TestHost host(std::move(made));
  const auto sleep_until = [&](RawClient& client, std::size_t count) {
    // A watchdog of the test ends a sleep that nothing else would.
    lws_sorted_usec_list_t watchdog{};
    lws_sul_schedule(
        rounds.host.context, 0, &watchdog, [](lws_sorted_usec_list_t*) {}, 30 * LWS_US_PER_SEC);
    const auto end = steady_clock::now() + longest;
    while (parse_answers(client.received).size() < count && steady_clock::now() < end) {
      lws_service(rounds.host.context, 0);  // waits
      client.step();
    }
    lws_sul_cancel(&watchdog);
    return statuses(parse_answers(client.received));
  };
  auto client = host.client();
  client.send(post_of(5) + "abc");
  client.step();
  CHECK(sleep_until(client, 1) == std::vector{408});
  auto deferred = host.client();
  deferred.send(get("/defer"));
  REQUIRE(host.run_until_handled(deferred, 1));
  host.settle();
  host.complete(0, "woken");
  CHECK(sleep_until(deferred, 1) == std::vector{200});
}

TEST_CASE("two robots and the host's own port share an lws_context", "[transport][libwebsockets]") {
  LwsHost host;
  TestHandler handlers[2];
  std::vector<std::unique_ptr<transport::Transport>> robots;
  for (auto& handler : handlers) {
    auto options = local_options();
    options.turn = [&robots] {
      for (const auto& robot : robots) robot->poll(milliseconds(1), milliseconds(0));
    };
    robots.push_back(transport::make_libwebsockets(std::move(options), host.context));
    REQUIRE(robots.back()->start(handler));
  }
  lws_context_creation_info info{};
  static const lws_protocols protocols[] = {{"raw",
                                             [](lws* wsi, lws_callback_reasons reason, void*, void*, std::size_t) {
                                               if (reason == LWS_CALLBACK_RAW_RX) lws_callback_on_writable(wsi);
                                               if (reason != LWS_CALLBACK_RAW_WRITEABLE) return 0;
                                               unsigned char bytes[LWS_PRE + 4] = {};
                                               std::copy_n("host", 4, bytes + LWS_PRE);
                                               lws_write(wsi, bytes + LWS_PRE, 4, LWS_WRITE_RAW);
                                               return 0;
                                             },
                                             0, 0, 0, nullptr, 0},
                                            {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  info.protocols = protocols;
  info.port = 0;
  info.iface = "127.0.0.1";
  info.options = LWS_SERVER_OPTION_ONLY_RAW;
  lws_vhost* const own = lws_create_vhost(host.context, &info);
  REQUIRE(own != nullptr);
  RawClient of_host(static_cast<std::uint16_t>(lws_get_vhost_listen_port(own)));
  RawClient first(robots[0]->port()), second(robots[1]->port());
  const auto run = [&](const std::function<bool()>& reached) {
    const auto end = steady_clock::now() + longest;
    while (!reached() && steady_clock::now() < end) {
      for (auto* const client : {&of_host, &first, &second}) client->step();
      lws_service(host.context, -1);
    }
    return reached();
  };
  of_host.send("hello");
  first.send(get("/"));
  second.send(get("/"));
  CHECK(run([&] { return of_host.received == "host" && contains(first.received, "hello") && contains(second.received, "hello"); }));
  robots[0]->stop();
  first.received.clear();
  second.received.clear();
  of_host.received.clear();
  of_host.send("again");
  second.send(get("/"));
  CHECK(run([&] { return of_host.received == "host" && contains(second.received, "hello"); }));
  CHECK(run([&] { return first.ended; }));
  robots.clear();
  of_host.received.clear();
  of_host.send("alone");
  CHECK(run([&] { return of_host.received == "host"; }));
}

TEST_CASE("a host's lws_context needs to be there, and a turn", "[transport][libwebsockets]") {
  LwsHost host;
  TestHandler handler;
  CHECK(transport::make_libwebsockets(local_options(), host.context)->start(handler).error().code == Errc::invalid_option);
  auto options = local_options();
  options.turn = [] {};
  CHECK(transport::make_libwebsockets(options, nullptr)->start(handler).error().code == Errc::invalid_option);
  options.address = "192.0.2.1";
  CHECK(transport::make_libwebsockets(options, host.context)->start(handler).error().code == Errc::io_error);
  options.address = "127.0.0.1";
  const auto server = transport::make_libwebsockets(options, host.context);
  REQUIRE(server->start(handler));
  CHECK(server->start(handler).error().code == Errc::invalid_option);
  CHECK(server->port() != 0);  // still the first start
}

// ------------------------------------------------------------------------------------------- stops under load, counted in turns

namespace {

struct Secure {
  Secure() {
    options.tls.emplace();
    options.tls->certificate_file = folder.put("server.pem", {&own});
    options.tls->key_file = folder.put_key("key.pem", own);
  }
  TlsFolder folder;
  Certificate authority = make_certificate({"authority", {}, -3600, 3600, true});
  Certificate own = make_certificate({"robot", "DNS:localhost,IP:127.0.0.1"}, &authority);
  SslContext client = tls_client(authority);
  transport::TransportOptions options = local_options();
};

/// The polls until a stop over TLS has its response; its client connects again when it is closed. `before` is called before each poll.
/// 0: never.
int polls_until_stopped(TestHost& host, SSL_CTX* context, const std::function<void()>& before) {
  constexpr int most = 20'000;
  constexpr milliseconds budget(200);  // for all that has come, on any machine
  int polls = 0;
  while (polls < most) {
    RawClient raw(host.server->port());
    TlsClientSide side(context);
    side.write("POST /stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n");
    std::string text;
    while (!raw.ended && !raw.send_failed && side.failure.empty() && polls < most) {
      raw.send(side.give());
      raw.step();
      text += side.take(std::exchange(raw.received, {}));
      if (contains(text, "\r\n\r\nstopped")) return polls;
      before();
      host.server->poll(budget, milliseconds(0));
      ++polls;
    }
  }
  return 0;
}

}  // namespace

TEST_CASE("a stop is served in a few turns while clients come with a ClientHello and go", "[transport][libwebsockets][tls][R0.1]") {
  const std::string way = GENERATE(from_range(ways));
  CAPTURE(way);
  Secure secure;
  secure.options.limits.max_connections = 50;  // all are taken; a new one serves stops
  secure.options.limits.reserved_connections = 16;
  secure.options.limits.header_timeout = std::chrono::hours(1);
  TestHost host(make(way, secure.options));
  const std::string hello = TlsClientSide(secure.client.get()).give();
  std::deque<RawClient> others;
  std::size_t came = 0;
  const auto churn = [&] {
    for (int i = 0; i < 8; ++i, ++came) {
      others.emplace_back(host.server->port());
      others.back().send(came % 3 == 0 ? hello.substr(0, hello.size() / 2) : hello);
      others.back().step();
    }
    while (others.size() > 200) others.pop_front();
  };
  for (int i = 0; i < 25; ++i) churn();
  std::vector<int> polls;
  for (int stop = 0; stop < 3; ++stop) polls.push_back(polls_until_stopped(host, secure.client.get(), churn));
  std::printf("%s: %zu clients came with a ClientHello; polls until a stop was served: %d, %d, %d\n", way.c_str(), came, polls[0], polls[1],
              polls[2]);
  for (const int count : polls) {
    CHECK(count > 0);
    CHECK(count <= 50);
  }
}

TEST_CASE("a stop is served in a few turns although descriptors have run out", "[transport][libwebsockets][tls][R0.1]") {
  const std::string way = GENERATE(from_range(ways));
  CAPTURE(way);
  Secure secure;
  HandClock clock;
  secure.options.clock = &clock;
  TestHost host(make(way, secure.options));
  const std::string hello = TlsClientSide(secure.client.get()).give();
  std::vector<RawClient> slow;
  for (int i = 0; i < 60; ++i) {
    slow.push_back(host.client());
    slow.back().send(hello);
    slow.back().step();
  }
  RawClient raw(host.server->port());  // behind the others
  TlsClientSide side(secure.client.get());
  side.write("POST /stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n");
  std::string text;
  int polls = 0;
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::dup(0);
  ::close(next);
  rlimit full = before;
  full.rlim_cur = static_cast<rlim_t>(next);
  ::setrlimit(RLIMIT_NOFILE, &full);
  for (; polls < 5000 && !raw.ended && !contains(text, "\r\n\r\nstopped"); ++polls) {
    raw.send(side.give());
    raw.step();
    text += side.take(std::exchange(raw.received, {}));
    clock.advance(milliseconds(10));  // accepting may pause for a time
    host.server->waker()->wake();
    host.server->poll(milliseconds(200), milliseconds(0));
  }
  ::setrlimit(RLIMIT_NOFILE, &before);
  std::printf("%s: no descriptors, 60 clients with a ClientHello before; polls until a stop was served: %d\n", way.c_str(), polls);
  CHECK(contains(text, "\r\n\r\nstopped"));
  CHECK(polls <= 50);
}

#endif
