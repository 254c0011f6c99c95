// SPDX-License-Identifier: Apache-2.0
#include "tests/support/websocket.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "src/http/websocket.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using engine::Push;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

/// GET /later upgrades when accept() says so, /forced upgrades any request, any other path upgrades requests with Upgrade and
/// says hello to the rest. /echo sends back. What the transport may not do is remembered in `wrong`.
class Handler final : public engine::Handler {
 public:
  struct Received {
    Channel channel;
    std::string message;
    bool text;
  };

  engine::Outcome handle(const http::Request& request, TimePoint) override {
    ++requests;
    could_upgrade = request.can_upgrade;
    const std::string path(request.target);
    http::Response response;
    if (path == "/forced") return engine::Upgraded{new_channel(path), response};
    if (!http::requests_upgrade(request, "websocket")) {
      response.set_body("hello");
      return response;
    }
    if (const auto refusal = http::check_websocket(request)) {
      response.status = refusal->status;
      response.fields.add("Sec-WebSocket-Version", "13");
      return response;
    }
    if (path == "/later") {
      tickets.push_back(engine::Ticket{++last_});
      return engine::Deferred{tickets.back()};
    }
    const auto channel = new_channel(path);
    response.fields.add("Location", "/subscriptions/" + std::to_string(static_cast<std::uint64_t>(channel)));
    return engine::Upgraded{channel, std::move(response)};
  }
  std::optional<engine::Reply> next_reply(TimePoint now) override {
    asked_at = now;
    if (replies.empty()) return std::nullopt;
    auto reply = std::move(replies.front());
    replies.pop_front();
    return reply;
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return deadline; }
  void abandon(engine::Ticket ticket) noexcept override { abandoned.push_back(ticket); }

  std::optional<Channel> next_ready(TimePoint) override {
    if (meanwhile) meanwhile();
    if (ready_.empty()) return std::nullopt;
    const auto channel = ready_.front();
    ready_.pop_front();
    const auto found = open.find(channel);
    if (found != open.end()) found->second.named = false;
    return channel;
  }
  std::optional<Push> next_push(Channel channel, TimePoint) override {
    const auto found = open.find(channel);
    if (found == open.end()) {
      wrong = "next_push of a channel that is closed";
      return std::nullopt;
    }
    auto& client = found->second;
    if (client.closing) wrong = "next_push after a close";
    if (client.endless) {
      ++pushed;
      ++client.pushed;
      auto message = std::make_shared<const std::string>(client.endless, 'e');
      on_the_way.push_back(message);
      return Push{std::move(message)};
    }
    if (client.queue.empty()) return std::nullopt;
    auto push = std::move(client.queue.front());
    client.queue.pop_front();
    client.closing = push.close != 0;
    ++pushed;
    return push;
  }
  void received(Channel channel, std::string_view message, bool text, TimePoint) override {
    if (open.count(channel) == 0) wrong = "received of a channel that is closed";
    messages.push_back({channel, std::string(message), text});
    if (open[channel].path == "/echo") open[channel].queue.push_back({std::make_shared<const std::string>(message), text});
  }
  void closed(Channel channel) noexcept override {
    if (open.erase(channel) == 0) wrong = "closed twice";
  }

  Channel new_channel(std::string path) {
    const Channel channel{++last_};
    channels.push_back(channel);
    open[channel].path = std::move(path);
    return channel;
  }
  /// Names the channel once, as Handler says.
  void make_ready(Channel channel) {
    const auto found = open.find(channel);
    if (found == open.end() || found->second.named) return;
    found->second.named = true;
    ready_.push_back(channel);
  }
  void say(Channel channel, std::string text) { say(channel, Push{std::make_shared<const std::string>(std::move(text))}); }
  void say(Channel channel, Push push) {
    open.at(channel).queue.push_back(std::move(push));
    make_ready(channel);
  }
  /// Answers the deferred handshake.
  Channel accept(std::size_t index) {
    const auto channel = new_channel("/echo");
    http::Response response;
    response.status = 101;
    replies.push_back({tickets.at(index), std::move(response), channel});
    return channel;
  }
  std::size_t alive_messages() const {
    return static_cast<std::size_t>(std::count_if(on_the_way.begin(), on_the_way.end(), [](const auto& message) { return !message.expired(); }));
  }

  struct Client {
    std::string path;
    std::deque<Push> queue;
    std::size_t endless = 0;  ///< bytes of each of endless messages
    std::size_t pushed = 0;
    bool named = false;
    bool closing = false;
  };
  std::map<Channel, Client> open;
  std::vector<Channel> channels;  ///< all there ever were
  std::vector<engine::Ticket> tickets;
  std::vector<engine::Ticket> abandoned;
  std::deque<engine::Reply> replies;
  std::vector<Received> messages;
  std::vector<std::weak_ptr<const std::string>> on_the_way;
  std::optional<std::chrono::steady_clock::time_point> deadline;
  TimePoint asked_at;
  std::function<void()> meanwhile;
  std::size_t requests = 0;
  std::size_t pushed = 0;
  bool could_upgrade = false;
  std::string wrong;

 private:
  std::uint64_t last_ = 0;
  std::deque<Channel> ready_;
};

transport::TransportOptions on_any_port() {
  transport::TransportOptions options;
  options.port = 0;
  options.limits.stop_timeout = milliseconds(200);
  return options;
}

/// A transport that is driven by the test's own thread, in between the steps of its clients, by a clock that is moved by hand.
struct Host {
  explicit Host(transport::TransportOptions options = on_any_port()) : limits(options.limits) {
    options.clock = &clock;
    server = make_network(std::move(options));
    if (const auto started = server->start(handler); !started) throw std::runtime_error(started.error().message);
  }
  ~Host() { CHECK(handler.wrong == ""); }

  std::unique_ptr<WebSocketClient> connect(int receive_buffer = 0) { return std::make_unique<WebSocketClient>(server->port(), receive_buffer); }
  std::unique_ptr<WebSocketClient> open(std::string_view path = "/echo", int receive_buffer = 0) {
    auto client = connect(receive_buffer);
    client->send(WebSocketClient::handshake(path));
    if (!run({client.get()}, [&] { return client->status != 0; }) || client->status != 101) throw std::runtime_error("no 101");
    return client;
  }
  /// Polls until `reached`, but no longer than anything here can take.
  template <class Reached>
  bool run(std::initializer_list<WebSocketClient*> clients, Reached reached) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < end) {
      for (auto* const client : clients) client->step();
      if (reached()) return true;
      server->poll(milliseconds(1), milliseconds(1));
    }
    return false;
  }
  bool run_to_frames(WebSocketClient& client, std::size_t count) {
    return run({&client}, [&] { return client.frames.size() >= count; });
  }
  bool run_to_end(WebSocketClient& client) {
    return run({&client}, [&] { return client.ended; }) && !client.cut;
  }
  /// Lets everything happen that can happen without a wait: loopback delivers within the system calls.
  void settle(std::initializer_list<WebSocketClient*> clients = {}) {
    for (int i = 0; i < 20; ++i) {
      for (auto* const client : clients) client->step();
      server->poll(milliseconds(1), milliseconds(0));
    }
  }
  Channel last() const { return handler.channels.back(); }

  FakeClock clock;
  transport::Limits limits;
  Handler handler;
  std::unique_ptr<transport::Transport> server;
};

