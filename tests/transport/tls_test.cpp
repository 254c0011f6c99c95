// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/transport.hpp>

#include <atomic>
#include <deque>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <thread>

#include "src/http/websocket.hpp"
#include "src/transport/http/addresses.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/tls.hpp"
#include "tests/support/websocket.hpp"
#include "tests/transport/framing_cases.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

/// A TestHandler that stores the TLS facts of the request, and echoes on WebSockets at /ws.
class TlsHandler final : public engine::Handler {
 public:
  engine::Outcome handle(const http::Request& request, TimePoint now) override {
    secure = request.secure;
    client_certificate = std::string(request.client_certificate);
    if (request.target != "/ws") return inner.handle(request, now);
    const engine::Channel channel{++last_channel_};
    queues_[channel];
    return engine::Upgraded{channel, {}};
  }
  std::optional<engine::Reply> next_reply(TimePoint now) override { return inner.next_reply(now); }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket ticket) noexcept override { inner.abandon(ticket); }
  std::optional<engine::Push> next_push(engine::Channel channel, TimePoint) override {
    auto& queue = queues_.at(channel);
    if (queue.empty()) return std::nullopt;
    auto push = std::move(queue.front());
    queue.pop_front();
    return push;
  }
  void received(engine::Channel channel, std::string_view message, bool text, TimePoint) override {
    queues_.at(channel).push_back({std::make_shared<const std::string>(message), text});
  }
  void closed(engine::Channel channel) noexcept override { queues_.erase(channel); }
  std::size_t channels() const { return queues_.size(); }

  TestHandler inner;
  bool secure = false;
  std::string client_certificate;

 private:
  std::uint64_t last_channel_ = 0;
  std::map<engine::Channel, std::deque<engine::Push>> queues_;
};

const Certificate& authority() {
  static const Certificate made = make_certificate({"authority", {}, -3600, 3600, true});
  return made;
}
Certificate localhost(const std::string& name = "robot") { return make_certificate({name, "DNS:localhost,IP:127.0.0.1"}, &authority()); }

/// A client over TLS that never blocks.
struct TlsClient {
  TlsClient(std::uint16_t port, SSL_CTX* context, int receive_buffer = 0)
      : raw(port, "127.0.0.1", receive_buffer), side(std::make_unique<TlsClientSide>(context)) {}
  void send(std::string_view text) { side->write(text); }
  void step() {
    received += side->take({});
    raw.send(side->give());
    raw.step();
    received += side->take(raw.received);
    raw.received.clear();
    raw.send(side->give());
    ended = raw.ended;
  }
  std::string server_name() const {
    const std::unique_ptr<X509, void (*)(X509*)> certificate(SSL_get_peer_certificate(side->get()), X509_free);
    char text[100] = "";
    if (certificate) X509_NAME_get_text_by_NID(X509_get_subject_name(certificate.get()), NID_commonName, text, sizeof text);
    return text;
  }

  RawClient raw;
  std::unique_ptr<TlsClientSide> side;
  std::string received;
  bool ended = false;
};

struct Host {
  explicit Host(const std::function<void(transport::TransportOptions&)>& change = {}) {
    options.port = 0;
    options.limits.max_body_bytes = 6'000'000;
    options.limits.linger_timeout = milliseconds(300);
    options.limits.stop_timeout = milliseconds(200);
    options.limits.max_websocket_message_bytes = 1'000'000;
    options.limits.max_websocket_messages = 100'000;
    const auto own = localhost();
    options.tls.emplace();
    options.tls->certificate_file = folder.put("server.pem", {&own});
    options.tls->key_file = folder.put_key("server-key.pem", own);
    folder.put("ca.pem", {&authority()});
    if (change) change(options);
    server = make_network(options);
    if (const auto started = server->start(handler); !started) throw std::runtime_error(started.error().message);
  }
  TlsClient client(int receive_buffer = 0) { return TlsClient(server->port(), context.get(), receive_buffer); }
  RawClient raw() { return RawClient(server->port()); }

