// SPDX-License-Identifier: Apache-2.0
#include "examples/baxter/linked_arm.hpp"

#include <cmath>
#include <cstdio>
#include <deque>
#include <optional>
#include <random>

#include <lrt/delivery/deliverer.hpp>
#include <lrt/shacl/validator.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/examples/arm.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"
#include "tests/support/together.hpp"

using namespace lrt::test;

namespace {

constexpr double pi = 3.14159265358979323846;

/// Connects to no host.
class NoDeliverer final : public lrt::delivery::Deliverer {
 public:
  void notify(lrt::subscription::Channel, std::string_view) override {}
  void stop() noexcept override {}
};

/// The example's program without its port and its sleep.
class Robot {
 public:
  Robot() {
    lrt::Options options;
    options.threads.io = lrt::Io::in_poll;
    options.clock = &clock;
    options.ids = std::make_shared<FixedIds>();
    options.listen.public_base = "http://example.org";
    options.security.allowed_hosts = {"localhost"};  // the Host of RequestText
    options.callbacks.allow = {"www.example.org"};
    options.callbacks.deliverer = [](auto&&...) -> lrt::Result<std::unique_ptr<lrt::delivery::Deliverer>> { return std::make_unique<NoDeliverer>(); };
    options.listen.transport = [this](lrt::transport::TransportOptions t) {
      auto made = std::make_unique<lrt::transport::Loopback>(std::move(t));
      loopback_ = made.get();
      return made;
    };
    server_.emplace(lrt::Server::create(std::move(options)).value());
    linked.add_to(*server_).value();
    step();  // the arm says whether it is stopped: until then nothing moves
  }

  /// One period of the control loop.
  void step() {
    clock.advance(std::chrono::milliseconds(1));
    arm.step();
    linked.publish();
    server_->poll();
  }
  Answer ask(const std::string& text) {
    RequestText request(text);
    std::optional<Answer> answer;
    loopback_->submit(request.get(), [&](lrt::http::Response r) { answer = Answer(r); });
    for (int i = 0; i < 100 && !answer; ++i) step();
    if (!answer) throw std::runtime_error("no answer to " + text);
    return *answer;
  }
  Answer get(const std::string& path) { return ask("GET " + path); }
  /// The request of Figure 5b.
  Answer rotate(const std::string& joint, const std::string& value, const std::string& unit = "vom:unit maths:Degree") {
    return ask("POST /baxter/" + joint +
               "/actions/rotate\nContent-Type: text/turtle\n\n"
               "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .\n"
               "@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n<> a maths:Scalar ; vom:numericalValue " +
               value + (unit.empty() ? "" : " ; " + unit) + " .");
  }
  std::string status(const std::string& location) {
    const lrt::rdf::Graph graph = get(location.substr(18)).graph();
    return std::string(graph.object(lrt::rdf::iri(location), lrt::vocab::lrt_::status).value().text.substr(24));
  }

  FakeClock clock;
  baxter::RightArm arm{arm_parameters()};
  baxter::LinkedArm linked{arm, lrt::urdf::load(arm_file).value()};
  const lrt::urdf::Model model = lrt::urdf::load(arm_file).value().model();

 private:
  lrt::transport::Loopback* loopback_ = nullptr;
  std::optional<lrt::Server> server_;
};

constexpr const char* base = "http://example.org/baxter/";

}  // namespace

TEST_CASE("Figure 2b, corrected: right_s1 is what the paper shows", "[examples][R1.3][R1.8][R1.9][R1.10][R1.11]") {
  Robot robot;
  const Answer a = robot.get("/baxter/right_s1");
  REQUIRE(a.status == 200);
  CHECK(missing(a,
                "<right_s1> a hybrit:RoboticThing , ros:RevoluteJoint , _:kind ;"
                "  hybrit:blueprint _:kind ; hybrit:subscriptions <right_s1/subscriptions> ; hybrit:action "
                "<right_s1/actions/rotate> ;"
                "  hybrit:property <right_s1/friction> , <right_s1/rotation> , <right_s1/jointReferenceFrame> ;"
                "  rdfs:seeAlso <http://example.org/baxter> ; dcterms:title \"right_s1\" ;"
                "  ros:friction <right_s1/friction> ; ros:jointReferenceFrame <right_s1/jointReferenceFrame> ; ros:rotation <right_s1/rotation> ;"
                "  xhv:prev <right_upper_shoulder> ; xhv:next <right_lower_shoulder> ;"
                "  ros:position <right_s1/position> ; ros:preceedingLink <right_upper_shoulder> ; ros:succeedingLink <right_lower_shoulder> ."
                "<right_s1/rotation> a spatial:AxisAngle . <right_s1/jointReferenceFrame> a maths:CoordinateSystem ."
                "<right_upper_shoulder> a hybrit:RoboticThing , ros:Link . <right_lower_shoulder> a ros:Link .",
                base) == "");
}

