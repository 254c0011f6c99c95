// SPDX-License-Identifier: Apache-2.0
// Baxter's right arm as Linked Robotic Things: a 1 kHz control loop that also polls the server. right_arm.urdf describes the arm.
// /world has what it sees, a table and two boxes, and a list of tasks that clients may change.
//
//   baxter [--port N] [--bind ADDRESS] [--public-base URL] [--allowed-host HOST]... [--cors ORIGIN]... [--allowed-origin ORIGIN]... [--demo]
//          [--allow-callback HOST]... [--subscriptions FILE] [--transport NAME] [--tls DIR] [--tokens FILE]
//          [--policy FILE] [--audit FILE] [--metrics] [--identity FILE]
//          [--mqtt HOST:PORT [--mqtt-prefix LEVELS] [--mqtt-user NAME --mqtt-password-file FILE] [--mqtt-ca FILE|system]
//           [--mqtt-certificate FILE --mqtt-key FILE]]
//
// --bind ADDRESS          an address or a host name to listen on; default: 127.0.0.1
// --public-base URL       by which clients know the robot behind a reverse proxy (examples/reverse_proxy)
// --allowed-host HOST     a further name of the robot that requests may have, with or without a port
// --cors ORIGIN           pages of this origin may read the robot in a browser; "*": all pages
// --allowed-origin ORIGIN pages of this origin may send commands and watch; with tokens, if they have one
// --demo                  the arm moves by itself, and somebody pushes a box
// --allow-callback HOST   a further receiver of web callbacks: a name, an address or a network, with or without a port
// --subscriptions FILE    stores web callbacks across restarts
// --transport NAME        http or libwebsockets, if it is built
// --tls DIR               HTTPS with DIR/server.pem and DIR/server-key.pem (examples/make-certificate.sh DIR); SIGHUP reloads them
// --tokens FILE           lets in only those who send a token of the file, a line "NAME ROLE TOKEN" each: reader, operator, administrator
// --policy FILE           access rights: rules of Web Access Control in Turtle, such as examples/policy.ttl
// --audit FILE            appends an audit line of JSON to FILE for each command, before its response; SIGHUP opens the file again
// --metrics               adds the Thing /server with the counters of the server; /server/metrics is their text for Prometheus
// --mqtt HOST:PORT        publishes every property and invocation to the MQTT broker there, if lrt::mqtt is built: a joint's position, and not
//                         its repetitions as `rotation` and in `positions`
// --mqtt-prefix LEVELS    the first levels of the topics; default: robots/ and the last part of the identity, robots/baxter
// --mqtt-user NAME        a user of the broker; --mqtt-password-file FILE has the password in its first line
// --mqtt-ca FILE          TLS, with the authorities of the broker's certificate, or "system"
// --mqtt-certificate FILE the robot's certificate for the broker (examples/make-robot-certificate.sh), with --mqtt-key FILE; SIGHUP reloads them
// --identity FILE         which robot this is, a JSON object {"iri": "https://robots.example/r7", ...}; default with --demo or --mqtt: the public base,
//                         or urn:lrt:baxter

#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#ifdef BAXTER_HAS_QUERY
#include <lrt/query.hpp>
#endif
#if BAXTER_HAS_MQTT
#include "examples/broker_options.hpp"
#endif
#include <lrt/security/audit_file.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/named.hpp>

#include "examples/baxter/linked_arm.hpp"
#include "examples/baxter/surroundings.hpp"

