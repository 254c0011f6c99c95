// SPDX-License-Identifier: Apache-2.0
// Times, numbers and losses, from publish() to a watch.
#include "src/client/stamp.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <lrt/client/callback_receiver.hpp>
#include <lrt/client/latest.hpp>
#include <lrt/transport/named.hpp>

#include "tests/client/watch_support.hpp"
#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"
#include "tests/support/websocket.hpp"

namespace lrt {
namespace {

using client::Change;
using client::Stamp;
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
using Utc = std::chrono::system_clock::time_point;

const Utc begin_time = Utc(std::chrono::seconds(1'800'000'000)) + std::chrono::microseconds(250);

/// Published values that name their own time.
void publish(PushingRobot& robot, int i) { robot.angle.publish(i, begin_time + milliseconds(i)); }

/// Takes the first value, and no further one before it is opened.
class StalledReader {
 public:
  client::OnChange callback() {
    return [this](const Change& change) {
      std::unique_lock lock(mutex_);
      changes.push_back(change);
      changed_.notify_all();
      changed_.wait(lock, [this] { return open_; });
    };
  }
  void wait_for_first() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !changes.empty(); });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  void wait_for_value(const std::string& body) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !changes.empty() && changes.back().kind == Kind::value && *changes.back().body == body; });
  }
  std::vector<Change> changes;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
};

std::string stream_header(const std::string& fields) { return "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n" + fields + "\r\n"; }

}  // namespace

TEST_CASE("of 1,000 values for a reader that stalls, received and left out are all, and each has its time", "[client][R0.12][R0.14][R0.16]") {
  const test::Watchdog watchdog("stamp");
  constexpr int count = 1000;
  for (const std::string_view transport : transport::names()) {
    for (const Via via : {Via::websocket, Via::event_stream, Via::callback}) {
      for (const std::size_t queue_length : {std::size_t{0}, std::size_t{8}, std::size_t{2000}}) {
        INFO(transport << " " << static_cast<int>(via) << " " << queue_length);
        lrt::Options options;
        options.callbacks.allow = {"127.0.0.1"};
        options.subscriptions.max_queue_length = 2000;
        PushingRobot robot(transport, 0, std::move(options));
        publish(robot, 0);
        WatchOptions wanted = by(via);
        wanted.accept = "application/json";
        wanted.queue_length = queue_length;
        if (via == Via::callback) wanted.receiver = client::CallbackReceiver::create().value();
        StalledReader reader;
        Watches watches(http_client(background()));
        const Watch watch = watches.watch(robot.url(), wanted, reader.callback(), Watches::Delivery::at_once).value();
        reader.wait_for_first();
        for (int i = 1; i <= count; ++i) publish(robot, i);
        reader.open();
        reader.wait_for_value(std::to_string(count));
        std::uint64_t received = 0, in_values = 0, in_gaps = 0, sequence = 0;
        bool is_exact = true, is_in_order = true;
        for (const Change& change : reader.changes) {
          if (change.kind == Kind::gap) {
            is_exact = is_exact && change.left_out && !change.reason;
            in_gaps += change.left_out.value_or(0);
            continue;
          }
          ++received;
          in_values += change.left_out.value_or(0);
          is_exact = is_exact && change.at == begin_time + milliseconds(std::stoi(*change.body)) && change.left_out;
          is_in_order = is_in_order && (sequence == 0 || change.sequence > sequence);
          sequence = change.sequence.value_or(0);
        }
        CHECK(is_exact);
        CHECK(is_in_order);
        CHECK(received - 1 + in_values + in_gaps == count);
        CHECK((queue_length == 0 ? in_gaps : in_values) == 0);
        CHECK(watch.counts().values - 1 + watch.counts().left_out == count);
        CHECK(watch.counts().dropped == 0);
        const auto got = http_client(client::Options())->send({"GET", robot.url(), {{"Accept", "application/json"}}, {}}).value();
        CHECK(*reader.changes.back().body == got.body);
      }
    }
  }
}

