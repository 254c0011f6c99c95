// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/hosts/flight_controller.hpp"
#include "tests/hosts/glue.hpp"
#include "tests/hosts/messages.hpp"
#include "tests/hosts/motors.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"
#include "tests/support/watchdog.hpp"

// Three programs that know nothing of lrt, on the web by a file of glue each.

using namespace lrt;
using namespace lrt::test;

namespace {

struct Web {
  Web() {
    Options options;
    options.listen.port = 0;
    options.listen.transport = transport::no_network;
    options.threads.dispatch = Dispatch::io_thread;
    options.limits.host_timeout =
        std::chrono::minutes(1);  // the first body waits for the shapes of 333 values, which a loaded machine compiles in seconds
    server.emplace(Server::create(std::move(options)).value());
  }
  Answer ask(const std::string& text, const std::string& body = {}) {
    RequestText request(text + "\nHost: localhost" + (body.empty() ? "" : "\nContent-Type: application/json\n\n" + body));
    return Answer(server->serve(request.get()).response);
  }
  std::string json(const std::string& path) { return ask("GET " + path + "\nAccept: application/json").body; }
  std::string wrong(const std::string& thing) {
    return violations([&](const std::string& path) { return ask("GET " + path + "\nAccept: text/turtle"); }, thing);
  }

  std::optional<Server> server;
};

}  // namespace

TEST_CASE("of 333 parameters the state has 332 values and an error, and each can be set by its name", "[hosts]") {
  flight::Parameters values;
  Web web;
  web.server->add(parameters_thing(values)).value();
  REQUIRE(flight::table().size() == 333);
  const std::string state = web.json("/parameters/state");
  CHECK(state.find(R"("MC_ROLLRATE_P":0.15)") != std::string::npos);
  CHECK(state.find(R"("@errors":{"CAL_3_XOFF":"it could not be read: it threw: sensor 3 does not answer"})") != std::string::npos);
  std::size_t members = 0;
  for (const flight::Parameter& p : flight::table()) members += state.find("\"" + p.name + "\":") != std::string::npos;
  CHECK(members == 333);
  CHECK(web.wrong("/parameters") == "");
  CHECK(web.ask("GET /parameters/CAL_3_XOFF").status == 500);

  CHECK(web.ask("PUT /parameters/MC_ROLLRATE_P", "0.2").status == 204);
  CHECK(web.json("/parameters/MC_ROLLRATE_P") == "0.2");
  CHECK(web.ask("PUT /parameters/MC_ROLLRATE_P", "7").status == 422);
  CHECK(web.ask("PUT /parameters/RC1_REV", "true").status == 204);
  CHECK(web.ask("PUT /parameters/RC1_MIN", "1000.5").status == 422);
  values.arm(true);
  CHECK(web.ask("PUT /parameters/MC_ROLLRATE_P", "0.1").says("not while the motors are armed"));
  CHECK(values.changes() == 2);
}

TEST_CASE("a motor that is unplugged while it is read and publishes leaves an error in its place, and harms nothing", "[hosts]") {
  Watchdog watchdog("a motor that is unplugged");
  motors::Bus bus;
  Web web;
  const auto serve = [&](const char* name) {
    const auto motor = bus.plug(name);
    serve_motor(*web.server, motor);
    return std::weak_ptr<motors::Motor>(motor);
  };
  const auto left = serve("left"), right = serve("right");
  CHECK(web.ask("POST /motors/left/actions/aim", "2").status == 204);
  std::atomic<bool> ends{false};
  std::atomic<int> wrong{0}, errors{0};
  std::thread reader([&] {
    while (!ends) {
      const Answer state = web.ask("GET /motors/left/state\nAccept: application/json");
      wrong += state.status != 200;
      if (state.says(R"("@errors":{"temperature":"it could not be read: the part of the robot's program that serves it is gone"})")) ++errors;
    }
  });
  while (web.json("/motors/left/state").find("\"sample\"") == std::string::npos) std::this_thread::yield();
  CHECK(web.wrong("/motors/left") == "");
  bus.unplug("left");
  CHECK(left.expired());
  while (errors < 3) std::this_thread::yield();
  CHECK(web.json("/motors/left/state").find("\"sample\":{") != std::string::npos);  // the last one, and its time says when
  CHECK(web.wrong("/motors/left") == "");
  CHECK(web.ask("POST /motors/left/actions/aim", "1").says("is gone"));
  ends = true;
  reader.join();
  CHECK(wrong == 0);
  CHECK(web.server->remove("motors/left"));
  const auto back = serve("left");
  CHECK_FALSE(back.expired());
  CHECK(web.json("/motors/left/state").find("@errors") == std::string::npos);
  bus.unplug("left");
  bus.unplug("right");
}

TEST_CASE("a program of steps with alternatives is read and written, and has exactly one alternative in each step", "[hosts]") {
  cell::Program program{"pick", {{"wait", cell::Wait{1}}, {"move", cell::MoveJ{}}}, std::nullopt};
  cell::Status status;
  Web web;
  web.server->add(cell_thing(program, status)).value();
  CHECK(
      web.json("/cell/program") ==
      R"({"name":"pick","steps":[{"name":"wait","what":{"wait":{"seconds":1}}},{"name":"move","what":{"moveJ":{"joints":[0,0,0,0,0,0],"speed":0.5}}}]})");
  CHECK(web.wrong("/cell") == "");
  CHECK(web.ask("PUT /cell/program", R"({"name":"p","steps":[{"name":"w","what":{"wait":{"seconds":2}}}]})").status == 204);
  REQUIRE(program.steps.size() == 1);
  CHECK(std::get<cell::Wait>(program.steps[0].what).seconds == 2);
  const Answer none = web.ask("PUT /cell/program", R"({"name":"p","steps":[{"name":"w","what":{}}]})");
  CHECK(none.status == 422);
  CHECK(
      web.ask("PUT /cell/program", R"({"name":"p","steps":[{"name":"w","what":{"wait":{"seconds":2},"moveJ":{"joints":[0,0,0,0,0,0],"speed":1}}}]})")
          .status == 422);
  CHECK(program.steps.size() == 1);
}
