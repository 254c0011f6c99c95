// SPDX-License-Identifier: Apache-2.0
#include "src/client/watches.hpp"

#include <atomic>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/client/watch_support.hpp"
#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"
#include "tests/support/websocket.hpp"

namespace lrt {
namespace {

using client::Change;
using client::Via;
using client::Watch;
using client::Watches;
using client::WatchOptions;
using std::chrono::milliseconds;
using test::background;
using test::by;
using test::Changes;
using test::field_of;
using test::Frame;
using test::http_client;
using test::Peer;
using test::PushingRobot;
using Kind = Change::Kind;

std::string opening_response(const std::string& request) {
  return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " +
         test::accept_of(field_of(request, "Sec-WebSocket-Key")) + "\r\n\r\n";
}
std::string frame(std::string payload, unsigned opcode = Frame::text) {
  Frame made;
  made.opcode = opcode;
  made.payload = std::move(payload);
  made.masked = false;
  return made.bytes();
}
bool wants_websocket(const std::string& request) { return field_of(request, "Upgrade") == "websocket"; }
std::string stream_header(const std::string& fields = {}) { return "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n" + fields + "\r\n"; }

TEST_CASE("a watch gets the present value and the next ones, by every protocol and on every transport", "[client][R0.12][R0.14]") {
  const test::Watchdog watchdog("watch");
  for (const std::string_view transport : transport::names()) {
    for (const Via via : {Via::any, Via::websocket, Via::event_stream, Via::polling}) {
      PushingRobot robot(transport);
      robot.angle.publish(1111.25);
      Watches watches(http_client(background()));
      Changes changes;
      const Watch watch = watches.watch(robot.url(), by(via), changes.callback()).value();
      CHECK(changes.wait(1)[0].kind == Kind::value);
      robot.angle.publish(2222.5);
      const Change second = changes.wait_value("2222.5");
      CHECK(second.url == robot.url());
      CHECK(second.media_type == "text/turtle");
      CHECK(second.graph().value().size() > 2);
      CHECK_FALSE(second.reason);
      CHECK(watch.is_connected());
      CHECK(watch.via() == (via == Via::any ? Via::websocket : via));
      CHECK(watch.counts().values >= 2);
      CHECK(watch.counts().gaps == 0);
      CHECK_FALSE(watch.last_error());
      const bool has_subscription = via != Via::polling;
      CHECK((watch.subscription().find("/arm/subscriptions/") != std::string::npos) == has_subscription);
      if (via == Via::event_stream || via == Via::polling) CHECK(second.entity_tag.substr(0, 1) == "\"");
    }
  }
}

TEST_CASE("a watch asks for its media type, its interval and its queue", "[client][json_ld][R0.17]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1111.25);
  Watches watches(http_client(background()));
  for (const Via via : {Via::websocket, Via::event_stream, Via::polling}) {
    WatchOptions options = by(via);
    options.accept = "application/ld+json";
    options.queue_length = 5;
    options.minimum_interval = milliseconds(1);
    Changes changes;
    const Watch watch = watches.watch(robot.url() + "#fragment", options, changes.callback()).value();
    const Change first = changes.wait(1)[0];
    CHECK(first.media_type == "application/ld+json");
    CHECK(first.body->substr(0, 1) == "{");
    INFO(*first.body);
    CHECK(first.graph().value().size() > 2);  // the context of the server is known
    if (via == Via::polling) continue;
    const auto described = http_client(client::Options())->send({"GET", watch.subscription(), {{"Accept", "text/turtle"}}, {}}).value();
    CHECK(described.body.find("lrt:queueLength 5") != std::string::npos);
    CHECK(described.body.find("0.001") != std::string::npos);
  }
}

TEST_CASE("a robot that begins again is a gap, and then a value", "[client][R0.14]") {
  const test::Watchdog watchdog("watch");
  for (const std::string_view transport : transport::names()) {
    for (const Via via : {Via::any, Via::event_stream, Via::polling}) {
      INFO(transport << " " << static_cast<int>(via));
      auto robot = std::make_unique<PushingRobot>(transport);
      const std::uint16_t port = robot->server->port();
      robot->angle.publish(1111.25);
      Watches watches(http_client(background()));
      Changes changes;
      const Watch watch = watches.watch(robot->url(), by(via), changes.callback()).value();
      changes.wait_value("1111.25");
      robot.reset();
      while (watch.is_connected()) std::this_thread::yield();
      robot = std::make_unique<PushingRobot>(transport, port);
      robot->angle.publish(7777.75);
      changes.wait_value("7777.75");
      const auto all = changes.all();
      std::size_t gaps = 0, last_gap = 0;
      for (std::size_t i = 0; i < all.size(); ++i)
        if (all[i].kind == Kind::gap) ++gaps, last_gap = i;
      CHECK(gaps >= 1);
      CHECK(gaps == watch.counts().gaps);
      CHECK(all[last_gap].reason);
      CHECK(last_gap + 1 < all.size());
      CHECK(all.front().kind == Kind::value);
    }
  }
}

TEST_CASE("a subscription that is deleted at the server ends its watch, and no other", "[client][R0.16]") {
  const test::Watchdog watchdog("watch");
  for (const std::string_view transport : transport::names()) {
    PushingRobot robot(transport);
    robot.angle.publish(1111.25);
    Watches watches(http_client(background()));
    Changes first, second;
    const Watch a = watches.watch(robot.url(), by(Via::websocket), first.callback()).value();
    const Watch b = watches.watch(robot.url(), by(Via::websocket), second.callback()).value();
    first.wait(1), second.wait(1);
    CHECK(a.subscription() != b.subscription());
    CHECK(http_client(client::Options())->send({"DELETE", a.subscription(), {}, {}}).value().status == 204);
    const Change end = first.wait_end();
    CHECK(end.reason->code == Errc::closed);
    CHECK_FALSE(a.is_connected());
    robot.angle.publish(2222.5);
    second.wait_value("2222.5");
    CHECK(b.is_connected());
  }
}

TEST_CASE("stop() ends the subscription at the server", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1);
  Watches watches(http_client(background()));
  for (const Via via : {Via::websocket, Via::event_stream}) {
    Changes changes;
    Watch watch = watches.watch(robot.url(), by(via), changes.callback()).value();
    changes.wait(1);
    const std::string subscription = watch.subscription();
    watch.stop();
    CHECK_FALSE(watch.is_connected());
    const auto http = http_client(client::Options());
    while (http->send({"GET", subscription, {}, {}}).value().status != 404) std::this_thread::yield();
  }
}

TEST_CASE("a refusal ends a watch with the reason of the server", "[client][R0.6]") {
  const test::Watchdog watchdog("watch");
  for (const std::string_view transport : transport::names()) {
    PushingRobot robot(transport);
    robot.angle.publish(1);
    Watches watches(http_client(background()));
    for (const Via via : {Via::any, Via::websocket, Via::event_stream, Via::polling}) {
      INFO(transport << " " << static_cast<int>(via));
      Changes missing;
      const Watch watch = watches.watch(robot.url() + "/none", by(via), missing.callback()).value();
      const Change end = missing.wait_end();
      CHECK(end.reason->code == Errc::refused);
      CHECK(end.reason->message.find("404") != std::string::npos);
      CHECK(watch.last_error()->message == end.reason->message);
      CHECK(missing.all().size() == 1);
    }
    Changes unwanted;
    WatchOptions image = by(Via::websocket);
    image.accept = "image/png";
    const Watch watch = watches.watch(robot.url(), image, unwanted.callback()).value();
    CHECK(unwanted.wait_end().reason->message.find("406") != std::string::npos);
  }
}

TEST_CASE("invalid URLs and options are errors at once", "[client]") {
  Watches watches(http_client(background()));
  const auto code = [&](const std::string& url, const WatchOptions& options) {
    return watches.watch(url, options, [](const Change&) {}).error().code;
  };
  for (const char* const url : {"", "arm", "ftp://robot.example/", "http://", "http://user@robot.example/"})
    CHECK(code(url, {}) == Errc::expected_iri);
  WatchOptions none;
  none.idle_time = milliseconds(0);
  CHECK(code("http://robot.example/", none) == Errc::invalid_option);
  CHECK(code("http://robot.example/", by(Via::callback)) == Errc::invalid_option);
  watches.stop();
  CHECK(code("http://robot.example/", {}) == Errc::closed);
}

TEST_CASE("a callback can stop its own watch, another one, and destroy both", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1);
  for (const auto where : {client::Callbacks::in_background, client::Callbacks::in_poll}) {
    client::Options options;
    options.callbacks = where;
    Watches watches(http_client(options));
    Changes others;
    auto other = std::make_unique<Watch>(watches.watch(robot.url(), by(Via::websocket), others.callback()).value());
    std::unique_ptr<Watch> own;
    std::mutex mutex;
    std::atomic<int> calls{0};
    const auto owned = std::make_shared<int>(1);
    {
      const std::lock_guard lock(mutex);
      own = std::make_unique<Watch>(watches
                                        .watch(robot.url(), by(Via::websocket),
                                               [&, owned](const Change&) {
                                                 const std::lock_guard guard(mutex);
                                                 ++calls;
                                                 other->stop();
                                                 other.reset();
                                                 own->stop();
                                                 own.reset();
                                               })
                                        .value());
    }
    while (calls == 0 || owned.use_count() > 1) {  // the callback is destroyed, too
      watches.poll(milliseconds(1));
      std::this_thread::yield();
    }
    robot.angle.publish(2);
    CHECK(calls == 1);
  }
}

