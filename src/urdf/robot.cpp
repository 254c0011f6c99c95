// SPDX-License-Identifier: Apache-2.0
#include <lrt/urdf.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include <lrt/base/iri.hpp>
#include <lrt/eigen.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/read_file.hpp"
#include "src/urdf/packages.hpp"

namespace lrt::urdf {
inline namespace v0 {
namespace {

/// A field with a name of its own in JSON.
rdf::FieldName named(std::string_view name, Iri term) {
  rdf::FieldName field(term);
  field.name = name;
  return field;
}

}  // namespace
}  // namespace v0
}  // namespace lrt::urdf

template <>
struct lrt::rdf::traits<lrt::urdf::FileState> : lrt::rdf::Record<lrt::urdf::FileState> {
  static void describe(Record<lrt::urdf::FileState>& r) {
    using lrt::urdf::FileState;
    r.field(lrt::urdf::named("bytes", lrt::vocab::dcat::byteSize), &FileState::bytes);
    r.field(lrt::urdf::named("modified", lrt::vocab::schema::dateModified), &FileState::modified);
  }
};

namespace lrt::urdf {
inline namespace v0 {
namespace {

constexpr Unit newton_metre_second_per_radian{Iri{"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}, {}, "N.m.s/rad"};
constexpr Unit newton_second_per_metre{Iri{"http://qudt.org/vocab/unit/N-SEC-PER-M"}, {}, "N.s/m"};
constexpr Unit per_second{Iri{"http://qudt.org/vocab/unit/PER-SEC"}, {}, "/s"};
constexpr Unit kilogram_square_metre{Iri{"http://qudt.org/vocab/unit/KiloGM-M2"}, {}, "kg.m2", vocab::quantitykind::MomentOfInertia};

// Unaligned types: the alignment of Isometry3d and Quaterniond depends on compiler flags, which may differ between the library and its host.
using Isometry = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;
using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;

bool is_angular(JointType type) noexcept { return type == JointType::revolute || type == JointType::continuous; }

/// The units of a joint's numbers.
template <bool angular>
struct UnitsOf {
  static constexpr const Unit& position = angular ? unit::radian : unit::metre;
  static constexpr const Unit& velocity = angular ? unit::radian_per_second : unit::metre_per_second;
  static constexpr const Unit& effort = angular ? unit::newton_metre : unit::newton;
  static constexpr const Unit& damping = angular ? newton_metre_second_per_radian : newton_second_per_metre;
};

// The constant properties of joints and links. The units depend on the joint's type.
template <bool angular>
struct LimitsOf : Limits {};
template <bool angular>
struct DynamicsOf : Dynamics {};
template <bool angular>
struct SafetyOf : Safety {};
template <bool angular>
struct MimicOf : Mimic {};

struct Mass {
  double mass = 0;
  Isometry origin = Isometry::Identity();
  double ixx = 0, ixy = 0, ixz = 0, iyy = 0, iyz = 0, izz = 0;
};

struct Appearance {
  std::optional<std::string> name;
  Isometry origin = Isometry::Identity();
  Shape::Kind geometry = Shape::Kind::box;
  std::optional<Eigen::Vector3d> size;
  std::optional<double> radius, length;
  std::optional<Eigen::Vector3d> scale;
  std::optional<std::string> material;
  std::optional<std::array<double, 4>> colour;
};

}  // namespace
}  // namespace v0
}  // namespace lrt::urdf

namespace lrt::rdf {
inline namespace v0 {

template <bool angular>
struct traits<urdf::LimitsOf<angular>> : Record<urdf::LimitsOf<angular>> {
  using T = urdf::LimitsOf<angular>;
  using Units = urdf::UnitsOf<angular>;
  static void describe(Record<T>& r) {
    r.is(vocab::lrt_::JointLimits);
    r.field(urdf::named("lower", vocab::lrt_::lowerLimit), &T::lower).unit(Units::position).title("Lower limit", "en");
    r.field(urdf::named("upper", vocab::lrt_::upperLimit), &T::upper).unit(Units::position).title("Upper limit", "en");
    r.field(urdf::named("velocity", vocab::lrt_::velocityLimit), &T::velocity).unit(Units::velocity).title("Greatest velocity", "en");
    r.field(urdf::named("effort", vocab::lrt_::effortLimit), &T::effort).unit(Units::effort).title("Greatest effort", "en");
  }
};
template <bool angular>
struct traits<urdf::DynamicsOf<angular>> : Record<urdf::DynamicsOf<angular>> {
  using T = urdf::DynamicsOf<angular>;
  using Units = urdf::UnitsOf<angular>;
  static void describe(Record<T>& r) {
    r.is(vocab::lrt_::JointDynamics);
    r.field(vocab::lrt_::damping, &T::damping).unit(Units::damping).title("Damping", "en");
    r.field(urdf::named("friction", vocab::lrt_::staticFriction), &T::friction).unit(Units::effort).title("Static friction", "en");
  }
};
template <bool angular>
struct traits<urdf::SafetyOf<angular>> : Record<urdf::SafetyOf<angular>> {
  using T = urdf::SafetyOf<angular>;
  using Units = urdf::UnitsOf<angular>;
  static void describe(Record<T>& r) {
    r.is(vocab::lrt_::SafetyLimits);
    r.field(vocab::lrt_::softLowerLimit, &T::soft_lower_limit).unit(Units::position).title("Soft lower limit", "en");
    r.field(vocab::lrt_::softUpperLimit, &T::soft_upper_limit).unit(Units::position).title("Soft upper limit", "en");
    r.field(urdf::named("kPosition", vocab::lrt_::positionGain), &T::k_position).unit(urdf::per_second).title("Gain of the position", "en");
    r.field(urdf::named("kVelocity", vocab::lrt_::velocityGain), &T::k_velocity).unit(Units::damping).title("Gain of the velocity", "en");
  }
};
template <bool angular>
struct traits<urdf::MimicOf<angular>> : Record<urdf::MimicOf<angular>> {
  using T = urdf::MimicOf<angular>;
  static void describe(Record<T>& r) {
    r.is(vocab::lrt_::MimicRule);
    r.field(vocab::lrt_::multiplier, &T::multiplier).title("Multiplier", "en");
    r.field(vocab::lrt_::offset, &T::offset).unit(urdf::UnitsOf<angular>::position).title("Offset", "en");
  }
};

template <>
struct traits<urdf::Mass> : Record<urdf::Mass> {
  using T = urdf::Mass;
  static void describe(Record<T>& r) {
    r.is(vocab::lrt_::Inertia);
    r.field(vocab::lrt_::mass, &T::mass).unit(unit::kilogram).title("Mass", "en");
    r.field(urdf::named("origin", vocab::spatial::spatialRelationship), &T::origin).unit(unit::metre).title("Centre of mass", "en");
    r.field(vocab::lrt_::ixx, &T::ixx).unit(urdf::kilogram_square_metre).title("Moment of inertia xx", "en");
    r.field(vocab::lrt_::ixy, &T::ixy).unit(urdf::kilogram_square_metre).title("Moment of inertia xy", "en");
    r.field(vocab::lrt_::ixz, &T::ixz).unit(urdf::kilogram_square_metre).title("Moment of inertia xz", "en");
    r.field(vocab::lrt_::iyy, &T::iyy).unit(urdf::kilogram_square_metre).title("Moment of inertia yy", "en");
    r.field(vocab::lrt_::iyz, &T::iyz).unit(urdf::kilogram_square_metre).title("Moment of inertia yz", "en");
    r.field(vocab::lrt_::izz, &T::izz).unit(urdf::kilogram_square_metre).title("Moment of inertia zz", "en");
  }
};

template <>
struct traits<urdf::Shape::Kind> : Enumeration<urdf::Shape::Kind> {
  using Kind = urdf::Shape::Kind;
  static void describe(Enumeration<Kind>& e) {
    e.name(Kind::box, "box").name(Kind::cylinder, "cylinder").name(Kind::sphere, "sphere");
    e.name(Kind::capsule, "capsule").name(Kind::mesh, "mesh");
  }
};

template <>
struct traits<urdf::Appearance> : Record<urdf::Appearance> {
  using T = urdf::Appearance;
  static void describe(Record<T>& r) {
    r.is(vocab::lrt_::Geometry);
    r.field(vocab::schema::name, &T::name);
    r.field(urdf::named("origin", vocab::spatial::spatialRelationship), &T::origin).unit(unit::metre);
    r.field(urdf::named("geometry", vocab::lrt_::geometryType), &T::geometry).title("Kind of shape", "en");
    r.field(vocab::lrt_::size, &T::size).unit(unit::metre);
    r.field(vocab::lrt_::radius, &T::radius).unit(unit::metre);
    r.field(vocab::lrt_::length, &T::length).unit(unit::metre);
    r.field(urdf::named("scale", vocab::spatial::scaling), &T::scale);
    r.field(urdf::named("material", vocab::lrt_::materialName), &T::material);
    r.field(vocab::lrt_::colour, &T::colour);
  }
};

}  // namespace v0
}  // namespace lrt::rdf

namespace lrt::urdf {
inline namespace v0 {
namespace {

Isometry isometry(const Pose& pose) {
  Isometry out = Isometry::Identity();
  out.linear() = Quaternion(pose.orientation.data()).toRotationMatrix();
  out.translation() = Eigen::Map<const Eigen::Vector3d>(pose.position.data());
  return out;
}

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// A file name of a description. If it is an IRI except for unencoded characters, these are encoded; else the text is kept.
Object file(std::string_view name) {
  std::string text;
  constexpr char hex[] = "0123456789ABCDEF";
  const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); };
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    const bool escape = c == '%' && i + 2 < name.size() && is_hex(name[i + 1]) && is_hex(name[i + 2]);
    if (escape || (c != '%' && std::string_view(" <>\"{}|^`\\").find(c) == std::string_view::npos)) {
      text += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      text += {'%', hex[byte >> 4U], hex[byte & 15U]};
    }
  }
  const iri::Parts parts = iri::split(text);
  if (parts.has_scheme && parts.scheme.size() > 1 && iri::is_absolute(text)) return Object(Iri(std::string_view(text)));
  return Object::typed(std::string(name), vocab::xsd::anyURI);
}

Iri class_of(JointType type) noexcept {
  switch (type) {
    case JointType::revolute: return vocab::ros::RevoluteJoint;
    case JointType::continuous: return vocab::ros::ContinuousJoint;
    case JointType::prismatic: return vocab::ros::PrismaticJoint;
    case JointType::floating: return vocab::ros::FloatingJoint;
    case JointType::planar: return vocab::ros::PlanarJoint;
    default: return vocab::ros::FixedJoint;
  }
}

template <class T>
PushedProperty<T> constant(Thing& thing, std::string_view path, const T& value, const Unit& unit = unit::none) {
  PushedProperty<T> property = thing.property<T>(path, unit);
  property.publish(value);
  return property;
}

/// Words for people.
template <class T>
void say(PushedProperty<T> property, const char* title, const char* description) {
  property.title(title, "en").description(description, "en");
}

}  // namespace

class LRT_LOCAL Robot::Impl {
 public:
  Impl(Model model, std::string_view path) : model_(std::move(model)), path_(path) {
    if (path_.empty()) path_ = model_.name.empty() ? "robot" : segment(model_.name);
    name_all();
    order_joints();
    thing_.emplace(path_);
    describe_robot();
    for (std::size_t j = 0; j < model_.joints.size(); ++j) describe_joint(j);
    for (std::size_t l = 0; l < model_.links.size(); ++l) describe_link(l);
    turn();
  }

