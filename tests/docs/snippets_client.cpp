// SPDX-License-Identifier: Apache-2.0
// Code of the guide's pages about clients. It is compiled, not run: lesson t23 and tests/client run the same functions.
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

#include <lrt/client.hpp>
#include <lrt/client/callback_receiver.hpp>
#include <lrt/client/latest.hpp>

namespace docs {

void use_a_robot() {
  lrt::Client client = lrt::Client::create().value();
  auto robot = client.open("http://127.0.0.1:8080/").value();
  auto joint = robot.thing("right_s1").value();
  double angle = joint.property("position").value().read<double>(lrt::unit::radian).value();
  joint.property("friction").value().write(1.5).value();           // an input that violates the published shape is not sent
  auto run = joint.action("rotate").value().invoke(43.6).value();  // sent as the action's binding says
  run.wait(std::chrono::seconds(10)).value();                      // or run.cancel()
  std::printf("it was at %g rad\n", angle);
}

void watch(lrt::Client& client, const std::string& url) {
  auto watch = client.watch(url, {}, [](const lrt::client::Change& change) {
    using Kind = lrt::client::Change::Kind;
    if (change.kind == Kind::value) std::printf("%s\n", change.body->c_str());
    if (change.kind == Kind::gap) std::printf("connected again: changes may be missing\n");
    if (change.kind == Kind::ended) std::printf("ended: %s\n", change.reason ? change.reason->message.c_str() : "");
  });
  if (!watch) return;
  while (true) {
    client.wait(std::chrono::milliseconds(100));
    client.poll();  // runs the lambda
  }
}

void follow(const lrt::client::Property& position) {
  auto leader = position.latest<double>().value();
  double target = 0;
  leader.take(target);  // noexcept: no lock, no allocation, no system call
}

void without_waiting(lrt::Client& client, lrt::client::Property& position) {
  client.async([&] { return position.read<double>(); },  // on a thread of the client
               [](const lrt::Result<double>& value) {    // in client.poll()
                 if (value) std::printf("%g\n", *value);
               });
}

lrt::Result<lrt::Client> with_identity() {
  lrt::client::Options options;
  options.identity.token_file = "robot.token";  // sent to the origins that the program names, and to no other
  options.ca_file = "plant-ca.pem";
  options.limits.response_time = std::chrono::seconds(3);
  return lrt::Client::create(options);
}

}  // namespace docs
