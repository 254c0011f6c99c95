// SPDX-License-Identifier: Apache-2.0
#include <lrt/urdf.hpp>

#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <type_traits>

#include <Eigen/Core>

#include <lrt/shacl/validator.hpp>

#include "tests/support/allocations.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"
#include "tests/support/skip.hpp"
#include "tests/urdf/documents.hpp"
#include "tests/urdf/kinematics.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

urdf::ParseOptions options_for(const std::string& file) {
  urdf::ParseOptions options;
  if (file.find("turtlebot3") != std::string::npos) options.arguments["namespace"] = "";
  return options;
}

/// The small robots and the real ones that are present.
std::vector<std::string> all_files() {
  std::vector<std::string> files = {picker_file, arm_file};
  for (const RealRobot& robot : all_real_robots) {
    if (std::ifstream(real_robots + robot.file)) files.push_back(real_robots + robot.file);
    else print_skip(real_robots + robot.file + " is not there");
  }
  return files;
}

/// One configuration within the limits.
std::vector<double> some_positions(const urdf::Model& model, std::mt19937& random) {
  std::vector<double> positions;
  for (const std::size_t j : model.variables) {
    const auto& limits = model.joints[j].limits;
    const bool bounded = limits && limits->lower && limits->upper;
    positions.push_back(std::uniform_real_distribution<double>(bounded ? *limits->lower : -4, bounded ? *limits->upper : 4)(random));
  }
  return positions;
}

/// The largest difference of positions [m] and of rotation matrices.
std::pair<double, double> difference(const urdf::Pose& pose, const ReferenceKinematics::Matrix& m) {
  const auto& [x, y, z, w] = pose.orientation;
  const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  double position = 0, orientation = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    position = std::max(position, std::abs(pose.position[i] - m[i][3]));
    for (std::size_t k = 0; k < 3; ++k) orientation = std::max(orientation, std::abs(r[i][k] - m[i][k]));
  }
  return {position, orientation};
}

std::size_t find_link(const urdf::Model& model, const std::string& name) {
  for (std::size_t l = 0; l < model.links.size(); ++l)
    if (model.links[l].name == name) return l;
  throw std::runtime_error(name);
}

double number_at(Bench& bench, const std::string& path) {
  return std::stod(std::string(bench.get(path).graph().object(rdf::iri("http://localhost" + path), vocab::vom::numericalValue).value().text));
}

}  // namespace

TEST_CASE("real robots load with the right number of links and joints", "[urdf]") {
  for (const RealRobot& expected : all_real_robots) {
    const std::string file = real_robots + expected.file;
    if (!std::ifstream(file)) continue;
    CAPTURE(file);
    const auto robot = urdf::load(file, options_for(file));
    REQUIRE(robot);
    CHECK(robot->model().links.size() == expected.links);
    CHECK(robot->model().joints.size() == expected.joints);
    CHECK(robot->model().variables.size() == expected.variables);
    const ReferenceKinematics other(file, "${namespace}");
    REQUIRE(other.links.size() == expected.links);
    REQUIRE(other.joints.size() == expected.joints);
    for (std::size_t l = 0; l < expected.links; ++l) CHECK(robot->model().links[l].name == other.links[l]);
    for (std::size_t j = 0; j < expected.joints; ++j) CHECK(robot->model().joints[j].name == other.joints[j]);
  }
  const std::string turtlebot = real_robots + "turtlebot3_burger.urdf";
  if (std::ifstream(turtlebot))
    CHECK(urdf::load(turtlebot).error().message.find("or give ParseOptions::arguments a value for the name") != std::string::npos);
}

TEST_CASE("the poses of all links equal those of an independent computation, in 1,000 configurations of each robot", "[urdf]") {
  std::mt19937 random(20261121);
  for (const std::string& file : all_files()) {
    CAPTURE(file);
    auto robot = urdf::load(file, options_for(file));
    REQUIRE(robot);
    const urdf::Model& model = robot->model();
    const ReferenceKinematics reference(file, "${namespace}");
    double position = 0, orientation = 0;
    for (int i = 0; i < 1000; ++i) {
      const std::vector<double> q = some_positions(model, random);
      ReferenceKinematics::Positions named;
      for (std::size_t v = 0; v < q.size(); ++v) named[model.joints[model.variables[v]].name] = q[v];
      robot->publish(q);
      for (std::size_t l = 0; l < model.links.size(); ++l) {
        const auto [p, o] = difference(robot->pose(l), reference.pose(model.links[l].name, named));
        position = std::max(position, p);
        orientation = std::max(orientation, o);
      }
    }
    CHECK(position < 1e-9);
    CHECK(orientation < 1e-9);
  }
}

