// SPDX-License-Identifier: Apache-2.0
// A robot of one joint, for the conductor: it has a position, and an action that changes it.
//
//   ex_conductor_arm NAME [--port N]
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <thread>

#include <lrt/lrt.hpp>

volatile std::sig_atomic_t interrupted = 0;

int main(int argc, char** argv) {
  if (argc != 2 && !(argc == 4 && std::string_view(argv[2]) == "--port")) return std::fputs("usage: ex_conductor_arm NAME [--port N]\n", stderr), 2;
  constexpr double step = 0.02;  // [rad] in one round of the loop
  constexpr double limit = 2;    // [rad] of the joint, both directions
  double angle = 0, target = 0;  // [rad]
  std::optional<lrt::Responder> moving;

  lrt::Thing joint{argv[1]};
  joint.type(lrt::vocab::ros::RevoluteJoint);
  auto position = joint.property<double>("position", lrt::unit::radian).predicate(lrt::vocab::ros::position).between(-limit, limit);
  joint
      .action("moveTo",
              [&](double to, lrt::Responder done) {
                target = to;
                done.on_cancel([&] { target = angle; });
                moving = std::move(done);
              })
      .consumes(lrt::Facets(lrt::unit::radian).between(-limit, limit))
      .policy(lrt::ActionPolicy::preempt())
      .effect(position, lrt::from_input);

  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(argc == 4 ? std::atoi(argv[3]) : 0);
  auto server = lrt::Server::create(options);
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(joint)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("%s is at %s\n", argv[1], server->url().c_str());
  std::fflush(stdout);
  for (const int end : {SIGINT, SIGTERM}) std::signal(end, [](int) { interrupted = 1; });
  while (!interrupted) {
    angle += std::clamp(target - angle, -step, step);
    position.publish(angle);
    if (moving && angle == target) {  // after the position is published, which the effect names
      moving->succeed();
      moving.reset();
    }
    server->poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}
