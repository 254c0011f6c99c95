// SPDX-License-Identifier: Apache-2.0
// Code that the guide shows and no example has: Things, threads, types, actions, subscriptions, security, transports, errors. It is compiled, not run.
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/libwebsockets.hpp>
#include <lrt/transport/named.hpp>
#include <lrt/world.hpp>

namespace docs {

// The comments of Thing, Server, Options and Responder

void thing(double& angle) {
  lrt::Thing joint{"baxter/right_s1"};
  joint.property(
      "rotation", [&] { return angle; }, lrt::unit::radian);
  joint.action("rotate", [&](double target, lrt::Responder done) {
    angle = target;
    done.succeed();
  });
}

template <class Ok, class Step>
void server(lrt::Thing joint, Ok robot_ok, Step control_step) {
  lrt::Server server = lrt::Server::create().value();  // http://127.0.0.1:8080/, for this machine only
  server.add(std::move(joint)).value();
  while (robot_ok()) {
    control_step();
    server.poll();  // handles what has arrived, never waits
  }
}
template void server(lrt::Thing, bool (*)(), void (*)());

lrt::Result<lrt::Server> options() {
  lrt::Options options;
  options.listen.address = "robot.local";
  options.security.tls.emplace();
  options.security.tls->certificate_file = "robot.pem";
  options.security.tls->key_file = "robot.key";
  options.security.token_file = "tokens.txt";
  options.limits.max_connections = 100;
  auto server = lrt::Server::create(std::move(options));
  return server;
}

void responder(lrt::Thing& joint, double upper_limit, void (*start_motion)(double target, std::function<void()> at_end)) {
  joint.action("rotate", [&](double target, lrt::Responder done) {
    if (target > upper_limit) return done.fail({lrt::Errc::out_of_range, "the target is beyond the limit"});
    start_motion(target, [done] { done.succeed(); });  // later, from any thread
  });
}

// things.md

lrt::Result<void> add_and_remove(lrt::Server& server) {
  std::vector<lrt::Thing> things;
  things.emplace_back("arm");
  things.emplace_back("arm/j1");                                         // below "arm": its part
  if (auto added = server.add(std::move(things)); !added) return added;  // all of them, or none
  return server.remove("arm");                                           // and all Things below it
}

lrt::Result<lrt::Server> with_public_base() {
  lrt::Options options;
  options.listen.address = "127.0.0.1";                         // the proxy is on this machine
  options.listen.public_base = "https://robots.example/cell7";  // the IRIs that clients see
  return lrt::Server::create(std::move(options));
}

lrt::WorldGraph make_map(lrt::World& world) {
  lrt::GraphOptions options;
  options.clients_may_write = true;
  options.file = "tasks.nt";  // kept over a restart
  return world.graph("tasks", options);
}

// threads.md

void dispatch(lrt::Thing& arm) {
  arm.dispatch(lrt::Dispatch::io_thread);                                                     // all lambdas of this Thing
  arm.property("mode", [] { return std::string("idle"); }).dispatch(lrt::Dispatch::in_poll);  // except this one
}

lrt::Options real_time() {
  lrt::Options options;
  options.threads.own.cpus = {0};                 // lrt's threads stay on CPU 0
  options.threads.own.stack_bytes = 1024 * 1024;  // for mlockall()
  options.threads.body_threads = 1;               // parses request bodies above 2 KiB
  return options;
}

template <class Robot>
void control_loop(Robot& robot, lrt::Server& server, lrt::PushedProperty<double>& position) {
  while (robot.ok()) {
    position.publish(robot.step());               // no lock, no allocation
    server.poll(std::chrono::microseconds(100));  // runs lambdas that are due, never waits
    robot.wait_for_next_period();
  }
}

struct AnyRobot {
  bool ok() { return false; }
  double step() { return 0; }
  void wait_for_next_period() {}
};
template void control_loop<AnyRobot>(AnyRobot&, lrt::Server&, lrt::PushedProperty<double>&);

// types.md

constexpr lrt::Unit pascal{lrt::Iri{"http://qudt.org/vocab/unit/PA"}, {}, "Pa", lrt::Iri{"http://qudt.org/vocab/quantitykind/Pressure"}};

void units_and_bounds(lrt::Thing& press) {
  double pressure = 101'325;
  auto set_pressure = [&](double wanted) { pressure = wanted; };
  press
      .property(
          "pressure", [&] { return pressure; }, pascal)
      .between(0, 2e6)
      .on_write(set_pressure);
  press.property("name", [] { return std::string("press 1"); });
  press.property<std::array<double, 6>>("joints", lrt::unit::radian);  // published
}

// actions.md

struct Pose {
  double height = 0, reach = 0;  // [m]
};
class Lift {
 public:
  void start(double, lrt::Responder done) { done.succeed(); }
};
class Slide {
 public:
  void start(double, lrt::Responder done) { done.succeed(); }
};

void compose(lrt::Thing& arm, lrt::Action& lift_action, lrt::Action& slide_action, Lift& lift, Slide& slide) {
  arm.action("moveTo",
             [&](double height, lrt::Responder done) {
               std::vector<lrt::Responder> parts = done.split(2);  // one responder for each part
               lift.start(height, parts[0]);
               slide.start(0.5 * height, parts[1]);
             })
      .composed_of(lift_action)
      .composed_of(slide_action);
}

// subscriptions.md

void observed(lrt::Thing& base) {
  auto bumper = base.property<bool>("bumper");
  bumper.urgent();  // each publish() wakes the engine: for rare events that must not wait
  auto encoder = base.property<double>("encoder", lrt::unit::radian);
  encoder.keep(200);       // values kept for subscribers with a queue
  encoder.every_sample();  // a repeated value counts as a change
}

lrt::Options callbacks() {
  lrt::Options options;
  options.callbacks.allow = {"dashboard.example", "192.0.2.0/24"};  // receivers that the robot may call; default: none
  options.callbacks.file = "/var/lib/robot/subscriptions.ttl";      // keeps callbacks over a restart
  return options;
}

// security.md

lrt::Options with_tokens() {
  lrt::Options options;
  options.listen.address = "0.0.0.0";
  options.security.tls = lrt::transport::TlsOptions{"server.pem", "server-key.pem", {}};
  options.security.token_file = "tokens";  // lines NAME ROLE TOKEN: "anna operator zK8rT2vQ9wY4mB7x"
  return options;
}

lrt::Options with_audit() {
  lrt::Options options;
  auto file = std::make_shared<std::ofstream>("audit.jsonl", std::ios::app);
  options.security.audit.sink = [file](std::string_view line) { *file << line << std::endl; };
  return options;
}

lrt::Result<void> with_counters(lrt::Server& server) { return server.add(lrt::server_thing(server)); }

lrt::Options with_rules() {
  using namespace lrt::security;
  lrt::Options options;
  options.security.token_file = "tokens";
  options.security.rules = {
      {"/", Scope::tree, {Who::Kind::authenticated}, Right::read | Right::subscribe},
      {"/", Scope::tree, {Who::Kind::role, "operator"}, Right::write | Right::invoke},
      {"/head/camera", Scope::here, {Who::Kind::principal, "anna"}, Right::read},
  };
  return options;
}

// transports.md

lrt::Options by_name() {
  lrt::Options options;
  options.listen.transport = [](lrt::transport::TransportOptions o) { return lrt::transport::make_named("libwebsockets", std::move(o)); };
  return options;
}

// examples/reverse_proxy/README.md

lrt::Options behind_proxy() {
  lrt::Options options;
  options.listen.public_base = "https://robot.example";  // base of all IRIs, Links and Locations, with the scheme and port that clients use
  options.security.allowed_hosts = {"alias.example"};    // further names by which the proxy is known
  return options;
}

// errors.md

void limits() {
  lrt::Options options;
  options.limits.max_body_bytes = 64 * 1024;
  options.limits.max_connections = 200;
  options.subscriptions.max_subscriptions = 100;
  options.log = [](lrt::LogLevel level, std::string_view message) {
    if (level >= lrt::LogLevel::warning) std::fprintf(stderr, "%.*s\n", static_cast<int>(message.size()), message.data());
  };
  auto server = lrt::Server::create(std::move(options));
  if (!server) {
    std::fprintf(stderr, "%s: %s\n", std::string(to_string(server.error().code)).c_str(), server.error().message.c_str());
    return;
  }
}

void refuse(lrt::Thing& arm, bool& brakes_on) {
  arm.action("move", [&brakes_on](double) -> lrt::Result<void> {
    if (brakes_on) return lrt::refused("the brakes are on");  // the client gets 409 with this sentence
    return {};
  });
}

// fleet.md

void ages(lrt::Thing& joint) {
  const auto read_temperature = [] { return 36.5; };
  joint.property("temperature", read_temperature, lrt::unit::degree_celsius).max_age(std::chrono::seconds(5), std::chrono::seconds(5));
  joint.max_age(std::chrono::seconds(1));  // the Thing and its state
}

}  // namespace docs
