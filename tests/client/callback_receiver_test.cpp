// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/callback_receiver.hpp>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/subscription/notification.hpp>

#include "src/exchange/tls.hpp"
#include "tests/client/watch_support.hpp"
#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"
#include "tests/support/odd_responses.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"

namespace lrt {
namespace {

using client::CallbackReceiver;
using client::CallbackReceiverOptions;
using client::Change;
using client::Via;
using client::Watch;
using client::Watches;
using client::WatchOptions;
using test::background;
using test::by;
using test::Changes;
using test::http_client;
using test::Peer;
using test::PushingRobot;
using Kind = Change::Kind;

std::string path_of(const std::string& url) { return url.substr(url.find('/', 8)); }

/// What a program's own server gives to the receiver.
test::Answer ask(CallbackReceiver& receiver, const std::string& text) {
  test::RequestText request(text);
  return test::Answer(receiver.handle(request.get()));
}

std::shared_ptr<CallbackReceiver> without_port(std::size_t max_callbacks = 1000) {
  CallbackReceiverOptions options;
  options.listens = false;
  options.public_url = "https://console.example/robots";
  options.max_body_bytes = 100;
  options.max_callbacks = max_callbacks;
  return CallbackReceiver::create(options).value();
}

TEST_CASE("callback URLs are below the public URL and cannot be guessed", "[client][R0.16]") {
  const auto receiver = without_port(2);
  const auto nothing = [](const CallbackReceiver::Notification&) {};
  const std::string a = receiver->add("", nothing).value(), b = receiver->add("", nothing).value();
  CHECK(a.find("https://console.example/robots/") == 0);
  CHECK(a.size() == receiver->url().size() + 32);
  CHECK(a != b);
  CHECK(receiver->add("", nothing).error().code == Errc::limit_exceeded);
  receiver->remove(a);
  receiver->remove("x");
  CHECK(receiver->add("", nothing));
  receiver->stop();
  CHECK(receiver->add("", nothing).error().code == Errc::closed);
  for (const char* const bad : {"", "console", "ftp://x/", "http://x/?a=1"}) {
    CallbackReceiverOptions options;
    options.listens = false;
    options.public_url = bad;
    CHECK(CallbackReceiver::create(options).error().code == Errc::invalid_option);
  }
}

TEST_CASE("a receiver confirms its own callbacks only", "[client][R0.16]") {
  const auto receiver = without_port();
  const std::string path = path_of(receiver->add("", [](const CallbackReceiver::Notification&) {}).value());
  const auto confirmed = ask(*receiver, "GET " + path + "?hub.mode=subscribe&hub.topic=http%3A%2F%2Frobot%2Farm&hub.challenge=a%20%3Cb%3E+c");
  CHECK(confirmed.status == 200);
  CHECK(confirmed.body == "a <b> c");
  CHECK(confirmed.field("Content-Type").find("text/plain") == 0);
  CHECK(ask(*receiver, "GET " + path).status == 404);
  CHECK(ask(*receiver, "GET " + path + "?hub.mode=unsubscribe&hub.challenge=x").status == 404);
  CHECK(ask(*receiver, "GET " + path + "?hub.mode=subscribe").status == 404);
  CHECK(ask(*receiver, "GET " + path + "?hub.mode=subscribe&hub.challenge=" + std::string(2000, 'x')).status == 404);
  CHECK(ask(*receiver, "GET /robots/" + std::string(32, '0') + "?hub.mode=subscribe&hub.challenge=x").status == 410);
  CHECK(ask(*receiver, "GET /other?hub.mode=subscribe&hub.challenge=x").status == 404);
  CHECK(ask(*receiver, "PUT " + path + "\n\nx").status == 405);
}

TEST_CASE("a notification is handed on if its signature is right", "[client][R0.16]") {
  const auto receiver = without_port();
  std::vector<std::string> taken;
  const auto take = [&](const CallbackReceiver::Notification& notification) {
    taken.push_back(std::string(notification.body) + "|" + std::string(notification.content_type) + "|" + std::string(notification.entity_tag));
  };
  const std::string signed_path = path_of(receiver->add("key", take).value()), open_path = path_of(receiver->add("", take).value());
  const std::string right = exchange::sign("key", "body");
  const auto post = [&](const std::string& path, const std::string& fields) {
    return ask(*receiver, "POST " + path + "\nContent-Type: text/turtle\n" + fields + "\nbody").status;
  };
  CHECK(post(signed_path, "X-Hub-Signature: " + right + "\nETag: \"1\"\n") == 204);
  CHECK(taken == std::vector<std::string>{"body|text/turtle|\"1\""});
  CHECK(post(signed_path, "") == 403);
  CHECK(post(signed_path, "X-Hub-Signature: " + exchange::sign("other", "body") + "\n") == 403);
  CHECK(post(signed_path, "X-Hub-Signature: " + exchange::sign("key", "other") + "\n") == 403);
  CHECK(post(signed_path, "X-Hub-Signature: sha1=0000\n") == 403);
  CHECK(post(signed_path, "X-Hub-Signature: " + right + "\nX-Hub-Signature: " + right + "\n") == 403);
  CHECK(post(signed_path, "X-Hub-Signature: " + right.substr(0, right.size() - 1) + "\n") == 403);
  CHECK(taken.size() == 1);
  CHECK(post(open_path, "") == 204);
  CHECK(taken.size() == 2);
  CHECK(ask(*receiver, "POST " + open_path + "\nContent-Type: text/plain\n\n" + std::string(101, 'x')).status == 413);
  receiver->remove("https://console.example" + open_path);
  CHECK(post(open_path, "") == 410);
  CHECK(receiver->counts().notifications == 2);
  CHECK(receiver->counts().unsigned_ == 6);
  CHECK(receiver->counts().unknown == 1);
}

struct CallingRobot : PushingRobot {
  static Options options(subscription::Confirmation confirmation) {
    Options made;
    made.callbacks.allow = {"127.0.0.1"};
    made.callbacks.confirmation = confirmation;
    made.callbacks.first_pause = std::chrono::milliseconds(10);
    return made;
  }
  explicit CallingRobot(std::string_view transport = {}, std::uint16_t port = 0)
      : PushingRobot(transport, port, options(subscription::Confirmation::all)) {}
};

TEST_CASE("a robot posts each value exactly once to a receiver that answers in an odd, valid way", "[client][R0.13]") {
  const test::Watchdog watchdog("callbacks");
  Options options;
  options.callbacks.allow = {"127.0.0.1"};
  options.callbacks.confirmation = subscription::Confirmation::not_loopback;
  options.callbacks.first_pause = std::chrono::milliseconds(1);  // a notification that is taken for a failure comes again at once
  PushingRobot robot({}, 0, std::move(options));
  Client client = Client::create().value();
  for (const test::OddResponse& odd : test::odd_responses()) {
    INFO(odd.name);
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<std::string> bodies;
    test::Receiver receiver([&](test::Peer& peer) {
      for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
        {
          const std::lock_guard lock(mutex);
          bodies.push_back(request.substr(request.find("\r\n\r\n")));
          changed.notify_all();
        }
        const std::size_t piece = odd.is_byte_by_byte ? 1 : odd.bytes.size();
        for (std::size_t at = 0; at < odd.bytes.size(); at += piece) peer.send(std::string_view(odd.bytes).substr(at, piece));
        if (odd.closes) return;
      }
    });
    robot.angle.publish(1000.5);
    const client::Response made = client.send({"GET", robot.url(), {{"Upgrade", "callback"}, {"Callback", receiver.url()}}, {}}).value();
    REQUIRE(made.status == 201);
    constexpr std::size_t values = 4;
    for (std::size_t i = 0; i < values; ++i) {
      std::unique_lock lock(mutex);
      REQUIRE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return bodies.size() > i; }));
      lock.unlock();
      robot.angle.publish(1001.5 + static_cast<double>(i));
    }
    CHECK(client.send({"DELETE", std::string(made.fields.find("Location").value_or("")), {}, {}}).value().status == 204);
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < values; ++i) CHECK(bodies[i].find(std::to_string(1000 + i) + ".5") != std::string::npos);
  }
}