  template <class Client, class Reached>
  bool run(std::initializer_list<Client*> clients, Reached reached) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < end) {
      for (auto* const one : clients) one->step();
      if (reached()) return true;
      server->poll(milliseconds(1), milliseconds(1));
    }
    return false;
  }
  template <class Client>
  bool run_to_end(Client& one) {
    return run({&one}, [&] { return one.ended; });
  }
  bool run_to_answers(TlsClient& one, std::size_t count) {
    return run({&one}, [&] {
      const auto answers = parse_answers(one.received);
      return answers.size() >= count && answers[count - 1].complete;
    });
  }
  bool run_to_handshake(TlsClient& one) {
    return run({&one}, [&] { return one.side->done(); });
  }
  void settle(std::initializer_list<TlsClient*> clients = {}) {
    for (int i = 0; i < 20; ++i) {
      for (auto* const one : clients) one->step();
      server->poll(milliseconds(1), milliseconds(1));
    }
  }
  /// A whole life of another client: the server is well.
  bool is_well() {
    auto other = client();
    other.send(get("/", "Connection: close\r\n"));
    return run_to_end(other) && statuses(parse_answers(other.received)) == std::vector{200} && other.side->closed;
  }

  TlsFolder folder;
  SslContext context = tls_client(authority());
  transport::TransportOptions options;
  TlsHandler handler;
  std::unique_ptr<transport::Transport> server;
};

void offer(SSL_CTX* context, std::string_view protocols) {
  SSL_CTX_set_alpn_protos(context, reinterpret_cast<const unsigned char*>(protocols.data()), static_cast<unsigned>(protocols.size()));
}

}  // namespace

TEST_CASE("requests over TLS are served and known to be secure", "[transport][tls][R0.2]") {
  Host host;
  CHECK(host.server->capabilities().tls);
  const int version = GENERATE(TLS1_2_VERSION, TLS1_3_VERSION);
  SSL_CTX_set_max_proto_version(host.context.get(), version);
  auto client = host.client();
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 1));
  CHECK(parse_answers(client.received)[0].body == "hello");
  CHECK(host.handler.secure);
  CHECK(host.handler.client_certificate.empty());
  CHECK(SSL_version(client.side->get()) == version);
  client.send(get("/none"));
  REQUIRE(host.run_to_answers(client, 2));
}

TEST_CASE("framing over TLS is as in the session", "[transport][tls][R0.1][R0.2]") {
  Host host([](auto& options) { options.limits.max_body_bytes = 1'000'000; });
  auto cases = framing_cases();
  for (auto& item : cases) {  // the scheme of an absolute target must be the connection's
    if (item.bytes.compare(0, 11, "GET http://") == 0) item.bytes.insert(8, "s");
    else if (item.bytes.compare(0, 12, "GET https://") == 0) item.bytes.erase(8, 1);
  }
  for (const auto& item : cases) {
    INFO(item.name);
    auto client = host.client();
    client.send(item.bytes);
    if (item.closes) {
      REQUIRE(host.run_to_end(client));
      CHECK(client.side->closed);
      CHECK_FALSE(client.raw.failed);
    } else {
      REQUIRE(host.run_to_answers(client, item.statuses.size()));
      CHECK_FALSE(client.ended);
    }
    CHECK(statuses(parse_answers(client.received)) == item.statuses);
  }
}

