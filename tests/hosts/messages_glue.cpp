// SPDX-License-Identifier: Apache-2.0
#include <lrt/thing.hpp>

#include "tests/hosts/glue.hpp"
#include "tests/hosts/messages.hpp"

namespace {

/// A step for clients: one of the three.
struct WebStep {
  std::string name;
  std::optional<cell::MoveJ> move_j;
  std::optional<cell::MoveL> move_l;
  std::optional<cell::Wait> wait;
};
struct WebProgram {
  std::string name;
  std::vector<WebStep> steps;
  std::optional<cell::Tool> tool;
};

}  // namespace

namespace lrt::rdf {
template <>
struct traits<cell::Mode> : Enumeration<cell::Mode> {
  static void describe(Enumeration& e) {
    e.name(cell::Mode::idle, "idle").name(cell::Mode::manual, "manual").name(cell::Mode::automatic, "automatic").name(cell::Mode::fault, "fault");
  }
};
template <>
struct traits<cell::Blend> : Enumeration<cell::Blend> {
  static void describe(Enumeration& e) {
    e.name(cell::Blend::none, "none").name(cell::Blend::corner, "corner").name(cell::Blend::parabolic, "parabolic");
  }
};
template <>
struct traits<cell::Vector3> : Record<cell::Vector3> {
  static void describe(Record& r) {
    r.field("x", &cell::Vector3::x).unit(unit::metre);
    r.field("y", &cell::Vector3::y).unit(unit::metre);
    r.field("z", &cell::Vector3::z).unit(unit::metre);
  }
};
template <>
struct traits<cell::Quaternion> : Record<cell::Quaternion> {
  static void describe(Record& r) {
    r.field("x", &cell::Quaternion::x);
    r.field("y", &cell::Quaternion::y);
    r.field("z", &cell::Quaternion::z);
    r.field("w", &cell::Quaternion::w);
  }
};
template <>
struct traits<cell::Pose> : Record<cell::Pose> {
  static void describe(Record& r) {
    r.field("position", &cell::Pose::position);
    r.field("orientation", &cell::Pose::orientation);
  }
};
template <>
struct traits<cell::MoveJ> : Record<cell::MoveJ> {
  static void describe(Record& r) {
    r.field("joints", &cell::MoveJ::joints).unit(unit::radian);
    r.field("speed", &cell::MoveJ::speed).unit(unit::radian_per_second).above(0);
  }
};
template <>
struct traits<cell::MoveL> : Record<cell::MoveL> {
  static void describe(Record& r) {
    r.field("target", &cell::MoveL::target);
    r.field("speed", &cell::MoveL::speed).unit(unit::metre_per_second).above(0);
    r.field("blend", &cell::MoveL::blend);
  }
};
template <>
struct traits<cell::Wait> : Record<cell::Wait> {
  static void describe(Record& r) { r.field("seconds", &cell::Wait::seconds).unit(unit::second).at_least(0); }
};
template <>
struct traits<WebStep> : Record<WebStep> {
  static void describe(Record& r) {
    r.named("Step");
    r.field("name", &WebStep::name);
    r.field("moveJ", &WebStep::move_j);
    r.field("moveL", &WebStep::move_l);
    r.field("wait", &WebStep::wait);
  }
};
template <>
struct traits<cell::Tool> : Record<cell::Tool> {
  static void describe(Record& r) {
    r.field("name", &cell::Tool::name);
    r.field("mass", &cell::Tool::mass).unit(unit::kilogram).at_least(0);
    r.field("flange", &cell::Tool::flange);
  }
};
template <>
struct traits<WebProgram> : Record<WebProgram> {
  static void describe(Record& r) {
    r.named("Program");
    r.field("name", &WebProgram::name);
    r.field("steps", &WebProgram::steps);
    r.field("tool", &WebProgram::tool);
  }
};
template <>
struct traits<cell::Status> : Record<cell::Status> {
  static void describe(Record& r) {
    r.field("mode", &cell::Status::mode);
    r.field("step", &cell::Status::step);
    r.field("now", &cell::Status::now);
    r.field("warnings", &cell::Status::warnings);
  }
};
}  // namespace lrt::rdf

namespace {

WebProgram shown(const cell::Program& program) {
  WebProgram web{program.name, {}, program.tool};
  for (const cell::Step& step : program.steps) {
    WebStep& one = web.steps.emplace_back();
    one.name = step.name;
    if (const auto* move_j = std::get_if<cell::MoveJ>(&step.what)) one.move_j = *move_j;
    if (const auto* move_l = std::get_if<cell::MoveL>(&step.what)) one.move_l = *move_l;
    if (const auto* wait = std::get_if<cell::Wait>(&step.what)) one.wait = *wait;
  }
  return web;
}

lrt::Result<void> take(cell::Program& program, const WebProgram& web) {
  cell::Program taken{web.name, {}, web.tool};
  for (const WebStep& step : web.steps) {
    if (int(step.move_j.has_value()) + int(step.move_l.has_value()) + int(step.wait.has_value()) != 1)
      return lrt::unexpected(lrt::Errc::expected_value, "step \"" + step.name + "\": expected one of moveJ, moveL and wait");
    cell::Step& one = taken.steps.emplace_back();
    one.name = step.name;
    if (step.move_j) one.what = *step.move_j;
    else if (step.move_l) one.what = *step.move_l;
    else one.what = *step.wait;
  }
  program = std::move(taken);
  return {};
}

}  // namespace

lrt::Thing cell_thing(cell::Program& program, const cell::Status& status) {
  lrt::Thing thing{"cell"};
  thing.property("program", [&program] { return shown(program); }).on_write([&program](const WebProgram& web) { return take(program, web); });
  thing.property("status", [&status] { return status; });
  return thing;
}
