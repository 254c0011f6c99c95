// Made by `lrt generate` of the Blueprints of a robot. Changes are lost when it is made again; `lrt generate --check` tells whether the
// robot still has these Blueprints.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/rdf/traits.hpp>

namespace baxter {

/// spatial:Translation3D
struct Translation3D {
  double x = 0;
  double y = 0;
  double z = 0;
};

/// spatial:Rotation3D
struct Rotation3D {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 0;
};

/// spatial:SpatialRelationship
struct SpatialRelationship {
  Translation3D translation;  ///< [m]
  Rotation3D rotation;
  std::optional<std::array<std::array<double, 3>, 3>> matrix;  ///< may be absent
};

/// lrt:Inertia
struct Inertia {
  double mass = 0;  ///< [kg]
  SpatialRelationship spatialRelationship;
  double ixx = 0;  ///< [kg.m2]
  double ixy = 0;  ///< [kg.m2]
  double ixz = 0;  ///< [kg.m2]
  double iyy = 0;  ///< [kg.m2]
  double iyz = 0;  ///< [kg.m2]
  double izz = 0;  ///< [kg.m2]
};

/// maths:Vector3D
struct Vector3D {
  double x = 0;
  double y = 0;
  double z = 0;
};

/// lrt:JointDynamics
struct JointDynamics {
  double damping = 0;  ///< [N.m.s/rad]
  double staticFriction = 0;  ///< [N.m]
};

/// lrt:JointLimits
struct JointLimits {
  std::optional<double> lowerLimit;  ///< [rad], may be absent
  std::optional<double> upperLimit;  ///< [rad], may be absent
  std::optional<double> velocityLimit;  ///< [rad/s], may be absent
  std::optional<double> effortLimit;  ///< [N.m], may be absent
};

/// maths:Vector3D
struct Vector3D2 {
  float x = 0;
  float y = 0;
  float z = 0;
};

/// spatial:AxisAngle
struct AxisAngle {
  float rotationAngle = 0;  ///< [rad]
  Vector3D2 rotationAxis;
};

/// lrt:StopState
struct StopState {
  bool stopped = false;
  std::optional<std::chrono::system_clock::time_point> stoppedSince;  ///< may be absent
  std::optional<std::string> stoppedBy;  ///< may be absent
};

/// ~/ns/vocabulary#JointAngles
struct JointAngles {
  float right_s0 = 0;  ///< [deg], at least -97.49, at most 97.49
  float right_s1 = 0;  ///< [deg], at least -123.01, at most 59.98
  float right_e0 = 0;  ///< [deg], at least -174.99, at most 174.99
  float right_e1 = 0;  ///< [deg], at least -2.86, at most 150
  float right_w0 = 0;  ///< [deg], at least -175.26, at most 175.26
  float right_w1 = 0;  ///< [deg], at least -89.99, at most 119.97
  float right_w2 = 0;  ///< [deg], at least -175.26, at most 175.26
};

}  // namespace baxter

template <>
struct lrt::rdf::traits<::baxter::Translation3D> : lrt::rdf::Record<::baxter::Translation3D> {
  static void describe(Record<::baxter::Translation3D>& r) {
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#Translation3D"});
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#x"}, &::baxter::Translation3D::x).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#y"}, &::baxter::Translation3D::y).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#z"}, &::baxter::Translation3D::z).allow_non_finite();
  }
  static const Type& type() {
    static const lrt::Immortal<Type> changed([] {
      Type t = Record<::baxter::Translation3D>::type();
      t.value_predicate = "http://vocab.arvida.de/2015/06/vom/vocab#quantityValue";
      t.value_classes = {"http://vocab.arvida.de/2015/06/maths/vocab#Vector3D"};
      return t;
    }());
    return *changed;
  }
};

