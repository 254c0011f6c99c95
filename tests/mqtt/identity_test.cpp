// SPDX-License-Identifier: Apache-2.0
// Robots that can be told apart: what is said when they cannot. The sentences are those of docs/fleet.md.
#include "src/mqtt/identity_checks.hpp"

#include <chrono>
#include <ctime>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>

#include "tests/mqtt/broker.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/tls.hpp"

using namespace lrt;
using namespace lrt::test;
using Catch::Matchers::ContainsSubstring;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::system_clock;

namespace {

/// The sentences of the table, by situation.
std::map<std::string, std::string> sentences() {
  std::ifstream file(LRT_SOURCE_DIR "/docs/fleet.md");
  const std::string page((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::size_t begin = page.find("### What a robot says");
  std::map<std::string, std::string> all;
  for (std::size_t at = page.find("\n| ", begin); at != std::string::npos; at = page.find("\n| ", at + 1)) {
    if (at > page.find("\n## ", begin)) break;
    const std::string line = page.substr(at + 3, page.find('\n', at + 1) - at - 3);
    const std::size_t last = line.rfind(" | `");
    if (last != std::string::npos) all[line.substr(0, line.find(" | "))] = line.substr(last + 4, line.size() - last - 4 - 3);
  }
  return all;
}

Identity robot(const std::string& name) {
  Identity identity;
  identity.iri = "https://robots.example/" + name;
  return identity;
}

system_clock::time_point at(int year, int month) {
  std::tm parts{};
  parts.tm_year = year - 1900;
  parts.tm_mon = month - 1;
  parts.tm_mday = 1;
  return system_clock::from_time_t(::timegm(&parts));
}

/// A certificate that is valid from one time to another, to a second or two.
Certificate valid(system_clock::time_point from, system_clock::time_point to, const std::string& iri, const Certificate* issuer = nullptr) {
  const auto from_now = [](system_clock::time_point time) {
    return static_cast<long>(std::chrono::duration_cast<seconds>(time - system_clock::now()).count());
  };
  return make_certificate({"r7", iri.empty() ? "" : "URI:" + iri, from_now(from), from_now(to)}, issuer);
}

/// One of January 2026, to the second. Its signature does not fit any more.
Certificate of_january(const std::string& iri) {
  const Certificate made = valid(at(2026, 1), at(2026, 2), iri);
  const auto set = [&](int (*field)(X509*, const ASN1_TIME*), system_clock::time_point time) {
    ASN1_TIME* const written = ASN1_TIME_set(nullptr, system_clock::to_time_t(time));
    field(made.certificate.get(), written);
    ASN1_TIME_free(written);
  };
  set(X509_set1_notBefore, at(2026, 1));
  set(X509_set1_notAfter, at(2026, 2));
  return made;
}

/// A server with a bridge, whose log is kept.
struct Robot {
  Robot(const std::string& name, std::uint16_t port, const std::function<void(mqtt::Options&, lrt::Options&)>& change = {}) {
    lrt::Options server_options;
    server_options.listen.port = 0;
    server_options.identity = robot(name);
    mqtt::Options options;
    options.broker.port = port;
    options.broker.first_pause = milliseconds(5);
    options.broker.max_pause = milliseconds(20);
    options.log = [this](LogLevel, std::string_view message) { log.append(message).append("\n"); };
    if (change) change(options, server_options);
    server.emplace(Server::create(std::move(server_options)).value());
    Thing base{"base"};
    x = base.property<double>("x");
    server->add(std::move(base)).value();
    x.publish(1);
    bridge.emplace(mqtt::Bridge::create(*server, std::move(options)).value());
  }
  void poll() {
    server->poll();
    bridge->poll();
  }
  std::string log;
  std::optional<Server> server;
  PushedProperty<double> x;
  std::optional<mqtt::Bridge> bridge;
};

template <class F>
void until(std::vector<Robot*> robots, F condition, Watcher* watcher = nullptr) {
  const auto end = std::chrono::steady_clock::now() + seconds(30);
  while (!condition()) {
    for (Robot* one : robots) one->poll();
    if (watcher) watcher->step();
    else std::this_thread::sleep_for(milliseconds(1));
    if (std::chrono::steady_clock::now() < end) continue;
    for (Robot* one : robots) UNSCOPED_INFO(one->log);
    FAIL("it did not come true in thirty seconds");
  }
}

}  // namespace

TEST_CASE("the sentences about identities are those of docs/fleet.md", "[mqtt][identity]") {
  auto documented = sentences();
  CHECK(documented.size() == 13);
  for (const char* of_others :
       {"a mirror reads two robots with one identity, or one robot by two URLs", "a command or a mirror has another URL of it than its public base"})
    CHECK(documented.erase(of_others) == 1);  // tests/tools
  const auto compare = [&](const std::string& situation, const std::string& said) {
    CAPTURE(situation);
    CHECK(said == documented[situation]);
    documented.erase(situation);
  };
  const std::string iri = "https://robots.example/r7", prefix = "robots/r7";
  compare("it has neither an identity nor a public base", mqtt::without_identity());
  compare("two robots have one identity", mqtt::another_robot(robot("r7"), prefix, {"s", iri, "", true}));
  compare("the same, at a broker that says why it ends a connection", mqtt::taken_over(robot("r7"), "lrt-r7-ID"));
  compare("two robots have one prefix", mqtt::another_robot(robot("r7"), prefix, {"s", "https://robots.example/r8", "", true}));
  compare("another robot had the prefix before",
          mqtt::earlier_status(robot("r7"), prefix, "https://new.example/r7", {"s", "https://robots.example/r6", "", false}));
  compare("its public base has changed",
          mqtt::earlier_status(robot("r7"), prefix, "https://new.example/r7", {"s", iri, "https://old.example/r7", false}));

  const TlsFolder folder;
  const auto plain = [&](std::string said) {  // the table has names without their folder
    for (const char* name : {"r7.pem", "ca.pem"})
      for (std::size_t found; (found = said.find(folder.path(name))) != std::string::npos;) said.replace(found, folder.path(name).size(), name);
    return said.substr(0, 2) == "; " ? said.substr(2) : said;
  };
  mqtt::Broker broker;
  broker.host = "broker.example";
  broker.tls.emplace().ca_file = folder.path("ca.pem");
  broker.tls->certificate_file = folder.path("r7.pem");
  const auto certificate = [&](const std::string& of) {
    const Certificate own = of_january(of);
    folder.put("r7.pem", {&own});
  };
  certificate(iri);
  compare("its certificate has expired", plain(mqtt::why_not_connected(broker, "x", at(2026, 3))));
  compare("its clock is wrong, as before it is set after a start", plain(mqtt::why_not_connected(broker, "x", system_clock::from_time_t(0))));
  compare("its certificate expires within 14 days",
          plain(mqtt::certificate_warning(broker, robot("r7"), prefix, at(2026, 2) - std::chrono::hours(24))));
  compare("the broker's certificate has expired, or is another's",
          plain(mqtt::why_not_connected(broker, "(certificate verify failed)", at(2026, 1) + std::chrono::hours(24))));
  CHECK(mqtt::certificate_warning(broker, robot("r7"), prefix, at(2026, 1) + std::chrono::hours(24)).empty());
  CHECK(mqtt::why_not_connected(broker, "x", at(2026, 1) + std::chrono::hours(24)).empty());
  certificate("https://robots.example/r8");
  compare("its certificate is of another robot", plain(mqtt::certificate_warning(broker, robot("r7"), prefix, at(2026, 1) + std::chrono::hours(24))));
  CHECK(documented.empty());

  // A certificate that has no IRI is the robot's if its CN is the level of the topics. A broker without TLS has nothing to do with it.
  certificate("");
  CHECK(mqtt::certificate_warning(broker, robot("r7"), "cells/r7", at(2026, 1) + std::chrono::hours(24)).empty());
  CHECK_THAT(mqtt::certificate_warning(broker, robot("r8"), "robots/r8", at(2026, 1) + std::chrono::hours(24)), ContainsSubstring("\"r7\""));
  folder.put("r7.pem", std::string("no certificate"));
  CHECK_THAT(mqtt::certificate_warning(broker, robot("r7"), prefix, at(2026, 3)), ContainsSubstring("cannot be read"));
  CHECK_THAT(mqtt::why_not_connected(broker, "x", at(2026, 3)), ContainsSubstring("cannot be read"));
  broker.tls.reset();
  CHECK(mqtt::why_not_connected(broker, "certificate verify failed", at(2026, 3)).empty());
  CHECK(mqtt::certificate_warning(broker, robot("r8"), prefix, at(2026, 3)).empty());
}

TEST_CASE("what a status does not say, or says in a hostile way, is not there", "[mqtt][identity]") {
  for (const char* text : {"", "no JSON", "[]", "{}", R"({"online":"true","session":5,"identity":"x","base":null})", R"({"identity":{"iri":7}})"}) {
    CAPTURE(text);
    const mqtt::StatusText status = mqtt::read_status(text);
    CHECK((status.session.empty() && status.iri.empty() && status.base.empty() && !status.online));
    CHECK(mqtt::earlier_status(robot("r7"), "robots/r7", "https://b.example", status).empty());
  }
  const mqtt::StatusText status = mqtt::read_status(R"({"online":true,"session":"s","base":"http://b","identity":{"iri":"urn:a","model":"m"}})");
  CHECK((status.online && status.session == "s" && status.base == "http://b" && status.iri == "urn:a"));
  CHECK(mqtt::read_status(std::string(100'000, ' ') + "{}").session.empty());
  // What comes from the broker is no control sequence for the terminal of who reads the log.
  const std::string said = mqtt::another_robot(robot("r7"), "robots/r7", {"s", "urn:\x1b[2J" + std::string(10'000, 'x'), "", true});
  CHECK(said.find('\x1b') == std::string::npos);
  CHECK(said.size() < 1'000);
  // Ports of this machine change with each start.
  CHECK(mqtt::earlier_status(robot("r7"), "robots/r7", "http://127.0.0.1:2", {"s", robot("r7").iri, "http://localhost:1", false}).empty());
}

TEST_CASE("a bridge without an identity and a public base is refused, and either is enough", "[mqtt][identity]") {
  lrt::Options options;
  options.listen.port = 0;
  const auto create = [&](const lrt::Options& server_options) -> Result<std::string> {
    Server server = Server::create(server_options).value();
    Result<mqtt::Bridge> bridge = mqtt::Bridge::create(server, {});
    if (!bridge) return Unexpected{bridge.error()};
    return bridge->topic("/base/x");
  };
  const Result<std::string> refused = create(options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_option);
  CHECK(refused.error().message == sentences()["it has neither an identity nor a public base"]);
  options.listen.public_base = "https://robots.example/cell7";
  CHECK(create(options).value() == "robots/cell7/base/x");
  options.identity.iri = "https://robots.example/r+7";
  CHECK(create(options).value() == "robots/r%2B7/base/x");
  options.listen.public_base.clear();
  CHECK(create(options).value() == "robots/r%2B7/base/x");
}

TEST_CASE("two robots with one identity at one broker are noticed by both", "[mqtt][identity]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Robot one("r7", broker.port()), two("r7", broker.port()), third("r8", broker.port());
  const std::string said = sentences()["two robots have one identity"];
  const std::string by_broker = "which is the client id of <https://robots.example/r7>";
  const auto knows = [&](const Robot& one_of) {
    return one_of.log.find(said) != std::string::npos || one_of.log.find(by_broker) != std::string::npos;
  };
  until({&one, &two, &third}, [&] { return knows(one) && knows(two); });
  CHECK(one.bridge->counters().taken_over > 0);
  CHECK(two.bridge->counters().taken_over > 0);
  CHECK(third.bridge->counters().taken_over == 0);
  CHECK(third.log.find("another") == std::string::npos);
}

TEST_CASE("a robot that starts again, or whose broker does, is no second one", "[mqtt][identity]") {
  if (!has_mosquitto()) return;
  Mosquitto broker("allow_anonymous true\npersistence true\nautosave_interval 1\nautosave_on_changes true\n");
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/r7/ns/status");
  std::optional<Robot> robot(std::in_place, "r7", broker.port());
  until(
      {&*robot}, [&] { return watcher.payload("robots/r7/ns/status").find("\"online\":true") != std::string::npos; }, &watcher);
  const std::string first = watcher.payload("robots/r7/ns/status");
  CHECK_THAT(first, ContainsSubstring(R"("identity":{"iri":"https://robots.example/r7"})"));
  robot.emplace("r7", broker.port());
  until(
      {&*robot},
      [&] {
        return watcher.payload("robots/r7/ns/status").find("\"online\":true") != std::string::npos && watcher.payload("robots/r7/ns/status") != first;
      },
      &watcher);
  const std::string last_will = [&] {
    for (const Watcher::Message& m : watcher.messages)
      if (m.payload.find("\"online\":false") != std::string::npos) return m.payload;
    return std::string();
  }();
  CHECK_THAT(last_will, ContainsSubstring(R"("identity":{"iri":"https://robots.example/r7"})") && ContainsSubstring("\"base\":"));
  for (const int signal : {SIGTERM, SIGKILL}) {
    const auto before = robot->bridge->counters().connections;
    broker.restart(signal);
    until({&*robot}, [&] {
      return robot->bridge->counters().connections > before && robot->bridge->counters().online && robot->bridge->counters().unacknowledged == 0;
    });
  }
  CHECK(robot->bridge->counters().taken_over == 0);
  CHECK(robot->log.find("another") == std::string::npos);
  CHECK(robot->log.find("before, and is") == std::string::npos);
}

TEST_CASE("a changed public base, and a prefix that another robot had, are noticed at the next start", "[mqtt][identity]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/#");
  const auto run = [&](const std::string& name, const std::string& base) {
    Robot robot(name, broker.port(), [&](mqtt::Options& m, lrt::Options& o) {
      o.listen.public_base = base;
      m.prefix = "robots/r7";
    });
    watcher.messages.clear();
    // The broker has sent what it had kept before it acknowledges the robot's own status.
    until(
        {&robot}, [&] { return watcher.newest("robots/r7/base/x").has_value() && robot.bridge->counters().acknowledged > 0; }, &watcher);
    return robot.log;
  };
  const auto table = sentences();
  const std::string moved = table.at("its public base has changed"), replaced = table.at("another robot had the prefix before");
  CHECK(run("r6", "https://old.example/r6").find("before, and is") == std::string::npos);
  CHECK_THAT(run("r7", "https://old.example/r7"), ContainsSubstring(replaced));
  CHECK(run("r7", "https://old.example/r7").find("before, and is") == std::string::npos);
  CHECK_THAT(run("r7", "https://new.example/r7"), ContainsSubstring(moved));
}

TEST_CASE("a certificate that has expired is the reason, and one that replaces it is used by the next connection, or by reload()",
          "[mqtt][identity]") {
  if (!has_mosquitto()) return;
  const Certificate authority = make_certificate({"authority", "", -3600, 3600, true});
  const Certificate own = make_certificate({"localhost", "DNS:localhost,IP:127.0.0.1"}, &authority);
  const auto now = system_clock::now();
  const std::string iri = "https://robots.example/r7";
  const Certificate expired = valid(now - std::chrono::hours(2), now - std::chrono::hours(1), iri, &authority),
                    good = valid(now - std::chrono::hours(1), now + std::chrono::hours(24 * 90), iri, &authority),
                    newer = valid(now - std::chrono::hours(1), now + std::chrono::hours(24 * 180), iri, &authority);
  const TlsFolder folder;
  const std::string ca = folder.put("ca.pem", {&authority});
  Mosquitto broker("allow_anonymous true\ncafile " + ca + "\ncertfile " + folder.put("broker.pem", {&own}) + "\nkeyfile " +
                   folder.put_key("broker.key", own) + "\nrequire_certificate true\nuse_identity_as_username true\n");
  folder.put("r7.pem", {&expired});
  folder.put_key("r7.key", expired);
  Robot robot("r7", broker.port(), [&](mqtt::Options& m, lrt::Options&) {
    m.broker.host = "localhost";
    m.broker.connect_time = seconds(2);
    m.broker.tls.emplace().ca_file = ca;
    m.broker.tls->certificate_file = folder.path("r7.pem");
    m.broker.tls->key_file = folder.path("r7.key");
  });
  until({&robot}, [&] { return robot.log.find("r7.pem has expired at ") != std::string::npos; });
  CHECK(robot.bridge->counters().connections == 0);

  folder.put_key("r7.key", good);
  folder.put("r7.pem", {&good});
  until({&robot}, [&] { return robot.bridge->counters().online; });
  CHECK(robot.log.find("takes it for another one") == std::string::npos);

  // Half of a new pair changes nothing; the whole one is used at once.
  folder.put("r7.pem", {&newer});
  const Result<void> refused = robot.bridge->reload();
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, ContainsSubstring("is not the key of the certificate"));
  folder.put_key("r7.key", newer);
  const auto before = robot.bridge->counters().connections;
  REQUIRE(robot.bridge->reload());
  until({&robot}, [&] { return robot.bridge->counters().connections > before && robot.bridge->counters().online; });
  CHECK(robot.bridge->counters().taken_over == 0);
  robot.bridge->stop();
  CHECK(robot.bridge->reload().error().code == Errc::closed);
}

TEST_CASE("a password is read from its file for each connection", "[mqtt][identity]") {
  if (!has_mosquitto()) return;
  const Folder folder;
  const std::string passwords = folder / "passwords", own = folder / "own";
  const auto set = [&](const std::string& password) {
    std::ofstream(passwords) << "r7:" << password << "\n";
    return std::system(("mosquitto_passwd -U " + passwords + " 2>/dev/null").c_str()) == 0;
  };
  if (!set("first")) {
    std::cout << "skipped: mosquitto_passwd does not work here\n";
    return;
  }
  std::ofstream(own) << "wrong\nsecond line\n";
  Mosquitto broker("allow_anonymous false\npassword_file " + passwords + "\n");
  Robot robot("r7", broker.port(), [&](mqtt::Options& m, lrt::Options&) {
    m.broker.user = "r7";
    m.broker.password_file = own;
  });
  until({&robot}, [&] { return robot.bridge->counters().failed_connections > 0; });
  CHECK(robot.bridge->counters().connections == 0);
  std::ofstream(own) << "first\r\n";
  until({&robot}, [&] { return robot.bridge->counters().online; });
  std::ofstream(own) << "";
  const Result<void> refused = robot.bridge->reload();
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, ContainsSubstring("password_file"));
  CHECK(robot.bridge->counters().online);
}
