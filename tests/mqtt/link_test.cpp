// SPDX-License-Identifier: Apache-2.0
// libmosquitto as a link: TLS, credentials, and brokers that are none.
#include "src/mqtt/link.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "src/base/event_waker.hpp"
#include "tests/mqtt/broker.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/tls.hpp"

using namespace lrt;
using namespace lrt::mqtt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

struct Seen final : Link::Events {
  int connections = 0, ends = 0, acknowledgements = 0, messages = 0;
  std::vector<int> confirmations;
  Agreement agreement;
  std::string reason, payloads;
  InMessage last;
  void connected(const Agreement& with) override {
    ++connections;
    agreement = with;
  }
  void disconnected(const std::string& why) override {
    ++ends;
    reason = why;
  }
  void acknowledged(int, bool, const std::string&) override { ++acknowledgements; }
  void confirmed(int id) override { confirmations.push_back(id); }
  void received(InMessage message) override {
    ++messages;
    payloads += message.payload + ';';
    last = std::move(message);
  }
  void subscription_refused(const std::string&, const std::string&) override {}
  int takeovers = 0;
  void taken_over() override { ++takeovers; }
};

LinkOptions options_of(std::uint16_t port) {
  LinkOptions options;
  options.broker.port = port;
  options.will.topic = "r/ns/status";
  options.will.payload = std::make_shared<const std::string>("{}");
  options.probed_filter = "r/ns/probe";
  options.waker = std::make_shared<EventWaker>();
  return options;
}

/// Steps until a condition holds.
template <class F>
void until(Link& link, Seen& seen, F condition) {
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (!condition() && std::chrono::steady_clock::now() < end) {
    link.step(seen);
    ::usleep(200);
  }
}

/// What becomes of one attempt to connect.
Seen attempt(LinkOptions options) {
  Seen seen;
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(std::move(options));
  if (!link) {
    seen.reason = link.error().message;
    return seen;
  }
  (*link)->connect();
  until(**link, seen, [&] { return seen.connections + seen.ends > 0; });
  return seen;
}