std::string kinds(const std::deque<Frame>& frames) {
  std::string text;
  for (const auto& frame : frames) text += "c t b . . . . . x i o"[frame.opcode * 2];
  return text;
}

const std::string euro = "\xE2\x82\xAC";

}  // namespace

// ------------------------------------------------------------------------------------------------------------- handshake

TEST_CASE("a handshake gets 101, the handler's fields and Date, and what the handler has for the channel", "[transport][R0.12][R0.14]") {
  Host host;
  CHECK(host.server->capabilities().websocket);
  auto client = host.connect();
  client->send(WebSocketClient::handshake("/arm"));
  REQUIRE(host.run({client.get()}, [&] { return client->status != 0; }));
  CHECK(client->status == 101);
  CHECK(client->head.find("HTTP/1.1 101 Switching Protocols\r\n") == 0);
  CHECK(client->head.find("\r\nDate: ") != std::string::npos);
  CHECK(client->head.find("\r\nLocation: /subscriptions/1\r\n") != std::string::npos);
  CHECK(client->head.find("\r\nServer:") == std::string::npos);
  host.handler.say(host.last(), "first");
  host.server->waker()->wake();
  REQUIRE(host.run_to_frames(*client, 1));
  CHECK(client->frames[0].payload == "first");
  CHECK(client->frames[0].opcode == Frame::text);
  CHECK(client->frames[0].fin);
}

TEST_CASE("frames that arrive with the handshake are not lost, however the bytes are split", "[transport][R0.12]") {
  Host host;
  const std::string bytes = WebSocketClient::handshake("/echo") + Frame{Frame::text, "first"}.bytes() + Frame{Frame::ping, "p"}.bytes() +
                            Frame{Frame::binary, std::string(3000, 'b')}.bytes();
  const std::size_t head = WebSocketClient::handshake("/echo").size();
  for (std::size_t at = 1; at <= bytes.size(); at += at < head + 40 ? 1 : 499) {
    auto client = host.connect();
    client->send(bytes.substr(0, at));
    client->step();
    host.server->poll(milliseconds(1), milliseconds(0));
    client->send(bytes.substr(at));
    const bool whole = host.run_to_frames(*client, 3);
    if (!whole || client->frames[0].payload + client->frames[1].payload != "firstp" || client->frames[2].payload.size() != 3000) {
      FAIL("split at " << at << ": " << kinds(client->frames));
    }
  }
  auto client = host.connect();  // a byte at a time
  for (const char byte : bytes.substr(0, head + 40)) {
    client->send(std::string_view(&byte, 1));
    client->step();
    host.server->poll(milliseconds(1), milliseconds(0));
  }
  client->send(bytes.substr(head + 40));
  REQUIRE(host.run_to_frames(*client, 3));
  CHECK(kinds(client->frames) == "tob");
}

TEST_CASE("many frames that arrive with the handshake are not lost", "[transport][R0.12]") {
  auto options = on_any_port();
  options.limits.max_websocket_messages = 10'000;
  Host host(options);
  auto client = host.connect();
  std::string bytes = WebSocketClient::handshake("/echo");
  for (int i = 0; i < 2000; ++i) bytes += Frame{Frame::text, std::to_string(i)}.bytes();
  client->send(bytes);
  REQUIRE(host.run_to_frames(*client, 2000));
  for (int i = 0; i < 2000; ++i) REQUIRE(client->frames[static_cast<std::size_t>(i)].payload == std::to_string(i));
}

TEST_CASE("a refused handshake leaves a connection that can try again", "[transport][R0.1][R0.12]") {
  Host host;
  const auto instead = [](std::string text, std::string_view what, std::string_view by) { return text.replace(text.find(what), what.size(), by); };
  const std::pair<int, std::string> cases[] = {
      {426, instead(WebSocketClient::handshake("/echo"), "Version: 13", "Version: 8")},
      {400, instead(WebSocketClient::handshake("/echo"), WebSocketClient::key, "c2hvcnQ=")},
      {400, instead(WebSocketClient::handshake("/echo"), "keep-alive, Upgrade", "keep-alive")},
      {200, instead(WebSocketClient::handshake("/echo"), "Upgrade: websocket", "Upgrade: h2c")},
  };
  for (const auto& [status, bytes] : cases) {
    INFO(bytes);
    auto refused = host.connect();
    refused->send(bytes);
    REQUIRE(host.run({refused.get()}, [&] { return refused->status != 0; }));
    CHECK(refused->status == status);
    CHECK_FALSE(refused->ended);
    auto again = host.connect();
    again->answers_before = 1;
    again->send(bytes + WebSocketClient::handshake("/echo") + Frame{Frame::text, "now"}.bytes());
    REQUIRE(host.run_to_frames(*again, 1));
    CHECK(again->frames[0].payload == "now");
  }
}

TEST_CASE("requests before the upgrade get their responses first", "[transport][R0.1][R0.12]") {
  Host host;
  auto client = host.connect();
  client->answers_before = 3;
  const std::string get = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  client->send(get + get + "POST /x HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\n\r\nabc" + WebSocketClient::handshake("/echo") +
               Frame{Frame::text, "after"}.bytes());
  REQUIRE(host.run_to_frames(*client, 1));
  CHECK(client->answers_before == 0);
  CHECK(client->status == 101);
  CHECK(client->frames[0].payload == "after");
  CHECK(host.handler.requests == 4);
}

TEST_CASE("an upgrade that was deferred keeps its handshake and the frames that came meanwhile", "[transport][R0.12]") {
  Host host;
  auto client = host.connect();
  client->answers_before = 1;
  client->send("GET / HTTP/1.1\r\nHost: a\r\n\r\n" + WebSocketClient::handshake("/later") + Frame{Frame::text, "early"}.bytes());
  REQUIRE(host.run({client.get()}, [&] { return !host.handler.tickets.empty(); }));
  client->send_text("later");
  host.settle({client.get()});
  CHECK(client->status == 0);
  host.handler.accept(0);
  host.server->waker()->wake();
  REQUIRE(host.run_to_frames(*client, 2));
  CHECK(client->frames[0].payload == "early");
  CHECK(client->frames[1].payload == "later");
}

