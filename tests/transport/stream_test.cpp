// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/session.hpp>

#include <functional>
#include <initializer_list>
#include <sstream>

#include "tests/support/catch.hpp"
#include "tests/support/tls.hpp"
#include "tests/transport/harness.hpp"
#include "tests/transport/stream_handler.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using transport::Session;

namespace {

const std::string request = "GET /stream HTTP/1.1\r\nHost: a\r\n\r\n";
const std::string old_request = "GET /stream HTTP/1.0\r\n\r\n";
const std::string hello = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";

/// A response, and what has come behind its header section.
struct Parts {
  std::string header;
  std::string rest;
};
Parts parts(const std::string& bytes) {
  const auto end = bytes.find("\r\n\r\n");
  if (end == std::string::npos) return {bytes, ""};
  return {bytes.substr(0, end + 4), bytes.substr(end + 4)};
}

std::string chunk(const std::string& text) {
  std::ostringstream size;
  size << std::hex << text.size();
  return size.str() + "\r\n" + text + "\r\n";
}
const std::string last_chunk = "0\r\n\r\n";

/// A session whose messages are pulled as a transport pulls them.
struct Run {
  explicit Run(transport::Limits given = {}) : limits(given) {
    context.handler = &handler;
    context.streams = true;
  }
  ~Run() { CHECK(handler.wrong == ""); }
  void receive(std::string_view bytes) {
    session.receive(bytes, clock.now());
    drain();
  }
  /// @param piece  bytes that the client takes at once
  void drain(std::size_t piece = std::string::npos) {
    for (;;) {
      for (auto output = session.output(); !output.empty(); output = session.output()) {
        std::string all(output.first);
        all.append(output.second).append(output.third);
        all.resize(std::min(all.size(), piece));
        written += all;
        session.sent(all.size(), clock.now());
      }
      if (!session.wants_message()) return;
      auto push = handler.next_push(*session.channel(), clock.now());
      if (!push) return;
      session.push(*std::move(push), clock.now());
    }
  }

  transport::Limits limits;
  HandClock clock;
  StreamHandler handler;
  transport::SessionContext context{limits};
  Session session{context, "192.0.2.1"};
  std::string written;
};

transport::TransportOptions on_any_port() {
  transport::TransportOptions options;
  options.port = 0;
  options.limits.stop_timeout = milliseconds(200);
  return options;
}

/// A transport that is driven by the test's own thread, by a clock that is moved by hand.
struct Host {
  explicit Host(transport::TransportOptions options = on_any_port()) : limits(options.limits) {
    options.clock = &clock;
    server = make_network(std::move(options));
    if (const auto started = server->start(handler); !started) throw std::runtime_error(started.error().message);
  }
  ~Host() { CHECK(handler.wrong == ""); }

  RawClient client(int receive_buffer = 0) { return RawClient(server->port(), "127.0.0.1", receive_buffer); }
  RawClient open(const std::string& text = request, int receive_buffer = 0) {
    const std::size_t before = handler.channels.size();
    auto made = client(receive_buffer);
    made.send(text);
    if (!run({&made}, [&] { return handler.channels.size() > before && !parts(made.received).header.empty(); }))
      throw std::runtime_error("no stream");
    return made;
  }
  /// Polls until `reached`, but no longer than anything here can take.
  bool run(std::initializer_list<RawClient*> clients, const std::function<bool()>& reached) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < end) {
      for (auto* const client : clients) client->step();
      if (reached()) return true;
      server->poll(milliseconds(1), milliseconds(1));
    }
    return false;
  }
  bool run_to(RawClient& client, const std::string& rest) {
    return run({&client}, [&] { return parts(client.received).rest.size() >= rest.size(); }) && parts(client.received).rest == rest;
  }
  /// Lets everything happen that can happen without a wait.
  void settle(std::initializer_list<RawClient*> clients = {}) {
    for (int i = 0; i < 20; ++i) {
      for (auto* const client : clients) client->step();
      server->poll(milliseconds(1), milliseconds(0));
    }
  }
  engine::Channel last() const { return handler.channels.back(); }

  HandClock clock;
  transport::Limits limits;
  StreamHandler handler;
  std::unique_ptr<transport::Transport> server;
};

}  // namespace

// --------------------------------------------------------------------------------------------------------------- session