TEST_CASE("a callback that throws is called again, and the log says so", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1);
  client::Options options = background();
  std::atomic<int> lines{0};
  options.log = [&](LogLevel, std::string_view text) { lines += text.find("a wrench") != std::string_view::npos; };
  Watches watches(http_client(options));
  Changes changes;
  const Watch watch = watches
                          .watch(robot.url(), by(Via::websocket),
                                 [&](const Change& change) {
                                   changes.callback()(change);
                                   throw std::runtime_error("a wrench");
                                 })
                          .value();
  changes.wait(1);
  robot.angle.publish(2222.5);
  changes.wait_value("2222.5");
  watches.stop();
  CHECK(lines >= 2);
}

TEST_CASE("stop() waits for a callback that runs, and no other follows", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  std::atomic<bool> stop{false};
  std::thread publisher([&] {
    for (double i = 0; !stop; ++i) robot.angle.publish(i), std::this_thread::yield();
  });
  Watches watches(http_client(background()));
  for (const Via via : {Via::websocket, Via::event_stream, Via::websocket, Via::event_stream}) {
    std::atomic<bool> is_inside{false}, is_stopping{false}, was_called_late{false}, has_stopped{false};
    Watch watch = watches
                      .watch(robot.url(), by(via),
                             [&](const Change&) {
                               if (has_stopped) was_called_late = true;
                               is_inside = true;
                               while (!is_stopping) std::this_thread::yield();
                               std::this_thread::sleep_for(milliseconds(2));  // beside stop(), which must wait
                               is_inside = false;
                             })
                      .value();
    while (!is_inside) std::this_thread::yield();
    is_stopping = true;
    watch.stop();
    has_stopped = true;
    CHECK_FALSE(is_inside);
    for (int i = 0; i < 100; ++i) std::this_thread::yield();
    CHECK_FALSE(was_called_late);
  }
  stop = true;
  publisher.join();
}