TEST_CASE("a deferred upgrade may be refused after all", "[transport][R0.12]") {
  Host host;
  auto client = host.connect();
  client->answers_before = 1;
  client->send(WebSocketClient::handshake("/later") + WebSocketClient::handshake("/echo") + Frame{Frame::text, "x"}.bytes());
  REQUIRE(host.run({client.get()}, [&] { return !host.handler.tickets.empty(); }));
  http::Response response;
  response.status = 406;
  host.handler.replies.push_back({host.handler.tickets[0], response, std::nullopt});
  host.server->waker()->wake();
  REQUIRE(host.run_to_frames(*client, 1));
  CHECK(client->before.find("HTTP/1.1 406 ") == 0);
}

TEST_CASE("a client that is gone before its deferred upgrade comes: abandoned, and the channel is closed", "[transport][R0.12]") {
  Host host;
  auto client = host.connect();
  client->send(WebSocketClient::handshake("/later"));
  REQUIRE(host.run({client.get()}, [&] { return !host.handler.tickets.empty(); }));
  client->reset();
  host.settle();
  CHECK(host.handler.abandoned == host.handler.tickets);
  host.handler.accept(0);
  host.server->waker()->wake();
  host.settle();
  CHECK(host.handler.open.empty());
}

TEST_CASE("a client that half-closed before its deferred upgrade comes is gone as soon as it is one", "[transport][R0.12]") {
  Host host;
  auto client = host.connect();
  client->send(WebSocketClient::handshake("/later"));
  REQUIRE(host.run({client.get()}, [&] { return !host.handler.tickets.empty(); }));
  client->half_close();
  host.settle({client.get()});
  host.handler.accept(0);
  host.server->waker()->wake();
  REQUIRE(host.run_to_end(*client));
  CHECK(host.handler.open.empty());
}

TEST_CASE("what is no handshake does not become a WebSocket, whatever the handler says", "[transport][R0.12]") {
  Host host;
  for (const std::string request : {"GET /forced HTTP/1.1\r\nHost: a\r\n\r\n", "POST /forced HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\nx"}) {
    auto client = host.connect();
    client->send(request);
    REQUIRE(host.run_to_end(*client));
    CHECK(client->status == 500);
    CHECK(host.handler.could_upgrade);
  }
  auto old = host.connect();
  auto text = WebSocketClient::handshake("/forced");
  old->send(text.replace(text.find("HTTP/1.1"), 8, "HTTP/1.0"));
  REQUIRE(host.run_to_end(*old));
  CHECK(old->status == 500);
  CHECK_FALSE(host.handler.could_upgrade);
  CHECK(host.handler.channels.size() == 3);
  CHECK(host.handler.open.empty());
}

// -------------------------------------------------------------------------------------------------------------- messages

