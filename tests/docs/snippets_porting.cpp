// SPDX-License-Identifier: Apache-2.0
// The worked examples of docs/porting. Each function makes the Thing that its page describes; main() sends the requests that the page shows, without a
// port, and exits with 1 if a response is not the one of the page. With --serve PORT it serves the lamp.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>

// rosbridge.md

struct Twist {
  double linear = 0;   // [m/s]
  double angular = 0;  // [rad/s]
};

template <>
struct lrt::rdf::traits<Twist> : lrt::rdf::Record<Twist> {
  static void describe(Record<Twist>& r) {
    r.field("linear", &Twist::linear).unit(unit::metre_per_second).between(-0.5, 0.5);
    r.field("angular", &Twist::angular).unit(unit::radian_per_second).between(-1, 1);
  }
};

struct Base {
  Twist wanted;
  void reset() { wanted = {}; }
};

lrt::PushedProperty<Twist> make_base(lrt::Server& server, Base& base) {
  lrt::Thing thing{"base"};
  auto velocity = thing.property<Twist>("velocity");  // the topic /odom: subscribe
  thing
      .property("command", [&base] { return base.wanted; })  // the topic /cmd_vel: publish
      .on_write([&base](const Twist& wanted) { base.wanted = wanted; });
  thing.action("reset", [&base] { base.reset(); });  // the service /reset: call_service
  server.add(std::move(thing)).value();
  return velocity;
}

// webthing-cpp.md

struct Lamp {
  bool on = true;
  int brightness = 50;
};

lrt::PushedProperty<bool> make_lamp(lrt::Server& server, Lamp& lamp) {
  lrt::Thing thing{"lamp"};
  thing.title("My Lamp").type(lrt::Iri{"https://webthings.io/schemas#Light"});
  thing.property("on", [&lamp] { return lamp.on; }).title("On/Off").on_write([&lamp](bool on) { lamp.on = on; });
  thing
      .property(
          "brightness", [&lamp] { return lamp.brightness; }, lrt::unit::percent)
      .between(0, 100)
      .on_write([&lamp](int level) { lamp.brightness = level; });
  thing
      .action("fade",
              [&lamp](int level, lrt::Responder done) {
                lamp.brightness = level;
                done.succeed();
              })
      .consumes(lrt::Facets{lrt::unit::percent}.between(0, 100));
  auto overheated = thing.property<bool>("overheated");  // an event: publish, and clients watch with a queue
  overheated.urgent();
  server.add(std::move(thing)).value();
  return overheated;
}

// opcua.md

struct Boiler {
  double setpoint = 60;  // [Cel]
  bool heating = false;
};

lrt::PushedProperty<double> make_boiler(lrt::Server& server, Boiler& boiler) {
  lrt::Thing thing{"plant/boiler"};                                                     // the folder "plant" is a Thing, if you add one
  auto temperature = thing.property<double>("temperature", lrt::unit::degree_celsius);  // a variable that is read and monitored
  temperature.between(-20, 150);                                                        // EURange
  thing
      .property(
          "setpoint", [&boiler] { return boiler.setpoint; }, lrt::unit::degree_celsius)
      .between(20, 90)
      .on_write([&boiler](double wanted) { boiler.setpoint = wanted; });
  thing.action("start", [&boiler]() -> lrt::Result<void> {  // a method
    if (boiler.heating) return lrt::refused("the boiler heats already");
    boiler.heating = true;
    return {};
  });
  server.add(std::move(thing)).value();
  return temperature;
}

// ros2.md

/// As sensor_msgs::msg::JointState.
struct JointState {
  std::vector<std::string> name;
  std::vector<double> position;
};

class LinkedJoints {
 public:
  explicit LinkedJoints(lrt::Server& server) : server_(server) {}