TEST_CASE("Figure 3, corrected: the rotation of right_s1", "[examples][R1.5][R1.9]") {
  Robot robot;
  const Answer a = robot.get("/baxter/right_s1/rotation");
  REQUIRE(a.status == 200);
  CHECK(missing(a,
                "<right_s1/rotation> a spatial:AxisAngle , spatial:Rotation3D , hybrit:Property ; rdfs:seeAlso <right_s1> ;"
                "  spatial:rotationAngle [ a maths:Scalar ; vom:numericalValue \"0\"^^xsd:float ; vom:unit maths:Radian ] ;"
                "  spatial:rotationAxis [ a maths:Vector3D ; maths:x \"0\"^^xsd:float ; maths:y \"0\"^^xsd:float ; maths:z \"1\"^^xsd:float ] .",
                base) == "");
}

// Corrections: the base of the container ends with a slash, so that members are below it, and the observed resource is the Property of right_s1.
TEST_CASE("Figure 4, corrected: a callback on the rotation of right_s1, as the container lists it", "[examples][paper 5.3][R0.16][R1.8]") {
  Robot robot;
  const Answer made = robot.ask("GET /baxter/right_s1/rotation\nUpgrade: callback\nCallback: http://www.example.org/receiver\nAccept: text/turtle");
  REQUIRE(made.status == 201);
  const std::string member = made.field("Location"), container = std::string(base) + "right_s1/subscriptions";
  REQUIRE(member.compare(0, container.size() + 1, container + "/") == 0);
  const Answer listed = robot.get("/baxter/right_s1/subscriptions");
  CHECK(missing(listed,
                "<right_s1/subscriptions> a ldp:Container ; ldp:contains <" + member + "> . <" + member +
                    "> a hybrit:Subscription , hybrit:WebCallback ;"
                    "  hybrit:onResource <right_s1/rotation> ; hybrit:callbackURL \"http://www.example.org/receiver\"^^xsd:anyURI ;"
                    "  hybrit:mediaType \"text/turtle\" ; dcterms:identifier \"" +
                    member.substr(container.size() + 1) + "\" .",
                base) == "");
  for (int i = 0; i < 300; ++i) robot.step();
  CHECK(robot.get("/baxter/right_s1/subscriptions").tag() == listed.tag());
}

TEST_CASE("Figure 5a, corrected: what rotate takes and how it is invoked", "[examples][R1.10]") {
  Robot robot;
  const Answer a = robot.get("/baxter/right_s1/actions/rotate");
  CHECK(missing(a,
                "<right_s1/actions/rotate> a hybrit:Action , hybrit:AsynchronousAction ; hybrit:binding [ a http-core:Request ;"
                "  http-core:mthd http-methods:POST ; http-core:requestURI <right_s1/actions/rotate> ] .",
                base) == "");
}

