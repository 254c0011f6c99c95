#include "examples/baxter/linked_arm.hpp"

#include <cmath>
#include <cstdio>
#include <string>

namespace vocab = lrt::vocab;

template <>
struct lrt::rdf::traits<baxter::LinkedArm::AxisAngle::Axis> : lrt::rdf::Record<baxter::LinkedArm::AxisAngle::Axis> {
  using Axis = baxter::LinkedArm::AxisAngle::Axis;
  static void describe(Record<Axis>& r) {
    r.is(vocab::maths::Vector3D);
    r.field(vocab::maths::x, &Axis::x);
    r.field(vocab::maths::y, &Axis::y);
    r.field(vocab::maths::z, &Axis::z);
  }
};

template <>
struct lrt::rdf::traits<baxter::LinkedArm::AxisAngle> : lrt::rdf::Record<baxter::LinkedArm::AxisAngle> {
  using AxisAngle = baxter::LinkedArm::AxisAngle;
  static void describe(Record<AxisAngle>& r) {
    r.is(vocab::spatial::AxisAngle).is(vocab::spatial::Rotation3D);
    r.field(vocab::spatial::rotationAngle, &AxisAngle::angle_rad).unit(lrt::unit::radian);
    r.field(vocab::spatial::rotationAxis, &AxisAngle::axis);
  }
};

template <>
struct lrt::rdf::traits<baxter::LinkedArm::Vector> : lrt::rdf::Record<baxter::LinkedArm::Vector> {
  using Vector = baxter::LinkedArm::Vector;
  static void describe(Record<Vector>& r) {
    r.is(vocab::maths::Vector3D);
    r.field(vocab::maths::x, &Vector::x);
    r.field(vocab::maths::y, &Vector::y);
    r.field(vocab::maths::z, &Vector::z);
  }
};

template <>
struct lrt::rdf::traits<baxter::LinkedArm::Frame> : lrt::rdf::Record<baxter::LinkedArm::Frame> {
  using Frame = baxter::LinkedArm::Frame;
  static void describe(Record<Frame>& r) {
    r.is(vocab::maths::CoordinateSystem);
    r.field("origin", &Frame::origin_m).unit(lrt::unit::metre);
    r.field("rollPitchYaw", &Frame::roll_pitch_yaw_rad).unit(lrt::unit::radian);
    r.field("parentLink", &Frame::parent_link);
  }
};

namespace baxter {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr lrt::Unit newton_metre_second_per_radian{lrt::Iri{"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}, {}, "N.m.s/rad"};

std::string in_baxter(const char* name) { return std::string("baxter/") + name; }

}  // namespace

lrt::Thing LinkedArm::make_joint(std::size_t index) {
  const JointDescription& d = RightArm::description(index);
  lrt::Thing thing{in_baxter(d.name)};
  const lrt::Object before = lrt::Object::resource(in_baxter(d.parent_link)), after = lrt::Object::resource(in_baxter(d.child_link));
  thing.type(vocab::ros::RevoluteJoint)
      .add(vocab::rdfs::seeAlso, lrt::Object::resource("baxter"))
      .add(vocab::xhv::prev, before)
      .add(vocab::xhv::next, after)
      .add(vocab::ros::preceedingLink, before)
      .add(vocab::ros::succeedingLink, after);

  auto rotation = thing.property<AxisAngle>("rotation");
  rotation.predicate(vocab::ros::rotation);
  joints_[index].rotation = rotation;

  Frame frame;
  frame.origin_m = {d.xyz[0], d.xyz[1], d.xyz[2]};
  frame.roll_pitch_yaw_rad = {d.rpy[0], d.rpy[1], d.rpy[2]};
  frame.parent_link = d.parent_link;
  auto reference = thing.property<Frame>("jointReferenceFrame");
  reference.predicate(vocab::ros::jointReferenceFrame);
  reference.publish(frame);

  thing.property("friction", [this, index] { return arm_.friction(index); }, newton_metre_second_per_radian)
      .predicate(vocab::ros::friction)
      .between(0, d.limits.friction_nms_rad)
      .on_write([this, index](double coefficient) { arm_.set_friction(index, coefficient); });

  thing.action("rotate", [this, index](float target_deg, lrt::Responder done) { rotate(index, target_deg, std::move(done)); })
      .consumes(lrt::Facets{lrt::unit::degree}.at_least(0).below(360))
      .policy(lrt::ActionPolicy::preempt());
  return thing;
}

/// Figure 5: the target angle is meant modulo 360 degrees; of the angles that it can be, the one that the joint can reach is taken.
void LinkedArm::rotate(std::size_t index, double target_deg, lrt::Responder done) {
  const JointLimits& limits = RightArm::limits(index);
  for (const double turn : {0.0, -360.0}) {
    if (arm_.move_to(index, (target_deg + turn) * pi / 180) != MoveResult::accepted) continue;
    done.on_cancel([this, index] { arm_.stop(index); });
    joints_[index].move = std::move(done);
    return;
  }
  char text[160];
  std::snprintf(text, sizeof text, "%g degrees is outside the limits of %s: %.1f to %.1f degrees, modulo 360", target_deg,
                RightArm::description(index).name, limits.lower_rad * 180 / pi, limits.upper_rad * 180 / pi);
  std::move(done).fail({lrt::Errc::refused, text});
}

lrt::Result<void> LinkedArm::add_to(lrt::Server& server) {
  lrt::Thing robot{"baxter"};
  robot.title("Baxter's right arm");
  if (auto added = server.add(std::move(robot)); !added) return added;
  for (std::size_t i = 0; i <= joint_count; ++i) {
    const char* name = i == 0 ? RightArm::description(0).parent_link : RightArm::description(i - 1).child_link;
    lrt::Thing link{in_baxter(name)};
    link.type(vocab::ros::Link);
    if (i > 0) link.add(vocab::xhv::prev, lrt::Object::resource(in_baxter(RightArm::description(i - 1).name)));
    if (i < joint_count) link.add(vocab::xhv::next, lrt::Object::resource(in_baxter(RightArm::description(i).name)));
    if (auto added = server.add(std::move(link)); !added) return added;
  }
  for (std::size_t i = 0; i < joint_count; ++i)
    if (auto added = server.add(make_joint(i)); !added) return added;
  publish();
  return {};
}

void LinkedArm::publish() noexcept {
  for (std::size_t i = 0; i < joint_count; ++i) {
    Joint& joint = joints_[i];
    const double* axis = RightArm::description(i).axis;
    joint.rotation->publish({static_cast<float>(arm_.position(i)),
                             {static_cast<float>(axis[0]), static_cast<float>(axis[1]), static_cast<float>(axis[2])}});
    if (!joint.move) continue;
    if (joint.move.cancelled()) joint.move = {};
    else if (!arm_.moving(i)) std::move(joint.move).succeed();
    else joint.move.progress(arm_.progress(i));
  }
}

}  // namespace baxter
