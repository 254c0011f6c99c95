// SPDX-License-Identifier: Apache-2.0
// The examples in the comments of Thing, Server, Options and Responder. They are compiled, not run. (snippets_test.py compiles the code of the pages.)
#include <functional>
#include <utility>

#include <lrt/lrt.hpp>

namespace docs {

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

}  // namespace docs