TEST_CASE("a server posts its changes to a watch, which confirms them and ends them", "[client][R0.13][R0.16]") {
  const test::Watchdog watchdog("callbacks");
  for (const std::string_view transport : transport::names()) {
    for (const bool is_signed : {false, true}) {
      INFO(transport << is_signed);
      CallingRobot robot(transport);
      robot.angle.publish(1111.25);
      const auto receiver = CallbackReceiver::create().value();
      Watches watches(http_client(background()));
      WatchOptions options = by(Via::callback);
      options.receiver = receiver;
      if (is_signed) options.subscriptions_url = "http://127.0.0.1:" + std::to_string(robot.server->port()) + "/arm/subscriptions";
      Changes changes;
      Watch watch = watches.watch(robot.url(), options, changes.callback()).value();
      const Change first = changes.wait_value("1111.25");
      CHECK(first.media_type == "text/turtle");
      CHECK(first.entity_tag.substr(0, 1) == "\"");
      CHECK(first.graph());
      robot.angle.publish(2222.5);
      changes.wait_value("2222.5");
      CHECK(watch.is_connected());
      CHECK(watch.via() == Via::callback);
      while (watch.subscription().empty()) std::this_thread::yield();  // the first notification may precede the response
      const std::string subscription = watch.subscription();
      const auto http = http_client(client::Options());
      const auto described = http->send({"GET", subscription, {}, {}}).value();
      CHECK(described.body.find(receiver->url()) != std::string::npos);
      watch.stop();
      while (http->send({"GET", subscription, {}, {}}).value().status != 404) std::this_thread::yield();
      CHECK(receiver->counts().unsigned_ == 0);
    }
  }
}