  // --- for the control loop

  /// @param at  time of the values; nullptr: now
  void publish(Numbers positions, Numbers velocities, Numbers efforts, const std::chrono::system_clock::time_point* at) noexcept {
    const auto put = [at](auto& property, const auto& value) noexcept { at ? property.publish(value, *at) : property.publish(value); };
    const auto finite = [](Numbers numbers, std::size_t i) { return i < numbers.size() && std::isfinite(numbers[i]); };
    for (std::size_t i = 0; i < model_.variables.size(); ++i) {
      const std::size_t joint = model_.variables[i];
      if (finite(positions, i)) values_[joint] = positions[i];
      if (finite(efforts, i)) put(moving_[of_joint_[joint]].effort, efforts[i]);
    }
    for (Moving& m : moving_) {
      if (m.joint != m.source) values_[m.joint] = m.multiplier * values_[m.source] + m.offset;
      put(m.position, values_[m.joint]);
      if (m.rotation) put(*m.rotation, Eigen::AngleAxisf(static_cast<float>(values_[m.joint]), m.axis));
      if (finite(velocities, m.variable)) put(m.velocity, m.multiplier * velocities[m.variable]);
    }
    if (all_) {
      for (std::size_t i = 0; i < moving_.size(); ++i) list_[static_cast<Eigen::Index>(i)] = values_[moving_[i].joint];
      put(*all_, list_);
    }
    turn();
    for (std::size_t l = 0; l < poses_.size(); ++l)
      if (moves_[l] || !published_) put(link_poses_[l], poses_[l]);
    published_ = true;
  }
  void move(std::size_t joint, const Pose& to) noexcept {
    const JointType type = model_.joints[joint].type;
    if (type != JointType::floating && type != JointType::planar) return;
    const Eigen::Map<const Eigen::Vector3d> at(to.position.data());
    const Quaternion turned(to.orientation.data());
    if (!at.allFinite() || !(std::abs(turned.norm() - 1) <= 1e-6)) return;
    free_[joint].translation() = at;
    free_[joint].linear() = turned.normalized().toRotationMatrix();
  }
  Pose pose(std::size_t link) const noexcept {
    const Quaternion turned(poses_[link].linear());
    const Eigen::Vector3d at = poses_[link].translation();
    return {{at.x(), at.y(), at.z()}, {turned.x(), turned.y(), turned.z(), turned.w()}};
  }