TEST_CASE("every Thing conforms to its blueprint, before and after it moves", "[urdf][R1.11]") {
  for (const std::string& file : all_files()) {
    auto robot = urdf::load(file, options_for(file));
    REQUIRE(robot);
    Bench bench;
    REQUIRE(robot->add_to(bench.engine));
    std::vector<std::string> paths = {robot->path()};
    for (std::size_t j = 0; j < robot->model().joints.size(); ++j) paths.push_back(robot->joint_path(j));
    for (std::size_t l = 0; l < robot->model().links.size(); ++l) paths.push_back(robot->link_path(l));
    std::mt19937 random(1);
    const std::vector<double> velocities(robot->model().variables.size(), 0.5);
    std::size_t checked = 0;
    for (int round = 0; round < 2; ++round) {
      for (const std::string& path : paths) {
        CAPTURE(file, path, round);
        const Answer state = bench.get("/" + path + "/state");
        REQUIRE(state.status == 200);
        CHECK(violations([&](const std::string& p) { return bench.get(p); }, "/" + path) == "");
        ++checked;
      }
      robot->publish(some_positions(robot->model(), random), velocities, velocities);
      bench.look();
    }
    CHECK(checked == 2 * paths.size());
  }
}

TEST_CASE("the Panda's flange is at the pose given by its maker's Denavit-Hartenberg parameters", "[urdf]") {
  const std::string file = real_robots + "panda.urdf";
  if (!std::ifstream(file)) {
    print_skip(file + " is not there");
    return;
  }
  // Craig's convention: of each axis a [m] and alpha [rad] before it, d [m] along it.
  constexpr double half_pi = 1.57079632679489662;
  constexpr double table[8][3] = {{0, 0, 0.333},   {0, -half_pi, 0},    {0, half_pi, 0.316}, {0.0825, half_pi, 0}, {-0.0825, -half_pi, 0.384},
                                  {0, half_pi, 0}, {0.088, half_pi, 0}, {0, 0, 0.107}};
  auto robot = urdf::load(file).value();
  std::mt19937 random(20261122);
  double position = 0, orientation = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::vector<double> q = some_positions(robot.model(), random);
    robot.publish(q);
    ReferenceKinematics::Matrix expected{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    for (std::size_t j = 0; j < 8; ++j) {
      const double a = table[j][0], alpha = table[j][1], d = table[j][2], theta = j < 7 ? q[j] : 0;
      const double c = std::cos(theta), s = std::sin(theta), ca = std::cos(alpha), sa = std::sin(alpha);
      expected =
          ReferenceKinematics::product(expected, {{{c, -s, 0, a}, {s * ca, c * ca, -sa, -d * sa}, {s * sa, c * sa, ca, d * ca}, {0, 0, 0, 1}}});
    }
    const auto [p, o] = difference(robot.pose(find_link(robot.model(), "panda_link8")), expected);
    position = std::max(position, p);
    orientation = std::max(orientation, o);
  }
  CHECK(position < 1e-9);
  CHECK(orientation < 1e-9);
}

TEST_CASE("the published pose of every link is its pose", "[urdf][R1.9]") {
  std::mt19937 random(7);
  for (const std::string& file : all_files()) {
    CAPTURE(file);
    auto robot = urdf::load(file, options_for(file)).value();
    const urdf::Model& model = robot.model();
    const ReferenceKinematics reference(file, "${namespace}");
    Bench bench;
    robot.add_to(bench.engine).value();
    for (int i = 0; i < 3; ++i) {
      const std::vector<double> q = some_positions(model, random);
      ReferenceKinematics::Positions named;
      for (std::size_t v = 0; v < q.size(); ++v) named[model.joints[model.variables[v]].name] = q[v];
      robot.publish(q);
      bench.look();
      for (std::size_t l = 0; l < model.links.size(); ++l) {
        const std::string body = bench.ask("GET /" + robot.link_path(l) + "/pose\nAccept: application/json").body;
        CAPTURE(body);
        urdf::Pose said;
        auto& p = said.position;
        auto& o = said.orientation;
        REQUIRE(std::sscanf(body.c_str(), R"({"translation":{"x":%lf,"y":%lf,"z":%lf},"rotation":{"x":%lf,"y":%lf,"z":%lf,"w":%lf})", &p[0], &p[1],
                            &p[2], &o[0], &o[1], &o[2], &o[3]) == 7);
        const auto [position, orientation] = difference(said, reference.pose(model.links[l].name, named));
        CHECK(position < 1e-9);
        CHECK(orientation < 1e-9);
      }
    }
  }
}