namespace {

volatile std::sig_atomic_t interrupted = 0;
volatile std::sig_atomic_t hung_up = 0;

/// With --demo each joint swings slowly through a third of its range, unless a command moves it.
void demonstrate(baxter::RightArm& arm) {
  for (std::size_t i = 0; i < baxter::joint_count; ++i) {
    if (arm.moving(i)) continue;
    const baxter::JointParameters& joint = arm.parameters(i);
    const double middle = (joint.lower_rad + joint.upper_rad) / 2, reach = (joint.upper_rad - joint.lower_rad) / 6;
    arm.move_to(i, arm.position(i) < middle ? middle + reach : middle - reach);
  }
}

/// The number of a port, all of the text.
bool read_port(std::string_view text, std::uint16_t& port) {
  const auto [read_to, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && read_to == text.data() + text.size();
}

int failed(const lrt::Error& error) { return std::fprintf(stderr, "baxter: %s\n", error.message.c_str()), 1; }

}  // namespace

int main(int argc, char** argv) {
  lrt::Options options;
  std::shared_ptr<lrt::security::AuditFile> audit;
  std::vector<std::string>& callbacks = options.callbacks.allow;
  callbacks = {"127.0.0.0/8", "::1"};  // this machine only, and the hosts of --allow-callback
#ifdef BAXTER_HAS_QUERY
  options.query = lrt::query::endpoint();  // SPARQL at /sparql
#endif
  bool demo = false, metrics = false;
#if BAXTER_HAS_MQTT
  broker::Arguments broker;
#endif
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg == "--demo") {
      demo = true;
    } else if (arg == "--metrics") {
      metrics = true;
    } else if (arg == "--bind" && i + 1 < argc) {
      options.listen.address = argv[++i];
    } else if (arg == "--public-base" && i + 1 < argc) {
      options.listen.public_base = argv[++i];
    } else if (arg == "--allowed-host" && i + 1 < argc) {
      options.security.allowed_hosts.emplace_back(argv[++i]);
    } else if (arg == "--cors" && i + 1 < argc) {
      options.security.read_origins.emplace_back(argv[++i]);
    } else if (arg == "--allowed-origin" && i + 1 < argc) {
      options.security.allowed_origins.emplace_back(argv[++i]);
    } else if (arg == "--allow-callback" && i + 1 < argc) {
      callbacks.emplace_back(argv[++i]);
    } else if (arg == "--subscriptions" && i + 1 < argc) {
      options.callbacks.file = argv[++i];
    } else if (arg == "--transport" && i + 1 < argc) {
      options.listen.transport = [name = std::string(argv[++i])](lrt::transport::TransportOptions t) {
        return lrt::transport::make_named(name, std::move(t));
      };
    } else if (arg == "--tls" && i + 1 < argc) {
      const std::string folder = argv[++i];
      options.security.tls.emplace();
      options.security.tls->certificate_file = folder + "/server.pem";
      options.security.tls->key_file = folder + "/server-key.pem";
    } else if (arg == "--tokens" && i + 1 < argc) {
      options.security.token_file = argv[++i];
    } else if (arg == "--policy" && i + 1 < argc) {
      options.security.policy_file = argv[++i];
    } else if (arg == "--audit" && i + 1 < argc) {
      lrt::security::AuditFileOptions waits;
      waits.respond_when_saved = true;
      auto file = lrt::security::audit_file(argv[++i], waits);
      if (!file) return failed(file.error());
      options.security.audit.file = audit = *std::move(file);
    } else if (arg == "--port" && i + 1 < argc) {
      if (!read_port(argv[++i], options.listen.port)) return std::fprintf(stderr, "baxter: --port wants 0 to 65535\n"), 2;
    } else if (arg == "--identity" && i + 1 < argc) {
      auto identity = lrt::Identity::from_file(argv[++i]);
      if (!identity) return failed(identity.error());
      options.identity = *std::move(identity);
#if BAXTER_HAS_MQTT
    } else if (i + 1 < argc && broker.take(arg, argv[i + 1])) {
      ++i;
#endif
    } else {
      std::fprintf(stderr,
                   "usage: baxter [--port N] [--bind ADDRESS] [--public-base URL] [--allowed-host HOST]...\n"
                   "              [--cors ORIGIN]... [--allowed-origin ORIGIN]... [--demo] [--allow-callback HOST]... [--subscriptions FILE]\n"
                   "              [--transport http|libwebsockets] [--tls DIR] [--tokens FILE] [--policy FILE]\n"
                   "              [--audit FILE] [--metrics] [--identity FILE]\n"
                   "              [--mqtt HOST:PORT [--mqtt-prefix LEVELS] [--mqtt-user NAME --mqtt-password-file FILE]\n"
                   "               [--mqtt-ca FILE|system] [--mqtt-certificate FILE --mqtt-key FILE]]\n");
      return arg == "--help" ? 0 : 2;
    }
  }
  bool meets_others = demo;