TEST_CASE("changes wait for poll(), the oldest values are dropped and counted", "[client]") {
  const test::Watchdog watchdog("watch");
  test::Receiver server([&](Peer& peer) {
    std::string bytes = opening_response(peer.read_request());
    for (int i = 0; i < 10; ++i) bytes += frame("value " + std::to_string(i));
    peer.send(bytes);
    peer.hang();
  });
  client::Options options;
  options.limits.max_waiting_changes = 3;
  std::atomic<int> wakes{0};
  Watches::Hooks hooks;
  hooks.wake = [&] { ++wakes; };
  Watches watches(http_client(options), hooks);
  std::vector<Change> changes;
  const Watch watch = watches.watch(server.url(), by(Via::websocket), [&](const Change& change) { changes.push_back(change); }).value();
  while (watch.counts().values < 10) std::this_thread::yield();
  CHECK(wakes >= 1);
  CHECK(changes.empty());
  while (watches.poll(milliseconds(1))) {}
  REQUIRE(changes.size() == 3);
  CHECK(*changes[0].body == "value 7");
  CHECK(changes[0].dropped == 7);
  CHECK(changes[2].dropped == 0);
  CHECK(watch.counts().dropped == 7);
}

TEST_CASE("poll() calls one callback if its budget is over", "[client]") {
  const test::Watchdog watchdog("watch");
  test::Receiver server([](Peer& peer) {
    peer.send(opening_response(peer.read_request()) + frame("a") + frame("b"));
    peer.hang();
  });
  Watches watches(http_client(client::Options()));
  int calls = 0;
  const Watch watch = watches.watch(server.url(), by(Via::websocket), [&](const Change&) { ++calls; }).value();
  while (watch.counts().values < 2) std::this_thread::yield();
  while (calls == 0) watches.poll(std::chrono::microseconds(0));  // the callback is announced after it is counted
  CHECK(calls == 1);
  while (calls < 2) watches.poll(std::chrono::microseconds(0));
  CHECK_FALSE(watches.poll(std::chrono::microseconds(0)));
}