template <>
struct lrt::rdf::traits<::baxter::Rotation3D> : lrt::rdf::Record<::baxter::Rotation3D> {
  static void describe(Record<::baxter::Rotation3D>& r) {
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#Rotation3D"});
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#x"}, &::baxter::Rotation3D::x).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#y"}, &::baxter::Rotation3D::y).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#z"}, &::baxter::Rotation3D::z).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#w"}, &::baxter::Rotation3D::w).allow_non_finite();
  }
  static const Type& type() {
    static const lrt::Immortal<Type> changed([] {
      Type t = Record<::baxter::Rotation3D>::type();
      t.value_predicate = "http://vocab.arvida.de/2015/06/vom/vocab#quantityValue";
      t.value_classes = {"http://vocab.arvida.de/2015/06/maths/vocab#Quaternion", "http://vocab.arvida.de/2015/06/maths/vocab#Vector4D"};
      return t;
    }());
    return *changed;
  }
};

template <>
struct lrt::rdf::traits<::baxter::SpatialRelationship> : lrt::rdf::Record<::baxter::SpatialRelationship> {
  static void describe(Record<::baxter::SpatialRelationship>& r) {
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#SpatialRelationship"});
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#translation"}, &::baxter::SpatialRelationship::translation).unit(lrt::unit::metre);
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#rotation"}, &::baxter::SpatialRelationship::rotation);
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#matrix"}, &::baxter::SpatialRelationship::matrix).allow_non_finite();
  }
};

template <>
struct lrt::rdf::traits<::baxter::Inertia> : lrt::rdf::Record<::baxter::Inertia> {
  static void describe(Record<::baxter::Inertia>& r) {
    r.is(lrt::Iri{"https://w3id.org/lrt/ns#Inertia"});
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#mass"}, &::baxter::Inertia::mass).unit(lrt::unit::kilogram).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#spatialRelationship"}, &::baxter::Inertia::spatialRelationship);
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#ixx"}, &::baxter::Inertia::ixx).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, lrt::Iri{""}, "kg.m2", {}}).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#ixy"}, &::baxter::Inertia::ixy).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, lrt::Iri{""}, "kg.m2", {}}).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#ixz"}, &::baxter::Inertia::ixz).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, lrt::Iri{""}, "kg.m2", {}}).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#iyy"}, &::baxter::Inertia::iyy).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, lrt::Iri{""}, "kg.m2", {}}).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#iyz"}, &::baxter::Inertia::iyz).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, lrt::Iri{""}, "kg.m2", {}}).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#izz"}, &::baxter::Inertia::izz).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, lrt::Iri{""}, "kg.m2", {}}).allow_non_finite();
  }
};

template <>
struct lrt::rdf::traits<::baxter::Vector3D> : lrt::rdf::Record<::baxter::Vector3D> {
  static void describe(Record<::baxter::Vector3D>& r) {
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#Vector3D"});
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#x"}, &::baxter::Vector3D::x).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#y"}, &::baxter::Vector3D::y).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#z"}, &::baxter::Vector3D::z).allow_non_finite();
  }
};

template <>
struct lrt::rdf::traits<::baxter::JointDynamics> : lrt::rdf::Record<::baxter::JointDynamics> {
  static void describe(Record<::baxter::JointDynamics>& r) {
    r.is(lrt::Iri{"https://w3id.org/lrt/ns#JointDynamics"});
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#damping"}, &::baxter::JointDynamics::damping).unit(lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}, lrt::Iri{""}, "N.m.s/rad", {}}).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#staticFriction"}, &::baxter::JointDynamics::staticFriction).unit(lrt::unit::newton_metre).allow_non_finite();
  }
};

template <>
struct lrt::rdf::traits<::baxter::JointLimits> : lrt::rdf::Record<::baxter::JointLimits> {
  static void describe(Record<::baxter::JointLimits>& r) {
    r.is(lrt::Iri{"https://w3id.org/lrt/ns#JointLimits"});
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#lowerLimit"}, &::baxter::JointLimits::lowerLimit).unit(lrt::unit::radian).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#upperLimit"}, &::baxter::JointLimits::upperLimit).unit(lrt::unit::radian).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#velocityLimit"}, &::baxter::JointLimits::velocityLimit).unit(lrt::unit::radian_per_second).allow_non_finite();
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#effortLimit"}, &::baxter::JointLimits::effortLimit).unit(lrt::unit::newton_metre).allow_non_finite();
  }
};