  // --- meshes

  std::vector<std::string> serve_meshes(const PackageOptions& options) {
    std::vector<std::string> warnings;
    std::unordered_map<std::string, std::string> served;  // path by name; empty: not served
    Thing all(path_ + "/meshes");
    all.default_title("Meshes").add(vocab::rdfs::seeAlso, Object::resource(path_));
    for (NamedMesh& mesh : meshes_) {
      const auto [known, is_new] = served.emplace(mesh.name, std::string());
      if (is_new) {
        if (Result<PackageFile> found = find_file(mesh.name, options)) known->second = serve(all, *std::move(found), options.max_bytes);
        else warnings.push_back("mesh \"" + mesh.name + "\" is not served: " + found.error().message);
      }
      if (!known->second.empty()) mesh.shape.add(vocab::dcat::downloadURL, Object::resource(known->second));
    }
    if (!served_.empty()) meshes_thing_.emplace(std::move(all));
    return warnings;
  }

  Model model_;
  std::string path_;
  std::optional<Thing> meshes_thing_;  // until things()
  std::vector<std::string> joint_paths_, link_paths_;
  std::optional<Thing> thing_;
  std::vector<Thing> joint_things_, link_things_;

  PushedProperty<double>& position(std::size_t joint) noexcept {
    return model_.joints[joint].takes_commands ? moving_[of_joint_[joint]].position : without_commands_;
  }

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  static constexpr int most_in_list = 512;
  using List = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::DontAlign, most_in_list, 1>;  // publish() does not allocate