TEST_CASE("an event stream is a chunked response without a length; each message is a chunk", "[transport][stream]") {
  Run run;
  run.receive(request);
  CHECK(run.handler.could_stream);
  CHECK(run.session.phase() == Session::Phase::streaming);
  const auto header = parts(run.written).header;
  CHECK(header.find("HTTP/1.1 200 OK\r\nDate: ") == 0);
  CHECK(contains(header, "\r\nContent-Type: text/event-stream\r\n"));
  CHECK(contains(header, "\r\nTransfer-Encoding: chunked\r\n"));
  CHECK_FALSE(contains(header, "Content-Length"));
  CHECK_FALSE(contains(header, "Connection"));
  CHECK(parts(run.written).rest.empty());

  const auto channel = run.handler.channels.back();
  CHECK(run.session.channel() == channel);
  run.handler.push(channel, "data: 1\n\n");
  run.handler.push(channel, std::string(5000, 'x'));
  run.drain();
  CHECK(parts(run.written).rest == chunk("data: 1\n\n") + chunk(std::string(5000, 'x')));
}

TEST_CASE("an event stream that has ended leaves its connection to the next request", "[transport][stream]") {
  Run run;
  run.receive(request);
  run.handler.push(run.handler.channels.back(), "a");
  run.handler.push(run.handler.channels.back(), StreamHandler::end());
  run.drain();
  CHECK(run.handler.open.empty());
  CHECK_FALSE(run.session.channel());
  CHECK(run.session.phase() == Session::Phase::idle);
  CHECK(parts(run.written).rest == chunk("a") + last_chunk);
  run.written.clear();
  run.receive(hello);
  CHECK(statuses(parse_answers(run.written)) == std::vector{200});
  run.written.clear();
  run.receive(request);
  run.handler.push(run.handler.channels.back(), "again");
  run.drain();
  CHECK(parts(run.written).rest == chunk("again"));
}

TEST_CASE("the owner of a session can end its event stream, and the connection is kept", "[transport][stream]") {
  Run run;
  run.session.end_stream(run.clock.now());  // there is none
  CHECK(run.session.phase() == Session::Phase::idle);
  run.receive(request + hello);
  run.handler.push(run.handler.channels.back(), "a");
  run.drain();
  run.session.end_stream(run.clock.now());
  CHECK(run.handler.open.empty());
  CHECK_FALSE(run.session.channel());
  run.drain();
  CHECK(parts(run.written).rest.find(chunk("a") + last_chunk + "HTTP/1.1 200 OK\r\n") == 0);  // and then the response to the next request
  CHECK(run.session.phase() == Session::Phase::idle);
  run.session.end_stream(run.clock.now());
  run.written.clear();
  run.receive(request);  // a further stream does not end
  CHECK(run.session.phase() == Session::Phase::streaming);
}

