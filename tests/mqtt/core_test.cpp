// SPDX-License-Identifier: Apache-2.0
// What a bridge does, with a link that is none and a clock that is moved by hand.
#include "src/mqtt/bridge.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>

#include "src/http/robot_time.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::mqtt;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// What a test and its link share.
struct Wire {
  int attempts = 0;
  bool connects = true, congested = false, breaks = false, taken_over = false;
  bool hangs = false;  ///< the broker answers no probe
  std::vector<int> probes;
  int answered = 0;
  std::optional<Agreement> agreement;
  std::vector<OutMessage> sent;
  std::vector<int> acknowledged;
  std::vector<InMessage> incoming;
  std::vector<std::string> filters, kept_filters;
  std::string lost;  ///< not empty: the connection ends with this reason
  int next_id = 1, next_probe = 1;
  OutMessage will;
  bool leaves_will = false;
  std::string client_id;

  std::vector<std::string> topics() const {
    std::vector<std::string> all;
    for (const OutMessage& m : sent) all.push_back(m.topic);
    return all;
  }
  const OutMessage* newest(const std::string& topic) const {
    const OutMessage* found = nullptr;
    for (const OutMessage& m : sent)
      if (m.topic == topic) found = &m;
    return found;
  }
};

class FakeLink final : public Link {
 public:
  explicit FakeLink(Wire& wire) : wire_(wire) {}
  void connect() override {
    ++wire_.attempts;
    connecting_ = true;
  }
  void set_will(OutMessage will) override { wire_.will = std::move(will); }
  void disconnect(bool with_will) noexcept override {
    connected_ = connecting_ = false;
    wire_.leaves_will = with_will;
  }
  Result<int> probe() override {
    if (!connected_) return unexpected(Errc::closed, "gone");
    wire_.probes.push_back(wire_.next_probe);
    return wire_.next_probe++;
  }
  Result<void> subscribe(const std::string& filter, int, bool retained) override {
    wire_.filters.push_back(filter);
    if (retained) wire_.kept_filters.push_back(filter);
    return {};
  }
  Result<int> publish(const OutMessage& message) override {
    if (!connected_ || wire_.breaks) return unexpected(Errc::closed, "gone");
    if (message.payload && message.payload->size() > 100'000) return unexpected(Errc::limit_exceeded, "too large");
    wire_.sent.push_back(message);
    return message.qos == 0 ? 0 : wire_.next_id++;
  }
  bool is_congested() const noexcept override { return wire_.congested; }
  void step(Events& events) override {
    if (std::exchange(connecting_, false)) {
      connected_ = wire_.connects;
      if (connected_) events.connected(wire_.agreement.value_or(Agreement{0}));
      else events.disconnected("refused");
    }
    if (connected_ && !wire_.lost.empty()) {
      connected_ = false;
      if (std::exchange(wire_.taken_over, false)) events.taken_over();
      events.disconnected(std::exchange(wire_.lost, {}));
    }
    if (connected_ && !wire_.hangs)
      for (const int id : std::exchange(wire_.probes, {})) {
        events.confirmed(id);
        ++wire_.answered;
      }
    for (const int id : std::exchange(wire_.acknowledged, {})) events.acknowledged(id, false, {});
    for (InMessage& m : std::exchange(wire_.incoming, {})) events.received(std::move(m));
  }
  int descriptor() const noexcept override { return -1; }
  bool wants_write() const noexcept override { return false; }
  milliseconds step_interval() const noexcept override { return milliseconds(1'000); }

 private:
  Wire& wire_;
  bool connecting_ = false, connected_ = false;
};

struct Bench {
  explicit Bench(const std::function<void(mqtt::Options&)>& change = {}, const std::function<void(lrt::Options&)>& change_server = {}) {
    lrt::Options server_options;
    server_options.listen.transport = transport::no_network;
    server_options.threads.io = Io::in_poll;
    server_options.clock = &clock;
    server_options.identity.iri = "https://robots.example/r";
    if (change_server) change_server(server_options);
    server.emplace(Server::create(std::move(server_options)).value());
    Thing arm{"arm"};
    a = arm.property<double>("a");
    b = arm.property<double>("b");
    a.on_write([this](double value) { written.push_back(value); });
    server->add(std::move(arm)).value();
    a.publish(1);
    b.publish(2);
    mqtt::Options options;
    options.prefix = "r";
    options.description.publish = options.description.things = false;
    options.publications.resize(1);
    options.publications[0].kinds = {Kind::property};
    options.publications[0].minimum_interval = milliseconds(0);
    if (change) change(options);
    core = BridgeCore::create(*server, std::move(options), [this](LinkOptions link) -> Result<std::unique_ptr<Link>> {
             wire.will = link.will;
             wire.client_id = link.broker.client_id;
             return std::unique_ptr<Link>(std::make_unique<FakeLink>(wire));
           }).value();
  }
  milliseconds turn(milliseconds later = milliseconds(0)) {
    now += later;
    clock.advance(milliseconds(1));
    server->poll();
    server->poll();
    return core->advance(now, std::chrono::milliseconds(100));
  }
  void turns(int count = 10) {
    for (int i = 0; i < count; ++i) turn();
  }

  lrt::test::FakeClock clock;
  std::optional<Server> server;
  PushedProperty<double> a, b;
  std::vector<double> written;
  Wire wire;
  std::unique_ptr<BridgeCore> core;
  BridgeCore::Instant now{std::chrono::hours(1)};
};

std::string user_of(const OutMessage& message, const std::string& wanted) {
  for (const auto& [name, value] : message.user)
    if (name == wanted) return value;
  return {};
}
std::string seq_of(const OutMessage& message) { return user_of(message, "seq"); }

}  // namespace

TEST_CASE("pauses between attempts grow, are limited, and differ by chance", "[mqtt]") {
  const auto pauses_of = [] {
    Bench bench([](mqtt::Options& o) {
      o.broker.first_pause = milliseconds(100);
      o.broker.max_pause = milliseconds(1'000);
    });
    bench.wire.connects = false;
    std::vector<milliseconds> pauses;
    for (int i = 0; i < 12; ++i) {
      const milliseconds rest = bench.turn();
      pauses.push_back(rest);
      CHECK(bench.wire.attempts == i + 1);
      bench.turn(rest - milliseconds(1));
      CHECK(bench.wire.attempts == i + 1);
      bench.now += milliseconds(1);
    }
    return pauses;
  };
  const std::vector<milliseconds> pauses = pauses_of();
  milliseconds expected{100};
  for (const milliseconds pause : pauses) {
    CHECK(pause >= expected / 2);
    CHECK(pause <= expected * 3 / 2 + milliseconds(1));
    expected = std::min(2 * expected, milliseconds(1'000));
  }
  CHECK(pauses_of() != pauses);
}

TEST_CASE("a connection that lasts is followed by the short pause, and one that ends at once by a longer one", "[mqtt]") {
  Bench bench([](mqtt::Options& o) {
    o.broker.first_pause = milliseconds(100);
    o.broker.max_pause = milliseconds(100'000);
  });
  bench.wire.connects = false;
  for (int i = 0; i < 10; ++i) bench.turn(milliseconds(200'000));
  bench.wire.connects = true;
  bench.turn(milliseconds(200'000));
  CHECK(bench.core->counters().online);
  bench.wire.lost = "gone";
  CHECK(bench.turn(milliseconds(9'999)) >= milliseconds(50'000));
  CHECK_FALSE(bench.core->counters().online);
  bench.turn(milliseconds(200'000));
  CHECK(bench.core->counters().online);
  bench.wire.lost = "gone";
  CHECK(bench.turn(milliseconds(10'000)) <= milliseconds(151));
}

TEST_CASE("a robot that starts again has the same client id, and another identity another one", "[mqtt][identity]") {
  const auto id_of = [](const std::string& iri, const std::string& id = {}, const std::string& prefix = {}) {
    return Bench(
               [&](mqtt::Options& o) {
                 o.prefix = prefix;
                 o.broker.client_id = id;
               },
               [&](lrt::Options& o) { o.identity.iri = iri; })
        .wire.client_id;
  };
  const std::string id = id_of("https://robots.example/r7");
  CHECK(id == id_of("https://robots.example/r7", {}, "cell/left"));
  CHECK(id.substr(0, 7) == "lrt-r7-");
  CHECK(id != id_of("https://robots.example/cell/r7"));
  CHECK(id_of("urn:" + std::string(900, 'a')).size() <= 64);
  CHECK(id_of("urn:" + std::string(900, 'a')) != id_of("urn:" + std::string(901, 'a')));
  CHECK(id_of("urn:\xC3\xA4/b").find_first_not_of("-abcdefghijklmnopqrstuvwxyz0123456789") == std::string::npos);
  CHECK(id_of("urn:r7", "mine") == "mine");
}

TEST_CASE("a robot whose client id another one takes says so, and waits the longest pause before it takes it back", "[mqtt][identity]") {
  std::string log;
  Bench bench([&](mqtt::Options& o) {
    o.broker.first_pause = milliseconds(100);
    o.broker.max_pause = milliseconds(100'000);
    o.log = [&](LogLevel, std::string_view text) { log.append(text).append("\n"); };
  });
  bench.turns();
  bench.wire.taken_over = true;
  bench.wire.lost = "Session taken over";
  CHECK(bench.turn(seconds(20)) >= milliseconds(50'000));
  CHECK(log.find("another client has connected as \"" + bench.wire.client_id + "\"") != std::string::npos);
  CHECK(bench.core->counters().taken_over == 1);
  // The next end of a connection is an ordinary one.
  bench.turn(seconds(200));
  CHECK(bench.core->counters().online);
  bench.wire.lost = "gone";
  CHECK(bench.turn(seconds(20)) <= milliseconds(151));
}

TEST_CASE("the status that a broker has kept shows another robot at each further connection", "[mqtt][identity]") {
  std::string log;
  Bench bench([&](mqtt::Options& o) { o.log = [&](LogLevel, std::string_view text) { log.append(text).append("\n"); }; });
  const auto kept = [&](const std::string& payload) {
    InMessage message;
    message.topic = "r/ns/status";
    message.payload = payload;
    message.retained = true;
    bench.wire.incoming.push_back(message);
  };
  const auto again = [&] {
    bench.wire.lost = "gone";
    bench.turns();
    bench.turn(seconds(200));
    CHECK(bench.core->counters().online);
  };
  bench.turns();
  CHECK(bench.wire.kept_filters == std::vector<std::string>{"r/ns/status"});
  kept(R"({"online":false,"session":"of an earlier run","identity":{"iri":"https://robots.example/r"}})");
  bench.turns();
  again();
  kept(*bench.wire.newest("r/ns/status")->payload);  // its own
  bench.turns();
  again();
  kept(R"({"online":false,"session":"of an earlier run","identity":{"iri":"https://robots.example/r"}})");  // of a broker that was restored
  bench.turns();
  CHECK(bench.core->counters().taken_over == 0);
  CHECK(log.find("another") == std::string::npos);
  again();
  // It was no earlier run: that robot has connected since then.
  kept(R"({"online":true,"session":"of an earlier run","since":"2026-11-29T08:00:00Z","identity":{"iri":"https://robots.example/r"}})");
  bench.turns();
  CHECK(bench.core->counters().taken_over == 1);
  again();
  kept(R"({"online":false,"session":"unknown","identity":{"iri":"https://robots.example/r"}})");
  bench.turns();
  CHECK(bench.core->counters().taken_over == 2);
  CHECK(log.find("another robot is <https://robots.example/r>, too") != std::string::npos);
  CHECK(bench.core->counters().dropped_commands == 0);
}

TEST_CASE("a bridge that is told to reconnect does so at once", "[mqtt][identity]") {
  Bench bench;
  bench.turns();
  REQUIRE(bench.wire.attempts == 1);
  bench.core->reconnect();
  bench.turns();
  CHECK(bench.wire.attempts == 2);
  CHECK(bench.core->counters().online);
  CHECK(bench.core->counters().connections == 2);
  // Also while it waits for its broker.
  bench.wire.connects = false;
  bench.wire.lost = "gone";
  bench.turns();
  const int before = bench.wire.attempts;
  bench.core->reconnect();
  bench.turn();
  CHECK(bench.wire.attempts == before + 1);
}

TEST_CASE("the Last Will of an older connection is overwritten, and robots with one prefix do not contradict each other", "[mqtt]") {
  std::string log;
  Bench bench([&](mqtt::Options& o) { o.log = [&](LogLevel, std::string_view text) { log.append(text); }; });
  const auto count = [&] {
    const std::vector<std::string> topics = bench.wire.topics();
    return std::count(topics.begin(), topics.end(), "r/ns/status");
  };
  const auto see = [&](const std::string& payload) {
    InMessage message;
    message.topic = "r/ns/status";
    message.payload = payload;
    bench.wire.incoming.push_back(message);
  };
  bench.turns();
  CHECK(count() == 1);
  see(R"({"online":false,"session":"old"})");
  see(R"({"online":false,"session":"older"})");
  bench.turns();
  CHECK(count() == 1);  // at most one in a second
  CHECK(bench.turn() <= seconds(1));
  bench.turn(seconds(1));
  CHECK(count() == 2);
  CHECK(bench.wire.sent.back().payload->find(R"({"online":true)") == 0);
  bench.turn(seconds(5));
  CHECK(log.find("another robot") == std::string::npos);
  see(R"({"online":true,"session":"another"})");
  bench.turn(seconds(5));
  bench.turn(seconds(5));
  CHECK(count() == 2);
  CHECK(log.find("another robot") != std::string::npos);
  CHECK(bench.core->counters().dropped_commands == 0);
}

TEST_CASE("what was not acknowledged is sent again on the next connection, in its order, and the status only anew", "[mqtt]") {
  Bench bench([](mqtt::Options& o) {
    o.publications[0].qos = 1;
    o.publications[0].queue_length = 10;
    o.publications[0].retain = false;  // else the newest value would be sent, too
    o.broker.max_pause = milliseconds(500);
  });
  bench.turns();
  bench.a.publish(3);
  bench.turns();
  REQUIRE(bench.wire.sent.size() == 4);  // the status, a, b, a
  const std::vector<OutMessage> first = bench.wire.sent;
  bench.wire.acknowledged = {2};
  bench.turn();
  const std::uint64_t published = bench.core->counters().published;
  for (int round = 0; round < 3; ++round) {
    bench.wire.lost = "gone";
    bench.turn();
    CHECK(bench.core->counters().unacknowledged == 2);
    bench.wire.sent.clear();
    bench.turn(seconds(10));
    CAPTURE(round);
    REQUIRE(bench.wire.sent.size() == 3);
    CHECK(bench.wire.sent[0].topic == "r/ns/status");
    for (const std::size_t i : {1U, 2U}) {
      CHECK(bench.wire.sent[i].topic == first[i + 1].topic);
      CHECK(bench.wire.sent[i].payload == first[i + 1].payload);
      CHECK(seq_of(bench.wire.sent[i]) == seq_of(first[i + 1]));
    }
    CHECK(bench.core->counters().unacknowledged == 3);
  }
  CHECK(bench.core->counters().published == published + 3);  // the status
  bench.wire.acknowledged = {bench.wire.next_id - 1, bench.wire.next_id - 2, bench.wire.next_id - 3};
  bench.turn();
  bench.wire.lost = "gone";
  bench.turn();
  bench.wire.sent.clear();
  bench.turn(seconds(10));
  CHECK(bench.wire.sent.size() == 1);
}

TEST_CASE("the Last Will says since when the robot was online, and a robot that takes its leave since when it is not", "[mqtt][meaning]") {
  Bench bench([](mqtt::Options& o) { o.broker.max_pause = milliseconds(500); });
  bench.turns();
  const auto since = [](const std::string& text, const std::string& member) {
    const std::size_t at = text.find("\"" + member + "\":\"");
    return at == std::string::npos ? std::string() : text.substr(at + member.size() + 4, 27);
  };
  REQUIRE(bench.wire.newest("r/ns/status"));
  const std::string online = *bench.wire.newest("r/ns/status")->payload, will = *bench.wire.will.payload;
  CHECK(since(online, "since").back() == 'Z');
  CHECK(since(will, "onlineSince") == since(online, "since"));
  CHECK(since(will, "since").empty());  // nobody knows it now
  CHECK(will.find("\"keepAlive\":15") != std::string::npos);
  bench.wire.lost = "gone";
  bench.turn();
  bench.turn(seconds(10));
  bench.turns();
  REQUIRE(bench.core->counters().connections == 2);
  CHECK(since(*bench.wire.will.payload, "onlineSince") >= since(will, "onlineSince"));
  bench.core->stop();
  const std::string last = *bench.wire.newest("r/ns/status")->payload;
  CHECK(last.find("{\"online\":false") == 0);
  CHECK(since(last, "since") >= since(last, "onlineSince"));
  CHECK(bench.wire.newest("r/ns/status")->retain);
  CHECK_FALSE(bench.wire.leaves_will);
}

TEST_CASE("a robot that cannot take its leave leaves its Last Will", "[mqtt][meaning]") {
  Bench bench;
  bench.turns();
  bench.wire.congested = true;
  bench.core->stop();
  CHECK(bench.wire.leaves_will);
}

TEST_CASE("the Last Will is retained and at the status topic", "[mqtt]") {
  Bench bench;
  CHECK(bench.wire.will.topic == "r/ns/status");
  CHECK(bench.wire.will.retain);
  CHECK(bench.wire.will.payload->find("{\"online\":false") == 0);
  bench.turns();
  REQUIRE_FALSE(bench.wire.sent.empty());
  CHECK(bench.wire.sent.front().topic == "r/ns/status");
  CHECK(bench.wire.sent.front().payload->find("{\"online\":true") == 0);
}

TEST_CASE("messages with QoS 0 have aliases as far as the broker allows, anew on each connection", "[mqtt]") {
  Bench bench;
  bench.wire.agreement = Agreement{1};
  bench.turns();
  REQUIRE(bench.wire.newest("r/arm/a"));
  REQUIRE(bench.wire.newest("r/arm/b"));
  CHECK(bench.wire.newest("r/arm/a")->alias + bench.wire.newest("r/arm/b")->alias == 1);
  const bool first = bench.wire.newest("r/arm/a")->alias == 1;
  bench.wire.sent.clear();
  bench.a.publish(3);
  bench.b.publish(4);
  bench.turns();
  REQUIRE(bench.wire.sent.size() == 2);
  for (const OutMessage& m : bench.wire.sent) {
    CHECK(m.topic == (m.alias == 1 ? "" : first ? "r/arm/b" : "r/arm/a"));
    CHECK(seq_of(m) == "2");
  }
  bench.wire.lost = "gone";
  bench.turn();
  bench.wire.sent.clear();
  bench.turn(seconds(10));
  bench.turns();
  CHECK(bench.wire.newest("r/arm/a"));
  CHECK(bench.wire.newest("r/arm/b"));
}

TEST_CASE("messages with QoS 1 have no alias, because they may be repeated on another connection", "[mqtt]") {
  Bench bench([](mqtt::Options& o) { o.publications[0].qos = 1; });
  bench.wire.agreement = Agreement{100};
  bench.turns();
  CHECK(bench.wire.newest("r/arm/a")->alias == 0);
}

TEST_CASE("while messages wait for their acknowledgement, values wait in the server", "[mqtt]") {
  Bench bench([](mqtt::Options& o) {
    o.publications[0].qos = 1;
    o.publications[0].queue_length = 5;
    o.limits.max_unacknowledged = 3;
  });
  bench.turns();
  CHECK(bench.core->counters().unacknowledged == 3);  // the status, a, b
  const std::size_t sent = bench.wire.sent.size();
  for (int i = 10; i < 20; ++i) {
    bench.a.publish(i);
    bench.turns(3);
  }
  CHECK(bench.wire.sent.size() == sent);
  CHECK(bench.core->counters().unacknowledged == 3);
  bench.wire.acknowledged = {1, 2, 3, 4'711};
  bench.turns();
  // The queue had place for five of ten. The gap shows.
  const auto& messages = bench.wire.sent;
  REQUIRE(messages.size() > sent);
  CHECK(messages[sent].topic == "r/arm/a");
  CHECK(std::stoi(seq_of(messages[sent])) > 2);
  CHECK(bench.core->counters().acknowledged == 3);
}

TEST_CASE("what comes and goes while there is no broker is forgotten", "[mqtt]") {
  const std::size_t queue_length = GENERATE(0U, 5U);
  Bench bench([&](mqtt::Options& o) {
    o.publications[0].queue_length = queue_length;
    o.publications[0].retain = true;
  });
  bench.wire.connects = false;
  bench.turns(3);
  const auto come_and_go = [&](int i) {
    Thing thing{"t" + std::to_string(i)};
    thing.property<int>("x").publish(i);
    REQUIRE(bench.server->add(std::move(thing)));
    bench.turn();
    REQUIRE(bench.server->remove("t" + std::to_string(i)));
    bench.turn();
  };
  for (int i = 0; i < 1'100; ++i) come_and_go(i);
  bench.turns(3);
  CHECK(bench.core->counters().resources <= (queue_length == 0 ? 2 : 1'002));  // a queue is kept until it can be sent
  bench.wire.connects = true;
  bench.turn(seconds(60));
  for (int i = 0; i < 100; ++i) {
    bench.turn();
    for (int id = 1; id < bench.wire.next_id; ++id) bench.wire.acknowledged.push_back(id);
  }
  CHECK(bench.core->counters().resources == 2);
  for (int i = 0; i < 1'100; ++i) {
    const OutMessage* const last = bench.wire.newest("r/t" + std::to_string(i) + "/x");
    REQUIRE(last);
    CHECK_FALSE(last->payload);
    CHECK(last->retain);
  }
}

TEST_CASE("a retained value with a queue is written again when the broker returns", "[mqtt]") {
  const bool retain = GENERATE(true, false);
  Bench bench([&](mqtt::Options& o) {
    o.publications[0].queue_length = 5;
    o.publications[0].retain = retain;
  });
  bench.turns();
  REQUIRE(bench.wire.newest("r/arm/a"));
  bench.wire.sent.clear();
  bench.wire.lost = "gone";
  bench.turn();
  bench.turn(seconds(60));
  bench.turns();
  REQUIRE(bench.core->counters().connections == 2);
  REQUIRE((bench.wire.newest("r/arm/a") != nullptr) == retain);
  if (!retain) return;
  CHECK(*bench.wire.newest("r/arm/a")->payload == "1");
  CHECK(seq_of(*bench.wire.newest("r/arm/a")) == "2");
  bench.wire.sent.clear();
  bench.a.publish(7);
  bench.turns();
  CHECK(*bench.wire.newest("r/arm/a")->payload == "7");
}

TEST_CASE("log lines that clients cause are limited in time", "[mqtt]") {
  std::vector<std::string> lines;
  Bench bench([&](mqtt::Options& o) { o.log = [&](LogLevel, std::string_view text) { lines.emplace_back(text); }; });
  bench.turns();
  const auto warn = [&](const std::string& filter) {
    lines.clear();
    for (int i = 0; i < 30; ++i) {
      InMessage message;
      message.topic = i % 2 == 0 ? "r/ns/put/arm/a" : "r/ns/status";  // commands are off; another robot
      message.payload = R"({"online":true})";
      bench.wire.incoming.push_back(message);
      bench.turn();
    }
    return std::count_if(lines.begin(), lines.end(), [&](const std::string& line) { return line.find(filter) != std::string::npos; });
  };
  CHECK(warn("command") == 5);
  CHECK(warn("command") == 0);
  bench.now += seconds(10);
  CHECK(warn("50 further messages") == 1);
}

TEST_CASE("a bridge disconnects when its server has stopped", "[mqtt]") {
  Bench bench;
  bench.turns();
  REQUIRE(bench.core->counters().online);
  bench.server->stop();
  bench.turns(3);
  CHECK_FALSE(bench.core->counters().online);
  const int attempts = bench.wire.attempts;
  bench.turn(seconds(100));
  CHECK(bench.wire.attempts == attempts);
}

TEST_CASE("a description that the owner may no longer read is deleted at the broker", "[mqtt]") {
  const lrt::test::Folder folder;
  const auto allow = [&](const std::string& roles) {
    std::ofstream(folder / "tokens") << "owner " << roles << " owner-0123456789abcdef\n";
    ::chmod((folder / "tokens").c_str(), 0600);
  };
  allow("reader");
  Bench bench(
      [](mqtt::Options& o) {
        o.description.publish = true;
        o.owner = std::make_shared<const security::Principal>(security::Principal{"owner", {"reader"}});
      },
      [&](lrt::Options& o) { o.security.token_file = folder / "tokens"; });
  bench.turns(20);
  REQUIRE(bench.wire.newest("r/ns/description"));
  CHECK(bench.wire.newest("r/ns/description")->payload);
  REQUIRE(bench.wire.newest("r/arm/a"));
  std::remove((folder / "tokens").c_str());
  allow("nobody");
  for (int i = 0; i < 100 && bench.wire.newest("r/ns/description")->payload; ++i) {
    bench.clock.advance(seconds(2));
    bench.turn(seconds(2));
  }
  CHECK_FALSE(bench.wire.newest("r/ns/description")->payload);
  CHECK(bench.wire.newest("r/ns/description")->retain);
}

TEST_CASE("a congested network stops the bridge, not the robot", "[mqtt]") {
  Bench bench;
  bench.turns();
  bench.wire.sent.clear();
  bench.wire.congested = true;
  for (int i = 0; i < 50; ++i) {
    bench.a.publish(i);
    CHECK(bench.turn() > milliseconds(0));
  }
  CHECK(bench.wire.sent.empty());
  bench.wire.congested = false;
  bench.turns();
  REQUIRE(bench.wire.newest("r/arm/a"));
  CHECK(*bench.wire.newest("r/arm/a")->payload == "49");
}

TEST_CASE("a message that finds the connection broken is sent on the next one", "[mqtt]") {
  Bench bench([](mqtt::Options& o) {
    o.publications[0].queue_length = 10;
    o.publications[0].retain = false;
    o.publications[0].qos = 1;
  });
  bench.turns();
  bench.wire.sent.clear();
  bench.wire.breaks = true;
  bench.a.publish(7);
  bench.turns();
  bench.wire.breaks = false;
  bench.wire.lost = "gone";
  bench.turn();
  bench.turn(seconds(10));
  bench.turns();
  REQUIRE(bench.wire.newest("r/arm/a"));
  CHECK(*bench.wire.newest("r/arm/a")->payload == "7");
  CHECK(seq_of(*bench.wire.newest("r/arm/a")) == "2");
}

TEST_CASE("a message that is too large is counted, and others follow", "[mqtt]") {
  Bench bench;
  Thing big{"big"};
  big.property<std::string>("text").publish(std::string(200'000, 'x'));
  REQUIRE(bench.server->add(std::move(big)));
  bench.turns();
  CHECK(bench.core->counters().refused == 1);
  CHECK(bench.wire.newest("r/arm/a"));
}

TEST_CASE("a bridge that has stopped does nothing", "[mqtt]") {
  Bench bench;
  bench.turns();
  bench.core->stop();
  const std::size_t sent = bench.wire.sent.size();
  bench.a.publish(5);
  bench.turns();
  CHECK(bench.wire.sent.size() == sent);
  CHECK_FALSE(bench.core->counters().online);
}

TEST_CASE("messages from the broker without commands are dropped", "[mqtt]") {
  Bench bench;
  bench.turns();
  CHECK(bench.wire.filters == std::vector<std::string>{"r/ns/status"});
  InMessage message;
  message.topic = "r/ns/put/arm/a";
  message.payload = "1";
  bench.wire.incoming.push_back(message);
  bench.turns();
  CHECK(bench.core->counters().dropped_commands == 1);
  CHECK(bench.core->counters().commands == 0);
}

namespace {

/// A robot that takes commands.
struct Commanded : Bench {
  explicit Commanded(milliseconds interval = seconds(1))
      : Bench([interval](mqtt::Options& o) {
          o.commands.enabled = o.commands.allow_unprotected = true;
          o.commands.time_interval = interval;
        }) {
    turns();
  }
  /// The stamp of now and a time.
  std::string in(milliseconds time) {
    http::RobotTime stamp = *http::RobotTime::parse(core->feed().robot_time());
    stamp.milliseconds += static_cast<std::uint64_t>(time.count());
    return stamp.text();
  }
  /// The status of the response to a write of `a`.
  std::string status(const std::string& payload, UserProperties user = {}, std::optional<seconds> expiry = {}) {
    InMessage message;
    message.topic = "r/ns/put/arm/a";
    message.payload = payload;
    message.user = std::move(user);
    message.response_topic = "replies/me";
    message.expiry = expiry;
    wire.incoming.push_back(message);
    turns(20);
    const OutMessage* const response = wire.newest("replies/me");
    REQUIRE(response);
    std::string found;
    for (const auto& [name, value] : response->user) {
      if (name == "status") found = value;
      if (name == "robot-time") CHECK(http::RobotTime::parse(value));
    }
    if (found == "412") CHECK(response->payload->find("LateCommand") != std::string::npos);
    return found;
  }
};

}  // namespace

TEST_CASE("a command says until when it is valid in a user property, or in its payload", "[mqtt][expiry]") {
  Commanded robot;
  const std::string late = robot.in(milliseconds(0)), soon = robot.in(std::chrono::hours(1));
  robot.turns();
  CHECK(robot.status("1") == "204");
  CHECK(robot.status("2", {{"valid-until", soon}}) == "204");
  CHECK(robot.status("3", {{"valid-until", late}}) == "412");
  CHECK(robot.status("3", {{"valid-until", "0000000000000000/99999999999"}}) == "412");
  CHECK(robot.status("3", {{"valid-until", "soon"}}) == "400");
  CHECK(robot.status("3", {{"valid-until", soon}, {"valid-until", soon}}) == "400");
  CHECK(robot.status(R"({"validUntil":")" + soon + R"(","value":4})") == "204");
  CHECK(robot.status(R"( { "validUntil" : ")" + soon + R"(" , "value" : 5 } )") == "204");
  CHECK(robot.status(R"({"validUntil":")" + late + R"(","value":6})") == "412");
  CHECK(robot.status(R"({"validUntil":"soon","value":6})") == "400");
  CHECK(robot.status(R"({"validUntil":")" + soon + R"("})").substr(0, 1) == "4");  // no value is left
  CHECK(robot.status(R"({"validUntil":")" + soon + R"(","value":6)").substr(0, 1) == "4");
  CHECK(robot.written == std::vector<double>{1, 2, 4, 5});
}

TEST_CASE("the message expiry of a command counts, whichever is earlier", "[mqtt][expiry]") {
  Commanded robot;
  CHECK(robot.status("1", {}, seconds(60)) == "204");
  CHECK(robot.status("2", {}, seconds(0)) == "412");
  CHECK(robot.status("2", {{"valid-until", robot.in(std::chrono::hours(1))}}, seconds(0)) == "412");
  CHECK(robot.status("2", {{"valid-until", robot.in(milliseconds(0))}}, seconds(60)) == "412");
  CHECK(robot.written == std::vector<double>{1});
}

TEST_CASE("a robot that takes commands says its time", "[mqtt][expiry]") {
  Commanded robot;
  const auto times = [&] {
    return std::count_if(robot.wire.sent.begin(), robot.wire.sent.end(), [](const OutMessage& m) { return m.topic == "r/ns/time"; });
  };
  CHECK(times() == 1);
  CHECK(robot.turn() <= milliseconds(1'000));
  robot.turn(milliseconds(999));
  CHECK(times() == 1);
  robot.turn(milliseconds(1));
  CHECK(times() == 2);
  const OutMessage& last = *robot.wire.newest("r/ns/time");
  CHECK(http::RobotTime::parse(*last.payload));
  CHECK_FALSE(last.retain);
  Commanded quiet(milliseconds(0));
  quiet.turn(seconds(10));
  CHECK_FALSE(quiet.wire.newest("r/ns/time"));
}

TEST_CASE("by default the newest values are retained, and each change of an invocation is sent with QoS 1", "[mqtt]") {
  const std::vector<Publication> publications = default_publications();
  REQUIRE(publications.size() == 2);
  CHECK(publications[0].kinds == std::vector<Kind>{Kind::property, Kind::control});
  CHECK(publications[0].qos == 0);
  CHECK(publications[0].retain);
  CHECK(publications[1].kinds == std::vector<Kind>{Kind::invocation});
  CHECK(publications[1].qos == 1);
  CHECK_FALSE(publications[1].retain);
  for (const Publication& p : publications) {
    CHECK(p.paths == "/**");
    CHECK(p.publish);
    CHECK(p.media_type == "application/json");
    CHECK_FALSE(p.minimum_interval);
    CHECK(p.form == Form::value);
    CHECK_FALSE(p.queue_length);  // each change of an invocation, see Publication::queue_length
  }
  CHECK(mqtt::Options().publications.size() == publications.size());
}

TEST_CASE("a bridge with the default publications sends each value once, and neither states, Things nor actions", "[mqtt]") {
  Bench bench([](mqtt::Options& options) { options.publications = default_publications(); });
  bench.turns();
  for (const char* const topic : {"r/arm/a", "r/arm/b"}) {
    CAPTURE(topic);
    REQUIRE(bench.wire.newest(topic));
    CHECK(bench.wire.newest(topic)->retain);
    CHECK(bench.wire.newest(topic)->qos == 0);
  }
  CHECK(bench.wire.newest("r/arm") == nullptr);
  const std::vector<std::string> topics = bench.wire.topics();
  CHECK(std::count_if(topics.begin(), topics.end(), [](const std::string& topic) { return topic.find("r/arm") == 0; }) == 2);
}

TEST_CASE("a broker keeps whether the robot is stopped, as each client sees it", "[mqtt][stop]") {
  Bench bench;
  bool flag = false;
  Thing base{"base"};
  base.action("stop", [&] { flag = true; }).stop([&] { return flag; });
  bench.server->add(std::move(base)).value();
  const auto says = [&](const std::string& text) {
    bench.clock.advance(milliseconds(150));
    bench.turns(20);
    const OutMessage* const newest = bench.wire.newest("r/base/stopped");
    REQUIRE(newest);
    CHECK(newest->retain);
    CHECK(newest->payload->find(text) != std::string::npos);
  };
  says(R"({"stopped":false})");
  flag = true;  // at the hardware
  says(R"("by":"the robot itself")");
  flag = false;
  says(R"({"stopped":false})");
}

TEST_CASE("values are sent with their time, unit, datatype and frame", "[mqtt][meaning]") {
  Bench bench;
  Thing base{"base"};
  base.property<double>("speed", unit::metre_per_second).frame(Object::resource("base")).publish(0.5);
  bench.server->add(std::move(base)).value();
  bench.turns(20);
  const OutMessage* const speed = bench.wire.newest("r/base/speed");
  REQUIRE(speed);
  CHECK(user_of(*speed, "unit") == vocab::unit_::M_PER_SEC.text);
  CHECK(user_of(*speed, "datatype") == vocab::xsd::double_.text);
  CHECK(user_of(*speed, "frame") == bench.core->feed().base() + "/base");
  CHECK(user_of(*speed, "time").find('T') == 10);
  CHECK(user_of(*speed, "time").back() == 'Z');
  CHECK(speed->is_utf8);
  REQUIRE(bench.wire.newest("r/arm/a"));
  CHECK(user_of(*bench.wire.newest("r/arm/a"), "unit").empty());
}

TEST_CASE("what the values of a Thing that is gone meant is not kept", "[mqtt][meaning]") {
  Bench bench;
  bench.turns();
  const std::size_t before = bench.core->meanings();
  for (int i = 0; i < 50; ++i) {
    const std::string name = "seen" + std::to_string(i);
    Thing seen{name};
    for (const char* const property : {"x", "y"}) seen.property<double>(property, unit::metre).frame(Object::resource(name)).publish(i);
    bench.server->add(std::move(seen)).value();
    bench.turns(3);
    CHECK(bench.core->meanings() == before + 1);
    CHECK(bench.wire.newest("r/" + name + "/y") != nullptr);
    bench.server->remove(name).value();
    bench.turns(3);
  }
  CHECK(bench.core->meanings() == before);
}

TEST_CASE("the form for MQTT 3.1.1 has what user properties have", "[mqtt][meaning]") {
  Bench bench([](mqtt::Options& o) { o.publications[0].form = Form::with_meaning; });
  bench.turns();
  REQUIRE(bench.wire.newest("r/arm/a"));
  const std::string text = *bench.wire.newest("r/arm/a")->payload;
  CHECK(text.find(R"({"value":1,"seq":1,"time":"20)") == 0);
  CHECK(text.find(R"("datatype":"http://www.w3.org/2001/XMLSchema#double")") != std::string::npos);
}

TEST_CASE("what a form needs is checked when the bridge is made", "[mqtt][meaning]") {
  lrt::Options server_options;
  server_options.listen.transport = transport::no_network;
  server_options.listen.public_base = "http://robot.example";
  Server server = Server::create(std::move(server_options)).value();
  const auto refused = [&](const std::function<void(Publication&)>& change) {
    mqtt::Options options;
    options.prefix = "r";
    change(options.publications.front());
    const auto made = Bridge::create(server, std::move(options));
    return !made && made.error().code == Errc::invalid_option;
  };
  CHECK(refused([](Publication& p) {
    p.form = Form::with_meaning;
    p.media_type = "application/cbor";
  }));
  CHECK(refused([](Publication& p) { p.minimum_interval = milliseconds(-1); }));
  CHECK_FALSE(refused([](Publication& p) { p.form = Form::with_meaning; }));
}

TEST_CASE("by default a value is sent ten times in a second at most, a counter once in ten seconds, each change of a queue at once",
          "[mqtt][defaults]") {
  Bench bench([](mqtt::Options& o) {
    Publication each;
    each.paths = "/arm/b";
    each.queue_length = 100;
    o.publications = default_publications();
    o.publications.insert(o.publications.begin(), each);
  });
  Thing counts{"counts"};
  int count = 0;
  PushedProperty<int> counter = counts.property<int>("n").as_counter();
  bench.server->add(std::move(counts)).value();
  for (int ms = 0; ms < 1'000; ++ms) {
    bench.a.publish(ms);
    bench.b.publish(ms);
    counter.publish(++count);
    bench.turn(milliseconds(1));
  }
  const std::vector<std::string> topics = bench.wire.topics();
  const auto sent = [&](const char* topic) { return std::count(topics.begin(), topics.end(), topic); };
  CHECK(sent("r/arm/a") >= 9);
  CHECK(sent("r/arm/a") <= 12);
  CHECK(sent("r/arm/b") > 50);
  CHECK(sent("r/counts/n") == 1);
}

TEST_CASE("documents of the server are not published by default", "[mqtt][defaults]") {
  Bench bench([](mqtt::Options& o) { o.publications = default_publications(); });
  bench.server->add(server_thing(*bench.server)).value();
  bench.turns(40);
  CHECK(bench.wire.newest("r/server/requests"));
  CHECK_FALSE(bench.wire.newest("r/server/metrics"));
  Bench all([](mqtt::Options& o) { o.publications[0].kinds = {Kind::document}; });
  all.server->add(server_thing(*all.server)).value();
  all.turns(40);
  CHECK(all.wire.newest("r/server/metrics"));
}

TEST_CASE("while the broker confirms nothing, values wait in the server, and the newest one is sent then", "[mqtt][newest]") {
  const int qos = GENERATE(0, 1, 2);
  Bench bench([&](mqtt::Options& o) {
    o.publications[0].qos = qos;
    o.limits.max_unacknowledged = 60'000;
  });
  bench.turns();
  bench.wire.hangs = true;
  std::size_t before = 0;
  int value = 100;
  // It stops by itself.
  for (int quiet = 0; quiet < 50; ++quiet) {
    before = bench.wire.sent.size();
    bench.a.publish(++value);
    bench.turns(3);
    if (bench.wire.sent.size() != before) quiet = 0;
    REQUIRE(bench.wire.sent.size() < 10'000);
  }
  CHECK(bench.turn(seconds(3)) > milliseconds(0));
  CHECK(bench.core->counters().lag >= seconds(3));
  before = bench.wire.sent.size();
  bench.wire.hangs = false;
  bench.turns();
  REQUIRE(bench.wire.sent.size() > before);
  CHECK(*bench.wire.sent[before].payload == std::to_string(value));
  bench.turns();
  CHECK(bench.core->counters().left_out > 0);
  CHECK(bench.core->counters().lag == milliseconds(0));
}

TEST_CASE("what was left out is what a receiver misses, over connections that break, too", "[mqtt][newest]") {
  Bench bench([](mqtt::Options& o) { o.broker.max_pause = milliseconds(500); });
  bench.turns();
  int value = 1;
  std::uint64_t seed = 20'26;
  for (int round = 0; round < 400; ++round) {
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    const auto chance = [&](unsigned one_of) { return (seed >> 33) % one_of == 0; };
    bench.wire.hangs = (seed >> 40) % 4 == 0;
    bench.wire.congested = (seed >> 45) % 4 == 0;
    if (chance(11)) bench.wire.breaks = true;
    for (std::uint64_t i = 0; i < (seed >> 50) % 5; ++i) {
      bench.a.publish(++value);
      if ((seed >> (51 + i)) % 2 == 0) bench.turn();
    }
    bench.turns(2);
    if (bench.wire.breaks || chance(17)) {
      bench.wire.breaks = false;
      bench.wire.lost = "gone";
      bench.turn();
      bench.turn(seconds(10));
    }
  }
  bench.wire.hangs = bench.wire.congested = bench.wire.breaks = false;
  bench.a.publish(++value);
  bench.turn(seconds(10));
  bench.turns(20);
  REQUIRE(bench.wire.newest("r/arm/a"));
  CHECK(*bench.wire.newest("r/arm/a")->payload == std::to_string(value));
  std::set<int> got;
  for (const OutMessage& m : bench.wire.sent)
    if (m.topic == "r/arm/a" && m.payload) got.insert(std::stoi(*m.payload));
  REQUIRE(*got.begin() == 1);
  CHECK(got.size() < static_cast<std::size_t>(value));
  CHECK(bench.core->counters().left_out == static_cast<std::uint64_t>(value) - got.size());
}

TEST_CASE("values of a topic with a queue are never replaced: they are in order, and a slow broker gets each", "[mqtt][newest]") {
  const int qos = GENERATE(0, 1);
  Bench bench([&](mqtt::Options& o) {
    o.publications[0].queue_length = 1'000;
    o.publications[0].qos = qos;
    o.limits.max_unacknowledged = 60'000;
  });
  bench.turns();
  for (int i = 10; i < 310; ++i) {
    bench.wire.hangs = i % 100 != 0;
    bench.a.publish(i);
    bench.turns(3);
  }
  bench.wire.hangs = false;
  bench.turns(200);
  int next = 10;
  std::uint64_t sequence = 2;
  for (const OutMessage& m : bench.wire.sent) {
    if (m.topic != "r/arm/a" || *m.payload == "1") continue;
    CHECK(*m.payload == std::to_string(next++));
    CHECK(seq_of(m) == std::to_string(sequence++));
  }
  CHECK(next == 310);
  CHECK(bench.core->counters().left_out == 0);
}

TEST_CASE("a bridge has no more unacknowledged messages than the broker takes at a time", "[mqtt][newest]") {
  Bench bench([](mqtt::Options& o) {
    o.publications[0].qos = 1;
    o.publications[0].queue_length = 100;
  });
  bench.wire.agreement = Agreement{0, 5};
  bench.turns();
  for (int i = 10; i < 50; ++i) {
    bench.a.publish(i);
    bench.turns(3);
    CHECK(bench.core->counters().unacknowledged <= 5);
  }
  CHECK(bench.core->counters().unacknowledged == 5);
}

TEST_CASE("each Thing is described in JSON at the broker, anew when it changes, and no longer when it is gone", "[mqtt][meaning]") {
  Bench bench([](mqtt::Options& o) {
    o.description.things = true;
    o.description.minimum_interval = milliseconds(10);
    o.home_assistant.emplace();
    o.broker.max_pause = milliseconds(500);
  });
  bench.turns(20);
  const OutMessage* arm = bench.wire.newest("r/ns/things/arm");
  REQUIRE(arm);
  CHECK(arm->retain);
  CHECK(arm->qos == 1);
  CHECK(arm->payload->find(R"("topic":"r/arm/a")") != std::string::npos);
  const std::string discovery = "homeassistant/device/" + id_of("r/arm") + "/config";
  REQUIRE(bench.wire.newest(discovery));
  CHECK(bench.wire.newest(discovery)->payload->find(R"("state_topic":"r/arm/a")") != std::string::npos);

  Thing tool{"tool"};
  tool.property<double>("width").publish(1);
  bench.server->add(std::move(tool)).value();
  for (int i = 0; i < 20; ++i) bench.turn(milliseconds(10));
  REQUIRE(bench.wire.newest("r/ns/things/tool"));
  CHECK(bench.wire.newest("r/ns/things/tool")->payload->find(R"("topic":"r/tool/width")") != std::string::npos);
  const std::vector<std::string> topics = bench.wire.topics();
  CHECK(std::count(topics.begin(), topics.end(), "r/ns/things/arm") == 1);  // it is the same

  bench.server->remove("tool").value();
  for (int i = 0; i < 20; ++i) bench.turn(milliseconds(10));
  CHECK_FALSE(bench.wire.newest("r/ns/things/tool")->payload);
  CHECK_FALSE(bench.wire.newest("homeassistant/device/" + id_of("r/tool") + "/config")->payload);

  bench.wire.sent.clear();
  bench.wire.lost = "gone";
  bench.turn();
  bench.turn(seconds(10));
  for (int i = 0; i < 20; ++i) bench.turn(milliseconds(10));
  CHECK(bench.wire.newest("r/ns/things/arm"));  // the broker may have lost it
  // At most its deletion again, which was not acknowledged.
  CHECK((!bench.wire.newest("r/ns/things/tool") || !bench.wire.newest("r/ns/things/tool")->payload));
}

TEST_CASE("between many descriptions there are values", "[mqtt][meaning]") {
  Bench bench([](mqtt::Options& o) { o.description.things = true; });
  for (int i = 0; i < 200; ++i) {
    Thing thing{"t" + std::to_string(i)};
    thing.property<double>("x").publish(i);
    bench.server->add(std::move(thing)).value();
  }
  bench.turn();
  bench.wire.hangs = true;  // from now on the window is what is sent in each round
  for (int i = 0; i < 2'000; ++i) {
    bench.a.publish(i);
    bench.turn(milliseconds(1));
    bench.wire.hangs = i % 3 != 0;
    for (int id = 1; id < bench.wire.next_id; ++id) bench.wire.acknowledged.push_back(id);
  }
  const std::vector<std::string> topics = bench.wire.topics();
  std::vector<std::size_t> descriptions;
  for (std::size_t i = 0; i < topics.size(); ++i)
    if (topics[i].find("r/ns/things/") == 0) descriptions.push_back(i);
  CHECK(descriptions.size() >= 201);
  REQUIRE_FALSE(descriptions.empty());
  const auto begin = topics.begin() + static_cast<std::ptrdiff_t>(descriptions.front()),
             end = topics.begin() + static_cast<std::ptrdiff_t>(descriptions.back());
  CHECK(std::count(begin, end, "r/arm/a") > 3);
}

TEST_CASE("a broker that answers pings and no probes is served nevertheless", "[mqtt][newest]") {
  std::string log;
  Bench bench([&](mqtt::Options& o) { o.log = [&](LogLevel, std::string_view text) { log.append(text); }; });
  bench.wire.hangs = true;
  int value = 100;
  for (int i = 0; i < 200; ++i) {
    bench.a.publish(++value);
    bench.turns(3);
  }
  const std::size_t stuck = bench.wire.sent.size();
  CHECK(stuck < 150);
  bench.turn(seconds(44));
  CHECK(bench.wire.sent.size() == stuck);
  bench.turn(seconds(2));
  bench.turns();
  CHECK(log.find("UNSUBSCRIBE") != std::string::npos);
  REQUIRE(bench.wire.sent.size() > stuck);
  CHECK(*bench.wire.newest("r/arm/a")->payload == std::to_string(value));
}

TEST_CASE("an invocation that is published leaves nothing out", "[mqtt][newest]") {
  Bench bench([](mqtt::Options& o) { o.publications = default_publications(); });
  Thing base{"base"};
  base.action("go", [](double, Responder done) { std::move(done).succeed(); });
  bench.server->add(std::move(base)).value();
  bench.turns(20);
  lrt::test::RequestText request("POST /base/actions/go\nHost: " + bench.core->feed().base().substr(7) +
                                 "\nContent-Type: application/json\nPrefer: respond-async\n\n1");
  CHECK(bench.server->serve(request.get()).response.status == 202);
  bench.turns(40);
  const std::vector<std::string> topics = bench.wire.topics();
  CHECK(std::any_of(topics.begin(), topics.end(), [](const std::string& topic) { return topic.find("r/base/actions/go/") == 0; }));
  CHECK(bench.core->counters().left_out == 0);
}

TEST_CASE("behind a link that is always busy, queues have their turn as well", "[mqtt][newest]") {
  Bench bench([](mqtt::Options& o) {
    Publication each;
    each.paths = "/arm/b";
    each.queue_length = 100;
    o.publications.insert(o.publications.begin(), each);
  });
  Thing busy{"busy"};
  std::vector<PushedProperty<int>> values;
  for (int i = 0; i < 50; ++i) values.push_back(busy.property<int>("v" + std::to_string(i)));
  bench.server->add(std::move(busy)).value();
  int value = 0;
  const auto round = [&] {
    ++value;
    for (auto& one : values) one.publish(value);
    bench.b.publish(value);
    bench.turn();
    bench.wire.hangs = value % 10 != 0;  // the window is closed most of the time
  };
  for (int i = 0; i < 100; ++i) round();
  bench.wire.lost = "gone";
  bench.turn();
  bench.turn(seconds(60));
  REQUIRE(bench.core->counters().connections == 2);
  bench.wire.sent.clear();
  for (int i = 0; i < 300; ++i) round();
  const std::vector<std::string> topics = bench.wire.topics();
  CHECK(std::count(topics.begin(), topics.end(), "r/arm/b") > 10);
  CHECK(std::count(topics.begin(), topics.end(), "r/busy/v49") > 3);
}

TEST_CASE("a description that takes long gets a tenth of the time, and comes after the values", "[mqtt][newest]") {
  Bench bench([](mqtt::Options& o) {
    o.description.publish = true;
    o.description.minimum_interval = milliseconds(100);
    o.broker.max_pause = milliseconds(500);
  });
  bench.turns(20);
  bench.wire.lost = "gone";
  bench.turn();
  bench.wire.sent.clear();
  bench.turn(seconds(10));
  bench.turns(20);
  const auto count = [&] {
    const std::vector<std::string> topics = bench.wire.topics();
    return std::count(topics.begin(), topics.end(), "r/ns/description");
  };
  const auto change = [&](const std::string& name) {
    Thing thing(name);
    thing.property<int>("x").publish(1);
    bench.server->add(std::move(thing)).value();
  };
  const std::vector<std::string> topics = bench.wire.topics();
  const auto description = std::find(topics.begin(), topics.end(), "r/ns/description");
  REQUIRE(description != topics.end());
  CHECK(std::find(topics.begin(), description, "r/arm/a") != description);
  CHECK(std::find(topics.begin(), description, "r/arm/b") != description);

  bench.wire.hangs = true;
  change("t1");
  for (int i = 0; i < 5; ++i) bench.turn(milliseconds(100));
  const auto before = count();
  CHECK(before >= 2);
  for (int i = 0; i < 10; ++i) {  // it is on its way for at least two seconds
    change("t2" + std::to_string(i));
    bench.turn(milliseconds(200));
  }
  CHECK(count() == before);
  bench.wire.hangs = false;
  bench.turns();
  for (int i = 0; i < 170; ++i) bench.turn(milliseconds(100));
  CHECK(count() == before);
  for (int i = 0; i < 100; ++i) bench.turn(milliseconds(100));
  CHECK(count() > before);
}