TEST_CASE("messages of every length and kind are echoed as they came", "[transport][R0.14]") {
  auto options = on_any_port();
  options.limits.max_websocket_message_bytes = 1'000'000;
  Host host(options);
  auto client = host.open();
  for (const std::size_t size : {0, 1, 125, 126, 127, 1535, 1536, 1537, 65535, 65536, 65537, 200'000, 1'000'000}) {
    for (const unsigned kind : {Frame::text, Frame::binary}) {
      INFO(size << ' ' << kind);
      std::string payload;
      while (payload.size() < size) payload += kind == Frame::text ? static_cast<char>('a' + payload.size() % 26) : static_cast<char>(payload.size());
      client->frames.clear();
      client->send(Frame{kind, payload});
      REQUIRE(host.run_to_frames(*client, 1));
      CHECK(client->frames[0].opcode == kind);
      CHECK((client->frames[0].payload == payload));
      CHECK(client->frames[0].fin);
    }
  }
  client->frames.clear();
  client->send_text("\xF0\x9F\xA4\x96 " + euro);
  REQUIRE(host.run_to_frames(*client, 1));
  CHECK(client->frames[0].payload == "\xF0\x9F\xA4\x96 " + euro);
}

TEST_CASE("a fragmented message is assembled, and control frames in between get a response at once", "[transport][R0.14]") {
  Host host;
  auto client = host.open();
  client->send(Frame{Frame::text, "one ", false});
  client->send(Frame{Frame::ping, "here?"});
  client->send(Frame{Frame::continuation, "", false});
  client->send(Frame{Frame::continuation, "two ", false});
  client->send(Frame{Frame::pong, "unasked"});
  client->send(Frame{Frame::ping, std::string(125, 'p')});
  REQUIRE(host.run_to_frames(*client, 2));
  CHECK(kinds(client->frames) == "oo");
  CHECK(client->frames[0].payload == "here?");
  CHECK(client->frames[1].payload == std::string(125, 'p'));
  client->send(Frame{Frame::continuation, "three"});
  REQUIRE(host.run_to_frames(*client, 3));
  CHECK(client->frames[2].payload == "one two three");
  client->send(Frame{Frame::binary, "", false});
  client->send(Frame{Frame::continuation, ""});
  REQUIRE(host.run_to_frames(*client, 4));
  CHECK(client->frames[3].opcode == Frame::binary);
  CHECK(client->frames[3].payload.empty());
}

TEST_CASE("frames have one meaning however the bytes are split", "[transport]") {
  Host host;
  const std::string bytes = Frame{Frame::text, "a" + euro, false}.bytes() + Frame{Frame::ping, "x"}.bytes() +
                            Frame{Frame::continuation, euro + "b"}.bytes() + Frame{Frame::binary, std::string(130, 'c')}.bytes() +
                            Frame{Frame::close, close_payload(1000, "bye")}.bytes();
  for (std::size_t at = 1; at < bytes.size(); ++at) {
    auto client = host.open();
    client->send(bytes.substr(0, at));
    host.settle({client.get()});
    client->send(bytes.substr(at));
    REQUIRE(host.run_to_end(*client));
    if (kinds(client->frames) != "otbx" || client->frames[1].payload != "a" + euro + euro + "b" || client->close_code() != 1000)
      FAIL("split at " << at << ": " << kinds(client->frames));
  }
  CHECK(host.handler.open.empty());
}

TEST_CASE("hundreds of pings in one segment all get pongs", "[transport]") {
  auto options = on_any_port();
  options.limits.max_websocket_messages = 4000;
  Host host(options);
  auto client = host.open();
  std::string bytes;
  for (int i = 0; i < 3000; ++i) bytes += Frame{Frame::ping, std::to_string(i)}.bytes();
  client->send(bytes);
  REQUIRE(host.run_to_frames(*client, 3000));
  for (std::size_t i = 0; i < 3000; ++i) REQUIRE(client->frames[i].payload == std::to_string(i));
}

TEST_CASE("the handler is called for more after each message, and channels it names are served in its order", "[transport]") {
  Host host;
  auto first = host.open("/a");
  const auto a = host.last();
  auto second = host.open("/b");
  const auto b = host.last();
  host.handler.say(b, "b1");
  host.handler.say(a, "a1");
  host.handler.say(b, "b2");
  for (int i = 0; i < 30; ++i) host.handler.say(a, std::to_string(i));  // more than one turn
  Push binary{std::make_shared<const std::string>("\x00\xFF"), false};
  host.handler.say(b, binary);
  host.handler.say(b, Push{});  // no message is an empty one
  host.settle({first.get(), second.get()});
  REQUIRE(first->frames.size() == 31);
  CHECK(first->frames[30].payload == "29");
  REQUIRE(second->frames.size() == 4);
  CHECK(second->frames[1].payload == "b2");
  CHECK(second->frames[2].opcode == Frame::binary);
  CHECK(second->frames[3].payload.empty());
  CHECK(host.handler.alive_messages() == 0);
}

// ---------------------------------------------------------------------------------------------------------------- limits

TEST_CASE("a message above the limit is closed with 1009, before it has come", "[transport]") {
  Host host;
  const auto limit = host.limits.max_websocket_message_bytes;
  auto fits = host.open();
  fits->send_text(std::string(limit, 'x'));
  REQUIRE(host.run_to_frames(*fits, 1));
  CHECK(fits->frames[0].payload.size() == limit);

  auto whole = host.open();
  whole->send_text(std::string(limit + 1, 'x'));
  auto announced = host.open();
  announced->send(Frame{Frame::binary, "only this", true, 0, true, 8, std::uint64_t{1} << 40});
  auto parts = host.open();
  parts->send(Frame{Frame::text, std::string(limit, 'x'), false});
  parts->send(Frame{Frame::continuation, "x", false});
  auto huge = host.open();
  huge->send_text(std::string(10'000'000, 'x'));  // the close must reach a client that still sends
  for (auto* const client : {whole.get(), announced.get(), parts.get(), huge.get()}) {
    REQUIRE(host.run({client}, [&] { return client->close_code() != 0; }));
    CHECK(client->close_code() == 1009);
    CHECK_FALSE(client->failed);
  }
  CHECK(host.handler.messages.size() == 1);
  CHECK(host.handler.open.size() == 1);
}

TEST_CASE("text that is no UTF-8 is closed with 1007, also when a character is split", "[transport]") {
  Host host;
  const std::vector<std::vector<Frame>> bad = {
      {{Frame::text, "a\xFF"}},
      {{Frame::text, "\xC0\xAF"}},
      {{Frame::text, "\xED\xA0\x80"}},
      {{Frame::text, "\xF4\x90\x80\x80"}},
      {{Frame::text, "ends within \xE2\x82"}},
      {{Frame::text, "\xE2\x82", false}, {Frame::continuation, "x"}},
      {{Frame::text, "\xE2", false}, {Frame::ping, ""}, {Frame::continuation, "\x82", false}, {Frame::continuation, ""}},
      {{Frame::text, "good", false}, {Frame::continuation, "\x80", false}},  // as soon as it is known
  };
  for (const auto& frames : bad) {
    auto client = host.open();
    for (const auto& frame : frames) client->send(frame);
    REQUIRE(host.run({client.get()}, [&] { return client->close_code() != 0; }));
    CHECK(client->close_code() == 1007);
    client->send_close(1007);
    REQUIRE(host.run_to_end(*client));
    CHECK_FALSE(client->failed);
  }
  CHECK(host.handler.messages.empty());
  CHECK(host.handler.open.empty());
  auto client = host.open();
  client->send(Frame{Frame::text, "\xE2", false});
  client->send(Frame{Frame::continuation, "\x82", false});
  client->send(Frame{Frame::continuation, "\xAC"});
  client->send(Frame{Frame::binary, "\xFF\xFE"});
  REQUIRE(host.run_to_frames(*client, 2));
  CHECK(client->frames[0].payload == euro);
}

TEST_CASE("what no client may send is closed with 1002", "[transport]") {
  Host host;
  std::vector<std::pair<std::string, std::vector<Frame>>> bad = {
      {"unmasked", {{Frame::text, "x", true, 0, false}}},
      {"unmasked ping", {{Frame::ping, "x", true, 0, false}}},
      {"rsv1", {{Frame::text, "x", true, 4}}},
      {"rsv2", {{Frame::text, "x", true, 2}}},
      {"rsv3", {{Frame::ping, "x", true, 1}}},
      {"fragmented ping", {{Frame::ping, "x", false}}},
      {"fragmented close", {{Frame::close, "", false}}},
      {"long ping", {{Frame::ping, std::string(126, 'x')}}},
      {"long pong", {{Frame::pong, "", true, 0, true, 8, 70'000}}},
      {"long close", {{Frame::close, close_payload(1000, std::string(124, 'x'))}}},
      {"continuation of nothing", {{Frame::continuation, "x"}}},
      {"continuation after the end", {{Frame::text, "x", false}, {Frame::continuation, "x"}, {Frame::continuation, "x"}}},
      {"message within another", {{Frame::text, "x", false}, {Frame::binary, "x"}}},
      {"length of 16 bits for 7", {{Frame::text, "x", true, 0, true, 2}}},
      {"length of 64 bits for 16", {{Frame::text, std::string(200, 'x'), true, 0, true, 8}}},
      {"length with the highest bit", {{Frame::text, "x", true, 0, true, 8, std::uint64_t{1} << 63}}},
      {"half a close code", {{Frame::close, "\x03"}}},
      {"a reason that is no UTF-8", {{Frame::close, close_payload(1000, "\xFF")}}},
  };
  for (const unsigned opcode : {3, 4, 5, 6, 7, 11, 12, 13, 14, 15}) bad.push_back({"opcode " + std::to_string(opcode), {{opcode, "x"}}});
  for (const unsigned code : {0, 999, 1004, 1005, 1006, 1014, 1015, 1016, 1100, 2000, 2999})
    bad.push_back({"close code " + std::to_string(code), {{Frame::close, close_payload(code)}}});
  for (const auto& [name, frames] : bad) {
    INFO(name);
    auto client = host.open();
    for (const auto& frame : frames) client->send(frame);
    REQUIRE(host.run_to_end(*client));
    CHECK(client->close_code() == (name == "length with the highest bit" ? 1009 : 1002));
    CHECK_FALSE(client->failed);
  }
  CHECK(host.handler.open.empty());
  CHECK(host.handler.channels.size() == bad.size());
}

TEST_CASE("a client that talks too much is closed with 1008", "[transport]") {
  auto options = on_any_port();
  options.limits.max_websocket_messages = 4;
  Host host(options);
  auto quiet = host.open();
  auto client = host.open();
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 3; ++i) client->send_text("x");
    client->send(Frame{Frame::ping, "counts as one"});
    REQUIRE(host.run_to_frames(*client, static_cast<std::size_t>(round + 1) * 4));
    host.clock.advance(host.limits.ping_interval);
    client->send(Frame{Frame::pong, ""});
    quiet->send(Frame{Frame::pong, ""});
    host.settle({client.get(), quiet.get()});
  }
  CHECK(client->close_code() == 0);
  for (int i = 0; i < 4; ++i) client->send_text("y");
  client->send_text("not received");
  REQUIRE(host.run({client.get()}, [&] { return client->close_code() != 0; }));
  CHECK(client->close_code() == 1008);
  client->send_close(1008);
  REQUIRE(host.run_to_end(*client));
  CHECK(host.handler.messages.size() == 13);
  CHECK(host.handler.open.size() == 1);
  quiet->send_text("still here");
  REQUIRE(host.run({quiet.get()}, [&] { return host.handler.messages.size() == 13; }));
}

TEST_CASE("a WebSocket needs no further descriptor", "[transport][R0.12]") {
  Host host;
  const auto early = host.open();
  const auto client = host.connect();
  host.settle({client.get()});
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::dup(0);
  ::close(next);
  rlimit full = before;
  full.rlim_cur = static_cast<rlim_t>(next);
  ::setrlimit(RLIMIT_NOFILE, &full);
  client->send(WebSocketClient::handshake("/echo"));
  const bool answered = host.run({client.get()}, [&] { return client->status != 0; });
  ::setrlimit(RLIMIT_NOFILE, &before);
  REQUIRE(answered);
  CHECK(client->status == 101);
  CHECK(host.handler.open.size() == 2);
  const auto late = host.open();
  early->send_text("still here");
  REQUIRE(host.run_to_frames(*early, 1));
}

TEST_CASE("pings are counted as messages are, and many of them are not one step of a poll", "[transport]") {
  auto options = on_any_port();
  options.limits.max_websocket_messages = 1000;
  Host host(options);
  auto client = host.open();
  std::string bytes;
  for (int i = 0; i < 1300; ++i) bytes += Frame{Frame::ping, ""}.bytes();
  client->send(bytes);
  while (!client->all_sent()) client->step();
  const auto pongs = [&] {
    return std::count_if(client->frames.begin(), client->frames.end(), [](const Frame& f) { return f.opcode == Frame::pong; });
  };
  for (auto before = pongs(), polls = pongs(); client->close_code() == 0; before = pongs()) {
    host.server->poll(std::chrono::microseconds(0), milliseconds(0));
    client->step();
    CHECK(pongs() - before <= 2);
    REQUIRE(++polls < 10'000);
  }
  CHECK(client->close_code() == 1008);
  CHECK(pongs() <= 1001);
  CHECK(pongs() >= 990);
}

TEST_CASE("a WebSocket counts as a connection, and is not closed for a new one", "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 2;
  Host host(options);
  auto first = host.open();
  auto second = host.open();
  auto third = host.connect();
  third->send(WebSocketClient::handshake("/echo"));
  REQUIRE(host.run_to_end(*third));
  CHECK(third->status == 503);
  first->send_text("still here");
  REQUIRE(host.run_to_frames(*first, 1));
  second->end();
  host.settle();
  auto fourth = host.open();
  CHECK(host.handler.open.size() == 2);
}

// --------------------------------------------------------------------------------------------------------------- closing

TEST_CASE("a client that closes gets its code back, and the connection ends without a reset", "[transport][R0.14]") {
  Host host;
  for (const unsigned code : {1000, 1001, 1011, 3000, 4999, 0}) {
    INFO(code);
    auto client = host.open();
    if (code == 0) client->send(Frame{Frame::close, ""});
    else client->send_close(code, "because");
    client->send_text("after the close");
    REQUIRE(host.run_to_end(*client));
    // The response to a close without a code may have none (RFC 6455 5.5.1), or 1000.
    CHECK((client->close_code() == code || (code == 0 && (client->close_code() == 1000 || client->close_code() == 1005))));
    CHECK_FALSE(client->failed);
    client->end();
  }
  CHECK(host.handler.messages.empty());
  CHECK(host.handler.open.empty());
}

TEST_CASE("the handler closes with its code and reason, after its earlier messages", "[transport][R0.14]") {
  Host host;
  auto client = host.open();
  host.handler.say(host.last(), "last words");
  host.handler.say(host.last(), Push{nullptr, true, 1000, "deleted"});
  REQUIRE(host.run_to_frames(*client, 2));
  CHECK(client->frames[0].payload == "last words");
  CHECK(client->close_code() == 1000);
  CHECK(client->close_reason() == "deleted");
  client->send_text("not received: the channel is closing");
  client->send(Frame{Frame::ping, "not answered"});
  host.settle({client.get()});
  CHECK_FALSE(client->ended);
  client->send_close(1000);
  REQUIRE(host.run_to_end(*client));
  CHECK_FALSE(client->failed);
  CHECK(host.handler.messages.empty());
  CHECK(host.handler.open.empty());

  auto clipped = host.open();  // RFC 6455 5.5: 125 bytes with the code
  std::string reason = "x";
  while (reason.size() < 200) reason += euro;
  host.handler.say(host.last(), Push{nullptr, true, 4001, reason});
  REQUIRE(host.run_to_frames(*clipped, 1));
  CHECK(clipped->close_reason() == reason.substr(0, 121));
}

TEST_CASE("both may close at once", "[transport][R0.14]") {
  Host host;
  auto client = host.open();
  client->send_close(3001);
  client->step();
  host.handler.say(host.last(), Push{nullptr, true, 1000, ""});
  REQUIRE(host.run_to_end(*client));
  CHECK((client->close_code() == 3001 || client->close_code() == 1000));
  CHECK(kinds(client->frames) == "x");
  CHECK(host.handler.open.empty());
}

TEST_CASE("the client's half of a close is awaited for close_timeout", "[transport]") {
  Host host;
  auto mute = host.open();
  host.handler.say(host.last(), Push{nullptr, true, 1000, ""});
  auto babbling = host.open();
  host.handler.say(host.last(), Push{nullptr, true, 1000, ""});
  auto open_end = host.open();  // responds, and does not end the connection
  host.handler.say(host.last(), Push{nullptr, true, 1000, ""});
  open_end->send_close(1000);
  host.settle({mute.get(), babbling.get(), open_end.get()});
  REQUIRE(mute->close_code() == 1000);
  CHECK(open_end->ended);
  host.clock.advance(host.limits.close_timeout - milliseconds(1));
  babbling->send_text("no close");
  host.settle({mute.get(), babbling.get()});
  CHECK_FALSE(mute->ended);
  CHECK_FALSE(babbling->ended);
  CHECK(host.handler.open.size() == 2);  // the one with a response is over
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == milliseconds(1));
  host.clock.advance(milliseconds(1));
  REQUIRE(host.run_to_end(*mute));
  REQUIRE(host.run_to_end(*babbling));
  CHECK(host.handler.open.empty());
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == milliseconds::max());  // no client is left, nothing is due
}

// ------------------------------------------------------------------------------------------------------------- keep-alive

TEST_CASE("a silent client is pinged, and dropped when nothing comes", "[transport]") {
  Host host;
  auto lively = host.open();
  auto dead = host.open();
  auto trickling = host.open();
  const std::string frame = Frame{Frame::text, "a long story"}.bytes();
  const auto all = {lively.get(), dead.get(), trickling.get()};
  host.settle(all);
  host.clock.advance(host.limits.ping_interval - milliseconds(1));
  host.settle(all);
  CHECK(lively->frames.empty());
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == milliseconds(1));
  trickling->send(frame.substr(0, 1));  // any byte is a sign of life
  host.settle(all);
  host.clock.advance(milliseconds(1));
  host.settle(all);
  CHECK(kinds(lively->frames) == "i");
  CHECK(kinds(dead->frames) == "i");
  CHECK(trickling->frames.empty());
  lively->send(Frame{Frame::pong, ""});
  host.settle(all);
  host.clock.advance(host.limits.pong_timeout - milliseconds(1));
  trickling->send(frame.substr(1, 1));
  host.settle(all);
  CHECK_FALSE(dead->ended);
  CHECK(host.handler.open.size() == 3);
  host.clock.advance(milliseconds(1));
  host.settle(all);
  CHECK(dead->ended);
  CHECK(host.handler.open.size() == 2);
  trickling->send(frame.substr(2));
  REQUIRE(host.run_to_frames(*trickling, 1));
  CHECK(trickling->frames[0].payload == "a long story");
  lively->send_text("still here");
  REQUIRE(host.run_to_frames(*lively, 2));
}

