// SPDX-License-Identifier: Apache-2.0
// The other side: a program that uses a robot. It is given one URL, finds the rest by links and types, reads and writes C++ values, and invokes an
// action by what it changes. Inputs are validated by the robot's own shapes before they are sent.
#include <atomic>
#include <cstdio>
#include <string>
#include <thread>

#include <lrt/client.hpp>
#include <lrt/lrt.hpp>

namespace {

/// Another robot: a gripper, served by its own thread.
void run_robot(std::atomic<bool>& ends, std::atomic<int>& port) {
  double width = 0.04, force = 10;  // [m], [N]
  lrt::Thing gripper{"gripper"};
  auto opening = gripper.property<double>("width", lrt::unit::metre);
  gripper
      .property(
          "force", [&] { return force; }, lrt::unit::newton)
      .on_write([&](double f) { force = f; })
      .between(0, 40);
  gripper.action("move", [&](double to) { width = to; }).consumes(lrt::Facets(lrt::unit::metre).between(0, 0.08)).effect(opening, lrt::from_input);
  lrt::Options options;
  options.listen.port = 0;
  lrt::Server server = lrt::Server::create(options).value();
  server.add(std::move(gripper)).value();
  port = server.port();
  while (!ends) {
    opening.publish(width);
    server.poll();
    std::this_thread::yield();
  }
}

void say(const std::string& what, const lrt::Result<void>& done) {
  std::printf("%s: %s\n", what.c_str(), done ? "done" : done.error().message.c_str());
}

}  // namespace

int main() {
  std::atomic<bool> ends{false};
  std::atomic<int> port{0};
  std::thread robot_thread([&] { run_robot(ends, port); });
  while (port == 0) std::this_thread::yield();

  {
    lrt::Client client = lrt::Client::create().value();
    const auto robot = client.open("http://127.0.0.1:" + std::to_string(port) + "/").value();
    for (const lrt::client::Thing& thing : robot.things()) {
      std::printf("%s has\n", thing.name().c_str());
      for (const auto& property : thing.properties())
        std::printf("  %s%s\n", property.name().c_str(), property.is_writable().value() ? ", which can be written" : "");
      for (const auto& action : thing.actions()) std::printf("  an action %s\n", action.name().c_str());
    }

    const auto gripper = robot.thing("gripper").value();
    const auto width = gripper.property("width").value(), force = gripper.property("force").value();
    std::printf("width: %g m\n", width.read<double>(lrt::unit::metre).value());
    std::printf("in millimetres: %s\n", width.read<double>(lrt::unit::millimetre).has_value() ? "a value" : "refused, nothing is converted silently");
    say("force 25 N", force.write(25.0));
    const auto too_much = force.write(100.0);
    std::printf("force 100 N: %s\n", too_much.error().message.c_str());

    lrt::client::ActionQuery query;  // whatever changes the width
    query.affects = width.url();
    const auto actions = robot.actions(query).value();
    const auto run = actions.front().invoke(0.02).value();
    const auto ended = run.wait(std::chrono::seconds(5)).value();
    std::printf("%s: %s\n", actions.front().name().c_str(), std::string(to_string(ended.status)).c_str());
    while (width.read<double>().value() != 0.02) std::this_thread::yield();  // the robot publishes it in its next step
    std::printf("width: %g m\n", width.read<double>().value());
  }

  ends = true;
  robot_thread.join();
}

// Output:
// gripper has
//   width
//   force, which can be written
//   an action move
// width: 0.04 m
// in millimetres: refused, nothing is converted silently
// force 25 N: done
// force 100 N: not sent: the input does not conform to the published shape: vom:numericalValue: expected at most 40, found 100
// move: succeeded
// width: 0.02 m
