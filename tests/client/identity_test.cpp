// SPDX-License-Identifier: Apache-2.0
#include <lrt/client.hpp>

#include <atomic>
#include <fstream>
#include <mutex>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/tls.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A robot that wants a token, which can change.
struct Guarded {
  explicit Guarded(std::string first) : token(std::move(first)), host(one_thing(robot.tool()), {}, options()) {}
  Options options() {
    Options o;
    o.security.authenticate = [this](const http::Request& request) -> std::optional<security::Principal> {
      const std::lock_guard lock(mutex);
      if (request.find("Authorization") == "Bearer " + token) return security::Principal{"operator", {"operator"}};
      return std::nullopt;
    };
    return o;
  }
  void set(const std::string& next) {
    const std::lock_guard lock(mutex);
    token = next;
  }

  std::mutex mutex;
  std::string token;
  SampleRobot robot;
  RobotHost host;
};

/// A robot with TLS, and what a client needs for it.
struct Secured {
  explicit Secured(bool wants_certificate = false) : host(one_thing(robot.tool()), {}, options(wants_certificate)) {}
  Options options(bool wants_certificate) {
    Options o;
    o.security.tls.emplace();
    o.security.tls->certificate_file = folder.put("server.pem", {&server});
    o.security.tls->key_file = folder.put_key("server.key", server);
    if (wants_certificate) {
      o.security.tls->client_ca_file = folder.put("clients.pem", {&authority});
      o.security.certificates = {{"CN=operator", {"operator", {"operator"}}}};
    }
    return o;
  }
  client::Options trusting() {
    client::Options o;
    o.ca_file = folder.put("authority.pem", {&authority});
    return o;
  }

  TlsFolder folder;
  Certificate authority = make_certificate({"Authority", {}, -3600, 3600, true});
  Certificate server = make_certificate({"localhost", "DNS:localhost,IP:127.0.0.1"}, &authority);
  SampleRobot robot;
  RobotHost host;
};

Result<client::Robot> open_with(client::Options options, const std::string& url) { return Client::create(std::move(options)).value().open(url); }

}  // namespace

TEST_CASE("a token is sent, and read again from its file when it is refused", "[client][R0.2]") {
  Guarded robot("first");
  CHECK(open_with({}, robot.host.url()).error().code == Errc::refused);
  client::Options options;
  options.identity.token = "first";
  CHECK(open_with(options, robot.host.url()).has_value());

  const Folder folder;
  const std::string file = folder / "token";
  std::ofstream(file) << "first\nwhat follows does not count\n";
  options = {};
  options.identity.token_file = file;
  Client client = Client::create(options).value();
  const client::Robot found = client.open(robot.host.url()).value();
  robot.set("second");
  CHECK(found.property("tool/weight").value().read<double>().error().message.find("401") != std::string::npos);
  std::ofstream(file) << "second\n";
  CHECK(found.property("tool/weight").value().read<double>().value() == 0.25);
}

TEST_CASE("an invalid identity is an error when the client is made", "[client]") {
  const auto refuses = [](auto change) {
    client::Options options;
    change(options);
    const auto made = Client::create(std::move(options));
    return !made && made.error().code == Errc::invalid_option;
  };
  CHECK(refuses([](client::Options& o) { o.identity.token = "with space"; }));
  CHECK(refuses([](client::Options& o) { o.identity.token = "with\nline"; }));
  CHECK(refuses([](client::Options& o) { o.identity.token_file = "/nowhere/token"; }));
  CHECK(refuses([](client::Options& o) { o.identity.certificate_file = "/nowhere/c.pem"; }));
  CHECK(refuses([](client::Options& o) { o.identity.certificate_file = o.identity.key_file = "/nowhere/c.pem"; }));
  CHECK(refuses([](client::Options& o) { o.identity.trusted_origins = {"robot.example"}; }));
  CHECK(refuses([](client::Options& o) { o.ca_file = "/nowhere/ca.pem"; }));
  CHECK(refuses([](client::Options& o) { o.limits.response_time = std::chrono::milliseconds(0); }));
}

TEST_CASE("a robot with TLS is used if its certificate is that of the host", "[client][R0.2]") {
  Secured robot;
  const auto found = open_with(robot.trusting(), robot.host.url());
  INFO((found ? std::string() : found.error().message));
  CHECK(found.has_value());
  const auto untrusted = open_with({}, robot.host.url());
  REQUIRE_FALSE(untrusted);
  CHECK(untrusted.error().message.find("certificate is not accepted") != std::string::npos);
  std::string other_name = robot.host.url();
  other_name.replace(other_name.find("127.0.0.1"), 9, "[::1]");
  CHECK_FALSE(open_with(robot.trusting(), other_name).has_value());
}

TEST_CASE("a client shows its certificate", "[client][R0.2]") {
  Secured robot(true);
  CHECK(open_with(robot.trusting(), robot.host.url()).error().message.find("401") != std::string::npos);
  const Certificate own = make_certificate({"operator"}, &robot.authority);
  client::Options options = robot.trusting();
  options.identity.certificate_file = robot.folder.put("client.pem", {&own});
  options.identity.key_file = robot.folder.put_key("client.key", own);
  CHECK(open_with(options, robot.host.url()).has_value());
  // Without being named by the program, the robot does not learn who asks.
  Client client = Client::create(options).value();
  CHECK(client.get(robot.host.url()).error().message.find("401") != std::string::npos);
  CHECK(client.open(robot.host.url()).has_value());
  CHECK(client.get(robot.host.url()).has_value());
}

TEST_CASE("HTTP Basic is sent over TLS and to this machine only", "[client][R0.2]") {
  client::Options options;
  options.identity.user = "operator";
  options.identity.password = "secret";
  SampleRobot robot;
  std::atomic<int> with_password{0};
  Options server;
  server.security.authenticate = [&](const http::Request& request) -> std::optional<security::Principal> {
    if (request.find("Authorization") != "Basic b3BlcmF0b3I6c2VjcmV0") return std::nullopt;
    ++with_password;
    return security::Principal{"operator", {"operator"}};
  };
  RobotHost host(one_thing(robot.tool()), {}, server);
  CHECK(open_with(options, host.url()).has_value());
  CHECK(with_password > 0);
}
