// SPDX-License-Identifier: Apache-2.0
// A fleet: N simulated robots in one program, each with its own server and its own connection to one MQTT broker.
//
//   ex_fleet --mqtt HOST:PORT [--robots N] [--properties N] [--rate HZ] [--first-port PORT] [--seconds N]
//
//   mosquitto -p 1883 &                                              # a broker
//   ex_fleet --mqtt localhost:1883 --robots 20 &                     # twenty robots
//   mosquitto_sub -V 5 -t 'robots/+/ns/status' -t 'robots/+/base/x' -v  # a dashboard of all
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

namespace {

volatile std::sig_atomic_t interrupted = 0;

struct Settings {
  std::string host;
  std::uint16_t port = 0;
  unsigned robots = 10, properties = 2, rate_hz = 10, first_port = 0, seconds = 0;
};

/// A mobile base that drives in a circle.
class Robot {
 public:
  static std::unique_ptr<Robot> create(const Settings& settings, unsigned number) {
    auto robot = std::make_unique<Robot>();
    lrt::Options options;
    options.threads.io = lrt::Io::in_poll;
    if (settings.first_port != 0) options.listen.port = static_cast<std::uint16_t>(settings.first_port + number);
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

    lrt::mqtt::Options mqtt;
    mqtt.broker.host = settings.host;
    mqtt.broker.port = settings.port;
    mqtt.prefix = "robots/r" + std::to_string(number);
    auto bridge = lrt::mqtt::Bridge::create(*robot->server_, mqtt);
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
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i], value = argv[i + 1];
    const std::size_t colon = value.rfind(':');
    if (name == "--mqtt" && colon != std::string_view::npos && read(value.substr(colon + 1), settings.port)) settings.host = value.substr(0, colon);
    else if (name == "--robots" && read(value, settings.robots)) continue;
    else if (name == "--properties" && read(value, settings.properties)) continue;
    else if (name == "--rate" && read(value, settings.rate_hz) && settings.rate_hz > 0) continue;
    else if (name == "--first-port" && read(value, settings.first_port)) continue;
    else if (name == "--seconds" && read(value, settings.seconds)) continue;
    else return std::nullopt;
  }
  return argc % 2 == 1 && !settings.host.empty() ? std::optional(settings) : std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const std::optional<Settings> settings = settings_of(argc, argv);
  if (!settings) {
    std::fprintf(stderr, "usage: ex_fleet --mqtt HOST:PORT [--robots N] [--properties N] [--rate HZ] [--first-port PORT] [--seconds N]\n");
    return 2;
  }
  std::vector<std::unique_ptr<Robot>> robots;
  for (unsigned i = 0; i < settings->robots; ++i) {
    robots.push_back(Robot::create(*settings, i));
    if (!robots.back()) return 1;
  }
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  std::printf("%u robots publish to %s:%u as robots/r0 to robots/r%u (Ctrl-C ends)\n", settings->robots, settings->host.c_str(),
              static_cast<unsigned>(settings->port), settings->robots - 1);
  std::fflush(stdout);

  const auto begin = std::chrono::steady_clock::now();
  const auto period = std::chrono::microseconds(1'000'000 / settings->rate_hz);
  auto next = begin;
  while (!interrupted && (settings->seconds == 0 || std::chrono::steady_clock::now() - begin < std::chrono::seconds(settings->seconds))) {
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