  /// A joint with a position.
  struct Moving {
    std::size_t joint, source;  ///< the joint at the end of its chain of mimics; itself if it mimics none
    double multiplier, offset;
    std::size_t variable;  ///< index of the source in Model::variables
    PushedProperty<double> position, velocity, effort;
    std::optional<PushedProperty<Eigen::AngleAxisf>> rotation;
    Eigen::Vector3f axis;
  };
  /// A joint in the kinematic computation.
  struct Step {
    std::size_t joint, parent, child;
    JointType type;
    Isometry origin;
    Eigen::Vector3d axis;
  };

  /// The poses of all links.
  void turn() noexcept {
    for (const Step& s : steps_) {
      Isometry& pose = poses_[s.child];
      pose = poses_[s.parent] * s.origin;
      switch (s.type) {
        case JointType::revolute:
        case JointType::continuous: pose.linear() = (pose.linear() * Eigen::AngleAxisd(values_[s.joint], s.axis).toRotationMatrix()).eval(); break;
        case JointType::prismatic: pose.translation() += pose.linear() * (values_[s.joint] * s.axis); break;
        case JointType::floating:
        case JointType::planar: pose = pose * free_[s.joint]; break;
        case JointType::fixed: break;
      }
    }
  }

  // --- meshes

  /// @return  its path below the server's root
  std::string serve(Thing& all, PackageFile found, std::size_t max_bytes) {
    const std::string name = found.package + '/' + found.name;
    std::string path = path_ + "/meshes/" + name;
    if (!served_.insert(name).second) return path;  // named in two ways
    const auto media_type = found.media_type;
    all.property(name, [file = std::move(found), max_bytes] { return state_of(file, max_bytes).value(); })
        .title("Mesh", "en")
        .description("A file with the shape of a link.", "en")
        .predicate(vocab::lrt_::file)
        .sample(std::chrono::milliseconds(0))
        .representation(media_type, [max_bytes](const FileState& file) { return read_file(file, max_bytes); })
        .as_file()
        .dispatch(Dispatch::io_thread);
    return path;
  }