TEST_CASE("values can be delivered on the thread that receives them", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1111.25);
  Watches watches(http_client(client::Options()));
  Changes changes;
  const Watch watch = watches.watch(robot.url(), by(Via::websocket), changes.callback(), Watches::Delivery::at_once).value();
  changes.wait_value("1111.25");
}

TEST_CASE("watches end with open connections, and their handles have no effect", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1);
  test::Receiver silent([](Peer& peer) { peer.hang(); });
  std::vector<Watch> handles;
  Changes changes;
  {
    Watches watches(http_client(background()));
    for (int i = 0; i < 40; ++i)
      handles.push_back(watches
                            .watch(i % 4 == 3 ? silent.url() : robot.url(),
                                   by(std::vector<Via>{Via::websocket, Via::event_stream, Via::polling, Via::any}[static_cast<std::size_t>(i % 4)]),
                                   changes.callback())
                            .value());
    changes.wait(30);
  }
  for (Watch& handle : handles) {
    CHECK_FALSE(handle.is_connected());
    handle.stop();
  }
}

TEST_CASE("a callback in the background can destroy the watches", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1);
  auto watches = std::make_unique<Watches>(http_client(background()));
  std::atomic<bool> destroyed{false}, made{false};
  Watch watch = watches
                    ->watch(robot.url(), by(Via::websocket),
                            [&](const Change&) {
                              while (!made) std::this_thread::yield();
                              watches.reset();
                              destroyed = true;
                            })
                    .value();
  made = true;
  while (!destroyed) std::this_thread::yield();
}

// ------------------------------------------------------------------------------------------------ servers of a test

/// The times, by a clock that a test moves, at which a server was connected.
struct Attempts {
  explicit Attempts(std::string text)
      : server([this, text](Peer& peer) {
          peer.read_request();
          const auto now = clock.now().steady;
          const std::lock_guard lock(mutex);
          peer.send(text);
          times.push_back(now);
        }) {}
  std::size_t count() const {
    const std::lock_guard lock(mutex);
    return times.size();
  }
  /// Moves the clock in steps until the server was connected so many times.
  void run(Watches& watches, std::size_t until) {
    while (count() < until) {
      clock.advance(milliseconds(5));
      watches.check_clock();
      std::this_thread::sleep_for(milliseconds(1));
    }
  }
  milliseconds pause(std::size_t i) const { return std::chrono::duration_cast<milliseconds>(times[i + 1] - times[i]); }

  test::FakeClock clock;
  mutable std::mutex mutex;
  std::vector<std::chrono::steady_clock::time_point> times;
  test::Receiver server;  // last: its threads end first
};

