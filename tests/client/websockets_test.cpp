// SPDX-License-Identifier: Apache-2.0
#include "src/client/websockets.hpp"

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include <lrt/server.hpp>

#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/tls.hpp"
#include "tests/support/watchdog.hpp"
#include "tests/support/websocket.hpp"

namespace lrt {
namespace {

using client::WebSocketEnd;
using client::WebSocketRequest;
using client::WebSockets;
using std::chrono::milliseconds;
using test::field_of;
using test::Frame;
using test::Peer;

/// Records what happens and lets a test wait for it.
class Record final : public client::WebSocketEvents {
 public:
  void opened(std::string location, std::string protocol) override {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    location_ = std::move(location);
    protocol_ = std::move(protocol);
    changed_.notify_all();
  }
  void received(std::string message) override {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
    changed_.notify_all();
  }
  void ended(const WebSocketEnd& end) override {
    const std::lock_guard lock(mutex_);
    CHECK_FALSE(end_);
    end_ = end;
    changed_.notify_all();
  }
  void wait_open() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_open_ || end_; });
    if (end_) UNSCOPED_INFO(end_->error.message);
    REQUIRE(is_open_);
  }
  WebSocketEnd wait_end() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return end_.has_value(); });
    return *end_;
  }
  std::vector<std::string> wait_messages(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return messages_.size() >= count || end_; });
    return messages_;
  }
  bool is_open() const {
    const std::lock_guard lock(mutex_);
    return is_open_;
  }
  std::string protocol() const {
    const std::lock_guard lock(mutex_);
    return protocol_;
  }
  std::string location() const {
    const std::lock_guard lock(mutex_);
    return location_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
  std::string location_, protocol_;
  std::vector<std::string> messages_;
  std::optional<WebSocketEnd> end_;
};

WebSocketRequest request_to(const std::string& url, const std::string& address = "127.0.0.1") {
  return {http::parse_url(url).value(), {numeric_address(address).value()}, {{"Accept", "text/turtle"}}};
}

std::string opening_response(const std::string& request, const std::string& fields = {}) {
  return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " +
         test::accept_of(field_of(request, "Sec-WebSocket-Key")) + "\r\n" + fields + "\r\n";
}

std::string frame(std::string payload, unsigned opcode = Frame::text, bool fin = true) {
  Frame made;
  made.opcode = opcode;
  made.payload = std::move(payload);
  made.fin = fin;
  made.masked = false;
  return made.bytes();
}

/// A server that opens each WebSocket and sends these bytes.
test::Receiver::Serve serve(std::string bytes) {
  return [bytes = std::move(bytes)](Peer& peer) {
    const std::string request = peer.read_request();
    peer.send(opening_response(request) + bytes);
    peer.hang();
  };
}

/// What becomes of a connection to a server that does this.
WebSocketEnd end_of(const test::Receiver::Serve& script, client::Options options = {}) {
  test::Receiver server(script);
  WebSockets sockets(options);
  const auto record = std::make_shared<Record>();
  sockets.open(request_to(server.url()), record);
  return record->wait_end();
}

TEST_CASE("a WebSocket opens, names its subscription, receives and closes", "[client][R0.14]") {
  const test::Watchdog watchdog("WebSocket");
  std::string request, close;
  std::mutex mutex;
  auto server = std::make_unique<test::Receiver>([&](Peer& peer) {
    const std::string got = peer.read_request();
    peer.send(opening_response(got, "Location: /arm/subscriptions/7\r\n"));
    peer.send(frame("one") + frame("tw", Frame::text, false) + frame("ping", Frame::ping) + frame("o", Frame::continuation));
    const std::lock_guard lock(mutex);
    request = got;
  });
  WebSockets sockets{client::Options()};
  const auto record = std::make_shared<Record>();
  auto wanted = request_to(server->url("127.0.0.1", "/arm/angle?minimumInterval=0.1"));
  wanted.fields.emplace_back("Authorization", "Bearer x");
  sockets.open(std::move(wanted), record);
  record->wait_open();
  CHECK(record->location() == "/arm/subscriptions/7");
  CHECK(record->wait_messages(2) == std::vector<std::string>{"one", "two"});
  record->wait_end();
  server.reset();
  CHECK(request.find("GET /arm/angle?minimumInterval=0.1 HTTP/1.1\r\n") == 0);
  CHECK(field_of(request, "Accept") == "text/turtle");
  CHECK(field_of(request, "Authorization") == "Bearer x");
  CHECK(field_of(request, "Host").find("127.0.0.1:") == 0);
  CHECK(field_of(request, "Origin").empty());
  CHECK(field_of(request, "Sec-WebSocket-Protocol").empty());
  CHECK(field_of(request, "Sec-WebSocket-Extensions").empty());
}