TEST_CASE("a thousand names with the same path get different paths quickly", "[urdf]") {
  std::string text = "<robot name='r'><link name='root'/>";
  std::string name = "............";
  for (int i = 0; i < 4096; ++i) {  // each a choice of '.' and '/'
    for (std::size_t bit = 0; bit < name.size(); ++bit) name[bit] = (i >> bit) & 1 ? '/' : '.';
    text += "<link name='a" + name + "'/><joint name='a" + name + "' type='fixed'><parent link='root'/><child link='a" + name + "'/></joint>";
  }
  const urdf::Robot robot(urdf::parse(text + "</robot>").value());
  CHECK(robot.joint_path(0) == "r/a............");
  CHECK(robot.joint_path(2) == "r/a............_joint2");
  CHECK(robot.joint_path(4095) == "r/a............_joint4095");
  CHECK(robot.link_path(4096) == "r/a............_link4096");
}

static_assert(std::is_convertible_v<std::vector<double>, urdf::Numbers> && std::is_convertible_v<Eigen::VectorXd, urdf::Numbers>);
static_assert(std::is_convertible_v<decltype(std::declval<Eigen::MatrixXd&>().col(0)), urdf::Numbers>);
static_assert(!std::is_convertible_v<decltype(std::declval<Eigen::MatrixXd&>().row(0)), urdf::Numbers>, "its numbers lie apart");

TEST_CASE("joints and links are Things as in Figure 2b", "[urdf][R1.3][R1.9]") {
  auto robot = urdf::load(picker_file).value();
  Bench bench;
  robot.add_to(bench.engine).value();
  CHECK(missing(bench.get("/picker"),
                "<picker> a hybrit:RoboticThing , ros:Robot ; dcterms:title \"picker\" ; lrt:rootLink <picker/rail> ;"
                "  dcterms:hasPart <picker/rail> , <picker/shoulder> , <picker/left_finger> , <picker/left_finger_link> ; hybrit:property "
                "<picker/positions> ;"
                "  lrt:positionsOf ( <picker/slide> <picker/turret> <picker/shoulder> <picker/elbow> <picker/left_finger> "
                "<picker/right_finger> ) ."
                "<picker/rail> a ros:Link . <picker/shoulder> a ros:Joint , ros:RevoluteJoint .") == "");
  CHECK(missing(bench.get("/picker/shoulder"),
                "<picker/shoulder> a hybrit:RoboticThing , ros:Joint , ros:RevoluteJoint ; dcterms:title \"shoulder\" ; dcterms:isPartOf "
                "<picker> ;"
                "  xhv:prev <picker/column> ; xhv:next <picker/upper_arm> ; ros:preceedingLink <picker/column> ; ros:succeedingLink "
                "<picker/upper_arm> ;"
                "  rdfs:seeAlso <picker> ;"
                "  ros:rotation <picker/shoulder/rotation> ; ros:position <picker/shoulder/position> ; ros:velocity <picker/shoulder/velocity> ;"
                "  ros:effort <picker/shoulder/effort> ; ros:jointReferenceFrame <picker/shoulder/jointReferenceFrame> ; hybrit:property "
                "<picker/shoulder/limits> ,"
                "  <picker/shoulder/axis> , <picker/shoulder/dynamics> , <picker/shoulder/safety> ."
                "<picker/column> a ros:Link . <picker/upper_arm> a ros:Link .") == "");
  CHECK(missing(bench.get("/picker/shoulder/limits"),
                "<picker/shoulder/limits> a lrt:JointLimits ; lrt:lowerLimit [ vom:numericalValue \"-1.2\"^^xsd:double ; vom:unit maths:Radian ] ;"
                "  lrt:velocityLimit [ vom:numericalValue \"1.5\"^^xsd:double ; qudt:hasUnit unit:RAD-PER-SEC ] .") == "");
  CHECK(missing(bench.get("/picker/slide/limits"),
                "<picker/slide/limits> lrt:upperLimit [ vom:numericalValue \"0.5\"^^xsd:double ; qudt:hasUnit unit:M ] .") == "");
  CHECK(missing(bench.get("/picker/right_finger"),
                "<picker/right_finger> a ros:PrismaticJoint ; lrt:mimics <picker/left_finger> ; ros:succeedingLink "
                "<picker/right_finger_link> .") == "");
  CHECK_FALSE(bench.get("/picker/slide").says("rotation>"));
  CHECK(missing(bench.get("/picker/hand"),
                "<picker/hand> a ros:Link ; xhv:prev <picker/flange> ; xhv:next <picker/left_finger> , <picker/right_finger> ; lrt:pose "
                "<picker/hand/pose> .") == "");
  CHECK(missing(bench.get("/picker/left_finger_link"), "<picker/left_finger_link> a ros:Link ; dcterms:title \"left_finger\" .") == "");
  CHECK(missing(bench.get("/picker/left_finger_link/visual/1"),
                "<picker/left_finger_link/visual/1> lrt:mesh <package://picker/meshes/finger.stl> ; lrt:frame <picker/left_finger_link> .") == "");
  CHECK(bench.get("/picker/hand/pose").status == 200);
  CHECK(missing(bench.get("/picker/hand/pose"),
                "<picker/hand/pose> spatial:sourceCoordinateSystem <picker/rail> ; spatial:targetCoordinateSystem <picker/hand> .") == "");
  CHECK(missing(bench.get("/picker/shoulder/jointReferenceFrame"),
                "<picker/shoulder/jointReferenceFrame> a maths:CoordinateSystem , spatial:SpatialRelationship ; spatial:sourceCoordinateSystem "
                "<picker/column> ;"
                "  spatial:targetCoordinateSystem <picker/shoulder/jointReferenceFrame> .") == "");
}