TEST_CASE("pauses double up to their maximum, and are random", "[client]") {
  const test::Watchdog watchdog("watch");
  for (const double chance : {0.0, 0.999}) {
    Attempts attempts(test::answer(500));
    Watches::Hooks hooks;
    hooks.clock = &attempts.clock;
    hooks.random = [chance] { return chance; };
    Watches watches(http_client(background()), hooks);
    WatchOptions options = by(Via::websocket);
    options.first_pause = milliseconds(200);
    options.max_pause = milliseconds(800);
    const Watch watch = watches.watch(attempts.server.url(), options, [](const Change&) {}).value();
    attempts.run(watches, 6);
    const std::lock_guard lock(attempts.mutex);
    const int whole[] = {200, 400, 800, 800, 800};
    for (std::size_t i = 0; i < 5; ++i) CHECK(attempts.pause(i).count() >= static_cast<int>(whole[i] * (0.5 + chance)) - 1);
  }
}

TEST_CASE("Retry-After is waited for, by every protocol", "[client]") {
  const test::Watchdog watchdog("watch");
  for (const Via via : {Via::websocket, Via::event_stream, Via::polling}) {
    Attempts attempts(test::answer(503, "", "Retry-After: 2\r\n"));
    Watches::Hooks hooks;
    hooks.clock = &attempts.clock;
    Watches watches(http_client(background()), hooks);
    WatchOptions options = by(via);
    options.max_pause = std::chrono::seconds(10);
    const Watch watch = watches.watch(attempts.server.url(), options, [](const Change&) {}).value();
    attempts.run(watches, 2);
    const std::lock_guard lock(attempts.mutex);
    CHECK(attempts.pause(0) >= milliseconds(2000));
  }
}

TEST_CASE("any: what a server does not have is left out", "[client][R1.6]") {
  const test::Watchdog watchdog("watch");
  std::atomic<int> polls{0};
  test::Receiver only_polling([&](Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
      if (!wants_websocket(request) && field_of(request, "Accept") != "text/event-stream") ++polls;
      peer.send(test::answer(200, polls < 5 ? "<> <http://e/p> 1 ." : "<> <http://e/p> 2 .", "Content-Type: text/turtle\r\n"));
    }
  });
  Watches watches(http_client(background()));
  Changes changes;
  const Watch watch = watches.watch(only_polling.url(), by(Via::any), changes.callback()).value();
  const auto all = changes.wait(2);  // no entity tags: the same bytes are no change
  CHECK(watch.via() == Via::polling);
  CHECK(*all[0].body == "<> <http://e/p> 1 .");
  CHECK(*all[1].body == "<> <http://e/p> 2 .");
  CHECK(all[1].graph().value().size() == 1);

  test::Receiver only_streams([](Peer& peer) {
    const std::string request = peer.read_request();
    if (field_of(request, "Accept") != "text/event-stream") return void(peer.send(test::answer(426)));
    peer.send(stream_header() + ": hello\n\nid: 7\ndata: {\ndata: }\n\nevent: other\ndata: no\n\n");
    peer.hang();
  });
  Changes events;
  const Watch stream = watches.watch(only_streams.url(), by(Via::any), events.callback()).value();
  const Change event = events.wait(1)[0];
  CHECK(stream.via() == Via::event_stream);
  CHECK(*event.body == "{\n}");
  CHECK(event.entity_tag == "7");
  CHECK(event.media_type == "application/ld+json");
}

TEST_CASE("hybrit:websocketUrl is followed where the resource itself has no WebSocket", "[client][R1.6]") {
  const test::Watchdog watchdog("watch");
  test::Receiver websockets([](Peer& peer) {
    const std::string request = peer.read_request();
    peer.send(opening_response(request) + frame("# " + request.substr(0, request.find("\r\n"))));
    peer.hang();
  });
  test::Receiver resource([&](Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request())
      peer.send(test::answer(
          200, "<> <https://hybr-it-projekt.de/ns/hybr-it#websocketUrl> \"ws://127.0.0.1:" + std::to_string(websockets.port()) + "/ws?id=1\" .",
          "Content-Type: text/turtle\r\n"));
  });
  Watches watches(http_client(background()));
  WatchOptions options = by(Via::any);
  options.queue_length = 2;
  Changes found, given;
  const Watch a = watches.watch(resource.url(), options, found.callback()).value();
  CHECK(*found.wait(1)[0].body == "# GET /ws?id=1&queueLength=2 HTTP/1.1");
  options.websocket_url = "ws://127.0.0.1:" + std::to_string(websockets.port()) + "/given";
  const Watch b = watches.watch(resource.url(), options, given.callback()).value();
  CHECK(*given.wait(1)[0].body == "# GET /given?queueLength=2 HTTP/1.1");
}

