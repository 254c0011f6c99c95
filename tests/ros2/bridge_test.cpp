// SPDX-License-Identifier: Apache-2.0
// The bridge on a graph without DDS: what a topic, a service, an action, a node become.
#include <lrt/ros2.hpp>

#include <algorithm>
#include <future>
#include <string>
#include <vector>

#include "tests/ros2/bridge_host.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using namespace lrt::test;
using ros2::Listed;
using ros2::Parameter;
using ros2::ParameterType;

std::string imu(std::uint32_t seconds, std::string_view frame, double turn) {
  Cdr cdr;
  cdr.header(seconds, 500, frame);
  for (const double d : {0.0, 0.0, 0.0, 1.0}) cdr.f64(d);
  for (int i = 0; i < 9; ++i) cdr.f64(0);
  for (const double d : {0.0, 0.0, turn}) cdr.f64(d);
  for (int i = 0; i < 9; ++i) cdr.f64(0);
  for (const double d : {0.0, 0.0, 9.81}) cdr.f64(d);
  for (int i = 0; i < 9; ++i) cdr.f64(0);
  return cdr.take();
}
std::string number(double d) { return Cdr().f64(d).take(); }
std::string twist(double x, double turn) {
  Cdr cdr;
  for (const double d : {x, 0.0, 0.0, 0.0, 0.0, turn}) cdr.f64(d);
  return cdr.take();
}
const std::string drive = R"({"linear":{"x":0.5,"y":0,"z":0},"angular":{"x":0,"y":0,"z":0.25}})";