TEST_CASE("a client that was pinged and says something else lives, and is pinged again", "[transport]") {
  Host host;
  auto client = host.open();
  for (int round = 0; round < 3; ++round) {
    client->frames.clear();
    host.clock.advance(host.limits.ping_interval);
    host.settle({client.get()});
    REQUIRE(kinds(client->frames) == "i");
    client->send(Frame{Frame::ping, ""});
    host.settle({client.get()});
    host.clock.advance(host.limits.pong_timeout);
    host.settle({client.get()});
    CHECK(kinds(client->frames) == "io");
    client->send(Frame{Frame::pong, ""});
    host.settle({client.get()});
  }
  CHECK_FALSE(client->ended);
}

TEST_CASE("a connection stays open while its client responds to pings", "[transport]") {
  Host host;
  auto client = host.open();
  for (int round = 0; round < 20; ++round) {
    host.clock.advance(host.limits.ping_interval);
    host.settle({client.get()});
    REQUIRE(kinds(client->frames) == "i");
    host.clock.advance(host.limits.pong_timeout - milliseconds(1));
    client->send(Frame{Frame::pong, client->frames[0].payload});
    host.settle({client.get()});
    client->frames.clear();
  }
  CHECK_FALSE(client->ended);
  CHECK(host.handler.open.size() == 1);
}