/// A listening socket that speaks no MQTT.
class Stranger {
 public:
  Stranger() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 8) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no listening socket");
    port_ = ntohs(address.sin_port);
  }
  ~Stranger() {
    ::close(listener_);
    hang_up();
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;
  std::uint16_t port() const noexcept { return port_; }
  /// Sends bytes to whoever has connected, once.
  void serve(const std::string& bytes) {
    if (client_ >= 0) return;
    client_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client_ >= 0 && !bytes.empty()) (void)::send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  void hang_up() {
    if (client_ >= 0) ::close(std::exchange(client_, -1));
  }

 private:
  int listener_, client_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace

TEST_CASE("a link connects by address and by name", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  LinkOptions options = options_of(broker.port());
  options.broker.host = GENERATE("127.0.0.1", "localhost");
  CHECK(attempt(std::move(options)).connections == 1);
}

TEST_CASE("a link that is destroyed while a name is resolved leaves nothing behind", "[mqtt]") {
  LinkOptions options = options_of(1);
  options.broker.host = "no-such-host.invalid";
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(std::move(options));
  REQUIRE(link);
  (*link)->connect();
}

TEST_CASE("a broker that is not there, or has no such name, is a reason", "[mqtt]") {
  CHECK(attempt(options_of(free_port())).ends == 1);
  LinkOptions options = options_of(1);
  options.broker.host = "no-such-host.invalid";
  const Seen seen = attempt(std::move(options));
  CHECK(seen.ends == 1);
  CHECK_FALSE(seen.reason.empty());
}

TEST_CASE("user and password are what the broker asks for", "[mqtt]") {
  if (!has_mosquitto()) return;
  const Folder folder;
  const std::string file = folder / "passwords";
  std::ofstream(file) << "r1:secret\n";
  if (std::system(("mosquitto_passwd -U " + file + " 2>/dev/null").c_str()) != 0) {
    std::cout << "skipped: mosquitto_passwd does not work here\n";
    return;
  }
  Mosquitto broker("allow_anonymous false\npassword_file " + file + "\n");
  LinkOptions good = options_of(broker.port());
  good.broker.user = "r1";
  good.broker.password = "secret";
  CHECK(attempt(good).connections == 1);
  good.broker.password = "wrong";
  const Seen refused = attempt(good);
  CHECK(refused.connections == 0);
  CHECK_THAT(refused.reason, Catch::Matchers::ContainsSubstring("refused"));
  CHECK(attempt(options_of(broker.port())).connections == 0);
}

TEST_CASE("TLS: the broker's certificate is verified, and the robot shows its own", "[mqtt]") {
  if (!has_mosquitto()) return;
  const Certificate authority = make_certificate({"authority", "", -3600, 3600, true}),
                    other = make_certificate({"another authority", "", -3600, 3600, true});
  const Certificate own = make_certificate({"localhost", "DNS:localhost,IP:127.0.0.1"}, &authority), robot = make_certificate({"r1"}, &authority);
  const TlsFolder folder;
  const std::string ca = folder.put("ca.pem", {&authority});
  Mosquitto broker("allow_anonymous true\ncafile " + ca + "\ncertfile " + folder.put("broker.pem", {&own}) + "\nkeyfile " +
                   folder.put_key("broker.key", own) + "\nrequire_certificate true\n");
  LinkOptions good = options_of(broker.port());
  good.broker.host = "localhost";
  good.broker.tls.emplace().ca_file = ca;
  good.broker.tls->certificate_file = folder.put("robot.pem", {&robot});
  good.broker.tls->key_file = folder.put_key("robot.key", robot);
  const Seen seen = attempt(good);
  INFO(seen.reason);
  CHECK(seen.connections == 1);
  good.broker.connect_time = milliseconds(500);  // a handshake that fails may leave a connection that says nothing
  LinkOptions stranger = good;
  stranger.broker.tls->ca_file = folder.put("other.pem", {&other});
  const Seen not_trusted = attempt(stranger);
  CHECK(not_trusted.connections == 0);
  CHECK_THAT(not_trusted.reason, Catch::Matchers::ContainsSubstring("TLS") && Catch::Matchers::ContainsSubstring("certificate verify failed"));
  LinkOptions nobody = good;
  nobody.broker.tls->certificate_file.clear();
  nobody.broker.tls->key_file.clear();
  CHECK(attempt(nobody).connections == 0);
  LinkOptions other_name = good;
  other_name.broker.host = "127.0.0.2";
  CHECK(attempt(other_name).connections == 0);
  LinkOptions plain = options_of(broker.port());
  plain.broker.connect_time = milliseconds(200);
  CHECK(attempt(plain).connections == 0);
}

TEST_CASE("a key with a passphrase is refused, because nobody can be asked for it", "[mqtt]") {
  const Certificate robot = make_certificate({"r1"});
  const TlsFolder folder;
  LinkOptions options = options_of(1);
  options.broker.tls.emplace().certificate_file = folder.put("robot.pem", {&robot});
  options.broker.tls->key_file = folder.put_key("robot.key", robot, "word");
  const Result<std::unique_ptr<Link>> refused = make_mosquitto_link(options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_option);
  CHECK_THAT(refused.error().message, Catch::Matchers::ContainsSubstring("passphrase"));
  options.broker.tls->key_file = folder.put_key("plain.key", robot);
  CHECK(make_mosquitto_link(options));
}

TEST_CASE("a broker that never accepts is given up, and its socket is closed", "[mqtt]") {
  Stranger stranger;
  LinkOptions options = options_of(stranger.port());
  options.broker.connect_time = milliseconds(50);
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(std::move(options));
  REQUIRE(link);
  (*link)->connect();
  const int socket = (*link)->descriptor();
  CHECK(::fcntl(socket, F_GETFD) != -1);
  Seen seen;
  until(**link, seen, [&] { return seen.ends > 0; });
  CHECK(seen.connections == 0);
  CHECK(seen.ends == 1);
  CHECK((*link)->descriptor() == -1);
  CHECK(::fcntl(socket, F_GETFD) == -1);
}

TEST_CASE("a link that waits for its broker does not want to write", "[mqtt]") {
  Stranger stranger;
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(options_of(stranger.port()));
  REQUIRE(link);
  (*link)->connect();
  CHECK((*link)->wants_write());
  Seen seen;
  until(**link, seen, [&] { return !(*link)->wants_write(); });
  CHECK_FALSE((*link)->wants_write());
  CHECK((*link)->descriptor() >= 0);
  CHECK(seen.connections + seen.ends == 0);
}

TEST_CASE("a connection has nothing of an earlier one: no half-received message, no limit of the broker", "[mqtt]") {
  Stranger stranger;
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(options_of(stranger.port()));
  REQUIRE(link);
  Seen seen;
  const auto connect = [&](const std::string& bytes) {
    const int before = seen.connections;
    (*link)->connect();
    until(**link, seen, [&] {
      stranger.serve(bytes);
      return seen.connections > before;
    });
  };
  const auto qos2 = [](char text) { return std::string("\x34\x07\x00\x01\x61\x00\x01\x00", 8) + text; };  // to the topic "a", with the id 1
  // Maximum QoS 0, no retained messages, packets of at most 30 bytes.
  connect(std::string("\x20\x0C\x00\x00\x09\x24\x00\x25\x00\x27\x00\x00\x00\x1E", 14) + qos2('1'));
  OutMessage message;
  message.topic = "a";
  message.payload = std::make_shared<const std::string>(100, 'x');
  message.qos = 1;
  message.retain = true;
  const Result<int> refused = (*link)->publish(message);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::limit_exceeded);
  for (int turn = 0; turn < 20; ++turn) (*link)->step(seen);
  CHECK(seen.messages == 0);  // it is not released yet
  stranger.hang_up();
  until(**link, seen, [&] { return seen.ends == 1; });

  connect(std::string("\x20\x03\x00\x00\x00", 5) + qos2('2') + std::string("\x62\x02\x00\x01", 4));  // and its PUBREL
  until(**link, seen, [&] { return seen.messages > 0; });
  CHECK(seen.payloads == "2;");
  const Result<int> accepted = (*link)->publish(message);
  REQUIRE(accepted);
  CHECK(*accepted != 0);  // QoS 1 again
}