  /// The callback of the subscription to joint_states. publish() does not wait. The first message with
  /// a new joint calls Server::add(), which takes a lock: use this where a lock is acceptable.
  void take(const JointState& state) {
    for (std::size_t i = 0; i < state.name.size() && i < state.position.size(); ++i) {
      auto found = joints_.find(state.name[i]);
      if (found == joints_.end()) found = joints_.emplace(state.name[i], add_joint(state.name[i])).first;
      found->second.publish(state.position[i]);
    }
  }

 private:
  lrt::PushedProperty<double> add_joint(const std::string& name) {
    lrt::Thing thing{"robot/" + name};
    auto position = thing.property<double>("position", lrt::unit::radian);
    position.facets(lrt::Facets{}.allow_non_finite());  // the shape allows NaN, which drivers send for what they do not measure
    if (auto added = server_.add(std::move(thing)); !added) std::fprintf(stderr, "%s: %s\n", name.c_str(), added.error().message.c_str());
    return position;
  }
  lrt::Server& server_;
  std::map<std::string, lrt::PushedProperty<double>> joints_;
};

namespace {

int failures = 0;

void expect(lrt::Server& server, int status, std::string_view content, std::string_view method, std::string_view target, std::string_view body = {}) {
  lrt::http::Request request;
  request.method = method;
  request.target = target;
  request.fields = {{"Host", "robot.example"}, {"Accept", "application/json"}};
  if (!body.empty()) request.fields.push_back({"Content-Type", "application/json"});
  request.body = body;
  const lrt::Served served = server.serve(request);
  const std::string_view found = served.response.content();
  if (served.response.status == status && found.find(content) != std::string_view::npos) return;
  std::printf("%.*s %.*s: expected %d and \"%.*s\", found %d and \"%.*s\"\n", static_cast<int>(method.size()), method.data(),
              static_cast<int>(target.size()), target.data(), status, static_cast<int>(content.size()), content.data(), served.response.status,
              static_cast<int>(found.size()), found.data());
  ++failures;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == "--serve") {  // the lamp, for the commands of webthing-cpp.md
    lrt::Options options;
    options.listen.port = static_cast<std::uint16_t>(std::atoi(argv[2]));
    auto server = lrt::Server::create(options).value();
    Lamp lamp;
    auto overheated = make_lamp(server, lamp);
    overheated.publish(false);
    server.run();
    return 0;
  }
  lrt::Options options;
  options.listen.transport = lrt::transport::no_network;
  options.listen.public_base = "http://robot.example";
  auto server = lrt::Server::create(std::move(options)).value();
  Base base;
  Lamp lamp;
  Boiler boiler;
  make_base(server, base).publish({0.25, 0});
  make_lamp(server, lamp).publish(false);
  make_boiler(server, boiler).publish(58.5);
  LinkedJoints joints(server);
  joints.take({{"shoulder"}, {0.5}});
  server.start();

  expect(server, 200, R"({"linear":0.25,"angular":0})", "GET", "/base/velocity");
  expect(server, 204, "", "PUT", "/base/command", R"({"linear": 0.2, "angular": 0})");
  expect(server, 422, "expected at most 0.5", "PUT", "/base/command", R"({"linear": 2, "angular": 0})");
  expect(server, 204, "", "POST", "/base/actions/reset");

  expect(server, 204, "", "PUT", "/lamp/on", "false");
  expect(server, 200, "false", "GET", "/lamp/on");
  expect(server, 422, "expected at most 100", "PUT", "/lamp/brightness", "150");
  expect(server, 204, "", "POST", "/lamp/actions/fade", "20");
  expect(server, 200, R"({"on":false,"brightness":20,"overheated":false})", "GET", "/lamp/state");

  expect(server, 200, "58.5", "GET", "/plant/boiler/temperature");
  expect(server, 204, "", "PUT", "/plant/boiler/setpoint", "70");
  expect(server, 204, "", "POST", "/plant/boiler/actions/start");
  expect(server, 409, "the boiler heats already", "POST", "/plant/boiler/actions/start");

  expect(server, 200, "0.5", "GET", "/robot/shoulder/position");
  server.stop();
  return failures == 0 ? 0 : 1;
}