TEST_CASE("a client that does not read costs one message on its way, and is dropped after write_timeout", "[transport]") {
  auto options = on_any_port();
  options.limits.ping_interval = options.limits.write_timeout * 10;  // not what is looked at
  Host host(options);
  auto stuck = host.open("/a", 4096);
  const auto channel = host.last();
  auto other = host.open();
  stuck->paused = true;
  host.handler.open[channel].endless = 1'000'000;
  host.handler.make_ready(channel);
  const auto pushed = [&] { return host.handler.open[channel].pushed; };
  for (std::size_t before = 0; before != pushed() || before == 0;) {
    before = pushed();
    host.settle({stuck.get(), other.get()});
  }
  const auto most = pushed();
  CHECK(host.handler.alive_messages() <= 1);
  host.handler.make_ready(channel);  // again and again, to no avail
  host.clock.advance(host.limits.write_timeout - milliseconds(1));
  host.settle({other.get()});
  CHECK(pushed() == most);
  CHECK(host.handler.alive_messages() <= 1);
  other->send_text("me");
  REQUIRE(host.run_to_frames(*other, 1));
  CHECK(host.handler.open.size() == 2);
  host.clock.advance(milliseconds(1));
  host.settle();
  CHECK(host.handler.open.size() == 1);
  CHECK(host.handler.alive_messages() == 0);
  other->send_text("me");
  REQUIRE(host.run_to_frames(*other, 2));
}

TEST_CASE("a client that reads slowly gets every message whole", "[transport]") {
  auto options = on_any_port();
  options.limits.ping_interval = options.limits.write_timeout * 100;
  Host host(options);
  auto client = host.open("/a", 4096);
  client->paused = true;
  for (int i = 0; i < 12; ++i) host.handler.say(host.last(), std::string(1'000'000, static_cast<char>('a' + i)));
  client->send(Frame{Frame::ping, "between"});  // its pong waits for the message that is being sent
  host.settle({client.get()});
  CHECK(host.handler.open[host.last()].queue.size() > 0);
  for (int i = 0; i < 4; ++i) {  // never done, always some progress
    host.clock.advance(host.limits.write_timeout - milliseconds(1));
    client->paused = false;
    const auto before = client->frames.size();
    REQUIRE(host.run_to_frames(*client, before + 1));
    client->paused = true;
    host.settle();
  }
  client->paused = false;
  REQUIRE(host.run_to_frames(*client, 13));
  char expected = 'a';
  for (const auto& frame : client->frames) {
    if (frame.opcode == Frame::pong) continue;
    CHECK(frame.payload.size() == 1'000'000);
    CHECK(frame.payload[0] == expected++);
  }
}

TEST_CASE("a client that does not read cannot keep a close or the end of the server from happening", "[transport]") {
  auto options = on_any_port();
  options.limits.stop_timeout = milliseconds(20);
  Host host(options);
  auto stuck = host.open("/a", 4096);
  stuck->paused = true;
  host.handler.open[host.last()].endless = 1'000'000;
  host.handler.make_ready(host.last());
  host.settle({stuck.get()});
  host.settle({stuck.get()});
  SECTION("too many messages") {
    for (std::size_t i = 0; i <= host.limits.max_websocket_messages; ++i) stuck->send_text("x");
    host.settle({stuck.get()});
    CHECK(host.handler.open.size() == 1);
    host.clock.advance(host.limits.close_timeout);
    host.settle({stuck.get()});
  }
  SECTION("a protocol error") {
    stuck->send(Frame{3, "x"});
    host.settle({stuck.get()});
    CHECK(host.handler.open.size() == 1);
    host.clock.advance(host.limits.write_timeout);
    host.settle({stuck.get()});
  }
  SECTION("the client closes") {
    stuck->send_close(1000);
    host.settle({stuck.get()});
    host.clock.advance(host.limits.write_timeout);
    host.settle({stuck.get()});
  }
  SECTION("the client vanishes") {
    stuck->reset();
    host.settle();
  }
  SECTION("the client half-closes") {
    stuck->half_close();
    host.settle();
  }
  SECTION("the server stops") { host.server->stop(); }
  CHECK(host.handler.open.empty());
  CHECK(host.handler.alive_messages() == 0);
}

// --------------------------------------------------------------------------------------------------------------- fairness