TEST_CASE("one predicate finds a quantity of every joint and link of every robot", "[urdf][R1.5][R1.9]") {
  for (const std::string& file : all_files()) {
    CAPTURE(file);
    auto robot = urdf::load(file, options_for(file)).value();
    Bench bench;
    robot.add_to(bench.engine).value();
    robot.publish(std::vector<double>(robot.model().variables.size(), 0));
    bench.look();
    // From a Thing to the numbers that are two predicates away.
    const auto numbers = [&](const std::string& path, Iri property, Iri quantity) {
      const rdf::Graph state = bench.get("/" + path + "/state").graph();
      std::vector<double> found;
      const std::string self = "http://localhost/" + path;
      for (const rdf::TermView& p : state.objects(rdf::iri(self), property))
        for (const rdf::TermView& q : state.objects(p, quantity))
          found.push_back(std::stod(std::string(state.object(q, vocab::vom::numericalValue).value().text)));
      return found;
    };
    const auto expected = [](const auto& optional) { return optional ? std::vector<double>{*optional} : std::vector<double>{}; };
    const urdf::Model& model = robot.model();
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const urdf::Joint& joint = model.joints[j];
      const urdf::Limits limits = joint.limits.value_or(urdf::Limits{});
      const std::string& path = robot.joint_path(j);
      CHECK(numbers(path, vocab::lrt_::limits, vocab::lrt_::lowerLimit) == expected(limits.lower));
      CHECK(numbers(path, vocab::lrt_::limits, vocab::lrt_::upperLimit) == expected(limits.upper));
      CHECK(numbers(path, vocab::lrt_::limits, vocab::lrt_::velocityLimit) == expected(limits.velocity));
      CHECK(numbers(path, vocab::lrt_::limits, vocab::lrt_::effortLimit) == expected(limits.effort));
      CHECK(numbers(path, vocab::lrt_::dynamics, vocab::lrt_::damping).size() == joint.dynamics.has_value());
      CHECK(numbers(path, vocab::lrt_::dynamics, vocab::lrt_::staticFriction).size() == joint.dynamics.has_value());
      CHECK(numbers(path, vocab::lrt_::safety, vocab::lrt_::softUpperLimit).size() == joint.safety.has_value());
      CHECK(numbers(path, vocab::lrt_::mimic, vocab::lrt_::offset).size() == joint.mimic.has_value());
    }
    for (std::size_t l = 0; l < model.links.size(); ++l) {
      const auto& inertial = model.links[l].inertial;
      CHECK(numbers(robot.link_path(l), vocab::lrt_::inertial, vocab::lrt_::mass) ==
            (inertial ? std::vector<double>{inertial->mass} : std::vector<double>{}));
      CHECK(numbers(robot.link_path(l), vocab::lrt_::inertial, vocab::lrt_::izz).size() == inertial.has_value());
    }
  }
}