TEST_CASE("a refused handshake has its status and Retry-After", "[client][R0.14]") {
  const test::Watchdog watchdog("WebSocket");
  for (const int status : {200, 302, 401, 403, 404, 406, 500, 503}) {
    const WebSocketEnd end = end_of([&](Peer& peer) {
      peer.read_request();
      peer.send(test::answer(status, "no", "Retry-After: 7\r\nLocation: http://127.0.0.1:1/elsewhere\r\n"));
      peer.hang();
    });
    CHECK(end.status == status);
    CHECK(end.error.code == Errc::refused);
    CHECK(end.retry_after == std::chrono::seconds(7));
  }
}

TEST_CASE("an opening response that is not valid opens nothing", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  client::Options options;
  options.limits.response_time = std::chrono::seconds(30);
  const auto with = [&](std::string response) {
    return end_of(
        [response](Peer& peer) {
          const std::string request = peer.read_request();
          std::string text = response;
          if (const std::size_t at = text.find("KEY"); at != std::string::npos)
            text.replace(at, 3, test::accept_of(field_of(request, "Sec-WebSocket-Key")));
          peer.send(text);
          peer.hang();
        },
        options);
  };
  const std::string begin = "HTTP/1.1 101 Switching Protocols\r\n", upgrade = "Upgrade: websocket\r\n", connection = "Connection: Upgrade\r\n";
  const std::string accept = "Sec-WebSocket-Accept: KEY\r\n";
  for (const std::string& response :
       {begin + upgrade + connection + "\r\n", begin + upgrade + connection + "Sec-WebSocket-Accept: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        begin + connection + accept + "\r\n", begin + upgrade + accept + "\r\n", begin + "Upgrade: h2c\r\n" + connection + accept + "\r\n",
        begin + upgrade + connection + accept + "Sec-WebSocket-Extensions: permessage-deflate\r\n\r\n",
        begin + upgrade + connection + accept + "Sec-WebSocket-Protocol: chat\r\n\r\n"}) {
    INFO(response);
    const WebSocketEnd end = with(response);
    CHECK(end.error.code == Errc::expected_http);
    CHECK(end.status == 0);
  }
  options.limits.response_time = milliseconds(300);  // some may be the beginning of a response
  for (const char* const garbage : {"garbage\r\n\r\n", "\x01\x02\x03\r\n\r\n", "HTTP/9.9 x\r\n\r\n", "\r\n\r\n"}) {
    const WebSocketEnd end = with(garbage);
    CHECK(end.status == 0);
    CHECK(end.code == 0);
  }
}

TEST_CASE("a server that closes in the middle of the handshake ends it", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  for (const char* const bytes : {"", "HTTP/1.1 101 Swit", "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n"}) {
    const WebSocketEnd end = end_of([&](Peer& peer) {
      peer.read_request();
      peer.send(bytes);
    });
    CHECK(end.error.code == Errc::closed);
  }
}

TEST_CASE("a server that never responds, or slowly, is given up", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  client::Options options;
  options.limits.response_time = milliseconds(150);
  CHECK(end_of([](Peer& peer) { peer.hang(); }, options).error.code == Errc::timed_out);
  CHECK(end_of([](Peer& peer) { peer.drip("HTTP/1.1 101 Switching Protocols\r\nX: yyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyy"); }, options)
            .error.code == Errc::timed_out);
}

