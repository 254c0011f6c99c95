// SPDX-License-Identifier: Apache-2.0
// A fleet: N simulated robots in one program, each with its own server and its own connection to one MQTT broker.
//
//   ex_fleet --mqtt HOST:PORT [--mqtt-prefix LEVELS] [--mqtt-user NAME --mqtt-password-file FILE] [--mqtt-ca FILE|system]
//            [--mqtt-certificate FILE --mqtt-key FILE] [--robots N] [--first-number N] [--properties N] [--rate HZ] [--first-port PORT] [--seconds N]
//            [--commands]
//
//   mosquitto -p 1883 &                                              # a broker
//   ex_fleet --mqtt localhost:1883 --robots 20 &                     # twenty robots
//   mosquitto_sub -V 5 -t 'robots/+/ns/status' -t 'robots/+/base/x' -v  # a dashboard of all
//
// Robot 7 is urn:lrt:r7, its topics begin with robots/r7, and "{}" in the options of the broker is 7: --mqtt-certificate 'fleet/r{}.pem'. With
// --commands the broker decides who may command the robots, and a response goes to replies/WHO/r7/... only (examples/mosquitto). SIGHUP connects again,
// with the certificates and passwords that are in their files then.
//
// One thread drives all robots: bridges are driven by it, too, and so are the servers. --first-port gives robot i the port PORT + i for HTTP; without it
// the robots have no port, and the broker is the only way to them.

#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>
#include <lrt/transport/loopback.hpp>

#include "examples/broker_options.hpp"

namespace {

volatile std::sig_atomic_t interrupted = 0;
volatile std::sig_atomic_t hung_up = 0;

struct Settings {
  broker::Arguments broker;
  unsigned robots = 10, first_number = 0, properties = 2, rate_hz = 10, first_port = 0, seconds = 0;
  bool commands = false;
};

/// A mobile base that drives in a circle.
class Robot {
 public:
  static std::unique_ptr<Robot> create(const Settings& settings, unsigned number) {
    auto robot = std::make_unique<Robot>();
    lrt::Options options;
    options.threads.io = lrt::Io::in_poll;
    const std::string name = "r" + std::to_string(number);
    options.identity.iri = "urn:lrt:" + name;
    options.identity.model = "mobile base, simulated";
    options.identity.software_version = LRT_VERSION;
    if (settings.first_port != 0) options.listen.port = static_cast<std::uint16_t>(settings.first_port + number - settings.first_number);
    else options.listen.transport = lrt::transport::no_network;
    auto server = lrt::Server::create(options);
    if (!server) return failed(server.error());
    robot->server_.emplace(*std::move(server));
    lrt::Thing base{"base"};
    for (unsigned i = 0; i < settings.properties; ++i)
      robot->values_.push_back(base.property<double>(i == 0   ? "x"
                                                     : i == 1 ? "y"
                                                              : "sensor" + std::to_string(i),
                                                     i < 2 ? lrt::unit::metre : lrt::unit::one));
    base.action("stop", [r = robot.get()](lrt::Responder done) {
      r->speed_ = 0;
      std::move(done).succeed();
    });
    if (auto added = robot->server_->add(std::move(base)); !added) return failed(added.error());

    lrt::mqtt::Options mqtt = settings.broker.options(number).value();
    if (settings.commands) {
      mqtt.commands.enabled = mqtt.commands.allow_unprotected = true;
      mqtt.commands.response_topics = {"replies/*/" + name + "/**"};
    }
    mqtt.log = [name](lrt::LogLevel level, std::string_view text) {
      if (level >= lrt::LogLevel::warning) std::fprintf(stderr, "ex_fleet: %s: %.*s\n", name.c_str(), static_cast<int>(text.size()), text.data());
    };
    auto bridge = lrt::mqtt::Bridge::create(*robot->server_, std::move(mqtt));
    if (!bridge) return failed(bridge.error());
    robot->bridge_.emplace(*std::move(bridge));
    robot->angle_ = number;
    return robot;
  }

