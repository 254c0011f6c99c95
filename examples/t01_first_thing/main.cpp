// One joint of a robot on the web: a property that is read, and an action that moves it.
#include <lrt/lrt.hpp>

#include <cstdio>

int main() {
  double angle = 0.5;  // [rad], owned by the control loop

  lrt::Thing joint{"baxter/right_s1"};
  joint.property("rotation", [&] { return angle; }, lrt::unit::radian);
  joint.action("rotate", [&](double target, lrt::Responder done) {
    angle = target;
    std::move(done).succeed();
  });

  auto server = lrt::Server::create();
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(joint)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("%s\n", server->url().c_str());
  server->run();  // or poll() from a control loop
}