  // --- names

  static std::string segment(std::string name) {
    std::replace(name.begin(), name.end(), '/', '.');
    return name == "." || name == ".." ? name + '_' : name;
  }
  void name_all() {
    std::unordered_set<std::string> taken = {"meshes", "positions"};  // of the robot itself
    std::unordered_map<std::string, std::size_t> counts;              // of duplicate paths
    const auto take = [&](const std::string& name, const char* suffix) {
      const std::string wanted = segment(name);
      std::string path = wanted;
      while (!taken.insert(path).second) {
        const std::size_t count = ++counts[wanted + suffix];
        path = wanted + suffix + (count > 1 ? std::to_string(count) : "");
      }
      return path_ + '/' + path;
    };
    for (const Joint& j : model_.joints) joint_paths_.push_back(take(j.name, "_joint"));
    for (const Link& l : model_.links) link_paths_.push_back(take(l.name, "_link"));
  }

  // --- kinematics

  void order_joints() {
    const std::size_t count = model_.joints.size();
    after_.resize(model_.links.size());
    for (std::size_t j = 0; j < count; ++j) after_[model_.joints[j].parent].push_back(j);
    values_.assign(count, 0);
    free_.assign(count, Isometry::Identity());
    poses_.assign(model_.links.size(), Isometry::Identity());
    moves_.assign(model_.links.size(), false);
    std::vector<std::size_t> way{model_.root};
    for (std::size_t i = 0; i < way.size(); ++i)
      for (const std::size_t j : after_[way[i]]) {
        const Joint& joint = model_.joints[j];
        steps_.push_back({j, joint.parent, joint.child, joint.type, isometry(joint.origin), vector(joint.axis)});
        moves_[joint.child] = moves_[joint.parent] || joint.type != JointType::fixed;
        way.push_back(joint.child);
      }
    for (const std::size_t j : model_.variables) {
      const std::optional<Limits>& limits = model_.joints[j].limits;
      if (limits) values_[j] = limits->clamp(0);
    }
  }

  // --- Things

  void describe_robot() {
    thing_->default_title(model_.name.empty() ? "robot" : model_.name).type(vocab::ros::Robot);
    thing_->add(vocab::lrt_::rootLink, Object::resource(link_paths_[model_.root]));
    // The joints of the list, in its order: an RDF list relative to the Thing.
    std::string order = "<> <" + std::string(vocab::lrt_::positionsOf.text) + "> (";
    const std::size_t below = path_.rfind('/') == std::string::npos ? 0 : path_.rfind('/') + 1;
    int count = 0;
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      if (!model_.joints[j].has_position()) continue;
      ++count;
      const std::size_t name = joint_paths_[j].rfind('/');
      order += " <./" + iri::encode_segment(joint_paths_[j].substr(below, name - below)) + '/' +
               iri::encode_segment(joint_paths_[j].substr(name + 1)) + '>';
    }
    if (count == 0 || count > most_in_list) return;
    list_.setZero(count);
    thing_->add_turtle(order + " ) .");
    all_ = thing_->property<List>("positions");
    all_->predicate(vocab::lrt_::positions)
        .title("Positions", "en")
        .description("The positions of all joints that move, in the order of lrt:positionsOf.", "en");
  }