TEST_CASE("pipelined requests over TLS get their responses in order with a deferred response among them", "[transport][tls][R0.1]") {
  Host host;
  auto client = host.client();
  std::string after;
  for (int i = 0; i < 3000; ++i) after += get("/head");  // more than is read or decrypted at once
  client.send(get("/") + get("/defer") + get("/big?100000") + after);
  REQUIRE(host.run({&client}, [&] { return host.handler.inner.requests == 2; }));
  host.settle({&client});
  CHECK(host.handler.inner.requests == 2);
  host.handler.inner.complete(host.handler.inner.open.at(0), "deferred");
  host.server->waker()->wake();
  REQUIRE(host.run_to_answers(client, 3003));
  const auto answers = parse_answers(client.received);
  CHECK(answers[1].body == "deferred");
  CHECK(answers[2].body.size() == 100'000);
  CHECK(statuses(answers) == std::vector<int>(3003, 200));
}

TEST_CASE("what TLS has decrypted is read on although the socket has no more", "[transport][tls][R0.2]") {
  Host host;
  SSL_CTX_set_max_send_fragment(host.context.get(), 10'000);  // so that the last record is read in parts
  auto client = host.client();
  REQUIRE(host.run_to_handshake(client));
  host.settle({&client});
  SECTION("by HTTP, after a deferred response") {
    std::string bytes = get("/defer");
    std::size_t count = 1;
    for (; bytes.size() < 69'500; ++count) bytes += get("/none");
    client.send(bytes);
    client.step();
    REQUIRE(client.raw.all_sent());
    host.settle();
    host.handler.inner.complete(host.handler.inner.open.at(0), "deferred");
    host.server->waker()->wake();
    REQUIRE(host.run_to_answers(client, count));
  }
  SECTION("by WebSocket") {
    client.send(WebSocketClient::handshake("/ws"));
    REQUIRE(host.run({&client}, [&] { return contains(client.received, "\r\n\r\n"); }));
    client.received.clear();
    std::string bytes;
    for (int i = 0; i < 6000; ++i) bytes += Frame{Frame::text, "abc"}.bytes();
    client.send(bytes);
    client.step();
    REQUIRE(client.raw.all_sent());
    REQUIRE(host.run({&client}, [&] { return client.received.size() == 6000 * 5; }));
  }
}

TEST_CASE("5 MB go both ways over TLS, also to a client that reads slowly", "[transport][tls][R0.2]") {
  Host host;
  std::string body;
  for (unsigned i = 0; body.size() < 5'000'000; ++i) body += std::to_string(i) + ",";
  auto client = host.client(GENERATE(0, 4096));
  client.send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body + get("/"));
  REQUIRE(host.run({&client}, [&] { return host.handler.inner.requests == 1; }));
  client.raw.paused = true;
  host.settle({&client});
  client.raw.paused = false;
  REQUIRE(host.run_to_answers(client, 2));
  const auto answers = parse_answers(client.received);
  CHECK((answers[0].body == body));
  CHECK(answers[1].body == "hello");
}

TEST_CASE("a handshake and a request over TLS may be split at any byte", "[transport][tls][long][R0.2]") {
  Host host;
  const int version = GENERATE(TLS1_2_VERSION, TLS1_3_VERSION);
  SSL_CTX_set_max_proto_version(host.context.get(), version);
  // at: the byte after which the client pauses; 0: after each.
  for (std::size_t at = 0, total = 1; at <= total; ++at) {
    INFO("split after byte " << at);
    auto raw = host.raw();
    TlsClientSide side(host.context.get());
    side.write(get("/"));
    std::string received;
    std::size_t sent = 0;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (parse_answers(received).empty() && std::chrono::steady_clock::now() < end) {
      for (auto bytes = side.give(); !bytes.empty();) {
        const auto part = bytes.substr(0, at == 0 ? 1 : sent < at ? at - sent : bytes.size());
        raw.send(part);
        raw.step();
        host.server->poll(milliseconds(1), milliseconds(0));
        host.server->poll(milliseconds(1), milliseconds(0));
        sent += part.size();
        bytes.erase(0, part.size());
      }
      host.server->poll(milliseconds(1), milliseconds(1));
      raw.step();
      received += side.take(raw.received);
      raw.received.clear();
    }
    REQUIRE(statuses(parse_answers(received)) == std::vector{200});
    if (at == 0) total = sent;
  }
}

TEST_CASE("WSS: a WebSocket over TLS echoes small and large messages, many at once", "[transport][tls][R0.2][R0.12]") {
  Host host;
  auto client = host.client();
  std::string bytes = WebSocketClient::handshake("/ws");
  std::vector<std::string> messages;
  for (std::size_t i = 0; i < 2000; ++i) messages.push_back(std::to_string(i));  // many in one TLS record
  messages.emplace_back(300'000, 'x');
  messages.emplace_back();
  for (const auto& message : messages) bytes += Frame{Frame::text, message}.bytes();
  client.send(bytes);
  std::vector<Frame> frames;
  FrameReader reader;
  const auto collect = [&] {
    const auto head = client.received.find("\r\n\r\n");
    if (frames.empty() && head != std::string::npos && contains(client.received, "HTTP/1.1 101 ")) client.received.erase(0, head + 4);
    if (contains(client.received.substr(0, 5), "HTTP/")) return;
    std::string_view rest = client.received;
    for (Frame frame; reader.next(rest, frame);) frames.push_back(frame);
    client.received.erase(0, client.received.size() - rest.size());
  };
  REQUIRE(host.run({&client}, [&] { return collect(), frames.size() == messages.size(); }));
  CHECK(host.handler.secure);
  for (std::size_t i = 0; i < messages.size(); ++i) REQUIRE((frames[i].payload == messages[i]));
  CHECK(host.handler.channels() == 1);

  client.send(Frame{Frame::close, close_payload(1000)}.bytes());
  REQUIRE(host.run({&client}, [&] { return collect(), client.ended; }));
  CHECK(frames.back().opcode == Frame::close);
  CHECK(client.side->closed);
  CHECK(host.handler.channels() == 0);
}

TEST_CASE("WSS: a message to a client that does not read goes on when it does", "[transport][tls][R0.12]") {
  Host host;
  auto client = host.client(4096);
  const std::string large(900'000, 'y');
  client.send(WebSocketClient::handshake("/ws") + Frame{Frame::binary, large}.bytes() + Frame{Frame::binary, large}.bytes());
  REQUIRE(host.run({&client}, [&] { return contains(client.received, "101"); }));
  client.raw.paused = true;
  for (int i = 0; i < 200; ++i) host.settle({&client});
  client.raw.paused = false;
  REQUIRE(host.run({&client}, [&] { return client.received.size() > 1'800'000; }));
}

TEST_CASE("clients with certificates are known by their subject, those of others do not get in", "[transport][tls][R0.2]") {
  const bool required = GENERATE(false, true);
  const int version = GENERATE(TLS1_2_VERSION, TLS1_3_VERSION);
  Host host([&](auto& options) {
    options.tls->require_client_certificate = required;
    options.tls->client_ca_file = options.tls->certificate_file.substr(0, options.tls->certificate_file.rfind('/')) + "/ca.pem";
  });
  SSL_CTX_set_max_proto_version(host.context.get(), version);
  const auto use = [&](const Certificate& certificate) {
    SSL_CTX_use_certificate(host.context.get(), certificate.certificate.get());
    SSL_CTX_use_PrivateKey(host.context.get(), certificate.key.get());
  };
  SECTION("none") {
    auto client = host.client();
    client.send(get("/"));
    if (required) {
      REQUIRE(host.run_to_end(client));
      CHECK(contains(client.side->failure, "alert"));
      CHECK(host.handler.inner.requests == 0);
    } else {
      REQUIRE(host.run_to_answers(client, 1));
      CHECK(host.handler.client_certificate.empty());
    }
  }
  SECTION("good") {
    use(make_certificate({"operator, chief"}, &authority()));
    auto client = host.client();
    client.send(get("/"));
    REQUIRE(host.run_to_answers(client, 1));
    CHECK(host.handler.client_certificate == "CN=operator\\, chief");
    CHECK(host.handler.secure);
  }
  SECTION("of another authority") {
    const auto other = make_certificate({"authority", {}, -3600, 3600, true});
    use(make_certificate({"operator"}, &other));
    auto client = host.client();
    client.send(get("/"));
    REQUIRE(host.run_to_end(client));
    CHECK(contains(client.side->failure, "alert"));
    CHECK(host.handler.inner.requests == 0);
  }
  SECTION("expired") {
    use(make_certificate({"operator", {}, -7200, -3600}, &authority()));
    auto client = host.client();
    client.send(get("/"));
    REQUIRE(host.run_to_end(client));
    CHECK(host.handler.inner.requests == 0);
  }
}

TEST_CASE("TLS below 1.2 is refused by an alert", "[transport][tls][R0.2]") {
  Host host;
  SSL_CTX_set_security_level(host.context.get(), 0);
  SSL_CTX_set_min_proto_version(host.context.get(), TLS1_VERSION);
  SSL_CTX_set_max_proto_version(host.context.get(), TLS1_1_VERSION);
  auto client = host.client();
  REQUIRE(host.run_to_end(client));
  CHECK(contains(client.side->failure, "alert protocol version"));
  SSL_CTX_set_max_proto_version(host.context.get(), 0);
  CHECK(host.is_well());
}

TEST_CASE("a client with h2 only is refused by an alert; one with http/1.1 or without ALPN is served", "[transport][tls][R0.2]") {
  Host host;
  using S = std::string_view;
  offer(host.context.get(), S("\x02h2", 3));
  auto only = host.client();
  REQUIRE(host.run_to_end(only));
  CHECK(contains(only.side->failure, "no application protocol"));
  offer(host.context.get(), S("\x02h2\x08http/1.1", 12));
  auto both = host.client();
  both.send(get("/"));
  REQUIRE(host.run_to_answers(both, 1));
  const unsigned char* chosen = nullptr;
  unsigned size = 0;
  SSL_get0_alpn_selected(both.side->get(), &chosen, &size);
  CHECK(S(reinterpret_cast<const char*>(chosen), size) == "http/1.1");
}

TEST_CASE("plain HTTP on the TLS port gets a plain 400", "[transport][tls][R0.2]") {
  Host host;
  for (const std::string& text : {get("/"), std::string("G"), std::string("OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n"),
                                  "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 200000\r\n\r\n" + std::string(200'000, 'x')}) {
    INFO(text.substr(0, 20));
    auto client = host.raw();
    client.send(text);
    REQUIRE(host.run({&client}, [&] { return contains(client.received, "https://\n"); }));
    const auto answers = parse_answers(client.received);
    CHECK(statuses(answers) == std::vector{400});
    CHECK(contains(answers[0].head, "\r\nContent-Type: text/plain\r\n"));
    CHECK(contains(answers[0].head, "\r\nConnection: close\r\n"));
    CHECK(contains(answers[0].body, "HTTPS"));
    client.half_close();
    REQUIRE(host.run_to_end(client));
    CHECK_FALSE(client.failed);
  }
  CHECK(host.handler.inner.requests == 0);
  CHECK(host.is_well());
}

TEST_CASE("garbage before, within and after the handshake closes", "[transport][tls][R0.2]") {
  Host host;
  const std::string hello = TlsClientSide(host.context.get()).give();
  std::string cut = hello;
  for (std::size_t i = 60; i < cut.size(); ++i) cut[i] = '\x55';
  for (const auto& bytes : {std::string(100, '\0'), std::string("\x80\x2e\x01\x00\x02", 5) + std::string(60, 'a'),
                            std::string("\x16\x03\x01\xff\xff", 5) + std::string(70'000, 'x'), std::string("\x15\x03\x01\x00\x02\x02\x28", 7),
                            std::string("\x17\x03\x03\x00\x05hello", 10), cut, hello + std::string(300, 'z')}) {
    INFO(static_cast<int>(bytes[0]) << " " << bytes.size());
    auto client = host.raw();
    client.send(bytes);
    REQUIRE(host.run_to_end(client));
    CHECK_FALSE(contains(client.received, "HTTP"));
  }
  auto client = host.client();
  REQUIRE(host.run_to_handshake(client));
  client.raw.send(std::string(100, 'x'));
  REQUIRE(host.run({&client.raw}, [&] { return client.raw.ended; }));
  CHECK(host.handler.inner.requests == 0);
  CHECK(host.is_well());
}

TEST_CASE("a client cannot make the server negotiate again", "[transport][tls][R0.2]") {
  Host host;
  SSL_CTX_set_max_proto_version(host.context.get(), TLS1_2_VERSION);
  auto client = host.client();
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 1));
  SSL_renegotiate(client.side->get());
  SSL_do_handshake(client.side->get());
  REQUIRE(host.run({&client}, [&] { return !client.side->failure.empty(); }));
  CHECK(client.side->failure == "no renegotiation");
  CHECK(host.is_well());
}

TEST_CASE("new keys of TLS 1.3 are taken", "[transport][tls][R0.2]") {
  Host host;
  auto client = host.client(4096);
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 1));
  SSL_key_update(client.side->get(), SSL_KEY_UPDATE_REQUESTED);
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 2));
}

TEST_CASE("a handshake has the time of the first header section", "[transport][tls][R0.2]") {
  HandClock clock;
  Host host([&](auto& options) { options.clock = &clock; });
  auto silent = host.raw();
  auto half = host.raw();
  half.send(TlsClientSide(host.context.get()).give().substr(0, 100));
  auto waits = host.client();  // the handshake is complete, nothing follows
  auto in_head = host.client();
  auto served = host.client();
  in_head.send("GET / HT");
  served.send(get("/"));
  REQUIRE(host.run({&served, &waits, &in_head}, [&] { return !served.received.empty() && waits.side->done() && in_head.side->done(); }));
  host.run({&half, &silent}, [&] { return half.all_sent(); });
  host.settle({&served, &waits, &in_head});
  clock.advance(host.options.limits.header_timeout - milliseconds(1));
  host.settle({&served, &waits, &in_head});
  for (auto* const one : {&silent, &half}) {
    one->step();
    CHECK_FALSE(one->ended);
  }
  CHECK_FALSE(waits.ended);
  clock.advance(milliseconds(1));
  REQUIRE(host.run_to_end(silent));
  REQUIRE(host.run_to_end(half));
  REQUIRE(host.run_to_end(waits));
  CHECK(waits.side->closed);
  REQUIRE(host.run_to_answers(in_head, 1));
  CHECK(statuses(parse_answers(in_head.received)) == std::vector{408});
  served.step();
  CHECK_FALSE(served.ended);
  clock.advance(host.options.limits.idle_timeout);
  REQUIRE(host.run_to_end(served));
  CHECK(served.side->closed);
}

TEST_CASE("a client that takes no bytes of a response over TLS is given up, one that takes few is not", "[transport][tls][R0.2]") {
  HandClock clock;
  Host host([&](auto& options) { options.clock = &clock; });
  auto client = host.client(65536);
  client.send(get("/big?60000000"));
  REQUIRE(host.run({&client}, [&] { return host.handler.inner.requests == 1; }));
  for (int i = 0; i < 3; ++i) {  // more than the system holds for it, so that the server sees that it takes some
    client.raw.paused = true;
    host.settle({&client});
    clock.advance(host.options.limits.write_timeout - milliseconds(1));
    host.settle({&client});
    client.raw.paused = false;
    const auto before = client.received.size();
    REQUIRE(host.run({&client}, [&] { return client.received.size() > before + 8'000'000; }));
    CHECK_FALSE(client.ended);
  }
  client.raw.paused = true;
  for (int i = 0; i < 20; ++i) {  // bytes that the system still buffers are progress, and end
    host.settle({&client});
    clock.advance(host.options.limits.write_timeout + milliseconds(1));
  }
  host.settle({&client});
  client.raw.paused = false;
  REQUIRE(host.run_to_end(client));
  CHECK(client.received.size() < 60'000'000);
}

TEST_CASE("an end without close_notify cuts a request only where framing says so", "[transport][tls][R0.2]") {
  Host host;
  const bool notify = GENERATE(true, false);
  const auto end = [&](TlsClient& client) {
    REQUIRE(host.run({&client}, [&] { return client.side->done() && client.raw.all_sent(); }));
    if (notify) {
      SSL_shutdown(client.side->get());
      client.step();
      client.step();
    }
    client.raw.half_close();
  };
  auto whole = host.client();
  whole.send(get("/"));
  end(whole);
  REQUIRE(host.run_to_end(whole));
  CHECK(statuses(parse_answers(whole.received)) == std::vector{200});
  for (const std::string text : {"GET / HT", "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\nhe"}) {
    auto cut = host.client();
    cut.send(text);
    end(cut);
    REQUIRE(host.run_to_end(cut));
    CHECK(statuses(parse_answers(cut.received)) == std::vector{400});
  }
}

TEST_CASE("connections above the limit get 503 over TLS, and a handshake is not idle", "[transport][tls][R0.2]") {
  Host host([](auto& options) { options.limits.max_connections = 1; });
  auto first = host.raw();
  first.send(TlsClientSide(host.context.get()).give().substr(0, 100));
  host.run({&first}, [&] { return first.all_sent(); });
  host.settle();
  auto second = host.client();
  second.send(get("/"));
  REQUIRE(host.run_to_end(second));
  CHECK(statuses(parse_answers(second.received)) == std::vector{503});
  CHECK(second.side->closed);
  first.close();
  host.settle();
  CHECK(host.is_well());
}

TEST_CASE("a new certificate is for new connections; open ones go on; bad files change nothing", "[transport][tls][R0.2]") {
  Host host;
  auto old = host.client();
  REQUIRE(host.run_to_handshake(old));
  CHECK(old.server_name() == "robot");
  const auto next = localhost("renewed");
  host.folder.put("server.pem", {&next});

  const auto broken = host.server->reload_tls();  // the key is the old one's
  REQUIRE_FALSE(broken);
  CHECK(broken.error().code == Errc::io_error);
  auto still = host.client();
  REQUIRE(host.run_to_handshake(still));
  CHECK(still.server_name() == "robot");

  host.folder.put_key("server-key.pem", next);
  REQUIRE(host.server->reload_tls());
  auto fresh = host.client();
  fresh.send(get("/"));
  REQUIRE(host.run_to_answers(fresh, 1));
  CHECK(fresh.server_name() == "renewed");
  old.send(get("/"));
  REQUIRE(host.run_to_answers(old, 1));

  auto options = host.options;
  options.tls.reset();
  const auto plain = make_network(options)->reload_tls();
  REQUIRE_FALSE(plain);
  CHECK(plain.error().code == Errc::invalid_option);
}

TEST_CASE("certificates may be read again on another thread while clients come", "[transport][threads][tls][R0.2]") {
  Host host;
  std::atomic<bool> done{false};
  std::atomic<int> bad{0};
  std::thread other([&] {
    while (!done) bad += host.server->reload_tls() ? 0 : 1;
  });
  bool well = true;
  for (int i = 0; i < 50 && well; ++i) well = host.is_well();
  done = true;
  other.join();
  CHECK(well);
  CHECK(bad == 0);
}

TEST_CASE("start says which file of TLS is wrong and why", "[transport][tls][R0.2]") {
  const TlsFolder folder;
  const auto own = localhost();
  const auto other = localhost();
  transport::TlsOptions good;
  good.certificate_file = folder.put("server.pem", {&own});
  good.key_file = folder.put_key("server-key.pem", own);
  const auto text = folder.put("text.pem", "no PEM at all\n");
  struct Case {
    Errc code;
    std::string says;
    std::function<void(transport::TlsOptions&)> change;
  };
  const Case cases[] = {
      {Errc::invalid_option, "certificate_file", [&](auto& tls) { tls.certificate_file.clear(); }},
      {Errc::invalid_option, "key_file", [&](auto& tls) { tls.key_file.clear(); }},
      {Errc::invalid_option, "client_ca_file", [&](auto& tls) { tls.require_client_certificate = true; }},
      {Errc::io_error, "none.pem\": No such file", [&](auto& tls) { tls.certificate_file = folder.path("none.pem"); }},
      {Errc::io_error, "none.pem\": No such file", [&](auto& tls) { tls.key_file = folder.path("none.pem"); }},
      {Errc::io_error, "none.pem\": No such file", [&](auto& tls) { tls.client_ca_file = folder.path("none.pem"); }},
      {Errc::io_error, "Is a directory", [&](auto& tls) { tls.certificate_file = folder.path(""); }},
      {Errc::io_error, "text.pem\": expected a certificate in PEM", [&](auto& tls) { tls.certificate_file = text; }},
      {Errc::io_error, "text.pem\": expected a private key in PEM", [&](auto& tls) { tls.key_file = text; }},
      {Errc::io_error, "text.pem\": expected certificates in PEM", [&](auto& tls) { tls.client_ca_file = text; }},
      {Errc::io_error, "other.pem\": it does not belong to the certificate in",
       [&](auto& tls) { tls.key_file = folder.put_key("other.pem", other); }},
      {Errc::io_error, "secret.pem\": it is encrypted", [&](auto& tls) { tls.key_file = folder.put_key("secret.pem", own, "abcd"); }},
  };
  for (const auto& item : cases) {
    INFO(item.says);
    TestHandler handler;
    transport::TransportOptions options;
    options.port = 0;
    options.tls = good;
    item.change(*options.tls);
    const auto server = make_network(options);
    const auto started = server->start(handler);
    REQUIRE_FALSE(started);
    CHECK(started.error().code == item.code);
    INFO(started.error().message);
    CHECK(contains(started.error().message, item.says));
    CHECK(server->port() == 0);
    CHECK(ERR_peek_error() == 0);
  }
}

TEST_CASE("the chain of the server's certificate is sent", "[transport][tls][R0.2]") {
  const auto between = make_certificate({"between", {}, -3600, 3600, true}, &authority());
  const auto leaf = make_certificate({"leaf", "DNS:localhost"}, &between);
  TlsFolder folder;
  Host host([&](auto& options) {
    options.tls->certificate_file = folder.put("chain.pem", {&leaf, &between});
    options.tls->key_file = folder.put_key("leaf-key.pem", leaf);
  });
  CHECK(host.is_well());
}

TEST_CASE("stop ends TLS connections in any state", "[transport][tls][R0.2]") {
  Host host;
  auto idle = host.client();
  auto waiting = host.client();
  auto websocket = host.client();
  auto shaking = host.raw();
  shaking.send(TlsClientSide(host.context.get()).give().substr(0, 50));
  idle.send(get("/"));
  REQUIRE(host.run_to_answers(idle, 1));
  waiting.send(get("/defer"));
  websocket.send(WebSocketClient::handshake("/ws"));
  REQUIRE(host.run({&waiting, &websocket}, [&] { return host.handler.inner.open.size() == 1 && contains(websocket.received, "101"); }));
  host.run({&shaking}, [&] { return shaking.all_sent(); });
  host.settle();
  host.server->stop();
  CHECK(host.handler.channels() == 0);
  CHECK(host.handler.inner.abandoned.size() == 1);
  for (auto* const client : {&idle, &waiting, &websocket}) {
    for (int i = 0; i < 1000 && !client->ended; ++i) client->step();
    CHECK(client->ended);
    CHECK(client->side->closed);
  }
  CHECK(statuses(parse_answers(waiting.received)) == std::vector{503});
  REQUIRE(host.server->start(host.handler));
  CHECK(host.is_well());
}

TEST_CASE("a client over TLS that is killed in any state leaves the others alone", "[transport][tls][R0.2]") {
  Host host;
  for (const bool hard : {true, false}) {
    for (const std::string& start :
         {std::string(), std::string("GET / HT"), get("/big?20000000"), get("/defer"), WebSocketClient::handshake("/ws")}) {
      for (const int steps : {1, 2, 10}) {
        auto client = host.client(4096);
        client.send(start);
        for (int i = 0; i < steps; ++i) client.step(), host.server->poll(milliseconds(1), milliseconds(1));
        hard ? client.raw.reset() : client.raw.close();
        host.settle();
      }
    }
  }
  CHECK(host.handler.channels() == 0);
  CHECK(host.is_well());
}

// -------------------------------------------------------------------------------------------------- connections per address

TEST_CASE("connections are counted by address, those of this machine are not", "[transport]") {
  transport::Addresses addresses(2);
  auto first = addresses.take("192.0.2.1");
  auto second = addresses.take("192.0.2.1");
  REQUIRE(first);
  REQUIRE(second);
  CHECK_FALSE(addresses.take("192.0.2.1"));
  auto other = addresses.take("2001:db8::1");
  CHECK(other);
  // One host of IPv6 has a whole /64.
  auto same_network = addresses.take("2001:db8::ffff:2");
  CHECK(same_network);
  CHECK_FALSE(addresses.take("2001:db8::3"));
  CHECK(addresses.take("2001:db8:0:1::3"));
  same_network.reset();
  first.reset();
  auto third = addresses.take("192.0.2.1");
  CHECK(third);
  CHECK_FALSE(addresses.take("192.0.2.1"));
  transport::Addresses::Place moved = *std::move(third);
  third.reset();
  CHECK_FALSE(addresses.take("192.0.2.1"));
  moved = {};
  CHECK(addresses.take("192.0.2.1"));
  for (const char* const own : {"127.0.0.1", "127.255.0.3", "::1"}) {
    std::vector<transport::Addresses::Place> places;
    for (int i = 0; i < 10; ++i) {
      auto place = addresses.take(own);
      REQUIRE(place);
      places.push_back(*std::move(place));
    }
  }
  second.reset();
  other.reset();
  CHECK(addresses.size() == 0);
  transport::Addresses none(0);
  CHECK_FALSE(none.take("192.0.2.1"));
  CHECK(none.size() == 0);
}

TEST_CASE("one address can have so many connections, and again when one leaves", "[transport]") {
  const std::string address = outer_address();
  const auto serve = [](transport::Transport& server, RawClient& client, auto reached) {
    for (int i = 0; i < 20'000 && !reached(); ++i) client.step(), server.poll(milliseconds(1), milliseconds(1));
    return reached();
  };
  TestHandler handler;
  transport::TransportOptions options;
  options.port = 0;
  options.limits.max_connections_per_address = 2;
  options.limits.linger_timeout = milliseconds(300);
  {
    const auto server = make_network(options);
    REQUIRE(server->start(handler));
    std::vector<RawClient> clients;
    for (int i = 0; i < 5; ++i) {
      clients.emplace_back(server->port());
      clients.back().send(get("/"));
      REQUIRE(serve(*server, clients.back(), [&] { return !clients.back().received.empty(); }));
      CHECK(statuses(parse_answers(clients.back().received)) == std::vector{200});
    }
  }
  if (address.empty()) {
    print_skip("this machine has no address but its loopback's: only that they are not counted was tested");
    return;
  }
  options.address = address;
  const auto server = make_network(options);
  REQUIRE(server->start(handler));
  std::vector<RawClient> clients;
  for (const int status : {200, 200, 503}) {
    clients.emplace_back(server->port(), address.c_str());
    clients.back().send(get("/"));
    REQUIRE(serve(*server, clients.back(), [&] { return !clients.back().received.empty(); }));
    CHECK(statuses(parse_answers(clients.back().received)) == std::vector{status});
  }
  clients[0].close();
  for (int i = 0; i < 20; ++i) server->poll(milliseconds(1), milliseconds(1));
  clients.emplace_back(server->port(), address.c_str());
  clients.back().send(get("/"));
  REQUIRE(serve(*server, clients.back(), [&] { return !clients.back().received.empty(); }));
  CHECK(statuses(parse_answers(clients.back().received)) == std::vector{200});
}