TEST_CASE("a broker that says why it ends a connection is heard", "[mqtt][identity]") {
  const auto reason_of = [](const std::string& packet) {
    Stranger stranger;
    Result<std::unique_ptr<Link>> link = make_mosquitto_link(options_of(stranger.port()));
    REQUIRE(link);
    (*link)->connect();
    Seen seen;
    until(**link, seen, [&] {
      stranger.serve(std::string("\x20\x03\x00\x00\x00", 5) + packet);
      return seen.ends > 0;
    });
    CHECK(seen.connections == 1);
    CHECK(seen.ends == 1);
    return std::to_string(seen.takeovers) + " " + seen.reason;
  };
  CHECK(reason_of(std::string("\xE0\x02\x8E\x00", 4)) == "1 the broker has ended the connection: Session taken over");
  CHECK(reason_of(std::string("\xE0\x02\x8B\x00", 4)) == "0 the broker has ended the connection: Server shutting down");
}

TEST_CASE("the password and the files of TLS are judged as they are now", "[mqtt][identity]") {
  const Certificate authority = make_certificate({"authority", "", -3600, 3600, true});
  const Certificate robot = make_certificate({"r1"}, &authority), other = make_certificate({"r2"}, &authority);
  const TlsFolder folder;
  LinkOptions options = options_of(1);
  options.broker.user = "r1";
  options.broker.password_file = folder.put("password", std::string("secret\n"));
  options.broker.tls.emplace().ca_file = folder.put("ca.pem", {&authority});
  options.broker.tls->certificate_file = folder.put("robot.pem", {&robot});
  options.broker.tls->key_file = folder.put_key("robot.key", robot);
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(options);
  REQUIRE(link);
  CHECK((*link)->check());
  const auto message = [&] {
    const Result<void> checked = (*link)->check();
    return checked ? std::string() : checked.error().message;
  };
  folder.put_key("robot.key", other);
  CHECK_THAT(message(), Catch::Matchers::ContainsSubstring("is not the key of the certificate"));
  folder.put("robot.pem", {&other});
  CHECK(message().empty());
  folder.put("robot.pem", std::string("-----BEGIN CERTIFICATE-----\nhalf"));
  CHECK_THAT(message(), Catch::Matchers::ContainsSubstring("expected a certificate"));
  folder.put("robot.pem", {&other});
  folder.put("password", std::string("\n"));
  CHECK_THAT(message(), Catch::Matchers::ContainsSubstring("password_file"));
  folder.put("password", std::string("other"));
  CHECK(message().empty());
  folder.put("ca.pem", std::string());
  CHECK_THAT(message(), Catch::Matchers::ContainsSubstring("expected a certificate"));
}