  void describe_joint(std::size_t index) {
    const Joint& joint = model_.joints[index];
    Thing& thing = joint_things_.emplace_back(joint_paths_[index]);
    const Object before = Object::resource(link_paths_[joint.parent]), after = Object::resource(link_paths_[joint.child]);
    thing.default_title(joint.name)
        .type(vocab::ros::Joint)
        .type(class_of(joint.type))
        .add(vocab::rdfs::seeAlso, Object::resource(path_))
        .add(vocab::xhv::prev, before)
        .add(vocab::xhv::next, after)
        .add(vocab::ros::preceedingLink, before)
        .add(vocab::ros::succeedingLink, after);
    if (is_angular(joint.type)) describe_numbers<true>(thing, index);
    else describe_numbers<false>(thing, index);
  }
  template <bool angular>
  void describe_numbers(Thing& thing, std::size_t index) {  // moving properties first, for readers
    describe_motion<angular>(thing, index);
    const Joint& joint = model_.joints[index];
    const Object before = Object::resource(link_paths_[joint.parent]), after = Object::resource(link_paths_[joint.child]);
    constant(thing, "jointReferenceFrame", isometry(joint.origin), unit::metre)
        .title("Reference frame", "en")
        .description("Where the joint is, seen from the link before it.", "en")
        .predicate(vocab::ros::jointReferenceFrame)
        .type(vocab::maths::CoordinateSystem)
        .frame(before)
        .add(vocab::spatial::targetCoordinateSystem, Object::resource(joint_paths_[index] + "/jointReferenceFrame"));
    if (joint.type != JointType::fixed && joint.type != JointType::floating)
      say(constant(thing, "axis", vector(joint.axis)).predicate(vocab::lrt_::axis).frame(after), "Axis",
          angular ? "The direction around which the joint turns." : "The direction of the joint's movement.");
    if (joint.limits)
      say(constant(thing, "limits", LimitsOf<angular>{*joint.limits}).predicate(vocab::lrt_::limits), "Limits",
          "How far and how fast the joint moves, and how strong it is.");
    if (joint.dynamics)
      say(constant(thing, "dynamics", DynamicsOf<angular>{*joint.dynamics}).predicate(vocab::lrt_::dynamics), "Dynamics",
          "Damping and friction of the joint.");
    if (joint.safety)
      say(constant(thing, "safety", SafetyOf<angular>{*joint.safety}).predicate(vocab::lrt_::safety), "Safety limits",
          "Where the controller begins to slow the joint down.");
    if (joint.mimic) {
      thing.add(vocab::lrt_::mimics, Object::resource(joint_paths_[joint.mimic->joint]));
      say(constant(thing, "mimic", MimicOf<angular>{*joint.mimic}).predicate(vocab::lrt_::mimic), "Mimic rule",
          "How the position follows from that of another joint.");
    }
  }
  template <bool angular>
  void describe_motion(Thing& thing, std::size_t index) {
    const Joint& joint = model_.joints[index];
    of_joint_.push_back(none);
    if (!joint.has_position()) return;
    of_joint_.back() = moving_.size();
    auto position = thing.property<double>("position", UnitsOf<angular>::position);
    say(position.predicate(vocab::ros::position), "Position",
        angular ? "The angle of the joint; zero is its reference position." : "How far the joint is moved along its axis.");
    if (!joint.mimic && joint.limits) {
      if (joint.limits->lower) position.at_least(*joint.limits->lower);
      if (joint.limits->upper) position.at_most(*joint.limits->upper);
    }
    auto velocity = thing.property<double>("velocity", UnitsOf<angular>::velocity);
    say(velocity.predicate(vocab::ros::velocity), "Velocity", angular ? "How fast the joint turns." : "How fast the joint moves.");
    auto effort = thing.property<double>("effort", UnitsOf<angular>::effort);
    say(effort.predicate(vocab::ros::effort), "Effort", angular ? "The torque of the joint's motor." : "The force of the joint's motor.");

    std::size_t source = index;
    double multiplier = 1, offset = 0;
    while (model_.joints[source].mimic) {
      const Mimic& mimic = *model_.joints[source].mimic;
      offset += multiplier * mimic.offset;
      multiplier *= mimic.multiplier;
      source = mimic.joint;
    }
    const auto variable = std::find(model_.variables.begin(), model_.variables.end(), source) - model_.variables.begin();
    if (source != index) values_[index] = multiplier * values_[source] + offset;
    moving_.push_back(
        {index, source, multiplier, offset, static_cast<std::size_t>(variable), position, velocity, effort, {}, vector(joint.axis).cast<float>()});
    if constexpr (angular) {
      auto rotation = thing.property<Eigen::AngleAxisf>("rotation");
      say(rotation.predicate(vocab::ros::rotation).frame(Object::resource(link_paths_[joint.child])), "Rotation",
          "The angle of the joint and the axis around which it turns.");
      moving_.back().rotation = rotation;
    }
  }