  void step(double seconds) {
    angle_ += speed_ * seconds;
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i].publish(i == 0 ? std::cos(angle_) : i == 1 ? std::sin(angle_) : angle_ + static_cast<double>(i));
  }
  void poll() {
    server_->poll();
    bridge_->poll();
  }
  void reload() {
    if (auto read = bridge_->reload(); !read) std::fprintf(stderr, "ex_fleet: the connection stays: %s\n", read.error().message.c_str());
  }
  lrt::mqtt::Counters counters() const { return bridge_->counters(); }

 private:
  static std::unique_ptr<Robot> failed(const lrt::Error& error) {
    std::fprintf(stderr, "ex_fleet: %s\n", error.message.c_str());
    return nullptr;
  }
  std::optional<lrt::Server> server_;
  std::vector<lrt::PushedProperty<double>> values_;
  double angle_ = 0, speed_ = 0.5;
  std::optional<lrt::mqtt::Bridge> bridge_;
};

template <class Number>
bool read(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

std::optional<Settings> settings_of(int argc, char** argv) {
  Settings settings;
  bool has_broker = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--commands") {
      settings.commands = true;
      continue;
    }
    if (++i == argc) return std::nullopt;
    const std::string value = argv[i];
    has_broker = has_broker || name == "--mqtt";
    if (settings.broker.take(name, value)) continue;
    if (name == "--robots" && read(value, settings.robots)) continue;
    if (name == "--first-number" && read(value, settings.first_number)) continue;
    if (name == "--properties" && read(value, settings.properties)) continue;
    if (name == "--rate" && read(value, settings.rate_hz) && settings.rate_hz > 0) continue;
    if (name == "--first-port" && read(value, settings.first_port)) continue;
    if (name == "--seconds" && read(value, settings.seconds)) continue;
    return std::nullopt;
  }
  return has_broker ? std::optional(settings) : std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const std::optional<Settings> settings = settings_of(argc, argv);
  if (!settings) {
    std::fprintf(stderr,
                 "usage: ex_fleet %s\n"
                 "                [--robots N] [--first-number N] [--properties N] [--rate HZ] [--first-port PORT] [--seconds N] [--commands]\n",
                 broker::Arguments::usage);
    return 2;
  }
  std::vector<std::unique_ptr<Robot>> robots;
  for (unsigned i = 0; i < settings->robots; ++i) {
    robots.push_back(Robot::create(*settings, settings->first_number + i));
    if (!robots.back()) return 1;
  }
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  if (settings->broker.has_files()) std::signal(SIGHUP, [](int) { hung_up = 1; });
  const lrt::mqtt::Options to = settings->broker.options(settings->first_number).value();
  std::printf("%u robots publish to %s:%u, from r%u on (Ctrl-C ends)\n", settings->robots, to.broker.host.c_str(),
              static_cast<unsigned>(to.broker.port), settings->first_number);
  std::fflush(stdout);

  const auto begin = std::chrono::steady_clock::now();
  const auto period = std::chrono::microseconds(1'000'000 / settings->rate_hz);
  auto next = begin;
  while (!interrupted && (settings->seconds == 0 || std::chrono::steady_clock::now() - begin < std::chrono::seconds(settings->seconds))) {
    if (hung_up) {
      hung_up = 0;
      for (auto& robot : robots) robot->reload();
    }
    for (auto& robot : robots) robot->step(1.0 / settings->rate_hz);
    next += period;
    do {
      for (auto& robot : robots) robot->poll();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } while (std::chrono::steady_clock::now() < next);
  }
  lrt::mqtt::Counters all;
  for (const auto& robot : robots) {
    const lrt::mqtt::Counters one = robot->counters();
    all.published += one.published;
    all.connections += one.connections;
    all.refused += one.refused;
  }
  std::printf("%llu messages published, %llu connections, %llu refused\n", static_cast<unsigned long long>(all.published),
              static_cast<unsigned long long>(all.connections), static_cast<unsigned long long>(all.refused));
}