TEST_CASE("an event stream that its owner ends is ended after the message that is being written", "[transport][stream]") {
  const std::string large(100'000, 'x');  // is not copied
  for (const std::string& message : {std::string("a"), large})
    for (const std::string& asked : {request, old_request}) {
      CAPTURE(message.size(), asked);
      Run run;
      run.receive(asked);
      run.session.push({std::make_shared<const std::string>(message)}, run.clock.now());
      CHECK(run.session.phase() == Session::Phase::writing);
      run.session.end_stream(run.clock.now());
      run.session.end_stream(run.clock.now());  // once more changes nothing
      run.drain(1'000);
      CHECK(run.handler.open.empty());
      CHECK_FALSE(run.session.channel());
      const bool chunked = asked == request;
      CHECK(parts(run.written).rest == (chunked ? chunk(message) + last_chunk : message));
      CHECK(run.session.phase() == (chunked ? Session::Phase::idle : Session::Phase::lingering));
      if (!chunked) continue;
      run.receive(request);  // a further stream does not end
      CHECK(run.session.phase() == Session::Phase::streaming);
    }
}

TEST_CASE("an event stream that its owner ends before its header section is written has no message", "[transport][stream]") {
  Run run;
  run.session.receive(request, run.clock.now());
  CHECK(run.session.channel());
  run.session.end_stream(run.clock.now());
  run.drain();
  CHECK(parts(run.written).header.find("HTTP/1.1 200 OK\r\n") == 0);
  CHECK(parts(run.written).rest == last_chunk);
  CHECK(run.handler.open.empty());
  CHECK(run.session.phase() == Session::Phase::idle);
}

TEST_CASE("HTTP/1.0 gets an event stream without chunks, and the end of the connection ends it", "[transport][stream]") {
  Run run;
  run.receive("GET /stream HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
  const auto header = parts(run.written).header;
  CHECK(contains(header, "\r\nConnection: close\r\n"));
  CHECK_FALSE(contains(header, "Transfer-Encoding"));
  CHECK_FALSE(contains(header, "Content-Length"));
  run.handler.push(run.handler.channels.back(), "data: 1\n\n");
  run.handler.push(run.handler.channels.back(), std::string(5000, 'x'));
  run.drain();
  CHECK(parts(run.written).rest == "data: 1\n\n" + std::string(5000, 'x'));
  run.clock.advance(run.limits.ping_interval);
  run.session.expire(run.clock.now());
  run.drain();
  run.handler.push(run.handler.channels.back(), StreamHandler::end());
  run.drain();
  CHECK(parts(run.written).rest == "data: 1\n\n" + std::string(5000, 'x') + ":\n\n");
  CHECK(run.session.phase() == Session::Phase::lingering);
  CHECK(run.handler.open.empty());
}

TEST_CASE("an event stream is the same however the bytes come and go, and a pipelined request waits for its end", "[transport][stream]") {
  const std::string bytes = request + hello + request;
  const auto play = [&](std::size_t at, std::size_t piece) {
    Run run;
    run.session.receive(std::string_view(bytes).substr(0, at), run.clock.now());
    run.drain(piece);
    run.session.receive(std::string_view(bytes).substr(at), run.clock.now());
    run.drain(piece);
    const std::size_t before = run.handler.requests;
    run.handler.push(run.handler.channels.back(), "data: 1\n\n");
    run.handler.push(run.handler.channels.back(), std::string(3000, 'x'));
    run.drain(piece);
    CHECK(before == 1);
    CHECK(run.handler.requests == 1);
    run.handler.push(run.handler.channels.back(), StreamHandler::end());
    run.drain(piece);
    CHECK(run.handler.requests == 3);
    return run.written;
  };
  const std::string expected = play(bytes.size(), std::string::npos);
  CHECK(contains(expected, chunk("data: 1\n\n") + chunk(std::string(3000, 'x')) + last_chunk + "HTTP/1.1 200 OK"));
  for (std::size_t at = 1; at < bytes.size(); ++at) {
    if (play(at, std::string::npos) != expected) FAIL("split at " << at);
  }
  for (const std::size_t piece : {1, 2, 3, 7, 1000}) {
    if (play(bytes.size(), piece) != expected) FAIL("pieces of " << piece);
  }
}

TEST_CASE("a large message of an event stream is not copied", "[transport][stream]") {
  Run run;
  run.receive(request);
  const auto message = std::make_shared<const std::string>(100'000, 'm');
  run.session.push({message}, run.clock.now());
  const auto output = run.session.output();
  CHECK(output.second.data() == message->data());
  CHECK(output.first == "186a0\r\n");
  CHECK(output.third == "\r\n");
  // An owner that knows two parts only sends the third later.
  run.session.sent(output.first.size() + output.second.size(), run.clock.now());
  CHECK(run.session.output().first == "\r\n");
  run.session.sent(2, run.clock.now());
  CHECK(run.session.wants_message());
  CHECK(message.use_count() == 1);
}

TEST_CASE("a message without bytes does not end an event stream", "[transport][stream]") {
  Run run;
  run.receive(request);
  run.handler.push(run.handler.channels.back(), "");
  run.handler.push(run.handler.channels.back(), engine::Push{});
  run.handler.push(run.handler.channels.back(), "a");
  run.drain();
  CHECK(parts(run.written).rest == chunk("a"));
}

TEST_CASE("what a client sends during an event stream is bounded", "[transport][stream]") {
  transport::Limits limits;
  limits.max_header_bytes = 1000;
  Run run(limits);
  run.receive(request);
  CHECK(run.session.wants_input());
  run.receive(std::string(999, 'G'));
  CHECK(run.session.wants_input());
  run.receive("G");
  CHECK_FALSE(run.session.wants_input());
  run.handler.push(run.handler.channels.back(), "a");
  run.drain();
  CHECK(parts(run.written).rest == chunk("a"));
}

TEST_CASE("HEAD of an event stream is its header section", "[transport][stream]") {
  Run run;
  run.receive("HEAD /stream HTTP/1.1\r\nHost: a\r\n\r\n" + hello);
  CHECK(run.handler.open.empty());
  CHECK(contains(parts(run.written).header, "\r\nTransfer-Encoding: chunked\r\n"));
  CHECK(statuses(parse_answers(parts(run.written).rest)) == std::vector{200});
}

TEST_CASE("a connection that cannot carry an event stream refuses it, and the channel is closed", "[transport][stream]") {
  for (const bool stopping : {false, true}) {
    Run run;
    (stopping ? run.context.stopping : run.context.streams) = stopping;
    run.receive("GET /forced HTTP/1.1\r\nHost: a\r\n\r\n");
    CHECK_FALSE(run.handler.could_stream);
    CHECK(statuses(parse_answers(run.written)) == std::vector{500});
    CHECK(run.handler.open.empty());
    CHECK(run.session.phase() == Session::Phase::lingering);
  }
}

TEST_CASE("an event stream may be the deferred response", "[transport][stream]") {
  Run run;
  run.receive("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  run.handler.push(run.handler.accept(0), "a");
  run.session.reply(*run.handler.next_reply(run.clock.now()), run.clock.now());
  run.drain();
  CHECK(parts(run.written).rest == chunk("a"));
  CHECK_FALSE(run.session.ticket());

  Run half_closed;
  half_closed.receive("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  half_closed.session.end_of_input(half_closed.clock.now());
  half_closed.handler.accept(0);
  half_closed.session.reply(*half_closed.handler.next_reply(half_closed.clock.now()), half_closed.clock.now());
  half_closed.drain();
  CHECK(parts(half_closed.written).rest == last_chunk);
  CHECK(half_closed.handler.open.empty());
  CHECK(half_closed.session.phase() == Session::Phase::closed);

  Run gone;
  gone.receive("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  gone.session.abandon();
  CHECK(gone.handler.abandoned == gone.handler.tickets);
  Run late;
  late.handler.tickets.push_back(engine::Ticket{7});
  late.handler.accept(0);
  late.session.reply(*late.handler.next_reply(late.clock.now()), late.clock.now());
  CHECK(late.handler.open.empty());
}

// --------------------------------------------------------------------------------------------------------------- sockets

TEST_CASE("an event stream comes over a socket as its messages are made", "[transport][stream]") {
  Host host;
  auto client = host.open();
  std::string expected;
  for (int i = 0; i < 100; ++i) {
    const std::string message = "data: " + std::string(static_cast<std::size_t>(i) * 100, 'd') + "\n\n";
    host.handler.push(host.last(), message);
    host.server->waker()->wake();
    expected += chunk(message);
    if (i % 10 == 0) REQUIRE(host.run_to(client, expected));
  }
  REQUIRE(host.run_to(client, expected));
  host.handler.push(host.last(), StreamHandler::end());
  host.server->waker()->wake();
  REQUIRE(host.run_to(client, expected + last_chunk));
  CHECK_FALSE(client.ended);
  CHECK(host.handler.open.empty());
  client.received.clear();
  client.send(hello);
  REQUIRE(host.run({&client}, [&] { return statuses(parse_answers(client.received)) == std::vector{200}; }));
}

TEST_CASE("event streams that end at once do not hold up what is pipelined behind them", "[transport][stream]") {
  Host host;
  auto client = host.client();
  std::string bytes;
  for (int i = 0; i < 300; ++i) bytes += "GET /ended HTTP/1.1\r\nHost: a\r\n\r\n";
  client.send(bytes + "GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n");
  REQUIRE(host.run({&client}, [&] { return client.ended; }));
  CHECK(host.handler.requests == 301);
  CHECK(host.handler.open.empty());
  CHECK(contains(client.received, "hello"));
}

TEST_CASE("a silent event stream gets comments", "[transport][stream]") {
  Host host;
  auto client = host.open();
  host.settle({&client});
  const auto interval = host.limits.ping_interval;
  host.clock.advance(interval - milliseconds(1));
  host.settle({&client});
  CHECK(parts(client.received).rest.empty());
  host.clock.advance(milliseconds(1));
  REQUIRE(host.run_to(client, chunk(":\n\n")));
  host.clock.advance(interval / 2);
  host.handler.push(host.last(), "a");  // begins the interval again
  REQUIRE(host.run_to(client, chunk(":\n\n") + chunk("a")));
  host.clock.advance(interval / 2);
  host.settle({&client});
  CHECK(parts(client.received).rest == chunk(":\n\n") + chunk("a"));
  host.clock.advance(interval / 2);
  REQUIRE(host.run_to(client, chunk(":\n\n") + chunk("a") + chunk(":\n\n")));
  CHECK(host.handler.open.size() == 1);
}

TEST_CASE("a client that does not read its event stream costs one message on its way, and is dropped after write_timeout", "[transport][stream]") {
  Host host;
  auto slow = host.open(request, 4096);
  slow.paused = true;
  const auto channel = host.last();
  host.handler.open.at(channel).endless = 100'000;
  host.handler.push(channel, "go");
  auto other = host.open();
  const auto channel_of_other = host.last();
  REQUIRE(host.run({&other}, [&] {
    const auto before = host.handler.pushed.size();
    host.settle({&other});
    return host.handler.pushed.size() == before;
  }));
  CHECK(host.handler.alive_messages() == 1);
  host.handler.push(channel_of_other, "still here");
  REQUIRE(host.run_to(other, chunk("still here")));

  host.clock.advance(host.limits.write_timeout - milliseconds(1));
  host.settle();
  CHECK(host.handler.open.count(channel) == 1);
  host.clock.advance(milliseconds(1));
  host.settle();
  CHECK(host.handler.open.count(channel) == 0);
  CHECK(host.handler.open.count(channel_of_other) == 1);
  CHECK(host.handler.alive_messages() == 0);
}

TEST_CASE("messages that are ready while a client does not read come when it does", "[transport][stream]") {
  Host host;
  auto client = host.open(request, 4096);
  client.paused = true;
  std::string expected;
  for (int i = 0; i < 50; ++i) {
    const std::string message(20'000, static_cast<char>('a' + i % 26));
    host.handler.push(host.last(), message);
    expected += chunk(message);
    host.settle({&client});
  }
  host.clock.advance(host.limits.write_timeout / 2);
  client.paused = false;
  REQUIRE(host.run_to(client, expected));
  host.handler.push(host.last(), "last");
  REQUIRE(host.run_to(client, expected + chunk("last")));
}

TEST_CASE("an endless event stream does not keep others from being served", "[transport][stream]") {
  Host host;
  auto greedy = host.open();
  host.handler.open.at(host.last()).endless = 1000;
  host.handler.push(host.last(), "go");
  auto other = host.client();
  for (std::size_t i = 1; i <= 20; ++i) {
    other.send(hello);
    REQUIRE(host.run({&other, &greedy}, [&] { return parse_answers(other.received).size() == i; }));
  }
  CHECK(host.handler.pushed.size() > 20);
}

TEST_CASE("the end of a client's sending ends its event stream", "[transport][stream]") {
  Host host;
  auto client = host.open();
  host.handler.push(host.last(), "a");
  REQUIRE(host.run_to(client, chunk("a")));
  client.half_close();
  REQUIRE(host.run({&client}, [&] { return client.ended; }));
  CHECK(parts(client.received).rest == chunk("a") + last_chunk);
  CHECK_FALSE(client.failed);
  CHECK(host.handler.open.empty());
}

TEST_CASE("the channel of a client that vanishes is closed, once", "[transport][stream]") {
  Host host;
  for (const bool reset : {false, true}) {
    auto client = host.open();
    auto blocked = host.open(request, 4096);
    host.handler.open.at(host.last()).endless = 100'000;
    host.handler.push(host.last(), "go");
    blocked.paused = true;
    host.settle({&client, &blocked});
    CHECK(host.handler.open.size() == 2);
    for (auto* const one : {&client, &blocked}) reset ? one->reset() : one->close();
    host.settle();
    CHECK(host.handler.open.empty());
  }
  auto late = host.client();
  late.send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  REQUIRE(host.run({&late}, [&] { return !host.handler.tickets.empty(); }));
  late.reset();
  host.settle();
  CHECK(host.handler.abandoned == host.handler.tickets);
  host.handler.accept(0);
  host.server->waker()->wake();
  host.settle();
  CHECK(host.handler.open.empty());
}

TEST_CASE("stop() ends event streams properly, and those that are not read after stop_timeout", "[transport][stream]") {
  Host host;
  auto client = host.open();
  auto old = host.open(old_request);
  auto deaf = host.open(request, 4096);
  host.handler.open.at(host.last()).endless = 100'000;
  host.handler.push(host.last(), "go");
  deaf.paused = true;
  host.settle({&client, &old, &deaf});
  CHECK(host.handler.open.size() == 3);
  host.server->stop();
  CHECK(host.handler.open.empty());
  for (auto* const one : {&client, &old, &deaf}) one->step();
  CHECK(parts(client.received).rest == last_chunk);
  CHECK(parts(old.received).rest.empty());
  CHECK(client.ended);
  CHECK(old.ended);
  CHECK_FALSE(client.failed);
}

TEST_CASE("an event stream is never closed for a new connection", "[transport][stream]") {
  auto options = on_any_port();
  options.limits.max_connections = 1;
  Host host(options);
  auto client = host.open();
  auto other = host.client();
  other.send(hello);
  REQUIRE(host.run({&client, &other}, [&] { return other.ended; }));
  CHECK(statuses(parse_answers(other.received)) == std::vector{503});
  CHECK(host.handler.open.size() == 1);
}

TEST_CASE("event streams come over TLS, large messages too", "[transport][stream][tls][R0.2]") {
  TlsFolder folder;
  const auto authority = make_certificate({"authority", {}, -3600, 3600, true});
  const auto own = make_certificate({"robot", "DNS:localhost,IP:127.0.0.1"}, &authority);
  auto options = on_any_port();
  options.tls.emplace();
  options.tls->certificate_file = folder.put("server.pem", {&own});
  options.tls->key_file = folder.put_key("server-key.pem", own);
  Host host(options);
  const auto context = tls_client(authority);
  TlsClientSide side(context.get());
  auto raw = host.client(8192);
  std::string received;
  const auto step = [&] {
    raw.send(side.give());
    raw.step();
    received += side.take(raw.received);
    raw.received.clear();
    raw.send(side.give());
  };
  const auto run_to = [&](const std::string& rest) {
    return host.run({}, [&] {
      step();
      return !parts(received).rest.empty() && parts(received).rest.size() >= rest.size();
    }) && parts(received).rest == rest;
  };
  side.write(request);
  REQUIRE(host.run({}, [&] { return step(), !host.handler.channels.empty() && contains(received, "\r\n\r\n"); }));
  std::string expected;
  for (const std::size_t size : {10, 2048, 2049, 40'000, 1'000'000, 3}) {
    host.handler.push(host.last(), std::string(size, 's'));
    expected += chunk(std::string(size, 's'));
  }
  REQUIRE(run_to(expected));
  raw.paused = true;
  host.clock.advance(host.limits.ping_interval);
  host.settle();
  raw.paused = false;
  REQUIRE(run_to(expected + chunk(":\n\n")));
  host.handler.push(host.last(), StreamHandler::end());
  REQUIRE(run_to(expected + chunk(":\n\n") + last_chunk));
  CHECK(host.handler.open.empty());
  received.clear();
  side.write(hello);
  REQUIRE(host.run({}, [&] { return step(), statuses(parse_answers(received)) == std::vector{200}; }));
}

TEST_CASE("a stream ends and its connection becomes a WebSocket while others get their messages", "[transport][R0.12]") {
  Host host;
  auto first = host.open(request +
                         "GET /websocket HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  auto second = host.open(), third = host.open();
  const auto channels = host.handler.channels;
  host.handler.push(channels[0], StreamHandler::end());
  for (const std::size_t i : {1U, 2U}) host.handler.push(channels[i], "data: 1\n\n");
  REQUIRE(host.run({&first, &second, &third}, [&] {
    return first.received.find("HTTP/1.1 101") != std::string::npos && second.received.find("data: 1") != std::string::npos &&
           third.received.find("data: 1") != std::string::npos;
  }));
  CHECK(host.handler.open.size() == 3);
}