  void describe_link(std::size_t index) {
    const Link& link = model_.links[index];
    const Object itself = Object::resource(link_paths_[index]);
    Thing& thing = link_things_.emplace_back(link_paths_[index]);
    thing.default_title(link.name).type(vocab::ros::Link).add(vocab::rdfs::seeAlso, Object::resource(path_));
    if (link.joint) thing.add(vocab::xhv::prev, Object::resource(joint_paths_[*link.joint]));
    for (const std::size_t j : after_[index]) thing.add(vocab::xhv::next, Object::resource(joint_paths_[j]));
    auto pose = thing.property<Isometry>("pose", unit::metre);
    say(pose, "Pose", "Where the link is, seen from the root link.");
    pose.predicate(vocab::lrt_::pose).frame(Object::resource(link_paths_[model_.root])).add(vocab::spatial::targetCoordinateSystem, itself);
    link_poses_.push_back(pose);
    if (const auto& i = link.inertial)
      say(constant(thing, "inertial",
                   Mass{i->mass, isometry(i->origin), i->inertia[0], i->inertia[1], i->inertia[2], i->inertia[3], i->inertia[4], i->inertia[5]})
              .predicate(vocab::lrt_::inertial)
              .frame(itself),
          "Inertia", "Mass, centre of mass and moments of inertia of the link.");
    for (std::size_t i = 0; i < link.visuals.size(); ++i)
      describe_shape(thing, vocab::lrt_::visual, "visual/" + std::to_string(i + 1), link.visuals[i], itself);
    for (std::size_t i = 0; i < link.collisions.size(); ++i)
      describe_shape(thing, vocab::lrt_::collision, "collision/" + std::to_string(i + 1), link.collisions[i], itself);
  }
  void describe_shape(Thing& thing, Iri predicate, const std::string& path, const Shape& shape, const Object& link) {
    Appearance appearance;
    if (!shape.name.empty()) appearance.name = shape.name;
    appearance.origin = isometry(shape.origin);
    appearance.geometry = shape.kind;
    if (shape.kind == Shape::Kind::box) appearance.size = vector(shape.size);
    const bool is_long = shape.kind == Shape::Kind::cylinder || shape.kind == Shape::Kind::capsule;
    if (is_long || shape.kind == Shape::Kind::sphere) appearance.radius = shape.radius;
    if (is_long) appearance.length = shape.length;
    if (shape.kind == Shape::Kind::mesh) appearance.scale = vector(shape.scale);
    if (shape.material) {
      if (!shape.material->name.empty()) appearance.material = shape.material->name;
      appearance.colour = shape.material->colour;
    }
    PushedProperty<Appearance> property = constant(thing, path, appearance);
    say(property.predicate(predicate).frame(link), predicate == vocab::lrt_::visual ? "Visual shape" : "Collision shape",
        predicate == vocab::lrt_::visual ? "What the link looks like." : "The shape with which collisions are computed.");
    if (shape.kind == Shape::Kind::mesh) {
      property.add(vocab::lrt_::mesh, file(shape.mesh));
      meshes_.push_back({shape.mesh, property});
    }
    if (shape.material && !shape.material->texture.empty()) property.add(vocab::lrt_::texture, file(shape.material->texture));
  }