template <>
struct lrt::rdf::traits<::baxter::Vector3D2> : lrt::rdf::Record<::baxter::Vector3D2> {
  static void describe(Record<::baxter::Vector3D2>& r) {
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#Vector3D"});
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#x"}, &::baxter::Vector3D2::x).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#y"}, &::baxter::Vector3D2::y).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/maths/vocab#z"}, &::baxter::Vector3D2::z).allow_non_finite();
  }
};

template <>
struct lrt::rdf::traits<::baxter::AxisAngle> : lrt::rdf::Record<::baxter::AxisAngle> {
  static void describe(Record<::baxter::AxisAngle>& r) {
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#AxisAngle"});
    r.is(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#Rotation3D"});
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#rotationAngle"}, &::baxter::AxisAngle::rotationAngle).unit(lrt::unit::radian).allow_non_finite();
    r.field(lrt::Iri{"http://vocab.arvida.de/2015/06/spatial/vocab#rotationAxis"}, &::baxter::AxisAngle::rotationAxis);
  }
};

template <>
struct lrt::rdf::traits<::baxter::StopState> : lrt::rdf::Record<::baxter::StopState> {
  static void describe(Record<::baxter::StopState>& r) {
    r.is(lrt::Iri{"https://w3id.org/lrt/ns#StopState"});
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#stopped"}, &::baxter::StopState::stopped);
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#stoppedSince"}, &::baxter::StopState::stoppedSince);
    r.field(lrt::Iri{"https://w3id.org/lrt/ns#stoppedBy"}, &::baxter::StopState::stoppedBy);
  }
};

template <>
struct lrt::rdf::traits<::baxter::JointAngles> : lrt::rdf::Record<::baxter::JointAngles> {
  static void describe(Record<::baxter::JointAngles>& r) {
    r.is(lrt::Iri{"#JointAngles"});
    r.field(lrt::Iri{"#JointAngles/right_s0"}, &::baxter::JointAngles::right_s0).unit(lrt::unit::degree).at_least(-97.49).at_most(97.49);
    r.field(lrt::Iri{"#JointAngles/right_s1"}, &::baxter::JointAngles::right_s1).unit(lrt::unit::degree).at_least(-123.01).at_most(59.98);
    r.field(lrt::Iri{"#JointAngles/right_e0"}, &::baxter::JointAngles::right_e0).unit(lrt::unit::degree).at_least(-174.99).at_most(174.99);
    r.field(lrt::Iri{"#JointAngles/right_e1"}, &::baxter::JointAngles::right_e1).unit(lrt::unit::degree).at_least(-2.86).at_most(150);
    r.field(lrt::Iri{"#JointAngles/right_w0"}, &::baxter::JointAngles::right_w0).unit(lrt::unit::degree).at_least(-175.26).at_most(175.26);
    r.field(lrt::Iri{"#JointAngles/right_w1"}, &::baxter::JointAngles::right_w1).unit(lrt::unit::degree).at_least(-89.99).at_most(119.97);
    r.field(lrt::Iri{"#JointAngles/right_w2"}, &::baxter::JointAngles::right_w2).unit(lrt::unit::degree).at_least(-175.26).at_most(175.26);
  }
};

namespace baxter {

/// right_arm_mount, right_lower_elbow, right_lower_forearm, right_lower_shoulder, right_upper_elbow, right_upper_forearm, right_upper_shoulder, right_wrist.
class Link {
 public:
  /// Takes a Thing of this kind, which has the classes, properties and actions.
  /// @par Errors  expected_value: it is of another kind
  static lrt::Result<Link> of(lrt::client::Thing thing) {
    lrt::client::Members members(std::move(thing), "Link", {"http://ros.org/#Link"});
    Link made(members);
    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());
    return made;
  }
  /// All Things of this kind that a robot has.
  static std::vector<Link> all(const lrt::client::Robot& robot) { return lrt::client::all_of<Link>(robot); }

