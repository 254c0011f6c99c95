// SPDX-License-Identifier: Apache-2.0
// A client subscribes what one robot does to what another one says: the receiver of a web callback is an action or a Property of another server.

#include <lrt/server.hpp>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A robot that is moved by its action `turn`, by its Property `target` and by new members of its collection.
struct Robot {
  explicit Robot(Options options = {}) : server(with_port(std::move(options))) {
    Thing thing{"arm"};
    angle = thing.property<double>("angle");
    thing.property("target", [this] { return target; }).on_write([this](double to) { target = to, ++moves; });
    thing.action("turn", [this](double to) { target = to, ++moves; });
    thing.collection<double>("waypoints").on_create([this](double to) { target = to, ++moves; });
    server.add(std::move(thing)).value();
    angle.publish(10);
  }
  static Server with_port(Options options) {
    options.listen.port = 0;
    return Server::create(std::move(options)).value();
  }
  std::string url() const { return server.url().substr(0, server.url().size() - 1); }

  double target = 0;
  int moves = 0;
  PushedProperty<double> angle;
  Server server;
};

Options posting(subscription::Confirmation confirmation) {
  Options options;
  options.callbacks.allow = {"127.0.0.1"};
  options.callbacks.confirmation = confirmation;
  options.callbacks.first_pause = std::chrono::milliseconds(1);
  return options;
}

/// Both robots work while a client waits for the response.
Answer ask(Robot& of, Robot& other, const std::string& text) {
  Socket client(of.server.port());
  const std::size_t line = std::min(text.find('\n'), text.size());
  return client.ask(text.substr(0, line) + "\nHost: 127.0.0.1:" + std::to_string(of.server.port()) + text.substr(line), [&] {
    of.server.poll();
    other.server.poll();
  });
}

/// The path of a stranger's subscription at `speaking`, whose receiver is that resource of `moved`.
std::string subscribe(Robot& speaking, Robot& moved, const std::string& receiver) {
  const Answer made =
      ask(speaking, moved, "GET /arm/angle\nAccept: application/json\nConnection: Upgrade\nUpgrade: callback\nCallback: " + moved.url() + receiver);
  REQUIRE(made.status == 201);
  return made.field("Location").substr(speaking.url().size());
}

/// Asks for the subscription until `enough` holds of the response; at most a minute.
template <class Enough>
Answer await(Robot& speaking, Robot& moved, const std::string& subscription, Enough enough) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (true) {
    Answer answer = ask(speaking, moved, "GET " + subscription);
    if (enough(answer)) return answer;
    if (std::chrono::steady_clock::now() > until) throw std::runtime_error("still " + std::to_string(answer.status) + ": " + answer.body);
  }
}

}  // namespace

TEST_CASE("a robot does not obey the notifications of another", "[server][security][R0.16]") {
  Robot moved, speaking(posting(subscription::Confirmation::none));
  const std::string receiver = GENERATE("/arm/actions/turn", "/arm/waypoints", "/arm/target");
  CAPTURE(receiver);
  const std::string subscription = subscribe(speaking, moved, receiver);
  await(speaking, moved, subscription, [](const Answer& a) { return a.says("lrt:lastError") && a.says("403"); });
  speaking.angle.publish(20);
  await(speaking, moved, subscription, [](const Answer& a) { return a.says("lrt:suspended true"); });
  CHECK(ask(speaking, moved, "GET " + subscription).says("lrt:delivered 0"));
  CHECK(moved.moves == 0);
  CHECK(moved.target == 0);
}

TEST_CASE("a robot that must confirm gets no notification of another", "[server][security][R0.13]") {
  Options obedient;  // what is delivered would be obeyed
  obedient.security.notification_senders = {"*"};
  Robot moved(std::move(obedient)), speaking(posting(subscription::Confirmation::all));
  const std::string receiver = GENERATE("/arm/actions/turn", "/arm/waypoints", "/arm/target");
  CAPTURE(receiver);
  const std::string subscription = subscribe(speaking, moved, receiver);
  speaking.angle.publish(20);
  await(speaking, moved, subscription, [](const Answer& a) { return a.status == 404; });
  CHECK(moved.moves == 0);
}

TEST_CASE("a robot obeys the notifications of another whose name it has been given", "[server][R0.16]") {
  Robot speaking(posting(subscription::Confirmation::none));
  Options obedient;
  obedient.security.notification_senders = {speaking.url()};
  Robot moved(std::move(obedient));
  const std::string subscription = subscribe(speaking, moved, "/arm/actions/turn");
  await(speaking, moved, subscription, [](const Answer& a) { return a.says("lrt:delivered 1"); });
  CHECK(moved.target == 10);
  speaking.angle.publish(20);
  await(speaking, moved, subscription, [](const Answer& a) { return a.says("lrt:delivered 2"); });
  CHECK(moved.target == 20);
  CHECK(moved.moves == 2);
}