TEST_CASE("a gap after a lost connection has the number of missing values, unless the server has begun again", "[client]") {
  const test::Watchdog watchdog("stamp");
  std::atomic<int> connections{0};
  test::Receiver server([&](Peer& peer) {
    peer.read_request();
    const int n = ++connections;
    const std::string series = n == 3 ? "Value-Series: other\r\n" : n == 4 ? "" : "Value-Series: one\r\n";
    const std::string sequence = n == 1 ? "5" : n == 2 ? "9" : n == 3 ? "20" : "21";
    peer.send(stream_header(series) + "retry: 5\ntime: 2027-01-15T08:00:00.5Z\nsequence: " + sequence + "\nleft-out: 1\ndata: x\n\n");
    if (n == 4) peer.hang();
  });
  Watches watches(http_client(background()));
  Changes changes;
  const Watch watch = watches.watch(server.url(), by(Via::event_stream), changes.callback()).value();
  const auto all = changes.wait(7);
  CHECK(all[0].left_out == 1);
  CHECK(all[0].sequence == 5);
  CHECK(all[0].at == Utc(std::chrono::seconds(1'800'000'000)) + milliseconds(500));
  REQUIRE(all[1].kind == Kind::gap);
  CHECK(all[1].left_out == 3);
  CHECK(all[1].reason);
  CHECK(all[2].left_out == 0);
  REQUIRE(all[3].kind == Kind::gap);
  CHECK_FALSE(all[3].left_out);
  REQUIRE(all[5].kind == Kind::gap);
  CHECK_FALSE(all[5].left_out);
  CHECK(watch.counts().gaps == 3);
  CHECK(watch.counts().left_out == 6);
}

TEST_CASE("a robot that begins again has another series", "[client]") {
  const test::Watchdog watchdog("stamp");
  auto robot = std::make_unique<PushingRobot>();
  const std::uint16_t port = robot->server->port();
  for (int i = 1; i <= 3; ++i) publish(*robot, 1111 * i);
  Watches watches(http_client(background()));
  Changes changes;
  const Watch watch = watches.watch(robot->url(), by(Via::websocket), changes.callback()).value();
  changes.wait_value("3333");
  robot = nullptr;
  while (watch.is_connected()) std::this_thread::yield();
  robot = std::make_unique<PushingRobot>("", port);
  for (int i = 1; i <= 9; ++i) publish(*robot, 1111 * i);
  changes.wait_value("9999");
  std::vector<std::string> series;
  for (const Change& change : changes.all()) {
    if (change.kind == Kind::gap) CHECK_FALSE(change.left_out);
    else if (series.empty() || series.back() != change.series) series.push_back(change.series);
  }
  CHECK(series.size() == 2);
  CHECK_FALSE(series.front().empty());
}

TEST_CASE("servers without stamps, with odd ones, and those that refuse subprotocols are watched as before", "[client][R0.14]") {
  const test::Watchdog watchdog("stamp");
  const auto frame = [](std::string payload) {
    Frame made;
    made.opcode = Frame::text;
    made.payload = std::move(payload);
    made.masked = false;
    return made.bytes();
  };
  const auto opening = [](const std::string& request, const std::string& more) {
    return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " +
           test::accept_of(field_of(request, "Sec-WebSocket-Key")) + "\r\n" + more + "\r\n";
  };
  // It ignores the offer, and its values look like stamps.
  test::Receiver plain([&](Peer& peer) {
    const std::string request = peer.read_request();
    CHECK(field_of(request, "Sec-WebSocket-Protocol") == "lrt.stamped");
    peer.send(opening(request, "") + frame(R"({"sequence":1})") + frame("two"));
    peer.hang();
  });
  // It refuses each offer.
  test::Receiver refusing([&](Peer& peer) {
    const std::string request = peer.read_request();
    if (!field_of(request, "Sec-WebSocket-Protocol").empty()) return void(peer.send(test::answer(400)));
    peer.send(opening(request, "") + frame("one") + frame("two"));
    peer.hang();
  });
  // It has further messages, and stamps with other members.
  test::Receiver later([&](Peer& peer) {
    const std::string request = peer.read_request();
    peer.send(opening(request, "Sec-WebSocket-Protocol: lrt.stamped\r\n") + frame(R"({"heartbeat":true})") +
              frame(R"({"sequence":7,"leftOut":"many","time":4,"more":[{}]})") + frame(R"({"sequence":1})") + frame("{}") +
              frame(R"({"series":"s","sequence":9,"leftOut":1})") + frame("two"));
    peer.hang();
  });
  Watches watches(http_client(background()));
  for (test::Receiver* server : {&plain, &refusing, &later}) {
    Changes changes;
    const Watch watch = watches.watch(server->url(), by(Via::websocket), changes.callback()).value();
    const auto all = changes.wait(2);
    CHECK(all[0].kind == Kind::value);
    CHECK(*all[0].body == (server == &refusing ? "one" : R"({"sequence":1})"));
    CHECK(*all[1].body == "two");
    CHECK((all[0].sequence == 7) == (server == &later));
    CHECK_FALSE(all[0].left_out);
    CHECK_FALSE(all[0].at);
    CHECK((all[1].left_out == 1) == (server == &later));
    CHECK(watch.via() == Via::websocket);
  }
}

TEST_CASE("what a server sends as a stamp is read within limits", "[client]") {
  CHECK_FALSE(client::read_stamp(""));
  CHECK_FALSE(client::read_stamp("{}"));
  CHECK_FALSE(client::read_stamp("[1]"));
  CHECK_FALSE(client::read_stamp(R"({"sequence":"1"})"));
  CHECK_FALSE(client::read_stamp(R"({"sequence":1,"x":")" + std::string(5000, 'x') + "\"}"));
  const auto large = client::read_stamp(R"({"sequence":18446744073709551615,"leftOut":-1,"time":"yesterday"})");
  REQUIRE(large);
  CHECK_FALSE(large->sequence);
  CHECK_FALSE(large->left_out);
  CHECK_FALSE(large->at);
  Stamp stamp;
  stamp.set_series(std::string(1000, 'x'));
  CHECK(stamp.series.empty());
}

TEST_CASE("a loop sees the time of the value that it took", "[client]") {
  const test::Watchdog watchdog("stamp");
  PushingRobot robot;
  publish(robot, 7);
  Watches watches(http_client(client::Options()));
  auto latest = client::Latest<int>::follow(
                    [&](client::OnChange on_change) {
                      WatchOptions options = by(Via::websocket);
                      options.accept = "application/json";
                      return watches.watch(robot.url(), options, std::move(on_change), Watches::Delivery::at_once);
                    },
                    [](const Change& change) -> Result<int> { return std::stoi(*change.body); })
                    .value();
  CHECK_FALSE(latest.source_time());
  int value = 0;
  while (!latest.take(value)) std::this_thread::yield();
  CHECK(value == 7);
  CHECK(latest.source_time() == begin_time + milliseconds(7));
}

}  // namespace lrt