TEST_CASE("nobody listens, and a second address is tried", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  WebSockets sockets{client::Options()};
  std::uint16_t free_port = 0;
  {
    test::Receiver gone([](Peer&) {});
    free_port = gone.port();
  }
  const auto refused = std::make_shared<Record>();
  sockets.open(request_to("http://127.0.0.1:" + std::to_string(free_port) + "/"), refused);
  CHECK(refused->wait_end().error.code == Errc::io_error);

  test::Receiver server(serve(frame("here")));
  const auto record = std::make_shared<Record>();
  WebSocketRequest request = request_to("http://127.0.0.1:" + std::to_string(server.port()) + "/", "127.0.0.2");
  request.addresses.push_back(numeric_address("127.0.0.1").value());
  sockets.open(std::move(request), record);
  CHECK(record->wait_messages(1) == std::vector<std::string>{"here"});
}

TEST_CASE("a message above the limit closes with 1009, whole and in fragments", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  client::Options options;
  options.limits.max_message_bytes = 10'000;
  std::string fragments = frame(std::string(4'000, 'x'), Frame::text, false);
  for (int i = 0; i < 3; ++i) fragments += frame(std::string(4'000, 'x'), Frame::continuation, i == 2);
  Frame huge;
  huge.masked = false;
  huge.length = std::uint64_t{1} << 62;
  for (const std::string& bytes : {frame(std::string(10'001, 'x')), fragments, huge.bytes() + std::string(20'000, 'x')}) {
    CHECK(end_of(serve(bytes), options).error.code == Errc::limit_exceeded);
  }
  test::Receiver server(serve(frame(std::string(10'000, 'x'))));
  WebSockets sockets(options);
  const auto record = std::make_shared<Record>();
  sockets.open(request_to(server.url()), record);
  CHECK(record->wait_messages(1).at(0).size() == 10'000);
}

TEST_CASE("frames that no server may send end the connection without a message", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  Frame reserved, long_ping, unknown, split_ping;
  reserved.rsv = 4;
  long_ping.opcode = Frame::ping, long_ping.payload = std::string(126, 'x');
  unknown.opcode = 5;
  split_ping.opcode = Frame::ping, split_ping.fin = false;
  for (Frame* const bad : {&reserved, &long_ping, &unknown, &split_ping}) {
    bad->masked = false;
    CHECK(end_of(serve(bad->bytes() + frame("never"))).code == 0);
  }
  CHECK(end_of(serve(frame("x", Frame::continuation))).code == 0);
  const WebSocketEnd bad_text = end_of(serve(frame("\xC3(")));
  CHECK(bad_text.error.code == Errc::expected_http);
}

TEST_CASE("the code and reason of the server's close are reported", "[client][R0.14]") {
  const test::Watchdog watchdog("WebSocket");
  for (const unsigned code : {1000U, 1001U, 1008U, 1011U, 4000U}) {
    const WebSocketEnd end = end_of(serve(frame(test::close_payload(code, "the reason"), Frame::close)));
    CHECK(end.code == code);
    CHECK(end.reason == "the reason");
  }
  CHECK(end_of(serve(frame("", Frame::close))).code == 1005);
}

TEST_CASE("pongs keep a connection without messages", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  test::Receiver server([](Peer& peer) {
    peer.send(opening_response(peer.read_request()));
    for (int i = 0; i < 2; ++i) {
      std::array<char, 6> ping{};
      if (::recv(peer.descriptor(), ping.data(), ping.size(), MSG_WAITALL) != 6 || static_cast<unsigned char>(ping[0]) != 0x89) return;
      peer.send(frame("", Frame::pong));
    }
    peer.send(frame(test::close_payload(4001), Frame::close));
    peer.hang();
  });
  WebSockets sockets{client::Options()};
  auto request = request_to(server.url());
  request.idle_time = milliseconds(2'000);  // pings after 1 s; the test machine may be busy
  const auto record = std::make_shared<Record>();
  sockets.open(std::move(request), record);
  const WebSocketEnd end = record->wait_end();
  INFO(end.error.message);
  CHECK(end.code == 4001);
}

TEST_CASE("a connection without a frame for idle_time has ended", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  test::Receiver deaf([](Peer& peer) {
    peer.send(opening_response(peer.read_request()));
    peer.hang_deaf();
  });
  WebSockets sockets{client::Options()};
  auto request = request_to(deaf.url());
  request.idle_time = milliseconds(200);
  const auto record = std::make_shared<Record>();
  sockets.open(std::move(request), record);
  CHECK(record->wait_end().error.code == Errc::timed_out);
}

TEST_CASE("close() closes with 1000, also before the handshake is over", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  std::mutex mutex;
  std::string received;
  auto server = std::make_unique<test::Receiver>([&](Peer& peer) {
    peer.send(opening_response(peer.read_request()) + frame("hello"));
    std::array<char, 64> bytes{};
    const auto got = ::recv(peer.descriptor(), bytes.data(), bytes.size(), 0);
    const std::lock_guard lock(mutex);
    if (got > 0) received.assign(bytes.data(), static_cast<std::size_t>(got));
  });
  WebSockets sockets{client::Options()};
  const auto record = std::make_shared<Record>();
  const auto id = sockets.open(request_to(server->url()), record);
  record->wait_messages(1);
  sockets.close(id);
  CHECK(record->wait_end().error.code == Errc::cancelled);
  server.reset();
  REQUIRE(received.size() == 8);  // masked
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(received[i]); };
  CHECK(byte(0) == 0x88);
  CHECK((((byte(6) ^ byte(2)) << 8) | (byte(7) ^ byte(3))) == 1000);

  test::Receiver silent([](Peer& peer) { peer.hang(); });
  const auto early = std::make_shared<Record>();
  sockets.close(sockets.open(request_to(silent.url()), early));
  CHECK(early->wait_end().error.code == Errc::cancelled);
  CHECK_FALSE(early->is_open());
  sockets.close(12345);  // unknown
}

TEST_CASE("stop() ends connections in every phase, and later ones at once", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  test::Receiver open(serve(frame("x"))), silent([](Peer&peer) { peer.hang(); });
  WebSockets sockets{client::Options()};
  std::vector<std::shared_ptr<Record>> records;
  for (int i = 0; i < 20; ++i) {
    records.push_back(std::make_shared<Record>());
    sockets.open(request_to((i % 2 == 0 ? open : silent).url()), records.back());
  }
  for (std::size_t i = 0; i < records.size(); i += 2) records[i]->wait_messages(1);
  sockets.stop();
  for (const auto& record : records) CHECK(record->wait_end().error.code == Errc::cancelled);
  const auto late = std::make_shared<Record>();
  CHECK(sockets.open(request_to(open.url()), late) != 0);
  sockets.stop();
}

TEST_CASE("a long target and a long host are sent whole", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  std::mutex mutex;
  std::string request;
  auto server = std::make_unique<test::Receiver>([&](Peer& peer) {
    const std::string got = peer.read_request();
    peer.send(opening_response(got) + frame("x"));
    const std::lock_guard lock(mutex);
    request = got;
  });
  const std::string host = std::string(60, 'a') + "." + std::string(60, 'b') + ".example", path = "/" + std::string(3000, 'x');
  {
    WebSockets sockets{client::Options()};
    const auto record = std::make_shared<Record>();
    sockets.open(request_to("http://" + host + ":" + std::to_string(server->port()) + path), record);
    CHECK(record->wait_messages(1).size() == 1);
  }
  server.reset();
  CHECK(request.find("GET " + path + " HTTP/1.1\r\n") == 0);
  CHECK(field_of(request, "Host").find(host + ":") == 0);
}

TEST_CASE("interim responses may come before the opening response, and bytes of frames with it", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  test::Receiver server([](Peer& peer) {
    const std::string request = peer.read_request();
    peer.send("HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 103 Early Hints\r\nLink: </x>\r\n\r\n" + opening_response(request) + frame("one") +
              frame("two").substr(0, 3));
    peer.send(frame("two").substr(3));
    peer.hang();
  });
  WebSockets sockets{client::Options()};
  const auto record = std::make_shared<Record>();
  sockets.open(request_to(server.url()), record);
  CHECK(record->wait_messages(2) == std::vector<std::string>{"one", "two"});
}

TEST_CASE("a subprotocol is offered, and only that one is accepted", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  for (const char* const chosen : {"", "Sec-WebSocket-Protocol: mine\r\n", "Sec-WebSocket-Protocol: yours\r\n"}) {
    std::mutex mutex;
    std::string request;
    auto server = std::make_unique<test::Receiver>([&](Peer& peer) {
      const std::string got = peer.read_request();
      peer.send(opening_response(got, chosen) + frame("x"));
      const std::lock_guard lock(mutex);
      request = got;
    });
    const auto record = std::make_shared<Record>();
    {
      WebSockets sockets{client::Options()};
      auto wanted = request_to(server->url());
      wanted.protocol = "mine";
      sockets.open(std::move(wanted), record);
      record->wait_end();
    }
    server.reset();
    CHECK(field_of(request, "Sec-WebSocket-Protocol") == "mine");
    const bool is_other = std::string_view(chosen).find("yours") != std::string_view::npos;
    CHECK(record->is_open() == !is_other);
    CHECK(record->protocol() == (is_other || *chosen == 0 ? "" : "mine"));
  }
}

TEST_CASE("a client that reads nothing does not hold up the others", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  std::string flood;
  for (int i = 0; i < 200; ++i) flood += frame("", Frame::ping);
  test::Receiver noisy(serve(flood + frame(std::string(200'000, 'x')))), quiet(serve(frame("here")));
  WebSockets sockets{client::Options()};
  const auto first = std::make_shared<Record>(), second = std::make_shared<Record>();
  sockets.open(request_to(noisy.url()), first);
  sockets.open(request_to(quiet.url()), second);
  CHECK(second->wait_messages(1) == std::vector<std::string>{"here"});
  CHECK(first->wait_messages(1).at(0).size() == 200'000);
}

TEST_CASE("a field with a line end is not sent", "[client]") {
  const test::Watchdog watchdog("WebSocket");
  test::Receiver server(serve(""));
  WebSockets sockets{client::Options()};
  auto request = request_to(server.url());
  request.fields.emplace_back("X", "a\r\nEvil: b");
  const auto record = std::make_shared<Record>();
  sockets.open(std::move(request), record);
  CHECK(record->wait_end().error.code == Errc::expected_http);
}

bool has_ipv6() {
  const int descriptor = ::socket(AF_INET6, SOCK_STREAM, 0);
  sockaddr_in6 loopback{};
  loopback.sin6_family = AF_INET6;
  loopback.sin6_addr = in6addr_loopback;
  const bool bound = ::bind(descriptor, reinterpret_cast<const sockaddr*>(&loopback), sizeof loopback) == 0;
  ::close(descriptor);
  return bound;
}

/// A robot with TLS on localhost.
struct SecureRobot {
  explicit SecureRobot(const std::string& client_authority = {}, const std::string& address = {}, const std::string& names = "DNS:localhost")
      : certificate(test::make_certificate({"localhost", names}, &authority)) {
    Options options;
    if (!address.empty()) options.listen.address = address;
    options.listen.port = 0;
    options.security.tls = transport::TlsOptions{folder.put("server.pem", {&certificate}), folder.put_key("server.key", certificate),
                                                 client_authority, !client_authority.empty()};
    server.emplace(Server::create(std::move(options)).value());
    Thing thing("arm");
    auto angle = thing.property<double>("angle");
    server->add(std::move(thing)).value();
    angle.publish(1.5);
  }
  std::string url(const std::string& host = "localhost") const { return "https://" + host + ":" + std::to_string(server->port()) + "/arm/angle"; }

  test::TlsFolder folder;
  const test::Certificate authority = test::make_certificate({"authority", {}, -3600, 3600, true});
  const test::Certificate certificate;
  const std::string ca_file = folder.put("ca.pem", {&authority});
  std::optional<Server> server;
};

TEST_CASE("wss accepts the certificate of the host by the given authorities only", "[client][R0.2]") {
  const test::Watchdog watchdog("wss");
  SecureRobot robot;
  client::Options trusting, strange;
  trusting.ca_file = robot.ca_file;
  {
    WebSockets sockets(trusting);
    const auto record = std::make_shared<Record>();
    sockets.open(request_to(robot.url()), record);
    record->wait_open();
    CHECK(record->wait_messages(1).at(0).find("1.5") != std::string::npos);
    const auto other_name = std::make_shared<Record>();
    sockets.open(request_to(robot.url("other.example")), other_name);
    other_name->wait_end();
    CHECK_FALSE(other_name->is_open());
  }
  WebSockets sockets(strange);
  const auto record = std::make_shared<Record>();
  sockets.open(request_to(robot.url()), record);
  record->wait_end();
  CHECK_FALSE(record->is_open());
}

TEST_CASE("wss shows the client's certificate", "[client][R0.2]") {
  const test::Watchdog watchdog("wss");
  test::TlsFolder folder;
  const test::Certificate users = test::make_certificate({"users", {}, -3600, 3600, true});
  const test::Certificate user = test::make_certificate({"ada"}, &users);
  SecureRobot robot(folder.put("users.pem", {&users}));
  client::Options options;
  options.ca_file = robot.ca_file;
  options.identity.certificate_file = folder.put("ada.pem", {&user});
  options.identity.key_file = folder.put_key("ada.key", user);
  WebSockets sockets(options);
  const auto record = std::make_shared<Record>();
  sockets.open(request_to(robot.url()), record);
  CHECK(record->wait_messages(1).size() == 1);
}

TEST_CASE("the client's certificate is not shown where it is not wanted", "[client]") {
  const test::Watchdog watchdog("wss");
  test::TlsFolder folder;
  const test::Certificate users = test::make_certificate({"users", {}, -3600, 3600, true});
  const test::Certificate user = test::make_certificate({"ada"}, &users);
  SecureRobot robot(folder.put("users.pem", {&users}));
  client::Options options;
  options.ca_file = robot.ca_file;
  options.identity.certificate_file = folder.put("ada.pem", {&user});
  options.identity.key_file = folder.put_key("ada.key", user);
  WebSockets sockets(options);
  const auto record = std::make_shared<Record>();
  auto request = request_to(robot.url());
  request.shows_certificate = false;
  sockets.open(std::move(request), record);
  record->wait_end();
  CHECK_FALSE(record->is_open());
}

TEST_CASE("wss to an IPv6 address checks the certificate of that address", "[client][R0.2]") {
  const test::Watchdog watchdog("wss");
  if (!has_ipv6()) {
    WARN("skipped: this machine has no ::1");
    return;
  }
  SecureRobot robot({}, "::1", "DNS:localhost,IP:::1"), other({}, "::1", "DNS:localhost,IP:127.0.0.1");
  for (SecureRobot* const each : {&robot, &other}) {
    client::Options options;
    options.ca_file = each->ca_file;
    WebSockets sockets(options);
    const auto record = std::make_shared<Record>();
    sockets.open(request_to(each->url("[::1]"), "::1"), record);
    if (each == &robot) {
      CHECK(record->wait_messages(1).size() == 1);
    } else {
      CHECK(record->wait_end().error.message.find("certificate") != std::string::npos);
      CHECK_FALSE(record->is_open());
    }
  }
}

}  // namespace
}  // namespace lrt