#if BAXTER_HAS_MQTT
  meets_others = meets_others || broker.options();
#endif
  if (options.identity.iri.empty() && meets_others) {
    options.identity.iri = options.listen.public_base.empty() ? "urn:lrt:baxter" : options.listen.public_base;
    options.identity.model = "Baxter";
    options.identity.manufacturer = "Rethink Robotics";
    options.identity.software_version = LRT_VERSION;
  }
  options.log = [](lrt::LogLevel level, std::string_view text) {
    if (level >= lrt::LogLevel::warning) std::fprintf(stderr, "baxter: %.*s\n", static_cast<int>(text.size()), text.data());
  };

  auto description = lrt::urdf::load(BAXTER_URDF);
  if (!description) return failed(description.error());
  const auto parameters = baxter::LinkedArm::parameters(description->model());
  if (!parameters) return failed(parameters.error());
  baxter::RightArm arm(*parameters);
  baxter::LinkedArm linked(arm, *std::move(description));
  auto server = lrt::Server::create(options);
  if (!server) return failed(server.error());
  if (auto added = linked.add_to(*server); !added) return failed(added.error());
  baxter::Surroundings surroundings;
  if (auto added = surroundings.add_to(*server); !added) return failed(added.error());
  if (metrics)
    if (auto added = server->add(lrt::server_thing(*server)); !added) return failed(added.error());

#if BAXTER_HAS_MQTT
  std::optional<lrt::mqtt::Bridge> bridge;
  if (auto mqtt = broker.options()) {
    mqtt->log = options.log;
    for (const char* const repeated : {"/baxter/*/rotation", "/baxter/positions"}) {
      lrt::mqtt::Publication none;
      none.paths = repeated;
      none.publish = false;
      mqtt->publications.insert(mqtt->publications.begin(), none);
    }
    auto made = lrt::mqtt::Bridge::create(*server, *std::move(mqtt));
    if (!made) return failed(made.error());
    bridge = *std::move(made);
    if (auto started = bridge->start(); !started) return failed(started.error());
  }
#endif

  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  bool reloads = options.security.tls || audit;
#if BAXTER_HAS_MQTT
  reloads = reloads || broker.has_files();
#endif
  if (reloads) std::signal(SIGHUP, [](int) { hung_up = 1; });
  std::printf("Baxter's right arm is at %s (Ctrl-C ends)\n", server->url().c_str());
  std::fflush(stdout);

  const auto began = std::chrono::steady_clock::now();
  auto next = began;
  while (!interrupted) {
    if (hung_up) {
      hung_up = 0;
      if (audit) audit->reopen();
      if (audit) audit->reopen();
      if (auto read = options.security.tls ? server->reload_tls() : lrt::Result<void>(); !read)
        std::fprintf(stderr, "baxter: the old certificate stays: %s\n", read.error().message.c_str());
#if BAXTER_HAS_MQTT
      if (auto read = broker.has_files() && bridge ? bridge->reload() : lrt::Result<void>(); !read)
        std::fprintf(stderr, "baxter: the connection to the broker stays: %s\n", read.error().message.c_str());
#endif
    }
    if (demo) demonstrate(arm);
    arm.step();
    linked.publish();
    surroundings.publish(std::chrono::duration<double>(next - began).count(), demo);
    server->poll();
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
#if BAXTER_HAS_MQTT
  bridge.reset();
#endif
  server->stop();
}