TEST_CASE("no predicate and no class of a robot description is private to its Thing", "[urdf][R1.5]") {
  for (const std::string& file : all_files()) {
    CAPTURE(file);
    auto robot = urdf::load(file, options_for(file)).value();
    Bench bench;
    robot.add_to(bench.engine).value();
    robot.publish(std::vector<double>(robot.model().variables.size(), 0));
    bench.look();
    std::vector<std::string> paths = {robot.path()};
    for (std::size_t j = 0; j < robot.model().joints.size(); ++j) paths.push_back(robot.joint_path(j));
    for (std::size_t l = 0; l < robot.model().links.size(); ++l) paths.push_back(robot.link_path(l));
    for (const std::string& path : paths) {
      const rdf::Graph state = bench.get("/" + path + "/state").graph();
      const std::string name = "http://localhost/" + path;
      const rdf::TermView self = rdf::iri(name);
      for (const rdf::Triple& t : state.triples()) {
        const rdf::TermView term = state.term(state.term(t.predicate) == rdf::TermView(vocab::rdf_::type) ? t.object : t.predicate);
        CAPTURE(term.text);
        const bool is_kind = term.text.substr(0, 28) == "http://localhost/blueprints/";  // of other Things, too
        CHECK((is_kind || term.text.substr(0, 17) != "http://localhost/"));
      }
      for (const rdf::TermView& property : state.objects(self, vocab::hybrit::property)) {
        const auto links = state.match(state.find(self), std::nullopt, state.find(property));
        CAPTURE(property.text);
        CHECK(std::distance(links.begin(), links.end()) >= 2);  // hybrit:property and a predicate of its own
      }
    }
  }
}

TEST_CASE("published positions are shown, copied by mimic joints and converted into poses", "[urdf]") {
  auto robot = urdf::load(picker_file).value();
  Bench bench;
  robot.add_to(bench.engine).value();
  robot.publish(std::array<double, 5>{0.25, 0, 0, 0.1, 0.03}, std::vector<double>{0, 0, 0, 0, 0.01}, std::vector<double>{7});
  bench.look();
  CHECK(number_at(bench, "/picker/slide/position") == 0.25);
  CHECK(number_at(bench, "/picker/slide/effort") == 7);
  CHECK(number_at(bench, "/picker/right_finger/position") == 0.03);
  CHECK(number_at(bench, "/picker/right_finger/velocity") == 0.01);
  CHECK(missing(bench.get("/picker/elbow/rotation"),
                "<picker/elbow/rotation> a spatial:AxisAngle , hybrit:Property ; lrt:frame <picker/forearm> ;"
                "  spatial:rotationAngle [ a maths:Scalar ; vom:numericalValue \"0.1\"^^xsd:float ; vom:unit maths:Radian ] ;"
                "  spatial:rotationAxis [ a maths:Vector3D ; maths:x \"0\"^^xsd:float ; maths:y \"1\"^^xsd:float ; maths:z \"0\"^^xsd:float ] .") ==
        "");
  const std::size_t carriage = find_link(robot.model(), "carriage");
  CHECK(robot.pose(carriage).position == std::array<double, 3>{0.25, 0, 0.1});
  CHECK(missing(bench.get("/picker/carriage/pose"),
                "<picker/carriage/pose> spatial:translation [ qudt:hasUnit unit:M ; vom:quantityValue [ maths:x \"0.25\"^^xsd:double ;"
                "  maths:y \"0\"^^xsd:double ; maths:z \"0.1\"^^xsd:double ] ] .") == "");
  CHECK(missing(bench.get("/picker/positions"),
                "<picker/positions> rdf:value ( \"0.25\"^^xsd:double \"0\"^^xsd:double \"0\"^^xsd:double "
                "\"0.1\"^^xsd:double \"0.03\"^^xsd:double \"0.03\"^^xsd:double ) .") == "");
}

TEST_CASE("joints start at 0 or at the nearest limit, and missing or non-finite numbers change nothing", "[urdf]") {
  auto robot = urdf::load(picker_file).value();
  Bench bench;
  robot.add_to(bench.engine).value();
  CHECK(bench.get("/picker/elbow/position").says("numericalValue") == false);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  robot.publish(std::vector<double>{nan, 1});
  bench.look();
  CHECK(number_at(bench, "/picker/slide/position") == 0);
  CHECK(number_at(bench, "/picker/turret/position") == 1);
  CHECK(number_at(bench, "/picker/elbow/position") == 0.1);
  robot.publish({});
  bench.look();
  CHECK(number_at(bench, "/picker/turret/position") == 1);
  for (std::size_t l = 0; l < robot.model().links.size(); ++l) CHECK(std::isfinite(robot.pose(l).position[0]));
}

