// SPDX-License-Identifier: Apache-2.0
// Commands through a link that freezes and thaws: none is carried out after its time, and each sender is told that it is not confirmed. How long a
// freeze lasts is a matter of the server's clock, which the test moves.

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/lrt.hpp>

#include "src/http/robot_time.hpp"
#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/frozen_link.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

void wait_until(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!holds() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(milliseconds(1));
  REQUIRE(holds());
}

/// A base with a clock of its own, behind a link.
struct Robot {
  explicit Robot(std::string_view transport) : host(one_thing(base()), transport, options()), link(host.server().port()) {}

  Thing base() {
    Thing thing{"base"};
    thing.property("speed", [this] { return speed.load(); }).on_write([this](double v) { speed = v, ++writes; });
    thing.action("drive", [this](double v) { speed = v, ++drives; });
    thing.action("stop", [this] { ++stops; }).stop();
    return thing;
  }
  Options options() {
    Options made;
    made.clock = &clock;
    auto& limits = made.limits;
    limits.header_timeout = limits.idle_timeout = limits.body_timeout = limits.write_timeout = std::chrono::hours(10);
    return made;
  }
  std::uint64_t late() { return host.server().counters().refusals[static_cast<std::size_t>(http::Denial::late)]; }

  FakeClock clock;
  std::atomic<double> speed{0};
  std::atomic<int> writes{0}, drives{0}, stops{0};
  RobotHost host;
  FrozenLink link;
};

std::string valid_for(const std::string& robot_time, int ms) {
  const std::size_t slash = robot_time.find('/');
  return "Valid-Until: " + robot_time.substr(0, slash + 1) + std::to_string(std::stoull(robot_time.substr(slash + 1)) + static_cast<unsigned>(ms)) +
         "\n";
}

client::Options with_life(milliseconds life) {
  client::Options options;
  options.command_life = life;
  return options;
}

}  // namespace