  lrt::client::Thing thing;
  /// Inertia. Mass, centre of mass and moments of inertia of the link.
  lrt::client::Readable<Inertia> inertial;
  /// Pose. Where the link is, seen from the root link.
  lrt::client::Readable<SpatialRelationship> pose;

 private:
  explicit Link(lrt::client::Members& members)
      : thing(members.thing()),
        inertial(members.property("https://w3id.org/lrt/ns#inertial", "inertial", true), lrt::rdf::traits<Inertia>::type(), lrt::unit::none),
        pose(members.property("https://w3id.org/lrt/ns#pose", "pose", true), lrt::rdf::traits<SpatialRelationship>::type(), lrt::unit::none) {}
};

/// right_e0, right_e1, right_s0, right_s1, right_w0, right_w1, right_w2.
class RevoluteJoint {
 public:
  /// Takes a Thing of this kind, which has the classes, properties and actions.
  /// @par Errors  expected_value: it is of another kind
  static lrt::Result<RevoluteJoint> of(lrt::client::Thing thing) {
    lrt::client::Members members(std::move(thing), "RevoluteJoint", {"http://ros.org/#Joint", "http://ros.org/#RevoluteJoint"});
    RevoluteJoint made(members);
    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());
    return made;
  }
  /// All Things of this kind that a robot has.
  static std::vector<RevoluteJoint> all(const lrt::client::Robot& robot) { return lrt::client::all_of<RevoluteJoint>(robot); }

  lrt::client::Thing thing;
  /// Axis. The direction around which the joint turns.
  lrt::client::Readable<Vector3D> axis;
  /// Dynamics. Damping and friction of the joint.
  lrt::client::Readable<JointDynamics> dynamics;
  /// Effort: [N.m]. The torque of the joint's motor.
  lrt::client::Readable<double> effort;
  /// Friction: [N.m.s/rad]. The coefficient of viscous friction that the control loop uses. Each Thing has its own bounds.
  lrt::client::Writable<double> friction;
  /// Reference frame. Where the joint is, seen from the link before it.
  lrt::client::Readable<SpatialRelationship> jointReferenceFrame;
  /// Limits. How far and how fast the joint moves, and how strong it is.
  lrt::client::Readable<JointLimits> limits;
  /// Position: [rad]. The angle of the joint; zero is its reference position. Each Thing has its own bounds.
  lrt::client::Writable<double> position;
  /// Rotation. The angle of the joint and the axis around which it turns.
  lrt::client::Readable<AxisAngle> rotation;
  /// Velocity: [rad/s]. How fast the joint turns.
  lrt::client::Readable<double> velocity;
  /// Rotate. Turns the joint to an angle within its limits. It takes time: wait for the invocation. Input: [deg].
  lrt::client::TypedAction<float, void> rotate;