TEST_CASE("a limit on one side bounds that side", "[urdf][R1.11]") {
  urdf::Robot robot(urdf::parse(two_links("revolute", "<limit lower='0.5' upper='inf' velocity='1' effort='1'/>")).value());
  const urdf::Limits limits = *robot.model().joints[0].limits;
  CHECK(limits.clamp(0) == 0.5);
  CHECK(limits.clamp(1e9) == 1e9);
  robot.position(0).on_write([](double) {});
  Bench bench;
  robot.add_to(bench.engine).value();
  robot.publish({});
  bench.look();
  CHECK(number_at(bench, "/r/j/position") == 0.5);
  CHECK(bench.turtle("PUT", "/r/j/position", number_body("0.4", "maths:Radian")).status == 422);
  CHECK(bench.turtle("PUT", "/r/j/position", number_body("1e9", "maths:Radian")).status == 204);
}

TEST_CASE("a joint with an unreadable limit, or with its limits exchanged, is shown, and takes no commands", "[urdf][R0.5]") {
  const std::string limits = GENERATE("lower='-1,5' upper='1'", "lower='1' upper='-1'");
  urdf::Robot robot(urdf::parse(two_links("revolute", "<limit " + limits + " velocity='1' effort='1'/>")).value());
  robot.position(0).on_write([](double) {});
  Bench bench;
  robot.add_to(bench.engine).value();
  robot.publish(std::vector<double>{0.25});
  bench.look();
  CHECK(number_at(bench, "/r/j/position") == 0.25);
  CHECK(bench.turtle("PUT", "/r/j/position", number_body("0.4", "maths:Radian")).status == 405);
}