TEST_CASE("a topic is a Property with units, the frame and the time of header.stamp", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/imu", "sensor_msgs/msg/Imu", "/driver");
  host.graph->announce();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/imu") == 1; }));
  host.graph->publish("/imu", imu(1'700'000'000, "imu_link", 0.5));
  host.settle();
  const std::string value = host.json("/imu/value");
  CHECK(value.find("0.5") != std::string::npos);
  CHECK(value.find("imu_link") != std::string::npos);
  const Answer turtle = host.ask("GET /imu/value\nAccept: text/turtle");
  CHECK(turtle.status == 200);
  CHECK(turtle.says("RAD-PER-SEC"));
  CHECK(turtle.says("M-PER-SEC2"));
  CHECK(turtle.says("2023-11-14T22:13:20"));
  CHECK(turtle.says("lrt:frame"));
  CHECK(turtle.says("\"imu_link\""));
  CHECK(host.listed("/imu", Listed::What::topic)->path == "/imu/value");
  CHECK(host.listed("/imu", Listed::What::topic)->as == "Property");
  CHECK(host.put("/imu/value", value).status == 405);
}

TEST_CASE("nothing is decoded that nobody reads", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/speed", "std_msgs/msg/Float64", "/driver");
  host.settle();
  for (int i = 0; i < 1000; ++i) host.graph->publish("/speed", number(i));
  CHECK(host.core->counters().decoded == 0);
  CHECK(host.json("/speed/value").find("999") != std::string::npos);
  CHECK(host.core->counters().decoded == 1);
}

TEST_CASE("what is gone is unavailable with the reason, and returns with its URI", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/speed", "std_msgs/msg/Float64", "/driver");
  host.settle();
  const Answer early = host.ask("GET /speed/value\nAccept: application/json");
  CHECK(early.status == 503);
  CHECK(early.says("no sample has come yet"));
  host.graph->publish("/speed", number(1));
  CHECK(host.json("/speed/value").find('1') != std::string::npos);
  host.graph->leave("/driver");
  host.settle();
  CHECK(host.core->counters().unavailable == 1);
  const Answer gone = host.ask("GET /speed/value\nAccept: application/json");
  CHECK(gone.status == 503);
  CHECK(gone.says("no node writes it now; the last was /driver"));
  CHECK(host.json("/speed/state").find("no node writes it now") != std::string::npos);
  CHECK(host.graph->publish("/speed", number(7)) == 0);
  host.graph->write("/speed", "std_msgs/msg/Float64", "/driver");
  host.settle();
  host.graph->publish("/speed", number(2));
  CHECK(host.json("/speed/value").find('2') != std::string::npos);
  CHECK(host.core->counters().unavailable == 0);
}

TEST_CASE("a malformed sample is no value, and the next one is", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/speed", "std_msgs/msg/Float64", "/driver");
  host.settle();
  for (const std::string& bad : {std::string(), std::string("\0\1\0\0", 4), number(1) + "behind", std::string("\0\2\0\0........", 12)}) {
    host.graph->publish("/speed", bad);
    CHECK(host.ask("GET /speed/value\nAccept: application/json").status == 500);
  }
  CHECK(host.core->counters().malformed >= 4);
  host.graph->publish("/speed", number(3));
  CHECK(host.json("/speed/value").find('3') != std::string::npos);
}

TEST_CASE("a topic is read-only unless it is allowed by name", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.topics = {"/cmd_*"};
  options.limits.command_life = std::chrono::hours(1);
  BridgeHost host(options);
  host.graph->read("/cmd_vel", "geometry_msgs/msg/Twist", "/base");
  host.graph->read("/other", "geometry_msgs/msg/Twist", "/base");
  host.settle();
  CHECK(host.put("/other/value", drive).status == 405);
  const Answer unread = host.put("/cmd_vel/value", drive);
  CHECK(unread.status == 409);
  CHECK(unread.says("no node reads /cmd_vel now"));
  CHECK(host.graph->written().empty());
  host.graph->readers["/cmd_vel"] = 1;
  CHECK(host.put("/cmd_vel/value", drive).status == 204);
  REQUIRE(host.graph->written().size() == 1);
  CHECK(host.graph->written()[0].payload == twist(0.5, 0.25));
  CHECK(host.json("/cmd_vel/value").find("0.25") != std::string::npos);
  CHECK(host.put("/cmd_vel/value", R"({"linear":{"x":"fast"}})").status == 422);
  CHECK(host.core->counters().commands == 1);
  CHECK(host.ask("GET /cmd_vel\nAccept: text/turtle").says("lrt:control"));
}

TEST_CASE("a written Twist has a life; then zero is written", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.topics = {"/cmd_vel"};
  options.limits.command_life = std::chrono::milliseconds(30);
  BridgeHost host(options);
  host.graph->read("/cmd_vel", "geometry_msgs/msg/Twist", "/base");
  host.graph->readers["/cmd_vel"] = 1;
  host.settle();
  CHECK(host.ask("GET /cmd_vel/value\nAccept: text/turtle").status != 404);
  CHECK(host.put("/cmd_vel/value", drive).status == 204);
  REQUIRE(comes_true([&] { return host.graph->written().size() >= 2; }));
  CHECK(host.graph->written()[0].payload == twist(0.5, 0.25));
  CHECK(host.graph->written()[1].payload == twist(0, 0));
  CHECK(host.comes("/cmd_vel/value", "\"x\":0"));
}

TEST_CASE("a stamped command has the time of its writing", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.topics = {"/**"};
  BridgeHost host(options);
  host.graph->read("/cmd", "geometry_msgs/msg/PointStamped", "/base");
  host.graph->readers["/cmd"] = 1;
  host.settle();
  CHECK(host.put("/cmd/value", R"({"header":{"frame_id":"map"},"point":{"x":1,"y":2,"z":3}})").status == 204);
  const std::string payload = host.graph->written().at(0).payload;
  const std::int64_t seconds = ros2::load<std::uint32_t>(payload.data() + 4, true);
  CHECK(std::abs(seconds - std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count()) < 60);
}

TEST_CASE("equal types have one record, and units of a place have a name with it", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/a", "geometry_msgs/msg/TwistStamped", "/driver");
  host.graph->write("/b", "nav_msgs/msg/Odometry", "/driver");
  host.graph->write("/c", "geometry_msgs/msg/Vector3", "/driver");
  host.settle();
  host.graph->publish("/c", Cdr().f64(1).f64(2).f64(3).take());
  const std::string terms = host.ask("GET /ns/vocabulary\nAccept: text/turtle").body;
  CHECK(terms.find("geometry_msgs.Twist.linear/x") != std::string::npos);
  CHECK(terms.find("geometry_msgs.Vector3/x") != std::string::npos);
  CHECK(terms.find("TwistWithCovariance.twist.linear") == std::string::npos);
  CHECK(host.json("/c/value").find("\"z\":3") != std::string::npos);
}

TEST_CASE("a service is an Action; a response that says no is a failure", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.services = {"/gripper/*"};
  BridgeHost host(options);
  host.graph->serve("/gripper/open", "std_srvs/srv/SetBool", "/gripper");
  host.graph->serve("/other", "std_srvs/srv/Trigger", "/x");
  host.settle();
  CHECK(host.ask("GET /other\nAccept: application/json").status == 404);
  CHECK(host.reason("/other", Listed::What::service) == "not allowed");
  std::atomic<int> status{0};
  std::string body;
  const auto post = [&](bool good) {
    std::thread client([&] {
      const Answer answer = host.ask("POST /gripper/open/actions/call\nContent-Type: application/json\n\n{\"data\":true}");
      body = answer.body;
      status = answer.status;
    });
    std::optional<FakeGraph::Called> call;
    CHECK(comes_true([&] { return (call = host.graph->take_call()).has_value(); }));
    if (call) {
      CHECK(call->request == Cdr().u8(1).take());
      call->done(std::make_shared<const std::string>(Cdr().u8(good).text(good ? "open" : "it is jammed").take()));
    }
    client.join();
  };
  post(true);
  CHECK((status == 200 || status == 204));
  post(false);
  CHECK(status == 409);
  CHECK(body.find("it is jammed") != std::string::npos);
  host.graph->leave("/gripper");
  host.settle();
  const Answer gone = host.ask("POST /gripper/open/actions/call\nContent-Type: application/json\n\n{\"data\":true}");
  CHECK(gone.status == 409);
  CHECK(gone.says("no node serves it now"));
  host.graph->serve("/gripper/open", "std_srvs/srv/SetBool", "/gripper", false);
  host.settle();
  CHECK(host.ask("POST /gripper/open/actions/call\nContent-Type: application/json\n\n{\"data\":true}").says("in doubt"));
}

TEST_CASE("an action is an Action with progress, feedback and cancel", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.actions = {"/move"};
  BridgeHost host(options, [](BridgeHost& h) {
    h.definitions.add_text("demo/action/Move", "float64 distance\n---\nfloat64 moved\nstring message\n---\nfloat64 distance_remaining\n").value();
  });
  host.graph->act("/move", "demo/action/Move", "/base");
  host.settle();
  const Answer sent = host.ask("POST /move/actions/send_goal\nPrefer: respond-async\nContent-Type: application/json\n\n{\"distance\":2}");
  CHECK(sent.status == 202);
  std::string invocation = sent.field("Location");
  invocation = invocation.substr(invocation.find("/move"));
  REQUIRE(comes_true([&] { return host.graph->goal() != nullptr; }));
  const std::shared_ptr<FakeGraph::Goal> goal = host.graph->goal();
  CHECK(goal->request.size() == 4 + 16 + 8);
  goal->events.feedback(std::make_shared<const std::string>(Cdr().f64(0).f64(0).f64(2).take()));
  goal->events.feedback(std::make_shared<const std::string>(Cdr().f64(0).f64(0).f64(0.5).take()));
  CHECK(host.comes(invocation, "0.75"));
  CHECK(host.json("/move/feedback").find("0.5") != std::string::npos);
  SECTION("succeeds") {
    goal->events.ended(std::make_shared<const std::string>(Cdr().u8(4).f64(2).text("there").take()), ros2::GoalStatus::succeeded);
    CHECK(host.comes(invocation, "there"));
    CHECK(host.comes(invocation, "succeeded"));
  }
  SECTION("is aborted") {
    goal->events.ended(std::make_shared<const std::string>(Cdr().u8(6).f64(1).text("a wall").take()), ros2::GoalStatus::aborted);
    CHECK(host.comes(invocation, "a wall"));
    CHECK(host.comes(invocation, "failed"));
  }
  SECTION("is cancelled") {
    CHECK(host.ask("DELETE " + invocation).status / 100 == 2);
    CHECK(comes_true([&] { return goal->is_cancelled.load(); }));
    goal->events.ended(std::make_shared<const std::string>(Cdr().u8(5).f64(1).text("").take()), ros2::GoalStatus::canceled);
    CHECK(host.comes(invocation, "cancelled"));
  }
}

TEST_CASE("the parts of an action that is not known are requested from its nodes", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.actions = {"/**"};
  std::vector<std::string> asked;
  BridgeHost host(options, [&](BridgeHost& h) {
    h.graph->describer = [&](const std::string& type, ros2::Definitions& to) -> Result<void> {
      asked.push_back(type);
      if (type == "demo/action/Move_FeedbackMessage") return to.add_text("demo/action/Move", "int32 a\n---\nint32 b\n---\nint32 c\n");
      return type.find("Move") != std::string::npos ? Result<void>() : unexpected(Errc::unavailable, "nobody knows");
    };
  });
  host.graph->act("/move", "demo/action/Move", "/base");
  host.settle();
  CHECK(asked == std::vector<std::string>{"demo/action/Move_SendGoal", "demo/action/Move_GetResult", "demo/action/Move_FeedbackMessage"});
  CHECK(host.listed("/move", Listed::What::action)->path == "/move/actions/send_goal");
  host.graph->act("/other", "demo/action/Other", "/base");
  host.settle();
  CHECK(host.reason("/other", Listed::What::action).find("nobody knows; its nodes do not say") == 0);
}

TEST_CASE("parameters are Properties with the ranges of their descriptors", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.parameters = {"/arm/*:max_*", "/arm/*:fixed"};
  BridgeHost host(options, [](BridgeHost& h) {
    Parameter speed;
    speed.name = "max_speed";
    speed.type = ParameterType::real;
    speed.value = rdf::Value(1.5);
    speed.description = "How fast it drives.";
    speed.range = Parameter::Range{0, 2, 0.5};
    Parameter fixed;
    fixed.name = "fixed";
    fixed.type = ParameterType::text;
    fixed.value = rdf::Value(std::string("a"));
    fixed.read_only = true;
    Parameter other;
    other.name = "other";
    other.type = ParameterType::integers;
    other.value = rdf::Value(rdf::Value::Sequence{rdf::Value(std::int64_t{1}), rdf::Value(std::int64_t{2})});
    h.graph->parameters_of["/arm/driver"] = {speed, fixed, other};
    h.graph->setter = [](const std::string&, const Parameter& p) -> Result<void> {
      if (*p.value.real() == 2) return refused("too fast today");
      return {};
    };
  });
  host.graph->join("/arm/driver", true);
  host.settle();
  const std::string base = "/nodes/arm/driver/parameters/";
  CHECK(host.json(base + "max_speed").find("1.5") != std::string::npos);
  CHECK(host.json(base + "other").find("[1,2]") != std::string::npos);
  CHECK(host.put(base + "max_speed", "1").status == 204);
  CHECK(host.put(base + "max_speed", "3").status == 422);
  CHECK(host.put(base + "max_speed", "0.7").status == 409);  // no step
  const Answer refusal = host.put(base + "max_speed", "2");
  CHECK(refusal.status == 409);
  CHECK(refusal.says("too fast today"));
  CHECK(host.put(base + "fixed", "\"b\"").status == 405);
  CHECK(host.put(base + "other", "[1]").status == 405);
  Parameter changed;
  changed.name = "max_speed";
  changed.type = ParameterType::real;
  changed.value = rdf::Value(0.25);
  host.graph->parameter_event("/arm/driver", {changed}, {});
  CHECK(host.comes(base + "max_speed", "0.25"));
  CHECK(host.listed("/arm/driver:max_speed", Listed::What::parameter)->as == "writable Property");
  host.graph->leave("/arm/driver");
  host.settle();
  CHECK(host.ask("GET " + base + "max_speed\nAccept: application/json").says("the node /arm/driver is gone"));
  host.graph->join("/arm/driver", true);
  host.settle();
  CHECK(host.json(base + "max_speed").find("1.5") != std::string::npos);
}

TEST_CASE("a lifecycle node has its state and its transitions", "[ros2][bridge]") {
  ros2::Options options;
  options.allowed.lifecycle = {"/camera"};
  BridgeHost host(options);
  host.graph->join("/camera", false, true);
  host.graph->announce();
  std::optional<FakeGraph::Called> call;
  REQUIRE(comes_true([&] { return (call = host.graph->take_call()).has_value(); }));
  CHECK(call->service == "/camera/get_state");
  call->done(std::make_shared<const std::string>(Cdr().u8(1).text("unconfigured").take()));
  CHECK(host.comes("/nodes/camera/lifecycle", "unconfigured"));
  CHECK(comes_true([&] { return host.ask("POST /nodes/camera/actions/activate").status == 409; }));
  std::atomic<int> status{0};
  std::thread client([&] { status = host.ask("POST /nodes/camera/actions/configure").status; });
  CHECK(comes_true([&] { return (call = host.graph->take_call()).has_value(); }));
  CHECK(call->service == "/camera/change_state");
  CHECK(call->request == Cdr().u8(1).text("configure").take());
  call->done(std::make_shared<const std::string>(Cdr().u8(1).take()));
  client.join();
  CHECK(status == 204);
  Cdr event;
  event.u32(0).u32(0).u8(1).text("configure").u8(10).text("configuring").u8(2).text("inactive");
  host.graph->publish("/camera/transition_event", event.take());
  CHECK(host.comes("/nodes/camera/lifecycle", "inactive"));
}

TEST_CASE("a type that is not known is requested from its nodes", "[ros2][bridge]") {
  ros2::Definitions other;
  other.add_text("demo/msg/Odd", "int32 odd\n").value();
  const std::string hash = other.message("demo/msg/Odd").value()->hash;
  BridgeHost host({}, [](BridgeHost& h) {
    h.graph->describer = [](const std::string& type, ros2::Definitions& to) -> Result<void> {
      if (type != "demo/msg/Odd") return unexpected(Errc::unavailable, "nobody knows");
      return to.add_text(type, "int32 odd\n");
    };
  });
  host.graph->write("/odd", "demo/msg/Odd", "/x", hash);
  host.graph->write("/unknown", "demo/msg/Unknown", "/x", "RIHS01_" + std::string(64, '0'));
  host.graph->write("/humble", "demo/msg/Humble", "/x");
  host.graph->write("/no_ros", "Plain::Type", "/x");
  host.settle();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/odd") == 1; }));
  host.graph->publish("/odd", Cdr().u32(7).take());
  CHECK(host.comes("/odd/value", "\"odd\":7"));
  CHECK(host.reason("/unknown") == "nobody knows");
  CHECK(host.reason("/humble").find("--definitions") != std::string::npos);
  CHECK(host.reason("/no_ros") == "its type is not one of ROS 2");
  CHECK(host.core->counters().left_out == 3);
}

TEST_CASE("two versions of one type: the first that is known is read, the other is stated", "[ros2][bridge]") {
  BridgeHost host({}, [](BridgeHost& h) { h.definitions.add_text("demo/msg/Odd", "int32 odd\n").value(); });
  const std::string hash = host.definitions.message("demo/msg/Odd").value()->hash;
  host.graph->write("/odd", "demo/msg/Odd", "/x", hash);
  host.settle();
  host.graph->write("/odd", "demo/msg/Odd", "/y", "RIHS01_" + std::string(64, '1'));
  host.settle();
  CHECK(host.reason("/odd").find("another version") != std::string::npos);
  CHECK(host.graph->subscriptions("/odd") == 1);
  host.graph->publish("/odd", Cdr().u32(7).take());
  CHECK(host.comes("/odd/value", "\"odd\":7"));
}

TEST_CASE("names that are too many are left out and counted, those of other namespaces are not looked at", "[ros2][bridge]") {
  ros2::Options options;
  options.limits.max_things = 20;
  options.namespaces = {"/arm"};
  options.path = "robots/r7";
  BridgeHost host(options);
  for (int i = 0; i < 200; ++i) host.graph->write("/arm/t" + std::to_string(i), "std_msgs/msg/Float64", "/x");
  host.graph->write("/armrest", "std_msgs/msg/Float64", "/x");
  host.settle();
  const ros2::Counters counters = host.core->counters();
  CHECK(counters.things == 20);
  CHECK(counters.left_out == 180);
  CHECK(host.core->list().size() == 20);
  CHECK(host.core->list()[0].path.substr(0, 15) == "/robots/r7/arm/");
}

TEST_CASE("the newest samples of all topics have a limit of bytes together", "[ros2][bridge]") {
  ros2::Options options;
  options.limits.max_kept_bytes = 2'500;
  BridgeHost host(options);
  for (const char* name : {"/a", "/b", "/c"}) host.graph->write(name, "std_msgs/msg/String", "/x");
  host.settle();
  const std::string large = Cdr().text(std::string(1'000, 'x')).take();
  for (const char* name : {"/a", "/b", "/c"}) host.graph->publish(name, large);
  CHECK(host.ask("GET /a/value\nAccept: application/json").status == 200);
  CHECK(host.ask("GET /b/value\nAccept: application/json").status == 200);
  CHECK(host.ask("GET /c/value\nAccept: application/json").says("max_kept_bytes"));
  host.graph->publish("/a", Cdr().text("small").take());
  host.graph->publish("/c", large);
  CHECK(host.ask("GET /c/value\nAccept: application/json").status == 200);
}

TEST_CASE("types have a limit, also for what changes its type", "[ros2][bridge]") {
  ros2::Options options;
  options.limits.max_types = 2;
  BridgeHost host(options);
  host.graph->write("/a", "std_msgs/msg/Float64", "/x");
  host.graph->write("/b", "std_msgs/msg/String", "/x");
  host.settle();
  host.graph->write("/c", "std_msgs/msg/Int8", "/x");
  host.graph->write("/d", "std_msgs/msg/String", "/x");  // which there is
  host.settle();
  CHECK(host.reason("/c").find("max_types") != std::string::npos);
  host.graph->publish("/d", Cdr().text("there").take());
  CHECK(host.json("/d/value").find("there") != std::string::npos);
  ros2::Options of_members;
  of_members.limits.max_type_members = 20;
  BridgeHost second(of_members);
  second.graph->write("/a", "std_msgs/msg/Float64", "/x");
  second.graph->write("/imu", "sensor_msgs/msg/Imu", "/x");
  second.settle();
  CHECK(second.reason("/a") == "");
  CHECK(second.reason("/imu").find("max_type_members") != std::string::npos);
}

TEST_CASE("events of nodes that are lost are no values that stay", "[ros2][bridge]") {
  Parameter speed;
  speed.name = "speed";
  speed.type = ParameterType::real;
  speed.value = rdf::Value(1.5);
  BridgeHost host({}, [&](BridgeHost& h) { h.graph->parameters_of["/n"] = {speed}; });
  host.graph->join("/n", true);
  host.settle();
  const std::string path = "/nodes/n/parameters/speed";
  REQUIRE(host.comes(path, "1.5"));
  std::promise<void> held, released;
  host.core->shared()->put([&] {
    held.set_value();
    released.get_future().wait();
  });
  held.get_future().wait();
  // The bridge's thread is busy, and a stranger sends more than is kept.
  std::vector<Parameter> many(1'000, speed);
  for (Parameter& p : many) p.value = rdf::Value(2.5);
  for (int i = 0; i < 200; ++i) host.graph->parameter_event("/n", many, {});
  {
    const std::lock_guard lock(host.core->shared()->mutex);
    CHECK(host.core->shared()->jobs.size() < 150);
    CHECK(host.core->shared()->has_lost_events);
  }
  {
    const std::lock_guard lock(host.graph->mutex);
    host.graph->parameters_of["/n"][0].value = rdf::Value(3.5);
  }
  released.set_value();
  CHECK(host.comes(path, "3.5"));  // the node was asked again
}

TEST_CASE("names of strangers that are no text are left out", "[ros2][bridge]") {
  BridgeHost host({}, [](BridgeHost& h) {
    Parameter good;
    good.name = "good";
    good.type = ParameterType::text;
    good.value = rdf::Value(std::string("a"));
    std::vector<Parameter> all;
    for (const char* name : {"good", "good", "a\nb", "\xFF", "..", "a//b", ""}) {
      all.push_back(good);
      all.back().name = name;
      all.back().description = "Words\xFF and\x1B[2J";
    }
    h.graph->parameters_of["/n"] = all;
  });
  host.graph->join("/n", true);
  host.graph->write("/imu", "sensor_msgs/msg/Imu", "/n");
  host.graph->announce();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/imu") == 1; }));
  host.graph->publish("/imu", imu(1, "\x1B[2J", 0.5));
  host.settle();
  CHECK(host.json("/nodes/n/parameters/good") == "\"a\"");
  CHECK(host.ask("GET /imu/value\nAccept: application/json").status == 200);
}

TEST_CASE("a path that the host uses is left to it", "[ros2][bridge]") {
  BridgeHost host({}, [](BridgeHost& h) {
    Thing mine{"speed"};
    mine.property("value", [] { return 5; });
    h.server->add(std::move(mine)).value();
  });
  host.graph->write("/speed", "std_msgs/msg/Float64", "/driver");
  host.settle();
  CHECK(host.listed("/speed", Listed::What::topic)->path == "/speed_topic/value");
}

TEST_CASE("the Things of a bridge go with it", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/a", "std_msgs/msg/Float64", "/x");
  host.graph->write("/a/b", "std_msgs/msg/Float64", "/x");
  host.settle();
  host.graph->publish("/a/b", number(1));
  CHECK(host.ask("GET /a/b/value\nAccept: application/json").status == 200);
  host.core.reset();
  CHECK(host.ask("GET /a/b/value\nAccept: application/json").status == 404);
  CHECK(host.ask("GET /a\nAccept: application/json").status == 404);
  host.core.emplace(*host.server, ros2::Options(), host.graph, host.definitions);
  host.core->start().value();
}

}  // namespace