  struct NamedMesh {
    std::string name;  // in the document
    PushedProperty<Appearance> shape;
  };
  std::vector<NamedMesh> meshes_;
  std::unordered_set<std::string> served_;       // meshes, by package and name
  std::vector<std::vector<std::size_t>> after_;  // joints whose parent is this link
  std::vector<Step> steps_;                      // parents first
  std::vector<double> values_;                   // of each joint
  std::vector<Isometry> free_;                   // of each joint, where it is floating or planar
  std::vector<Isometry> poses_;                  // of each link
  std::vector<bool> moves_;                      // of each link
  Thing unserved_{"unserved"};                   ///< no server gets it
  PushedProperty<double> without_commands_ = unserved_.property<double>("position");
  std::vector<Moving> moving_;
  std::vector<std::size_t> of_joint_;  // index of each joint in moving_
  std::vector<PushedProperty<Isometry>> link_poses_;
  std::optional<PushedProperty<List>> all_;
  List list_;
  bool published_ = false;
};

Robot::Robot(Model model, std::string_view path) : impl_(std::make_unique<Impl>(std::move(model), path)) {}
Robot::Robot(Robot&&) noexcept = default;
Robot& Robot::operator=(Robot&&) noexcept = default;
Robot::~Robot() = default;

const Model& Robot::model() const noexcept { return impl_->model_; }
const std::string& Robot::path() const noexcept { return impl_->path_; }
const std::string& Robot::joint_path(std::size_t joint) const noexcept { return impl_->joint_paths_[joint]; }
const std::string& Robot::link_path(std::size_t link) const noexcept { return impl_->link_paths_[link]; }
Thing& Robot::thing() noexcept { return *impl_->thing_; }
Thing& Robot::joint(std::size_t joint) noexcept { return impl_->joint_things_[joint]; }
Thing& Robot::link(std::size_t link) noexcept { return impl_->link_things_[link]; }
PushedProperty<double>& Robot::position(std::size_t joint) noexcept { return impl_->position(joint); }
std::vector<std::string> Robot::serve_meshes(const PackageOptions& options) { return impl_->serve_meshes(options); }
void Robot::publish(Numbers positions, Numbers velocities, Numbers efforts) noexcept { impl_->publish(positions, velocities, efforts, nullptr); }
void Robot::publish(Numbers positions, Numbers velocities, Numbers efforts, std::chrono::system_clock::time_point at) noexcept {
  impl_->publish(positions, velocities, efforts, &at);
}
void Robot::move(std::size_t joint, const Pose& to) noexcept { impl_->move(joint, to); }
Pose Robot::pose(std::size_t link) const noexcept { return impl_->pose(link); }

std::vector<Thing> Robot::things() {
  assert(impl_->thing_);
  std::vector<Thing> all;
  all.push_back(*std::move(impl_->thing_));
  impl_->thing_.reset();
  for (Thing& joint : impl_->joint_things_) all.push_back(std::move(joint));
  for (Thing& link : impl_->link_things_) all.push_back(std::move(link));
  if (impl_->meshes_thing_) all.push_back(*std::move(impl_->meshes_thing_));
  return all;
}

Result<Robot> load(const std::string& file, const ParseOptions& options) {
  const Result<std::string> text = lrt::read_file(file, options.max_bytes);
  if (!text) return Unexpected{text.error()};
  Result<Model> model = parse(*text, options);
  if (!model) {
    Error error = std::move(model).error();
    error.message = file + ": " + error.message;
    return Unexpected{std::move(error)};
  }
  return Robot(*std::move(model), options.path);
}

}  // namespace v0
}  // namespace lrt::urdf