 private:
  explicit RevoluteJoint(lrt::client::Members& members)
      : thing(members.thing()),
        axis(members.property("https://w3id.org/lrt/ns#axis", "axis", true), lrt::rdf::traits<Vector3D>::type(), lrt::unit::none),
        dynamics(members.property("https://w3id.org/lrt/ns#dynamics", "dynamics", true), lrt::rdf::traits<JointDynamics>::type(), lrt::unit::none),
        effort(members.property("http://ros.org/#effort", "effort", true), lrt::rdf::traits<double>::type(), lrt::unit::newton_metre),
        friction(members.property("http://ros.org/#friction", "friction", true), lrt::rdf::traits<double>::type(), lrt::Unit{lrt::Iri{"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}, lrt::Iri{""}, "N.m.s/rad", {}}),
        jointReferenceFrame(members.property("http://ros.org/#jointReferenceFrame", "jointReferenceFrame", true), lrt::rdf::traits<SpatialRelationship>::type(), lrt::unit::none),
        limits(members.property("https://w3id.org/lrt/ns#limits", "limits", true), lrt::rdf::traits<JointLimits>::type(), lrt::unit::none),
        position(members.property("http://ros.org/#position", "position", true), lrt::rdf::traits<double>::type(), lrt::unit::radian),
        rotation(members.property("http://ros.org/#rotation", "rotation", true), lrt::rdf::traits<AxisAngle>::type(), lrt::unit::none),
        velocity(members.property("http://ros.org/#velocity", "velocity", true), lrt::rdf::traits<double>::type(), lrt::unit::radian_per_second),
        rotate(members.action("", "rotate", true), {lrt::rdf::traits<float>::type(), lrt::unit::degree}, {}) {}
};

/// Baxter's right arm.
class Robot {
 public:
  /// Takes a Thing of this kind, which has the classes, properties and actions.
  /// @par Errors  expected_value: it is of another kind
  static lrt::Result<Robot> of(lrt::client::Thing thing) {
    lrt::client::Members members(std::move(thing), "Robot", {"http://ros.org/#Robot"});
    Robot made(members);
    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());
    return made;
  }
  /// All Things of this kind that a robot has.
  static std::vector<Robot> all(const lrt::client::Robot& robot) { return lrt::client::all_of<Robot>(robot); }

  lrt::client::Thing thing;
  /// Positions: at most 512 members. The positions of all joints that move, in the order of lrt:positionsOf.
  lrt::client::Readable<std::vector<double>> positions;
  /// Stopped. Whether the robot is stopped, since when and by whom. What moves is unavailable meanwhile.
  lrt::client::Readable<StopState> stopped;
  /// Move all joints. All joints rotate at the same time, each to its target angle. It takes time: wait for the invocation.
  lrt::client::TypedAction<JointAngles, void> moveTo;
  /// Release. Ends the stop. The arm stays where it is until the next command.
  lrt::client::TypedAction<void, void> release;
  /// Stop. All joints brake, and take no command until the release.
  lrt::client::TypedAction<void, void> stop;

 private:
  explicit Robot(lrt::client::Members& members)
      : thing(members.thing()),
        positions(members.property("https://w3id.org/lrt/ns#positions", "positions", true), lrt::rdf::traits<std::vector<double>>::type(), lrt::unit::none),
        stopped(members.property("https://w3id.org/lrt/ns#stopState", "stopped", true), lrt::rdf::traits<StopState>::type(), lrt::unit::none),
        moveTo(members.action("", "moveTo", true), {lrt::rdf::traits<JointAngles>::type(), lrt::unit::none}, {}),
        release(members.action("", "release", true), {}, {}),
        stop(members.action("", "stop", true), {}, {}) {}
};

/// What Baxter sees and has to do.
class World {
 public:
  /// Takes a Thing of this kind, which has the classes, properties and actions.
  /// @par Errors  expected_value: it is of another kind
  static lrt::Result<World> of(lrt::client::Thing thing) {
    lrt::client::Members members(std::move(thing), "World", {"http://www.w3.org/ns/ldp#BasicContainer", "http://www.w3.org/ns/ldp#Container", "http://www.w3.org/ns/ldp#RDFSource", "https://w3id.org/lrt/ns#World"});
    World made(members);
    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());
    return made;
  }
  /// All Things of this kind that a robot has.
  static std::vector<World> all(const lrt::client::Robot& robot) { return lrt::client::all_of<World>(robot); }

  lrt::client::Thing thing;

 private:
  explicit World(lrt::client::Members& members)
      : thing(members.thing()) {}
};

}  // namespace baxter