TEST_CASE("what a hostile broker sends ends the connection at most", "[mqtt]") {
  const std::string accepted("\x20\x03\x00\x00\x00", 5);
  std::vector<std::string> attacks = {
      std::string("\x20\x03\x00\x87\x00", 5),                                   // not authorized
      std::string("\x20\xFF\xFF\xFF\xFF\xFF", 6),                               // a length of five bytes
      accepted + accepted,                                                      // twice
      accepted + std::string("\x30\xFF\xFF\xFF\x7F\x00\x01", 7),                // a message of 256 MB, which does not come
      accepted + std::string("\x30\x05\xFF\xFF\x61\x62\x63", 7),                // a topic that is longer than the message
      accepted + std::string("\x30\x06\x00\x01+\x00xx", 8),                     // a wildcard
      accepted + std::string("\x30\x07\x00\x01\x61\x02\x26\x00\x00", 9),        // a user property that is cut off
      accepted + std::string("\x30\x06\x00\x02\xC3\x28\x00x", 8),               // a topic that is not UTF-8
      accepted + std::string("\x40\x02\xFF\xFF", 4),                            // an acknowledgement of nothing
      accepted + std::string("\x90\x04\x00\x01\x00\x80", 6),                    // a subscription that nobody asked for
      accepted + std::string("\x10\x02\x00\x00", 4) + std::string(64, '\xFF'),  // a client's packet
      "HTTP/1.1 400 Bad Request\r\n\r\n",
  };
  std::mt19937 random(20'26);  // NOLINT: the same bytes each time
  // Packets of each type and with each flag, with chance in them, but without properties: those of an unknown type end a process that has
  // libmosquitto 2.0.11, by an assertion (docs/mqtt.md).
  const auto chance = [&](std::size_t most) {
    std::string bytes(random() % (most + 1), '\0');
    for (char& c : bytes) c = static_cast<char>(random() % 256);
    return bytes;
  };
  for (int i = 0; i < 300; ++i) {
    std::string bytes = i % 4 == 0 ? "" : accepted;
    for (int packet = 0; packet < 3; ++packet) {
      const auto first = static_cast<char>(random() % 256);
      std::string body;
      if ((first & 0xF0) == 0x30) {
        const std::string topic = chance(4);
        body = std::string(1, '\0') + static_cast<char>(topic.size()) + topic;
        if ((first & 0x06) != 0) body += std::string("\0", 1) + static_cast<char>(random() % 4);
        body += std::string(1, '\0') + chance(5);
      } else {
        const char zero = 0, reason = static_cast<char>(random() % 256), id = static_cast<char>(random() % 4);
        switch ((first >> 4) & 15) {
          case 14:
          case 15: body = {reason, zero}; break;
          case 2: body = {id, reason, zero}; break;
          case 9:
          case 11: body = {zero, id, zero, reason}; break;
          default: body = {zero, id, reason, zero};
        }
        body.resize(random() % (body.size() + 1));
      }
      bytes += first;
      bytes += static_cast<char>(body.size());
      bytes += body;
    }
    attacks.push_back(std::move(bytes) + chance(1));
  }
  for (const std::string& bytes : attacks) {
    Stranger stranger;
    LinkOptions options = options_of(stranger.port());
    Result<std::unique_ptr<Link>> link = make_mosquitto_link(std::move(options));
    REQUIRE(link);
    (*link)->connect();
    Seen seen;
    for (int turn = 0; turn < 20; ++turn) {
      stranger.serve(bytes);
      (*link)->step(seen);
      if (seen.connections > 0 && seen.ends == 0) {
        OutMessage message;
        message.topic = "a";
        message.qos = 1;
        (void)(*link)->publish(message);
      }
    }
    stranger.hang_up();
    until(**link, seen, [&] { return seen.ends > 0; });
    CHECK(seen.ends == 1);
    CHECK((*link)->descriptor() == -1);
    link->reset();
  }
}

TEST_CASE("a broker answers a probe after the messages before it", "[mqtt][newest]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("a", 0);
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(options_of(broker.port()));
  REQUIRE(link);
  CHECK_FALSE((*link)->probe());  // not connected
  (*link)->connect();
  Seen seen;
  until(**link, seen, [&] { return seen.connections > 0; });
  OutMessage message;
  message.topic = "a";
  message.payload = std::make_shared<const std::string>("1");
  message.is_utf8 = true;
  std::vector<int> ids;
  for (int i = 0; i < 3; ++i) {
    REQUIRE((*link)->publish(message));
    const Result<int> id = (*link)->probe();
    REQUIRE(id);
    ids.push_back(*id);
  }
  until(**link, seen, [&] { return seen.confirmations.size() == 3; });
  CHECK(seen.confirmations == ids);
  CHECK(seen.ends == 0);
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (watcher.messages.size() < 3 && std::chrono::steady_clock::now() < end) watcher.step();
  REQUIRE(watcher.messages.size() == 3);
  CHECK(watcher.messages.front().is_utf8);
}

TEST_CASE("the Last Will is that of the connection, and a robot that takes its leave has none", "[mqtt][meaning]") {
  if (!has_mosquitto()) return;
  const bool with_will = GENERATE(true, false);
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("r/ns/status");
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(options_of(broker.port()));
  REQUIRE(link);
  OutMessage will;
  will.topic = "r/ns/status";
  will.payload = std::make_shared<const std::string>("later");
  (*link)->set_will(will);
  (*link)->connect();
  Seen seen;
  until(**link, seen, [&] { return seen.connections > 0; });
  OutMessage last = will;
  last.payload = std::make_shared<const std::string>("leaves");
  REQUIRE((*link)->publish(last));
  (*link)->disconnect(with_will);
  const std::string expected = with_will ? "later" : "leaves";
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (watcher.payload("r/ns/status") != expected && std::chrono::steady_clock::now() < end) watcher.step();
  CHECK(watcher.payload("r/ns/status") == expected);
}

TEST_CASE("a link reports how many messages the broker takes at a time", "[mqtt][newest]") {
  Stranger stranger;
  Result<std::unique_ptr<Link>> link = make_mosquitto_link(options_of(stranger.port()));
  REQUIRE(link);
  (*link)->connect();
  Seen seen;
  const std::string accepted("\x20\x06\x00\x00\x03\x21\x00\x05", 8);  // Receive Maximum 5
  until(**link, seen, [&] {
    stranger.serve(accepted);
    return seen.connections > 0;
  });
  CHECK(seen.agreement.receive_maximum == 5);
}