TEST_CASE("a client that ends deletes its callbacks", "[client][R0.16]") {
  const test::Watchdog watchdog("callbacks");
  CallingRobot robot;
  robot.angle.publish(1111.25);
  const auto receiver = CallbackReceiver::create().value();
  std::string subscription;
  {
    Watches watches(http_client(background()));
    WatchOptions options = by(Via::callback);
    options.receiver = receiver;
    Changes changes;
    const Watch watch = watches.watch(robot.url(), options, changes.callback()).value();
    changes.wait(1);
    while (watch.subscription().empty()) std::this_thread::yield();
    subscription = watch.subscription();
    watches.stop();
  }
  CHECK(http_client(client::Options())->send({"GET", subscription, {}, {}}).value().status == 404);
}

TEST_CASE("a subscription that a server has forgotten is made again, after a gap", "[client][R0.16]") {
  const test::Watchdog watchdog("callbacks");
  auto robot = std::make_unique<CallingRobot>();
  const std::uint16_t port = robot->server->port();
  robot->angle.publish(1111.25);
  Watches watches(http_client(background()));
  WatchOptions options = by(Via::callback);
  options.receiver = CallbackReceiver::create().value();
  options.idle_time = std::chrono::milliseconds(50);
  Changes changes;
  const Watch watch = watches.watch(robot->url(), options, changes.callback()).value();
  changes.wait_value("1111.25");
  robot.reset();
  robot = std::make_unique<CallingRobot>("", port);
  robot->angle.publish(7777.75);
  changes.wait_value("7777.75");
  CHECK(watch.counts().gaps >= 1);
}

TEST_CASE("the later server of the paper's authors is understood, one that ignores Upgrade is not", "[client][R0.13]") {
  const test::Watchdog watchdog("callbacks");
  std::atomic<bool> understands{true};
  std::atomic<int> deleted{0};
  test::Receiver server([&](Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
      if (request.substr(0, 6) == "DELETE") {
        ++deleted;
        peer.send(test::answer(204));
        continue;
      }
      const std::size_t at = request.find("\r\nCallback: ");
      const std::string callback = at == std::string::npos ? "" : request.substr(at + 12, request.find("\r\n", at + 12) - at - 12);
      const std::string body =
          understands ? "<#s> <https://hybr-it-projekt.de/ns/hybr-it#callbackUrl> \"" + callback + "\" ." : "<> <http://e/p> 1 .";
      // A server must not be able to name what this program deletes at another one.
      peer.send(test::answer(200, body, "Content-Type: text/turtle\r\nLocation: http://127.0.0.1:1/robot\r\n"));
    }
  });
  Watches watches(http_client(background()));
  WatchOptions options = by(Via::callback);
  options.receiver = CallbackReceiver::create().value();
  {
    Changes changes;
    const Watch watch = watches.watch(server.url(), options, changes.callback()).value();
    while (!watch.is_connected()) std::this_thread::yield();
    CHECK(watch.subscription().empty());
  }
  understands = false;
  Changes changes;
  const Watch watch = watches.watch(server.url(), options, changes.callback()).value();
  CHECK(changes.wait_end().reason->message.find("does not support web callbacks") != std::string::npos);
  CHECK(deleted == 0);
}

TEST_CASE("a server that may not call the receiver says so", "[client][R0.13]") {
  const test::Watchdog watchdog("callbacks");
  PushingRobot robot;  // it makes no callbacks
  robot.angle.publish(1);
  Watches watches(http_client(background()));
  WatchOptions options = by(Via::callback);
  options.receiver = CallbackReceiver::create().value();
  Changes changes;
  const Watch watch = watches.watch(robot.url(), options, changes.callback()).value();
  CHECK(changes.wait_end().reason->message.find("403") != std::string::npos);
  options.subscriptions_url = "http://other.example/arm/subscriptions";
  CHECK(watches.watch(robot.url(), options, changes.callback()).error().code == Errc::invalid_option);
}

TEST_CASE("a notification can end its receiver", "[client][threads]") {
  const test::Watchdog watchdog("callbacks");
  auto receiver = CallbackReceiver::create().value();
  std::atomic<bool> is_gone{false};
  const std::string url = receiver
                              ->add("",
                                    [&](const CallbackReceiver::Notification&) {
                                      receiver.reset();
                                      is_gone = true;
                                    })
                              .value();
  const Result<http::Url> parsed = http::parse_url(url);
  test::Socket socket(parsed->port);
  socket.send("POST " + parsed->target + "\nHost: " + parsed->authority + "\nContent-Type: text/plain\n\nx");
  while (!is_gone) std::this_thread::yield();
  while (!socket.ended()) socket.receive(std::chrono::milliseconds(10));
}

TEST_CASE("a receiver listens on its own port", "[client]") {
  const auto receiver = CallbackReceiver::create().value();
  CallbackReceiverOptions same;
  same.port = receiver->port();
  CHECK(CallbackReceiver::create(same).error().code == Errc::address_in_use);
  test::Socket socket(receiver->port());
  const auto answer = socket.ask("GET /x\nHost: 127.0.0.1");
  CHECK(answer.status == 404);
}

}  // namespace
}  // namespace lrt