// Made of:
//   Link |  |  | ros:Link
//   Link | property inertial |  | record lrt:Inertia
//   Link | property inertial | by | read-only lrt:inertial
//   Link | property inertial | lrt:ixx | xsd:double [kg.m2 unit:KiloGM-M2]
//   Link | property inertial | lrt:ixy | xsd:double [kg.m2 unit:KiloGM-M2]
//   Link | property inertial | lrt:ixz | xsd:double [kg.m2 unit:KiloGM-M2]
//   Link | property inertial | lrt:iyy | xsd:double [kg.m2 unit:KiloGM-M2]
//   Link | property inertial | lrt:iyz | xsd:double [kg.m2 unit:KiloGM-M2]
//   Link | property inertial | lrt:izz | xsd:double [kg.m2 unit:KiloGM-M2]
//   Link | property inertial | lrt:mass | xsd:double [kg unit:KiloGM]
//   Link | property inertial | spatial:spatialRelationship | record spatial:SpatialRelationship
//   Link | property inertial | spatial:spatialRelationship lrt:matrix | optional list[3] of list[3] of xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:rotation | record spatial:Rotation3D by vom:quantityValue maths:Quaternion maths:Vector4D
//   Link | property inertial | spatial:spatialRelationship spatial:rotation maths:w | xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:rotation maths:x | xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:rotation maths:y | xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:rotation maths:z | xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:translation | record spatial:Translation3D by vom:quantityValue maths:Vector3D [m unit:M]
//   Link | property inertial | spatial:spatialRelationship spatial:translation maths:x | xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:translation maths:y | xsd:double
//   Link | property inertial | spatial:spatialRelationship spatial:translation maths:z | xsd:double
//   Link | property pose |  | record spatial:SpatialRelationship
//   Link | property pose | by | read-only lrt:pose
//   Link | property pose | lrt:matrix | optional list[3] of list[3] of xsd:double
//   Link | property pose | spatial:rotation | record spatial:Rotation3D by vom:quantityValue maths:Quaternion maths:Vector4D
//   Link | property pose | spatial:rotation maths:w | xsd:double
//   Link | property pose | spatial:rotation maths:x | xsd:double
//   Link | property pose | spatial:rotation maths:y | xsd:double
//   Link | property pose | spatial:rotation maths:z | xsd:double
//   Link | property pose | spatial:translation | record spatial:Translation3D by vom:quantityValue maths:Vector3D [m unit:M]
//   Link | property pose | spatial:translation maths:x | xsd:double
//   Link | property pose | spatial:translation maths:y | xsd:double
//   Link | property pose | spatial:translation maths:z | xsd:double
//   RevoluteJoint |  |  | ros:Joint ros:RevoluteJoint
//   RevoluteJoint | action rotate | by | asynchronous
//   RevoluteJoint | input of action rotate |  | xsd:float [deg unit:DEG]
//   RevoluteJoint | property axis |  | record maths:Vector3D
//   RevoluteJoint | property axis | by | read-only lrt:axis
//   RevoluteJoint | property axis | maths:x | xsd:double
//   RevoluteJoint | property axis | maths:y | xsd:double
//   RevoluteJoint | property axis | maths:z | xsd:double
//   RevoluteJoint | property dynamics |  | record lrt:JointDynamics
//   RevoluteJoint | property dynamics | by | read-only lrt:dynamics
//   RevoluteJoint | property dynamics | lrt:damping | xsd:double [N.m.s/rad unit:N-M-SEC-PER-RAD]
//   RevoluteJoint | property dynamics | lrt:staticFriction | xsd:double [N.m unit:N-M]
//   RevoluteJoint | property effort |  | xsd:double [N.m unit:N-M]
//   RevoluteJoint | property effort | by | read-only ros:effort
//   RevoluteJoint | property friction |  | xsd:double [N.m.s/rad unit:N-M-SEC-PER-RAD]
//   RevoluteJoint | property friction | by | writable ros:friction
//   RevoluteJoint | property jointReferenceFrame |  | record spatial:SpatialRelationship
//   RevoluteJoint | property jointReferenceFrame | by | read-only ros:jointReferenceFrame
//   RevoluteJoint | property jointReferenceFrame | lrt:matrix | optional list[3] of list[3] of xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:rotation | record spatial:Rotation3D by vom:quantityValue maths:Quaternion maths:Vector4D
//   RevoluteJoint | property jointReferenceFrame | spatial:rotation maths:w | xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:rotation maths:x | xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:rotation maths:y | xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:rotation maths:z | xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:translation | record spatial:Translation3D by vom:quantityValue maths:Vector3D [m unit:M]
//   RevoluteJoint | property jointReferenceFrame | spatial:translation maths:x | xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:translation maths:y | xsd:double
//   RevoluteJoint | property jointReferenceFrame | spatial:translation maths:z | xsd:double
//   RevoluteJoint | property limits |  | record lrt:JointLimits
//   RevoluteJoint | property limits | by | read-only lrt:limits
//   RevoluteJoint | property limits | lrt:effortLimit | optional xsd:double [N.m unit:N-M]
//   RevoluteJoint | property limits | lrt:lowerLimit | optional xsd:double [rad unit:RAD]
//   RevoluteJoint | property limits | lrt:upperLimit | optional xsd:double [rad unit:RAD]
//   RevoluteJoint | property limits | lrt:velocityLimit | optional xsd:double [rad/s unit:RAD-PER-SEC]
//   RevoluteJoint | property position |  | xsd:double [rad unit:RAD]
//   RevoluteJoint | property position | by | writable ros:position
//   RevoluteJoint | property rotation |  | record spatial:AxisAngle spatial:Rotation3D
//   RevoluteJoint | property rotation | by | read-only ros:rotation
//   RevoluteJoint | property rotation | spatial:rotationAngle | xsd:float [rad unit:RAD]
//   RevoluteJoint | property rotation | spatial:rotationAxis | record maths:Vector3D
//   RevoluteJoint | property rotation | spatial:rotationAxis maths:x | xsd:float
//   RevoluteJoint | property rotation | spatial:rotationAxis maths:y | xsd:float
//   RevoluteJoint | property rotation | spatial:rotationAxis maths:z | xsd:float
//   RevoluteJoint | property velocity |  | xsd:double [rad/s unit:RAD-PER-SEC]
//   RevoluteJoint | property velocity | by | read-only ros:velocity
//   Robot |  |  | ros:Robot
//   Robot | action moveTo | by | asynchronous
//   Robot | action release | by | synchronous
//   Robot | action stop | by | synchronous
//   Robot | input of action moveTo |  | record ~/ns/vocabulary#JointAngles
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_e0 | xsd:float [deg unit:DEG], at least -174.99, at most 174.99
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_e1 | xsd:float [deg unit:DEG], at least -2.86, at most 150
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_s0 | xsd:float [deg unit:DEG], at least -97.49, at most 97.49
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_s1 | xsd:float [deg unit:DEG], at least -123.01, at most 59.98
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_w0 | xsd:float [deg unit:DEG], at least -175.26, at most 175.26
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_w1 | xsd:float [deg unit:DEG], at least -89.99, at most 119.97
//   Robot | input of action moveTo | ~/ns/vocabulary#JointAngles/right_w2 | xsd:float [deg unit:DEG], at least -175.26, at most 175.26
//   Robot | property positions |  | list[0..512] of xsd:double
//   Robot | property positions | by | read-only lrt:positions
//   Robot | property stopped |  | record lrt:StopState
//   Robot | property stopped | by | read-only lrt:stopState
//   Robot | property stopped | lrt:stopped | xsd:boolean
//   Robot | property stopped | lrt:stoppedBy | optional xsd:string
//   Robot | property stopped | lrt:stoppedSince | optional xsd:dateTime
//   World |  |  | ldp:BasicContainer ldp:Container ldp:RDFSource lrt:World
// Digest: 29745c5a5969c3c5