TEST_CASE("a WebSocket of another protocol is left for what the server has besides", "[client][R1.6]") {
  const test::Watchdog watchdog("watch");
  SECTION("it sends messages that are no representations") {
    std::promise<void> closed;
    test::Receiver server([&](Peer& peer) {  // as the Community Solid Server on each URL
      for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
        if (request.find("Upgrade: websocket") != std::string::npos) {
          peer.send(opening_response(request) + frame("warning Missing Sec-WebSocket-Protocol header, expected value solid-0.1") +
                    frame("protocol solid-0.1"));
          peer.hang();
          return closed.set_value();
        }
        if (field_of(request, "Accept") == "text/event-stream") peer.send(test::answer(406));
        else
          peer.send(test::answer(200, "<> <http://www.w3.org/1999/02/22-rdf-syntax-ns#value> 5 .", "Content-Type: text/turtle\r\nETag: \"1\"\r\n"));
      }
    });
    Watches watches(http_client(background()));
    Changes changes;
    WatchOptions options = by(Via::any);
    options.idle_time = std::chrono::minutes(10);  // longer than the watchdog: only the watch ends the WebSocket
    const Watch watch = watches.watch(server.url(), options, changes.callback()).value();
    CHECK(changes.wait(1)[0].kind == Kind::value);
    CHECK(changes.all()[0].body->find("value> 5") != std::string::npos);
    CHECK(watch.via() == Via::polling);
    closed.get_future().wait();  // the WebSocket does not stay open beside
  }
  SECTION("it opens and closes each without a message") {
    std::atomic<int> opened{0};
    test::Receiver server([&](Peer& peer) {
      for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
        if (request.find("Upgrade: websocket") != std::string::npos) {
          ++opened;
          peer.send(opening_response(request) + frame(test::close_payload(1011), Frame::close));
          return peer.hang();
        }
        peer.send(stream_header() + "data: <> <http://example.org/a> 1 .\n\n");
        return peer.hang();
      }
    });
    Watches watches(http_client(background()));
    Changes changes;
    const Watch watch = watches.watch(server.url(), by(Via::any), changes.callback()).value();
    CHECK(changes.wait(1)[0].kind == Kind::value);
    CHECK(watch.via() == Via::event_stream);
    CHECK(opened == 3);
  }
}

TEST_CASE("a server without the first media type is asked for the next", "[client][R1.6]") {
  const test::Watchdog watchdog("watch");
  for (const Via via : {Via::websocket, Via::event_stream}) {
    test::Receiver server([&](Peer& peer) {
      const std::string request = peer.read_request();
      const bool has_it = request.find("application%2Fn-triples") != std::string::npos || field_of(request, "Accept") == "application/n-triples";
      if (!has_it) return void(peer.send(test::answer(406)));
      peer.send(via == Via::websocket ? opening_response(request) + frame("x") : stream_header() + "data: x\n\n");
      peer.hang();
    });
    Watches watches(http_client(background()));
    Changes changes;
    const Watch watch = watches.watch(server.url(), by(via), changes.callback()).value();
    CHECK(changes.wait(1)[0].media_type == "application/n-triples");
  }
}