TEST_CASE("a command of any client that was frozen on its way is not carried out", "[client][expiry]") {
  for (const std::string_view name : transport::names()) {
    CAPTURE(name);
    Robot robot(name);
    Socket socket(robot.link.port());
    const Answer first = socket.ask("GET /base/speed\nHost: 127.0.0.1");
    const std::string time = first.field("Robot-Time");
    REQUIRE(http::RobotTime::parse(time));
    CHECK(socket.ask("POST /base/actions/drive\nHost: 127.0.0.1\nContent-Type: application/json\n" + valid_for(time, 2000) + "\n0.1").status == 204);
    int expected = 0;
    for (const milliseconds frozen : {milliseconds(1'000), milliseconds(12'000), milliseconds(60'000)}) {
      const std::string now = socket.ask("GET /base/speed\nHost: 127.0.0.1").field("Robot-Time");
      robot.link.freeze_to_server();
      socket.send("POST /base/actions/drive\nHost: 127.0.0.1\nContent-Type: application/json\n" + valid_for(now, 900) + "\n0.5");
      robot.clock.advance(frozen);
      robot.link.thaw();
      const Answer answer = socket.await();
      CHECK(answer.status == 412);
      CHECK(answer.says("LateCommand"));
      CHECK(robot.late() == static_cast<std::uint64_t>(++expected));
    }
    CHECK(robot.drives == 1);
    // The response alone is frozen: the command was in time.
    const std::string now = socket.ask("GET /base/speed\nHost: 127.0.0.1").field("Robot-Time");
    robot.link.freeze_to_client();
    socket.send("POST /base/actions/drive\nHost: 127.0.0.1\nContent-Type: application/json\n" + valid_for(now, 900) + "\n0.2");
    wait_until([&] { return robot.drives == 2; });
    robot.clock.advance(milliseconds(60'000));
    robot.link.thaw();
    CHECK(socket.await().status == 204);
  }
}

TEST_CASE("the client library tells its caller that a command is not confirmed, and it is not carried out later", "[client][expiry]") {
  Robot robot("");
  Client client = Client::create(with_life(milliseconds(1'000))).value();
  Client patient = Client::create(with_life(std::chrono::minutes(1))).value();  // for what arrives, on a slow machine too
  const client::Robot found = client.open(robot.link.url()).value();
  const client::Property speed = found.property("base/speed").value();
  const client::Action drive = found.action("base/drive").value();
  const client::Property slow_speed = patient.open(robot.link.url()).value().property("base/speed").value();
  REQUIRE(slow_speed.write(0.1));
  REQUIRE(patient.open(robot.link.url()).value().action("base/drive").value().invoke(0.2));
  for (const auto& freeze : {&FrozenLink::freeze_to_server, &FrozenLink::freeze}) {
    REQUIRE(drive.get());  // so that the command has nothing to read first
    const std::uint64_t before = robot.late();
    (robot.link.*freeze)();
    const auto driven = drive.invoke(0.8);
    REQUIRE_FALSE(driven);
    CHECK(driven.error().code == Errc::unconfirmed);
    const Result<void> written = speed.write(0.7);  // reads first how it is written
    REQUIRE_FALSE(written);
    CHECK(written.error().code == Errc::timed_out);
    const auto sent = client.send({"PUT", speed.url(), {{"Content-Type", "application/json"}}, "0.7"});
    REQUIRE_FALSE(sent);
    CHECK(sent.error().code == Errc::unconfirmed);
    robot.clock.advance(std::chrono::minutes(1));
    robot.link.thaw();
    wait_until([&] { return robot.late() == before + 2; });
  }
  CHECK(robot.writes == 1);
  CHECK(robot.drives == 1);
  // The response is frozen: it was carried out, once, and its sender does not know.
  REQUIRE(drive.get());
  robot.link.freeze_to_client();
  const auto driven = drive.invoke(0.9);
  REQUIRE_FALSE(driven);
  CHECK(driven.error().code == Errc::unconfirmed);
  robot.link.thaw();
  wait_until([&] { return robot.drives == 2; });
  REQUIRE(slow_speed.write(0.3));
  CHECK(robot.drives == 2);
}

TEST_CASE("a stop that was frozen on its way is carried out when it arrives", "[client][expiry]") {
  Robot robot("");
  Client client = Client::create(with_life(milliseconds(300))).value();
  const client::Action stop = client.open(robot.link.url()).value().action("base/stop").value();
  robot.link.freeze_to_server();
  bool is_pressed = false;
  std::thread presses([&] { is_pressed = static_cast<bool>(stop.invoke()); });
  robot.clock.advance(std::chrono::hours(1));
  CHECK(robot.stops == 0);
  robot.link.thaw();
  wait_until([&] { return robot.stops == 1; });
  presses.join();
  CHECK(is_pressed);
}

TEST_CASE("a server that was started again meanwhile does not carry out a command for the one before", "[client][expiry]") {
  Robot before(""), after("");
  Client client = Client::create(with_life(std::chrono::hours(1))).value();
  const client::Action drive = client.open(before.link.url()).value().action("base/drive").value();
  REQUIRE(drive.invoke(0.1));
  before.link.lead_to(after.host.server().port());
  const auto refused = drive.invoke(0.2);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::refused);
  CHECK(refused.error().message.find("412") != std::string::npos);
  CHECK(after.drives == 0);
  CHECK(drive.invoke(0.3));  // the refusal has said the time of the new one
  CHECK(after.drives == 1);
}

TEST_CASE("a client that knows no time asks once, and a server without the field gets no further request", "[client][expiry]") {
  Robot robot("");
  std::vector<std::string> requests;
  client::Options options;
  options.log = [&](LogLevel, std::string_view text) { requests.emplace_back(text); };
  Client client = Client::create(options).value();
  const std::string url = robot.host.url() + "base/actions/drive";
  const client::Request drive{"POST", url, {{"Content-Type", "application/json"}}, "0.5"};
  for (int i = 0; i < 3; ++i) CHECK(client.send(drive).value().status == 204);
  REQUIRE(requests.size() == 4);
  CHECK(requests[0].rfind("OPTIONS ", 0) == 0);
  CHECK(robot.drives == 3);
}

TEST_CASE("a watch with heartbeats knows how old its newest word is, and says when there is none", "[client][heartbeat]") {
  for (const client::Via via : {client::Via::websocket, client::Via::event_stream}) {
    Robot robot("");
    client::Options options;
    options.callbacks = client::Callbacks::in_background;
    Client client = Client::create(options).value();
    std::atomic<int> values{0}, silent{0}, heard{0};
    client::WatchOptions how;
    how.via = via;
    how.heartbeat = milliseconds(100);
    how.silence = milliseconds(300);
    const client::Watch watch = client
                                    .watch(robot.link.url() + "base/speed", how,
                                           [&](const client::Change& change) {
                                             if (change.kind == client::Change::Kind::value) ++values;
                                             if (change.kind == client::Change::Kind::silent) ++silent;
                                             if (change.kind == client::Change::Kind::heard) ++heard;
                                           })
                                    .value();
    const auto beat = [&] { robot.clock.advance(milliseconds(100)), robot.host.server().wake(); };
    wait_until([&] { return beat(), values > 0 && watch.age(); });
    wait_until([&] { return silent > 0; });  // the robot's clock stands still, and so do its heartbeats
    CHECK(*watch.age() >= milliseconds(300));
    wait_until([&] { return beat(), heard > 0; });
    CHECK(watch.is_connected());
  }
}