TEST_CASE("floating and planar joints are moved by a pose", "[urdf]") {
  for (const std::string type : {"floating", "planar"}) {
    urdf::Robot robot(urdf::parse(two_links(type, "<origin xyz='1 0 0' rpy='0 0 1.5707963267948966'/>")).value());
    robot.move(0, {{2, 0, 0}, {0, 0, 0, 1}});
    robot.publish({});
    const urdf::Pose pose = robot.pose(1);
    CHECK(pose.position[0] == Approx(1));
    CHECK(pose.position[1] == Approx(2));
  }
  urdf::Robot fixed(urdf::parse(two_links()).value());
  fixed.move(0, {{2, 0, 0}, {0, 0, 0, 1}});
  fixed.publish({});
  CHECK(fixed.pose(1).position[0] == 0);
  urdf::Robot free(urdf::parse(two_links("floating")).value());
  free.move(0, {{1, 0, 0}, {0, 0, 0, 1}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const urdf::Pose& wrong : {urdf::Pose{{nan, 0, 0}, {0, 0, 0, 1}}, {{2, 0, 0}, {0, 0, 0, 2}}, {{2, 0, 0}, {nan, 0, 0, 1}}}) free.move(0, wrong);
  free.publish({});
  CHECK(free.pose(1).position == std::array<double, 3>{1, 0, 0});
}

TEST_CASE("a mimic of a mimic follows the first", "[urdf]") {
  urdf::Robot robot(
      urdf::parse("<robot name='r'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>"
                  "<joint name='z' type='prismatic'><parent link='a'/><child link='d'/><limit velocity='1' effort='1' lower='-9' upper='9'/>"
                  "<mimic joint='y' multiplier='2' offset='1'/></joint>"
                  "<joint name='y' type='prismatic'><parent link='a'/><child link='c'/><limit velocity='1' effort='1' lower='-9' upper='9'/>"
                  "<mimic joint='x' multiplier='-3' offset='0.5'/></joint>"
                  "<joint name='x' type='prismatic'><parent link='a'/><child link='b'/><limit velocity='1' effort='1' lower='-9' "
                  "upper='9'/></joint></robot>")
          .value());
  robot.publish(std::vector<double>{1});
  CHECK(robot.pose(1).position[0] == 1);
  CHECK(robot.pose(2).position[0] == -2.5);
  CHECK(robot.pose(3).position[0] == -4);
}

TEST_CASE("every name gets a unique path", "[urdf][R0.3]") {
  const std::string names[] = {"state", "ein Gelenk \xC3\xA4?#%", "a/b", "a.b", "..", "<&>", "positions"};
  std::string text = "<robot name='my robot/1'><link name='root'/>";
  for (std::string name : names) {
    if (name == "<&>") name = "&lt;&amp;&gt;";
    text += "<link name='" + name + "'/><joint name='" + name + "' type='continuous'><parent link='root'/><child link='" + name + "'/></joint>";
  }
  urdf::Robot robot(urdf::parse(text + "</robot>").value());
  CHECK(robot.path() == "my robot.1");
  CHECK(robot.joint_path(0) == "my robot.1/state");
  CHECK(robot.link_path(1) == "my robot.1/state_link");
  CHECK(robot.joint_path(2) == "my robot.1/a.b");
  CHECK(robot.joint_path(3) == "my robot.1/a.b_joint");
  Bench bench;
  REQUIRE(robot.add_to(bench.engine));
  CHECK(missing(bench.get("/my%20robot.1/ein%20Gelenk%20%C3%A4%3F%23%25"),
                "<my%20robot.1/ein%20Gelenk%20%C3%A4%3F%23%25> a ros:ContinuousJoint ; dcterms:title \"ein Gelenk \xC3\xA4?#%\" .") == "");
  CHECK(missing(bench.get("/my%20robot.1"),
                "<my%20robot.1> dcterms:hasPart <my%20robot.1/%3C&%3E> , <my%20robot.1/%3C&%3E_link> , <my%20robot.1/.._> .") == "");
}

TEST_CASE("meshes with an IRI are links, others are names", "[urdf]") {
  const auto mesh = [](const std::string& name) {
    urdf::Robot robot(
        urdf::parse("<robot name='r'><link name='a'><visual><geometry><mesh filename='" + name + "'/></geometry></visual></link></robot>").value());
    Bench bench;
    robot.add_to(bench.engine).value();
    const Answer a = bench.get("/r/a/visual/1\nAccept: application/n-triples");
    const std::size_t at = a.body.find("ns#mesh> ");
    return a.body.substr(at + 9, a.body.find(" .\n", at) - at - 9);
  };
  CHECK(mesh("package://p/my m%20esh%.stl") == "<package://p/my%20m%20esh%25.stl>");
  CHECK(mesh("file:///tmp/{a}.stl") == "<file:///tmp/%7Ba%7D.stl>");
  CHECK(mesh("meshes/a b.stl") == "\"meshes/a b.stl\"^^<http://www.w3.org/2001/XMLSchema#anyURI>");
  CHECK(mesh("C:\\meshes\\a.stl") == "\"C:\\\\meshes\\\\a.stl\"^^<http://www.w3.org/2001/XMLSchema#anyURI>");
}

TEST_CASE("a position with on_write is written within the joint's limits", "[urdf][R0.5]") {
  auto robot = urdf::load(picker_file).value();
  double target = 0;
  robot.position(2).on_write([&](double position) { target = position; });
  robot.joint(2).action("stop", [] {});
  Bench bench;
  robot.add_to(bench.engine).value();
  robot.publish({});
  bench.look();
  CHECK(bench.turtle("PUT", "/picker/shoulder/position", number_body("1.5", "maths:Radian")).status == 204);
  CHECK(target == 1.5);
  CHECK(bench.turtle("PUT", "/picker/shoulder/position", number_body("2.5")).status == 422);
  CHECK(bench.turtle("PUT", "/picker/elbow/position", number_body("1")).status == 405);
  CHECK(target == 1.5);
  CHECK(bench.ask("POST /picker/shoulder/actions/stop").status == 204);
}

TEST_CASE("a robot with a duplicate path is not added at all", "[urdf]") {
  Bench bench;
  bench.add(Thing{"picker/hand"});
  auto robot = urdf::load(picker_file).value();
  const auto added = robot.add_to(bench.engine);
  REQUIRE_FALSE(added);
  CHECK(added.error().code == Errc::duplicate_path);
  CHECK(bench.get("/picker").status == 404);
  CHECK(bench.get("/picker/rail").status == 404);
  CHECK(bench.get("/picker/hand").status == 200);  // the earlier Thing is unchanged
  CHECK(bench.get("/").says("/picker/hand>"));
  urdf::ParseOptions options;
  options.path = "cell/arm";
  auto other = urdf::load(picker_file, options).value();
  CHECK(other.joint_path(0) == "cell/arm/slide");
  REQUIRE(other.add_to(bench.engine));
  CHECK(missing(bench.get("/cell/arm"),
                "<cell/arm> lrt:positionsOf ( <cell/arm/slide> <cell/arm/turret> <cell/arm/shoulder> <cell/arm/elbow> "
                "<cell/arm/left_finger> <cell/arm/right_finger> ) .") == "");
}

TEST_CASE("publishing allocates nothing", "[urdf]") {
  for (const std::string& file : all_files()) {
    CAPTURE(file);
    auto robot = urdf::load(file, options_for(file)).value();
    Bench bench;
    robot.add_to(bench.engine).value();
    std::mt19937 random(1);
    std::vector<std::vector<double>> all;
    for (int i = 0; i < 100; ++i) all.push_back(some_positions(robot.model(), random));
    const std::size_t before = allocations;
    for (const std::vector<double>& q : all) robot.publish(q, q, q);
    CHECK(allocations == before);
  }
}

TEST_CASE("descriptions from many tools become Things that conform to their Blueprints", "[urdf][R1.11]") {
  const std::string prismatic = "<limit lower='-1' upper='1'/>", free = "<limit effort='1' velocity='1'/>";
  const std::string sphere = "<geometry><sphere radius='1'/></geometry>";
  const std::string documents[] = {two_links("prismatic", prismatic),
                                   two_links("revolute", free),
                                   two_links("revolute", "<limit lower='0' upper='0' effort='0' velocity='0'/>"),
                                   two_links("revolute", "<limit lower='-inf' upper='2' velocity='1e308'/>"),
                                   two_links("revolute"),
                                   two_links("fixed", "<limit/>"),
                                   two_links("planar", "<axis xyz='0 0 1'/>" + prismatic),
                                   two_links("floating", "<axis xyz='0 0 0'/>" + free),
                                   two_links("continuous", "<mimic joint='none'/><dynamics friction='1'/><safety_controller k_velocity='0'/>"),
                                   "<robot name='a/b'><link name='..'><inertial><mass value='0'/><inertia ixx='9' iyy='0' izz='1'/></inertial>"
                                   "<visual name='v'>" +
                                       sphere + "<material name='grey'/></visual><visual name='v'>" + sphere +
                                       "<material><color rgba='9 9 9 9'/></material></visual>"
                                       "<visual/><collision><geometry><capsule radius='1' "
                                       "length='2'/></geometry></collision><collision><geometry><plane/></geometry></collision>"
                                       "<visual><geometry><mesh filename='C:\\m\\a b.stl' scale='0 0 0'/></geometry></visual>"
                                       "<visual><geometry><mesh filename='$(find p)/m.dae'/></geometry></visual><visual><geometry><mesh "
                                       "filename='package://'/></geometry></visual>"
                                       "<visual><geometry><mesh filename='model://m/[1].obj#a'/></geometry></visual><visual><geometry><mesh "
                                       "filename='?a:b'/></geometry></visual>"
                                       "</link></robot>"};
  std::mt19937 random(3);
  std::size_t resources = 0;
  for (const std::string& document : documents) {
    CAPTURE(document);
    auto model = urdf::parse(document);
    REQUIRE(model);
    urdf::Robot robot(*std::move(model));
    Bench bench;
    REQUIRE(robot.add_to(bench.engine));
    std::vector<std::string> paths = {robot.path()};
    for (std::size_t j = 0; j < robot.model().joints.size(); ++j) paths.push_back(robot.joint_path(j));
    for (std::size_t l = 0; l < robot.model().links.size(); ++l) paths.push_back(robot.link_path(l));
    for (int round = 0; round < 3; ++round) {
      for (const std::string& path : paths) {
        CAPTURE(path, round);
        CHECK(violations([&](const std::string& p) { return bench.get(p); }, "/" + path) == "");
        const rdf::Graph thing = bench.get("/" + path).graph();
        for (const rdf::TermView& property : thing.objects(rdf::iri("http://localhost/" + path), vocab::hybrit::property)) {
          const Answer answer = bench.get(std::string(property.text.substr(16)));
          CHECK(answer.status == 200);
          CHECK_FALSE(answer.graph().empty());
          ++resources;
        }
      }
      const std::vector<double> positions = some_positions(robot.model(), random);
      robot.publish(positions, positions, positions);
      bench.look();
    }
  }
  CHECK(resources > 200);
  // A limit that the document does not have is not one of 0.
  urdf::Robot robot(urdf::parse(two_links("prismatic", prismatic)).value());
  Bench bench;
  robot.add_to(bench.engine).value();
  CHECK(bench.get("/r/j/limits").says("lrt:upperLimit"));
  CHECK_FALSE(bench.get("/r/j/limits").says("lrt:velocityLimit"));
  CHECK_FALSE(bench.get("/r/j/limits").says("lrt:effortLimit"));
}

TEST_CASE("a capsule is shown as a capsule", "[urdf]") {
  urdf::Robot robot(
      urdf::parse("<robot name='r'><link name='a'><collision><geometry><capsule radius='1' length='2'/></geometry></collision></link></robot>")
          .value());
  Bench bench;
  robot.add_to(bench.engine).value();
  const Answer shape = bench.get("/r/a/collision/1");
  CHECK(shape.says("\"capsule\""));
  CHECK(shape.says("lrt:length"));
}