TEST_CASE("codes of a close: some end a watch, after others it connects again", "[client][R0.14]") {
  const test::Watchdog watchdog("watch");
  for (const unsigned code : {1000U, 1008U, 1001U, 1011U, 1012U, 4000U}) {
    test::Receiver server([&](Peer& peer) {
      peer.send(opening_response(peer.read_request()) + frame("value") + frame(test::close_payload(code, "why"), Frame::close));
      peer.hang();
    });
    Watches watches(http_client(background()));
    Changes changes;
    const Watch watch = watches.watch(server.url(), by(Via::websocket), changes.callback()).value();
    if (code == 1000 || code == 1008) {
      const Change end = changes.wait_end();
      CHECK(end.reason->message.find("why") != std::string::npos);
      CHECK(changes.all().size() == 2);
      CHECK(server.connections() == 1);
    } else {
      const auto all = changes.wait(3);
      CHECK(all[1].kind == Kind::gap);
      CHECK(all[2].kind == Kind::value);
    }
  }
}

TEST_CASE("an event stream that ends is a gap, one with 204 has ended", "[client]") {
  const test::Watchdog watchdog("watch");
  std::atomic<int> count{0};
  test::Receiver server([&](Peer& peer) {
    peer.read_request();
    if (++count == 3) peer.send("HTTP/1.1 204 No Content\r\n\r\n");
    else peer.send(stream_header() + "retry: 5\ndata: x\n\n");
  });
  Watches watches(http_client(background()));
  Changes changes;
  const Watch watch = watches.watch(server.url(), by(Via::event_stream), changes.callback()).value();
  changes.wait_end();
  const auto all = changes.all();
  REQUIRE(all.size() == 4);
  CHECK(all[1].kind == Kind::gap);
  CHECK(all[1].reason->message.find("ended the event stream") != std::string::npos);
}

TEST_CASE("a stream without a byte for idle_time is lost", "[client]") {
  const test::Watchdog watchdog("watch");
  test::Receiver server([](Peer& peer) {
    peer.read_request();
    peer.send(stream_header() + "data: x\n\n");
    peer.hang();
  });
  Watches watches(http_client(background()));
  WatchOptions options = by(Via::event_stream);
  options.idle_time = milliseconds(50);
  Changes changes;
  const Watch watch = watches.watch(server.url(), options, changes.callback()).value();
  CHECK(changes.wait(3)[1].reason->code == Errc::timed_out);
}

TEST_CASE("what is longer than the limit ends a watch", "[client]") {
  const test::Watchdog watchdog("watch");
  client::Options options = background();
  options.limits.max_message_bytes = 1000;
  options.limits.max_body_bytes = 1000;
  const std::string longer(5000, 'x');
  for (const Via via : {Via::websocket, Via::event_stream}) {
    test::Receiver server([&](Peer& peer) {
      const std::string request = peer.read_request();
      peer.send(via == Via::websocket ? opening_response(request) + frame(longer) : stream_header() + "data: " + longer + "\n\n");
      peer.hang();
    });
    Watches watches(http_client(options));
    Changes changes;
    const Watch watch = watches.watch(server.url(), by(via), changes.callback()).value();
    CHECK(changes.wait_end().reason->code == Errc::limit_exceeded);
  }
}

TEST_CASE("streams above their limit are refused, or polled", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1);
  client::Options options = background();
  options.limits.max_streams = 1;
  Watches watches(http_client(options));
  Changes first, second;
  const Watch a = watches.watch(robot.url(), by(Via::event_stream), first.callback()).value();
  first.wait(1);
  const Watch b = watches.watch(robot.url(), by(Via::event_stream), second.callback()).value();
  CHECK(second.wait_end().reason->code == Errc::limit_exceeded);
}

TEST_CASE("a resource that is gone after a connection is tried for a time", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1111.25);
  Watches watches(http_client(background()));
  Changes changes;
  WatchOptions options = by(Via::websocket);
  options.max_pause = milliseconds(300);
  const Watch watch = watches.watch(robot.url(), options, changes.callback()).value();
  changes.wait(1);
  robot.server->remove("arm").value();
  CHECK(changes.wait_end().reason->message.find("404") != std::string::npos);
}

