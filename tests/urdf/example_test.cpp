// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_urdf_robot/moving_robot.hpp"

#include <cmath>
#include <fstream>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"
#include "tests/support/skip.hpp"
#include "tests/urdf/documents.hpp"

using namespace lrt;
using namespace lrt::test;
using ex_urdf_robot::MovingRobot;
using ex_urdf_robot::Trajectory;

namespace {

urdf::Robot picker() { return urdf::load(picker_file).value(); }

std::string refusal(const std::string& text) {
  const auto trajectory = Trajectory::parse(text, picker().model());
  return trajectory ? std::string() : trajectory.error().message;
}

/// The example's program without its port and its sleep.
class Running {
 public:
  explicit Running(urdf::Robot robot, std::optional<Trajectory> trajectory = {}) : moving(std::move(robot), std::move(trajectory)) {
    moving.step();
    moving.add_to(bench.engine).value();
  }
  void step(int count = 1) {
    for (int i = 0; i < count; ++i) moving.step();
    bench.look();
    bench.run();
  }
  double number(const std::string& path) {
    return std::stod(std::string(bench.get(path).graph().object(rdf::iri("http://localhost" + path), vocab::vom::numericalValue).value().text));
  }
  Bench bench;
  MovingRobot moving;
};

}  // namespace

TEST_CASE("a recording is read by joint names or by number, and interpolated between its lines", "[urdf][examples]") {
  const urdf::Robot robot = picker();
  std::vector<double> q(5, 9), dq(5, 9), tau(5, 9);
  Trajectory named = Trajectory::parse("time, shoulder , right_finger,dq_turret,tau_slide\r\n10,1,5,2,3\n\n11,2,5,4,3\n", robot.model()).value();
  CHECK(named.duration() == 1);
  named.at(0.25, q, dq, tau);
  CHECK(q == std::vector<double>{9, 9, 1.25, 9, 9});
  CHECK(dq == std::vector<double>{9, 2.5, 9, 9, 9});
  CHECK(tau == std::vector<double>{3, 9, 9, 9, 9});
  named.at(1.5, q, dq, tau);  // from the start
  CHECK(q[2] == 1.5);
  Trajectory numbered = Trajectory::parse("t,q1,q5,dq2,tau3\n0,1,2,3,4\n", robot.model()).value();
  numbered.at(7, q, dq, tau);
  CHECK(q == std::vector<double>{1, 9, 1.5, 9, 2});
  CHECK(dq[1] == 3);
  CHECK(tau[2] == 4);
}

TEST_CASE("an invalid recording is refused with the line", "[urdf][examples]") {
  CHECK(refusal("") == "line 1: expected the names of columns, found nothing");
  CHECK(refusal("q1,t\n") == "line 1: expected the names of columns, t or time first, found \"q1\"");
  CHECK(refusal("t,q6\n") == "line 1: expected a joint that moves, or q, dq or tau with a number from 1 to 5, found column \"q6\"");
  CHECK(refusal("t,flange\n") != "");
  CHECK(refusal("t,q0\n") != "");
  CHECK(refusal("t,q1,slide\n") == "line 1: expected one column for each joint, found another in \"slide\"");
  CHECK(refusal("t,q1\n") == "line 1: expected at least one line of numbers");
  CHECK(refusal("t,q1\n0,1\n1\n") == "line 3: expected 2 numbers, found 1");
  CHECK(refusal("t,q1\n0,1\n\n1,x\n") == "line 4: expected a number in column \"q1\", found \"x\"");
  CHECK(refusal("t,q1\n0,nan\n") == "line 2: expected a number in column \"q1\", found \"nan\"");
  CHECK(refusal("t,q1\n1,1\n0,1\n") == "line 3: expected times that go on");
  CHECK(Trajectory::load("/nowhere/x.csv", picker().model()).error().code == Errc::io_error);
}

TEST_CASE("a robot with a recording follows it", "[urdf][examples]") {
  urdf::Robot robot = picker();
  Trajectory trajectory = Trajectory::parse("t,slide,dq_slide,tau_slide\n0,0,0.1,5\n1,0.1,0.1,5\n", robot.model()).value();
  Running running(std::move(robot), std::move(trajectory));
  running.step(500);
  CHECK(running.number("/picker/slide/position") == Approx(0.05));
  CHECK(running.number("/picker/slide/velocity") == Approx(0.1));
  CHECK(running.number("/picker/slide/effort") == Approx(5));
  CHECK(running.number("/picker/elbow/position") == 0.1);  // no column: at rest, at the limit next to 0
  CHECK(running.bench.turtle("PUT", "/picker/slide/position", number_body("0.2")).status == 405);
}

TEST_CASE("without a recording joints move to the targets of clients, within their velocity limits", "[urdf][examples][R0.5][R0.8]") {
  Running running(picker());
  Bench& bench = running.bench;
  CHECK(bench.turtle("PUT", "/picker/slide/position", "<> a maths:Scalar ; vom:numericalValue 0.2 ; qudt:hasUnit unit:M .").status == 204);
  running.step(250);
  CHECK(running.number("/picker/slide/position") == Approx(0.1));
  CHECK(running.number("/picker/slide/velocity") == Approx(0.4));
  running.step(260);
  CHECK(running.number("/picker/slide/position") == 0.2);
  CHECK(running.number("/picker/slide/velocity") == 0);

  const Answer a = bench.turtle("POST", "/picker/shoulder/actions/move", number_body("1.5", "maths:Radian"));
  CHECK(a.status == 204);
  const std::string location = a.field("Location");
  running.step(500);
  CHECK(missing(bench.get(location.substr(16)), "<" + location + "> lrt:status lrt:running .") == "");
  CHECK(running.number("/picker/shoulder/position") == Approx(0.75));
  running.step(510);
  CHECK(missing(bench.get(location.substr(16)), "<" + location + "> lrt:status lrt:succeeded .") == "");
  CHECK(running.number("/picker/shoulder/position") == 1.5);
  CHECK(bench.turtle("POST", "/picker/shoulder/actions/move", number_body("2.5", "maths:Radian")).status == 422);

  const std::string back = bench.turtle("POST", "/picker/shoulder/actions/move", number_body("0", "maths:Radian")).field("Location");
  running.step(100);
  CHECK(bench.ask("DELETE " + back.substr(16)).status == 204);
  running.step(100);
  CHECK(running.number("/picker/shoulder/position") == Approx(1.35));
}

TEST_CASE("the recording of a real arm moves its description", "[urdf][examples]") {
  const std::string csv = LRT_SHARED_DIR "/robots/trajectories/panda_exciting_100hz.csv";
  if (!std::ifstream(csv)) {
    print_skip(csv + " is not there");
    return;
  }
  urdf::Robot robot = urdf::load(real_robots + "panda.urdf").value();
  Trajectory trajectory = Trajectory::load(csv, robot.model()).value();
  CHECK(trajectory.lines() > 1000);
  const double duration = trajectory.duration();
  Running running(std::move(robot), std::move(trajectory));
  CHECK(running.number("/panda/panda_joint1/position") == Approx(-0.9584));
  const urdf::Pose before = running.moving.robot().pose(7);
  running.step(static_cast<int>(duration * 500));
  const urdf::Pose after = running.moving.robot().pose(7);
  double moved = 0;
  for (std::size_t i = 0; i < 3; ++i) moved = std::max(moved, std::abs(after.position[i] - before.position[i]));
  CHECK(moved > 0.01);
  CHECK(running.number("/panda/panda_joint2/effort") != 0);
}