TEST_CASE("Figure 5b: 43.6 degrees move the joint", "[examples][R0.7][R0.8]") {
  Robot robot;
  const Answer a = robot.rotate("right_s1", "\"43.6\"^^xsd:float");
  CHECK(a.status == 204);
  const std::string location = a.field("Location");
  REQUIRE(location.find("http://example.org/baxter/right_s1/actions/rotate/") == 0);
  robot.step();
  CHECK(robot.status(location) == "running");
  for (int i = 0; i < 300; ++i) robot.step();
  const lrt::rdf::Graph graph = robot.get(location.substr(18)).graph();
  const double progress = std::stod(std::string(graph.object(lrt::rdf::iri(location), lrt::vocab::lrt_::progress).value().text));
  CHECK(progress > 0);
  CHECK(progress < 1);
  for (int i = 0; i < 60'000 && robot.arm.moving(baxter::right_s1); ++i) robot.step();
  robot.step();
  CHECK(robot.status(location) == "succeeded");
  CHECK(robot.arm.position(baxter::right_s1) == Approx(43.6 * pi / 180));
  const lrt::rdf::Graph rotation = robot.get("/baxter/right_s1/rotation").graph();
  const auto angle = rotation.object(lrt::rdf::iri("http://example.org/baxter/right_s1/rotation"), lrt::vocab::spatial::rotationAngle).value();
  CHECK(std::stof(std::string(rotation.object(angle, lrt::vocab::vom::numericalValue).value().text)) == Approx(0.76096F));
}

TEST_CASE("a negative angle is taken: the range is that of the joint", "[examples][R0.8]") {
  Robot robot;
  const Answer a = robot.rotate("right_s1", "-10");
  CHECK(a.status == 204);
  for (int i = 0; i < 60'000 && (i < 10 || robot.arm.moving(baxter::right_s1)); ++i) robot.step();
  robot.step();
  CHECK(robot.status(a.field("Location")) == "succeeded");
  CHECK(robot.arm.position(baxter::right_s1) == Approx(-10 * pi / 180));
}

TEST_CASE("what rotate does not take is 422 and the arm does not move", "[examples][R0.6]") {
  Robot robot;
  const auto refused = [&](const std::string& value, const std::string& unit = "vom:unit maths:Degree") {
    const Answer a = robot.rotate("right_s1", value, unit);
    CAPTURE(value, unit, a.body);
    CHECK(a.status == 422);
    CHECK(a.links_to("http://example.org" + bounds_of(robot, "/baxter/right_s1", "http://example.org"), "http://www.w3.org/ns/ldp#constrainedBy"));
    for (int i = 0; i < 100; ++i) robot.step();
    CHECK(robot.arm.position(baxter::right_s1) == 0);
    CHECK_FALSE(robot.get("/baxter/right_s1/actions/rotate").says("lrt:invocation"));
  };
  refused("59.99");  // the limit is 1.047 rad, 59.988 degrees
  refused("-123.02");
  refused("350");
  refused("\"fast\"");
  refused("\"NaN\"^^xsd:float");
  refused("43.6", "");
  refused("43.6", "vom:unit maths:Radian");
  refused("43.6", "vom:unit vom:Degree");  // the misprint of Figure 5b
  refused("43.6 , 50");
}

TEST_CASE("cancelling an invocation stops the arm, a newer one takes over", "[examples][R0.5]") {
  Robot robot;
  const std::string first = robot.rotate("right_s1", "43.6").field("Location");
  for (int i = 0; i < 300; ++i) robot.step();
  CHECK(robot.arm.moving(baxter::right_s1));
  CHECK(robot.ask("DELETE " + first.substr(18)).status == 204);
  for (int i = 0; i < 5'000; ++i) robot.step();
  CHECK_FALSE(robot.arm.moving(baxter::right_s1));
  CHECK(robot.arm.position(baxter::right_s1) > 0);
  CHECK(robot.arm.position(baxter::right_s1) < 43 * pi / 180);
  CHECK(robot.status(first) == "cancelled");

  const std::string second = robot.rotate("right_s1", "50").field("Location");
  for (int i = 0; i < 100; ++i) robot.step();
  const std::string third = robot.rotate("right_s1", "20").field("Location");
  for (int i = 0; i < 20'000 && (i < 10 || robot.arm.moving(baxter::right_s1)); ++i) robot.step();
  robot.step();
  CHECK(robot.status(second) == "cancelled");
  CHECK(robot.status(third) == "succeeded");
  CHECK(robot.arm.position(baxter::right_s1) == Approx(20 * pi / 180));
}

TEST_CASE("friction is read and written, within its bounds", "[examples][R0.5]") {
  Robot robot;
  CHECK(missing(robot.get("/baxter/right_s1/friction"), "<right_s1/friction> a hybrit:Property ; vom:numericalValue \"0.7\"^^xsd:double .", base) ==
        "");
  const auto put = [&](const std::string& value) {
    return robot
        .ask("PUT /baxter/right_s1/friction\nContent-Type: text/turtle\n\n<> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> " + value +
             " ; <http://qudt.org/schema/qudt/hasUnit> <http://qudt.org/vocab/unit/N-M-SEC-PER-RAD> .")
        .status;
  };
  CHECK(put("0.9") == 204);
  CHECK(robot.arm.friction(baxter::right_s1) == 0.9);
  CHECK(put("-0.1") == 422);
  CHECK(put("1e9") == 422);
  CHECK(robot.arm.friction(baxter::right_s1) == 0.9);
}

TEST_CASE("a position that is written is where the joint goes, within its limits, and a rotation that was under way fails", "[examples][R0.5]") {
  Robot robot;
  const auto put = [&](const std::string& value) {
    return robot.ask("PUT /baxter/right_s1/position\nContent-Type: application/json\n\n" + value).status;
  };
  const std::string location = robot.rotate("right_s1", "43.6").field("Location");
  for (int i = 0; i < 100; ++i) robot.step();
  CHECK(robot.status(location) == "running");
  CHECK(put("1.0471") == 422);
  CHECK(robot.status(location) == "running");
  CHECK(put("-0.5") == 204);
  CHECK(robot.status(location) == "failed");
  for (int i = 0; i < 20'000 && robot.arm.moving(baxter::right_s1); ++i) robot.step();
  CHECK(robot.arm.position(baxter::right_s1) == -0.5);
}

TEST_CASE("seven joints and the links around them are reached from the root by links and triples alone", "[examples][R0.3][R0.4][R0.9][R1.7]") {
  Robot robot;
  std::set<std::string> by_links = {"http://example.org/"}, by_triples = {"http://example.org/"};
  const auto walk = [&](std::set<std::string>& seen, auto next) {
    std::vector<std::string> open(seen.begin(), seen.end());
    while (!open.empty()) {
      const std::string at = open.back();
      open.pop_back();
      const Answer a = robot.get(at.substr(18));
      CAPTURE(at);
      REQUIRE(a.status == 200);
      for (std::string target : next(a)) {
        target = target.substr(0, target.find('#'));
        if (target.find("http://example.org/") == 0 && seen.insert(target).second) open.push_back(target);
      }
    }
  };
  walk(by_links, [](const Answer& a) { return a.linked("related"); });
  walk(by_triples, [](const Answer& a) {
    std::vector<std::string> all;
    const lrt::rdf::Graph graph = a.graph();
    for (const lrt::rdf::Triple& t : graph.triples())
      if (graph.term(t.object).is_iri()) all.emplace_back(graph.term(t.object).text);
    return all;
  });
  for (const lrt::urdf::Joint& j : robot.model.joints) {
    const std::string joint = base + j.name;
    for (const char* part : {"", "/state", "/rotation", "/position", "/friction", "/jointReferenceFrame", "/actions/rotate", "/subscriptions"}) {
      CAPTURE(joint, part);
      CHECK(by_links.count(joint + part) == 1);
      CHECK(by_triples.count(joint + part) == 1);
    }
    CHECK(by_links.count(base + robot.model.links[j.child].name) == 1);
  }
  for (const std::string& target : by_links) {
    CAPTURE(target);
    CHECK(by_triples.count(target) == 1);
  }
}

TEST_CASE("every Thing of Baxter conforms to its blueprint", "[examples][R1.11]") {
  Robot robot;
  std::vector<std::string> things = {"/baxter"};
  for (const lrt::urdf::Joint& joint : robot.model.joints) things.push_back("/baxter/" + joint.name);
  for (const lrt::urdf::Link& link : robot.model.links) things.push_back("/baxter/" + link.name);
  for (const std::string& thing : things) {
    CAPTURE(thing);
    CHECK(violations([&](const std::string& path) { return robot.get(path); }, thing, "http://example.org") == "");
  }
}

namespace {

/// A body for moveTo: each angle as `rotate` takes it.
std::string angles(const std::array<double, baxter::joint_count>& degrees) {
  std::string body = "POST /baxter/actions/moveTo\nContent-Type: application/json\n\n{";
  for (std::size_t i = 0; i < degrees.size(); ++i)
    body += std::string(i ? "," : "") + '"' + baxter::RightArm::name(i) + "\":" + std::to_string(degrees[i]);
  return body + "}";
}

double progress(Robot& robot, const std::string& location) {
  const lrt::rdf::Graph graph = robot.get(location.substr(18)).graph();
  return std::stod(std::string(graph.object(lrt::rdf::iri(location), lrt::vocab::lrt_::progress).value().text));
}

bool is_moving(const baxter::RightArm& arm) {
  for (std::size_t i = 0; i < baxter::joint_count; ++i)
    if (arm.moving(i)) return true;
  return false;
}

}  // namespace

TEST_CASE("rotate says which property it changes, and how; its effect holds when it has succeeded", "[examples][R1.10]") {
  Robot robot;
  const Answer action = robot.get("/baxter/right_s1/actions/rotate");
  CHECK(missing(action,
                "<right_s1/actions/rotate> hybrit:produces <right_s1/actions/rotate#effect-1> , <right_s1/actions/rotate#effect-2> ;"
                " hybrit:consumes _:input ."
                "<right_s1/actions/rotate#effect-1> a sh:NodeShape ; <http://www.w3.org/ns/sosa/forProperty> <right_s1/position> ;"
                " sh:node _:position ; lrt:valueFrom _:input ; lrt:tolerance <right_s1/actions/rotate#effect-1.tolerance> ."
                "<right_s1/actions/rotate#effect-1.tolerance> a maths:Scalar ; vom:numericalValue \"1e-06\"^^xsd:double ; vom:unit maths:Radian ."
                "<right_s1/actions/rotate#effect-2> <http://www.w3.org/ns/sosa/forProperty> <right_s1/rotation> ; sh:node _:rotation .",
                base) == "");
  CHECK(robot.rotate("right_s1", "43.6").status == 204);
  for (int i = 0; i < 60'000 && (i < 10 || robot.arm.moving(baxter::right_s1)); ++i) robot.step();
  const auto compiled =
      lrt::shacl::Shapes::compile(together(robot.get(bounds_of(robot, "/baxter/right_s1", "http://example.org")).graph(), action.graph()));
  REQUIRE(compiled);
  const std::string joint = std::string(base) + "right_s1";
  const lrt::rdf::Graph state = robot.get("/baxter/right_s1/rotation").graph();
  const auto report = lrt::shacl::validate(*compiled, state, lrt::rdf::iri(joint + "/rotation"), lrt::rdf::iri(joint + "/actions/rotate#effect-2"));
  REQUIRE(report);
  INFO(report->to_text());
  CHECK(report->conforms());
}

TEST_CASE("each angle within the limits is taken, and its effect holds, 200 times", "[examples][R1.10]") {
  Robot robot;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> within_limits(-175.26F, 175.26F);
  for (int n = 0; n < 200; ++n) {
    char degrees[32];
    std::snprintf(degrees, sizeof degrees, "%.6f", static_cast<double>(within_limits(random)));
    CAPTURE(degrees);
    const Answer a = robot.rotate("right_w2", degrees);
    REQUIRE(a.status == 204);
    do robot.step();
    while (robot.arm.moving(baxter::right_w2));
    robot.step();
    REQUIRE(robot.status(a.field("Location")) == "succeeded");
    const lrt::rdf::Graph state = robot.get("/baxter/right_w2/position").graph();
    const auto at = state.object(lrt::rdf::iri(std::string(base) + "right_w2/position"), lrt::vocab::vom::numericalValue).value();
    CHECK(std::abs(std::stod(std::string(at.text)) - std::stod(degrees) * pi / 180) <= 1e-6);
  }
}

TEST_CASE("moveTo is composed of the joints' rotate, and takes an angle for each", "[examples][R1.10]") {
  Robot robot;
  const Answer a = robot.get("/baxter/actions/moveTo");
  CHECK(missing(robot.get("/baxter"), "<http://example.org/baxter> hybrit:action <actions/moveTo> .", base) == "");
  for (std::size_t i = 0; i < baxter::joint_count; ++i) {
    const std::string joint = baxter::RightArm::name(i);
    CHECK(missing(a,
                  "<actions/moveTo> a hybrit:AsynchronousAction ; dcterms:hasPart <" + joint +
                      "/actions/rotate> ; hybrit:produces _:effect , _:other ; hybrit:consumes _:input ."
                      "_:effect <http://www.w3.org/ns/sosa/forProperty> <" +
                      joint + "/position> ; lrt:valueFrom _:input ; lrt:inputField _:field . _:other <http://www.w3.org/ns/sosa/forProperty> <" +
                      joint + "/rotation> . <" + joint + "/actions/rotate> a hybrit:Action .",
                  base) == "");
    CHECK(robot.ask("GET /baxter/actions/moveTo\nAccept: application/json")
              .says("\"href\":\"http://example.org/baxter/" + joint + "/actions/rotate\""));
  }
  CHECK(robot.ask(angles({0, 0, 0, 0, 0, 0, 360})).status == 422);
  CHECK(robot.ask(angles({0, 0, 0, -3, 0, 0, 0})).status == 422);  // right_e1 begins at -2.9 degrees
  CHECK(robot.ask("POST /baxter/actions/moveTo\nContent-Type: application/json\n\n{\"right_s0\":1}").status == 422);
  const Answer refused = robot.ask(angles({10, 10, 10, 10, 10, 10, 180}));  // 180 degrees is too far for right_w2
  CHECK(refused.status == 422);
  CHECK(refused.says("right_w2"));
  CHECK_FALSE(is_moving(robot.arm));
}

TEST_CASE("moveTo moves all joints, its progress is theirs, and it ends with the last", "[examples][R0.8]") {
  Robot robot;
  const std::array<double, baxter::joint_count> target = {10, -10, 20, 30, -20, 5, 0};
  const Answer a = robot.ask(angles(target));
  REQUIRE(a.status == 204);
  const std::string location = a.field("Location");
  robot.step();
  for (std::size_t i = 0; i + 1 < baxter::joint_count; ++i) CHECK(robot.arm.moving(i));
  double last = 0;
  bool one_rests = false, others_move = false;
  for (int n = 0; n < 1'000 && is_moving(robot.arm); ++n) {
    for (int i = 0; i < 50; ++i) robot.step();
    const double now = progress(robot, location);
    CHECK(now >= last);
    last = now;
    if (!is_moving(robot.arm)) break;
    one_rests |= !robot.arm.moving(baxter::right_s0);
    others_move = true;
    CHECK(now > 0);
    CHECK(now < 1);
    CHECK(robot.status(location) == "running");
  }
  CHECK((one_rests && others_move));
  robot.step();
  CHECK(robot.status(location) == "succeeded");
  CHECK(progress(robot, location) == 1);
  for (std::size_t i = 0; i < baxter::joint_count; ++i) CHECK(robot.arm.position(i) == Approx(target[i] * pi / 180).margin(1e-9));
}

TEST_CASE("cancelling moveTo stops all joints", "[examples][R0.5]") {
  Robot robot;
  const std::string location = robot.ask(angles({40, 40, 40, 40, 40, 40, 40})).field("Location");
  for (int i = 0; i < 200; ++i) robot.step();
  CHECK(is_moving(robot.arm));
  CHECK(robot.ask("DELETE " + location.substr(18)).status == 204);
  for (int i = 0; i < 5'000; ++i) robot.step();
  CHECK_FALSE(is_moving(robot.arm));
  CHECK(robot.status(location) == "cancelled");
  for (std::size_t i = 0; i < baxter::joint_count; ++i) CHECK(robot.arm.position(i) < 39 * pi / 180);
}

TEST_CASE("a command to one joint takes over from moveTo, which fails and stops the others", "[examples][R0.5]") {
  Robot robot;
  const std::string location = robot.ask(angles({40, 40, 40, 40, 40, 40, 40})).field("Location");
  for (int i = 0; i < 200; ++i) robot.step();
  const std::string rotate = robot.rotate("right_s1", "20").field("Location");
  CHECK(robot.status(location) == "failed");
  CHECK(robot.get(location.substr(18)).says("right_s1 was given another target"));
  for (int i = 0; i < 20'000 && is_moving(robot.arm); ++i) robot.step();
  robot.step();
  CHECK(robot.status(rotate) == "succeeded");
  CHECK(robot.arm.position(baxter::right_s1) == Approx(20 * pi / 180));
  CHECK(robot.arm.position(baxter::right_s0) < 39 * pi / 180);

  // And the other way round.
  const std::string again = robot.rotate("right_s1", "50").field("Location");
  for (int i = 0; i < 100; ++i) robot.step();
  const std::string all = robot.ask(angles({5, 5, 5, 5, 5, 5, 5})).field("Location");
  CHECK(robot.status(again) == "failed");
  CHECK(robot.status(all) == "running");
}