TEST_CASE("the identity goes to trusted origins only", "[client]") {
  const test::Watchdog watchdog("watch");
  std::mutex mutex;
  std::vector<std::string> tokens;
  const auto serve = [&](Peer& peer) {
    const std::string request = peer.read_request();
    {
      const std::lock_guard lock(mutex);
      tokens.push_back(field_of(request, "Authorization"));
    }
    peer.send(wants_websocket(request) ? opening_response(request) + frame("x") : stream_header() + "data: x\n\n");
    peer.hang();
  };
  test::Receiver trusted(serve), stranger(serve);
  client::Options options = background();
  options.identity.token = "secret";
  options.identity.trusted_origins = {"http://127.0.0.1:" + std::to_string(trusted.port())};
  Watches watches(http_client(options));
  for (const Via via : {Via::websocket, Via::event_stream}) {
    for (const test::Receiver* const server : {&trusted, &stranger}) {
      Changes changes;
      const Watch watch = watches.watch(server->url(), by(via), changes.callback()).value();
      changes.wait(1);
      const std::lock_guard lock(mutex);
      CHECK(tokens.back() == (server == &trusted ? "Bearer secret" : ""));
    }
  }
}

TEST_CASE("neither a redirect nor hybrit:websocketUrl takes the identity to another origin, trusted or not", "[client]") {
  const test::Watchdog watchdog("watch");
  std::mutex mutex;
  std::vector<std::string> tokens;
  test::Receiver other([&](Peer& peer) {
    const std::string request = peer.read_request();
    {
      const std::lock_guard lock(mutex);
      tokens.push_back(field_of(request, "Authorization"));
    }
    peer.send(wants_websocket(request) ? opening_response(request) + frame("x") : stream_header() + "data: x\n\n");
    peer.hang();
  });
  const std::string port = std::to_string(other.port());
  test::Receiver first([&](Peer& peer) {
    for (std::string request = peer.read_request(); !request.empty(); request = peer.read_request()) {
      if (field_of(request, "Accept") == "text/event-stream") peer.send(test::answer(307, "", "Location: " + other.url() + "\r\n"));
      else
        peer.send(test::answer(200, "<> <https://hybr-it-projekt.de/ns/hybr-it#websocketUrl> \"ws://127.0.0.1:" + port + "/\" .",
                               "Content-Type: text/turtle\r\n"));
    }
  });
  client::Options options = background();
  options.identity.token = "secret";
  options.identity.trusted_origins = {"http://127.0.0.1:" + std::to_string(first.port()), "http://127.0.0.1:" + port};
  Watches watches(http_client(options));
  for (const Via via : {Via::websocket, Via::event_stream}) {
    Changes changes;
    const Watch watch = watches.watch(first.url(), by(via), changes.callback()).value();
    changes.wait(1);
  }
  const std::lock_guard lock(mutex);
  CHECK(tokens == std::vector<std::string>{"", ""});
}

TEST_CASE("names are resolved without delaying other watches", "[client]") {
  const test::Watchdog watchdog("watch");
  PushingRobot robot;
  robot.angle.publish(1111.25);
  client::Options options = background();
  options.limits.resolve_time = std::chrono::seconds(30);
  std::mutex mutex;
  std::condition_variable changed;
  bool may_end = false;
  Watches::Hooks hooks;
  hooks.resolve = [&](const std::string& name) -> Result<std::vector<Address>> {
    if (name == "robot.example") return std::vector<Address>{numeric_address("127.0.0.1").value()};
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return may_end; });
    return unexpected(Errc::io_error, "no such name");
  };
  {
    Watches watches(http_client(options), hooks);
    Changes hanging, named, numeric;
    const Watch a = watches.watch("http://hangs.example/arm", by(Via::websocket), hanging.callback()).value();
    std::string url = robot.url();
    const Watch b = watches.watch(url, by(Via::websocket), numeric.callback()).value();
    numeric.wait_value("1111.25");
    test::Receiver server([](Peer& peer) {
      const std::string request = peer.read_request();
      peer.send(opening_response(request) + frame(field_of(request, "Host")));
      peer.hang();
    });
    const Watch c = watches.watch(server.url("robot.example"), by(Via::websocket), named.callback()).value();
    CHECK(*named.wait(1)[0].body == "robot.example:" + std::to_string(server.port()));
    {
      const std::lock_guard lock(mutex);
      may_end = true;
    }
    changed.notify_all();
    while (!a.last_error()) std::this_thread::yield();
  }
}

}  // namespace
}  // namespace lrt