namespace {

/// Twenty clients that want the newest value, and how many values were sent to each.
struct Audience {
  Audience() {
    for (int i = 0; i < 20; ++i) {
      clients.push_back(host.open("/a"));
      sent[host.last()];
    }
    host.settle();
  }
  /// Gives a value to those that have none waiting, in one order each time, as the engine names the observers of a resource.
  void publish() {
    for (auto& [channel, count] : sent) {
      if (!host.handler.open[channel].queue.empty()) continue;
      ++count;
      host.handler.say(channel, "x");
    }
  }

  Host host;
  std::vector<std::unique_ptr<WebSocketClient>> clients;
  std::map<engine::Channel, std::size_t> sent;
};

}  // namespace

TEST_CASE("poll leaves the channels that its budget does not cover to the next poll, which does not wait", "[transport]") {
  Host host;
  std::vector<std::unique_ptr<WebSocketClient>> clients;
  for (int i = 0; i < 20; ++i) clients.push_back(host.open("/a"));
  host.settle();
  for (const auto channel : host.handler.channels) {
    host.handler.say(channel, "1");
    host.handler.say(channel, "2");
  }
  host.server->waker()->wake();
  host.server->poll(microseconds(0), milliseconds(0));
  for (int polls = 0; host.handler.pushed < 40; ++polls) {
    REQUIRE(polls < 100);
    const auto before = host.handler.pushed;
    const auto due = host.server->poll(microseconds(0), std::chrono::minutes(10));
    CHECK(host.handler.pushed - before <= 2);  // one client's
    CHECK((due == milliseconds(0) || host.handler.pushed == 40));
  }
  host.settle();
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == host.limits.ping_interval);
  for (auto& client : clients) {
    client->step();
    CHECK(kinds(client->frames) == "tt");
  }
}

TEST_CASE("a channel that always has more does not keep the others waiting", "[transport]") {
  Host host;
  auto greedy = host.open("/a");
  const auto endless = host.last();
  auto modest = host.open("/b");
  host.handler.open[endless].endless = 10;
  host.handler.make_ready(endless);
  host.server->poll(microseconds(0), milliseconds(0));
  host.handler.say(host.last(), "me too");
  for (int polls = 0; modest->frames.empty(); ++polls) {
    REQUIRE(polls < 10);
    host.server->poll(microseconds(0), milliseconds(0));
    for (auto* const client : {greedy.get(), modest.get()}) client->step();
  }
  auto http = host.connect();
  http->send("GET / HTTP/1.1\r\nHost: a\r\n\r\n");
  REQUIRE(host.run({greedy.get(), http.get()}, [&] { return http->body == "hello"; }));
  host.handler.open[endless].endless = 0;
}

TEST_CASE("what a small budget can send is shared by all clients that always have a new value", "[transport]") {
  Audience all;
  auto& [host, clients, sent] = all;
  const std::size_t rounds = 30;
  for (std::size_t poll = 0; poll < rounds * clients.size(); ++poll) {
    all.publish();
    host.server->poll(microseconds(0), milliseconds(0));
    clients[poll % clients.size()]->step();
  }
  for (const auto& [channel, count] : sent) {
    CHECK(count >= rounds);
    CHECK(count <= rounds + 2);
  }
}

TEST_CASE("clients that become ready together, more than are served until the next value, get equally many", "[transport]") {
  Audience all;
  auto& [host, clients, sent] = all;
  const std::size_t values = 200, served = 15;  // of 20 clients
  for (std::size_t value = 0; value < values; ++value) {
    all.publish();
    for (std::size_t poll = 0; poll < served; ++poll) host.server->poll(microseconds(0), milliseconds(0));
    for (auto& client : clients) client->step();
  }
  for (const auto& [channel, count] : sent) {
    CHECK(count >= values * served / clients.size());
    CHECK(count <= values * served / clients.size() + 2);
  }
}

TEST_CASE("a client that talks fast does not keep the others waiting", "[transport]") {
  auto options = on_any_port();
  options.limits.max_websocket_messages = std::numeric_limits<std::size_t>::max();
  Host host(options);
  auto fast = host.open("/a");
  auto slow = host.open("/b");
  const auto b = host.last();
  host.settle();
  std::string flood;
  for (int i = 0; i < 5000; ++i) flood += Frame{Frame::text, "x"}.bytes();
  fast->send(flood);
  fast->step();
  slow->send_text("me");
  slow->step();
  const auto heard = [&] {
    return std::any_of(host.handler.messages.begin(), host.handler.messages.end(), [&](const auto& m) { return m.channel == b; });
  };
  for (int polls = 0; !heard(); ++polls) {
    REQUIRE(polls < 1000);
    host.server->poll(microseconds(0), milliseconds(0));
  }
  CHECK(host.handler.messages.size() < 5000);
  REQUIRE(host.run({fast.get()}, [&] { return host.handler.messages.size() == 5001; }));
}

// Not on a loop that waits for the descriptor: this handler's deadline, which is over, keeps it readable.
TEST_CASE("a wait for the handler ends when it is due, not at the next millisecond before or after", "[transport][former_deadline]") {
  Handler handler;
  transport::TransportOptions options;
  options.port = 0;
  const auto server = make_network(options);  // by the system's clock
  REQUIRE(server->start(handler));
  int early = 0;
  for (int i = 0; i < 50; ++i) {
    handler.deadline = std::chrono::steady_clock::now() + microseconds(1300);
    handler.asked_at = {};
    server->poll(milliseconds(1), std::chrono::seconds(10));
    if (handler.asked_at.steady < *handler.deadline) ++early;
  }
  CHECK(early <= 1);  // one poll may end by the wake of a former deadline
}

// ------------------------------------------------------------------------------------------------------------- vanishing

TEST_CASE("a client that vanishes in any state is noticed, and its channel closed once", "[transport]") {
  Host host;
  const std::string handshake = WebSocketClient::handshake("/echo");
  const std::string starts[] = {handshake,
                                handshake + "\x81",
                                handshake + Frame{Frame::text, "half", true, 0, true, -1, 100}.bytes(),
                                handshake + Frame{Frame::text, "part", false}.bytes(),
                                handshake + Frame{Frame::text, "whole"}.bytes(),
                                handshake + Frame{Frame::ping, "p"}.bytes(),
                                handshake + Frame{Frame::close, ""}.bytes(),
                                handshake + Frame{Frame::text, "\xFF"}.bytes(),
                                handshake + Frame{Frame::text, std::string(4000, 'x')}.bytes() + Frame{Frame::close, ""}.bytes()};
  std::size_t count = 0;
  for (const int how : {0, 1, 2}) {
    for (const bool at_once : {true, false}) {
      for (const bool closing : {true, false}) {
        for (const auto& start : starts) {
          auto client = host.connect();
          client->paused = true;
          client->send(start);
          client->step();
          if (!at_once) host.settle({client.get()});
          if (!at_once && closing && host.handler.open.count(host.last()) != 0) {
            host.handler.say(host.last(), Push{nullptr, true, 1000, "x"});
            host.settle();
          }
          if (how == 0) client->reset();
          else if (how == 1) client->end();
          else client->half_close();
          host.settle({client.get()});
          host.settle();
          if (!at_once || how != 0) ++count;
          INFO(how << at_once << closing << ' ' << start.substr(handshake.size()));
          CHECK(host.handler.open.empty());
        }
      }
    }
  }
  CHECK(host.handler.channels.size() >= count);
  auto other = host.open();
  other->send_text("x");
  REQUIRE(host.run_to_frames(*other, 1));
}

TEST_CASE("a push to a client that has just vanished has no effect on others", "[transport]") {
  Host host;
  for (int i = 0; i < 20; ++i) {
    auto client = host.open("/a");
    const auto channel = host.last();
    i % 2 == 0 ? client->reset() : client->end();
    for (int n = 0; n < 20; ++n) host.handler.say(channel, std::string(10'000, 'x'));
    host.server->waker()->wake();
    for (int n = 0; n < 3; ++n) host.server->poll(microseconds(0), milliseconds(0));
  }
  host.settle();
  CHECK(host.handler.open.empty());
}

// ---------------------------------------------------------------------------------------------------------------- the end

TEST_CASE("stop closes every WebSocket with 1001 and waits for the clients' closes", "[transport]") {
  Host host;
  auto polite = host.open();
  auto mute = host.open();
  auto talking = host.open();
  auto waiting = host.connect();
  waiting->send(WebSocketClient::handshake("/later"));
  auto too_late = host.connect();
  too_late->send(WebSocketClient::handshake("/later"));
  const auto all = {polite.get(), mute.get(), talking.get(), waiting.get(), too_late.get()};
  REQUIRE(host.run(all, [&] { return host.handler.tickets.size() == 2; }));
  talking->send_text("on its way");
  talking->step();
  bool answered = false;
  host.handler.meanwhile = [&] {
    for (auto* const client : all) client->step();
    if (!answered && polite->close_code() == 1001) polite->send_close(1001), polite->step(), answered = true;
    if (host.handler.channels.size() == 3) host.handler.accept(0);
  };
  host.server->stop();
  host.handler.meanwhile = nullptr;
  for (auto* const client : all) client->step();
  CHECK(host.handler.open.empty());
  CHECK(answered);
  CHECK(polite->ended);
  CHECK_FALSE(polite->failed);
  CHECK(mute->close_code() == 1001);
  CHECK(talking->close_code() == 1001);
  CHECK(waiting->status == 503);
  CHECK(too_late->status == 503);
  CHECK(host.handler.channels.size() == 4);
  CHECK(host.handler.abandoned == std::vector{host.handler.tickets[1]});

  REQUIRE(host.server->start(host.handler));  // and it can begin again
  auto again = host.open();
  again->send_text("again");
  REQUIRE(host.run_to_frames(*again, 1));
}

TEST_CASE("a transport that is destroyed closes its channels", "[transport]") {
  Host host;
  auto idle = host.open();
  auto half = host.open();
  half->send(Frame{Frame::text, "part", false});
  auto closing = host.open();
  host.handler.say(host.last(), Push{nullptr, true, 1000, ""});
  auto stuck = host.open("/a", 4096);
  stuck->paused = true;
  host.handler.open[host.last()].endless = 1'000'000;
  host.handler.make_ready(host.last());
  host.settle({idle.get(), half.get(), closing.get(), stuck.get()});
  CHECK(host.handler.open.size() == 4);
  host.server.reset();
  CHECK(host.handler.open.empty());
}

TEST_CASE("many sockets that open, talk and end in any order leave nothing behind", "[transport]") {
  auto options = on_any_port();
  options.limits.max_connections = 150;
  options.limits.max_websocket_messages = 1'000'000;
  Host host(options);
  std::mt19937 random(20261121);
  const auto pick = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  std::vector<std::unique_ptr<WebSocketClient>> clients;
  for (int step = 0; step < 6000; ++step) {
    if (clients.size() < 120 && pick(3) == 0) {
      clients.push_back(host.connect(pick(4) == 0 ? 4096 : 0));
      clients.back()->send(WebSocketClient::handshake(pick(5) == 0 ? "/later" : pick(2) == 0 ? "/echo" : "/a"));
    } else if (!clients.empty()) {
      const auto at = pick(clients.size());
      auto& client = *clients[at];
      switch (pick(12)) {
        case 0: client.send_text("hello"); break;
        case 1: client.send(Frame{Frame::binary, std::string(pick(4096), 'b')}); break;
        case 2: client.send(Frame{Frame::ping, "?"}); break;
        case 3: client.send(Frame{Frame::text, "part", false}); break;
        case 4: client.send_close(1000); break;
        case 5: client.reset(); break;
        case 6: client.end(); break;
        case 7: client.half_close(); break;
        case 8: client.paused = !client.paused; break;
        case 9:
          if (!host.handler.open.empty()) {
            auto found = std::next(host.handler.open.begin(), static_cast<std::ptrdiff_t>(pick(host.handler.open.size())));
            if (!found->second.closing) host.handler.say(found->first, std::string(pick(100'000), 'p'));
          }
          break;
        case 10:
          if (pick(4) == 0 && !host.handler.open.empty()) {
            auto found = std::next(host.handler.open.begin(), static_cast<std::ptrdiff_t>(pick(host.handler.open.size())));
            if (found->second.queue.empty() || found->second.queue.back().close == 0) {
              if (!found->second.closing) host.handler.say(found->first, Push{nullptr, true, 1000, "enough"});
            }
          }
          break;
        default:
          if (!host.handler.tickets.empty()) {
            host.handler.accept(host.handler.tickets.size() - 1);
            host.handler.tickets.pop_back();
          }
      }
      if (client.ended || pick(30) == 0) clients.erase(clients.begin() + static_cast<std::ptrdiff_t>(at));
    }
    if (pick(40) == 0) host.clock.advance(milliseconds(500));
    for (auto& client : clients) client->step();
    host.server->poll(microseconds(pick(3) * 100), milliseconds(0));
  }
  CHECK(host.handler.channels.size() > 100);
  clients.clear();
  host.settle();
  host.clock.advance(host.limits.write_timeout + host.limits.ping_interval + host.limits.pong_timeout);
  for (std::size_t i = 0; i < host.handler.tickets.size(); ++i) host.handler.accept(i);
  host.server->waker()->wake();
  for (int i = 0; i < 10; ++i) host.settle(), host.clock.advance(host.limits.ping_interval);
  CHECK(host.handler.open.empty());
  CHECK(host.handler.alive_messages() == 0);
  auto other = host.open();
  other->send_text("x");
  REQUIRE(host.run_to_frames(*other, 1));
}
