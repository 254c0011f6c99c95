// SPDX-License-Identifier: Apache-2.0
#pragma once

// A robot with a URDF description as Linked Robotic Things. Needs the target lrt::urdf; not part of lrt.hpp.
//
//   auto robot = lrt::urdf::load("robot.urdf");        // Result<Robot>
//   robot->add_to(server);                             // a Thing for the robot, each joint and each link
//   robot->publish(positions);                         // in the control loop: joints, and the pose of every link

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/property.hpp>
#include <lrt/thing.hpp>

namespace lrt::urdf {
inline namespace v0 {

/// Position [m] and orientation of one frame in another. The orientation is a unit quaternion in the order x y z w. The
/// type has no Eigen members, because their alignment depends on compiler flags; `Eigen::Map<const
/// Eigen::Quaterniond>(p.orientation.data())` is a view.
struct Pose {
  std::array<double, 3> position{0, 0, 0};        ///< x y z [m]
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< x y z w, norm 1
};

/// The types of joints of URDF.
enum class JointType : std::uint8_t { revolute, continuous, prismatic, fixed, floating, planar };
/// The enumerator's name, "revolute".
/// @par Threads  Any.
LRT_API std::string_view to_string(JointType type) noexcept;

/// The limits of a joint: rad, rad/s and N m for revolute and continuous joints, m, m/s and N for others. A limit that
/// is missing or infinite in the document has no value.
struct Limits {
  /// @{
  /// Limits of the position of a revolute or prismatic joint; no values if lower > upper in the document.
  std::optional<double> lower, upper;
  /// @}
  /// @{
  /// Maximum.
  std::optional<double> velocity, effort;
  /// @}

  /// The nearest position within the limits.
  double clamp(double position) const noexcept {
    if (lower) position = std::max(position, *lower);
    return upper ? std::min(position, *upper) : position;
  }
};
/// Physical properties of a joint.
struct Dynamics {
  double damping = 0;   ///< [N m s/rad], [N s/m]
  double friction = 0;  ///< static [N m], [N]
};
/// Parameters of the safety controller of a joint.
struct Safety {
  /// @{
  /// Soft limits of the position.
  double soft_lower_limit = 0, soft_upper_limit = 0;
  /// @}
  double k_position = 0;  ///< [1/s]
  double k_velocity = 0;  ///< [N m s/rad], [N s/m]
};
/// A joint that follows another one: position = multiplier * position of the other joint + offset.
struct Mimic {
  std::size_t joint = 0;  ///< index in Model::joints
  /// @{
  /// Factor, and offset in the unit of the position.
  double multiplier = 1, offset = 0;
  /// @}
};

/// A joint: it connects two links.
struct Joint {
  std::string name;                   ///< unique among the joints
  JointType type = JointType::fixed;  ///< how it moves
  /// @{
  /// Indices in Model::links.
  std::size_t parent = 0, child = 0;
  /// @}
  Pose origin;                          ///< of the joint's frame in the parent's frame; at position 0 the child's frame is the joint's frame
  std::array<double, 3> axis{1, 0, 0};  ///< unit vector in the joint's frame; planar joint: the normal of the plane
  std::optional<Limits> limits;         ///< nullopt: none in the document
  std::optional<Dynamics> dynamics;     ///< nullopt: none in the document
  std::optional<Safety> safety;         ///< nullopt: none in the document
  std::optional<Mimic> mimic;           ///< nullopt: it does not follow another joint
  std::uint32_t line = 0;               ///< in the document, from 1
  bool takes_commands = true;           ///< false: its limits in the document are not numbers, or the lower is above the upper

  /// Whether its position is one number: true for revolute, continuous and prismatic joints.
  bool has_position() const noexcept { return type <= JointType::prismatic; }
};

/// Mass and inertia of a link.
struct Inertial {
  Pose origin;                      ///< of the centre of mass in the link's frame; its orientation is that of the tensor's axes
  double mass = 0;                  ///< [kg]
  std::array<double, 6> inertia{};  ///< xx xy xz yy yz zz about the centre of mass [kg m^2]
};
/// The look of a visual shape.
struct Material {
  std::string name;                             ///< as in the document
  std::optional<std::array<double, 4>> colour;  ///< red, green, blue, alpha, 0 to 1
  std::string texture;                          ///< file name or IRI as in the document
};
/// A visual or collision shape of a link.
struct Shape {
  /// The geometry.
  enum class Kind : std::uint8_t { box, cylinder, sphere, capsule, mesh };
  std::string name;              ///< as in the document; may be empty
  Pose origin;                   ///< in the link's frame
  Kind kind = Kind::box;         ///< the geometry
  std::array<double, 3> size{};  ///< box: the edge lengths along x y z [m]
  /// @{
  /// The dimensions of a cylinder along z, a capsule (`length` without the two half spheres) or a sphere (`radius` only) [m].
  double radius = 0, length = 0;
  /// @}
  std::string mesh;                      ///< file name or IRI as in the document
  std::array<double, 3> scale{1, 1, 1};  ///< of a mesh, along x y z
  std::optional<Material> material;      ///< of a visual
};
/// A link: a rigid body with its frame.
struct Link {
  std::string name;                  ///< unique among the links
  std::optional<Inertial> inertial;  ///< nullopt: none in the document
  /// @{
  /// Its shapes, in the document's order.
  std::vector<Shape> visuals, collisions;
  /// @}
  std::optional<std::size_t> joint;  ///< the joint whose child it is; nullopt: the root
  std::uint32_t line = 0;            ///< in the document, from 1
};

/// The content of a URDF: a tree of joints and links, both in the document's order.
struct Model {
  std::string name;                    ///< of the robot
  std::vector<Joint> joints;           ///< in the document's order
  std::vector<Link> links;             ///< in the document's order
  std::size_t root = 0;                ///< index of the link that is not the child of a joint
  std::vector<std::size_t> variables;  ///< indices of joints with a position of their own, which do not mimic another joint
  std::vector<std::string> warnings;   ///< irregular elements, with their lines, that were left out or corrected
};

/// Options and limits of parse().
struct ParseOptions {
  /// The path of the robot's Thing; empty: the robot's name.
  std::string path;
  /// Values for `${name}` and `$(arg name)`. A xacro:arg or xacro:property of a name with a value is ignored. Other
  /// xacro elements and other `${...}` are errors; other `$(...)` are plain text.
  std::map<std::string, std::string> arguments;
  std::size_t max_bytes = 16 * 1024 * 1024;  ///< of the document; more: limit_exceeded
  std::size_t max_elements = 100'000;        ///< of the document; more: limit_exceeded
};

/// Reads a description in URDF 1.0 to 1.2. Elements that are not part of URDF (gazebo, transmission, ...) are ignored,
/// and so are the limits of acceleration, deceleration and jerk of version 1.2.
///
/// Joints, links and masses must be valid: names, references, numbers; the mass, ixx, iyy and izz must not be negative.
/// Irregular limits, dynamics, safety controllers, mimics of unknown joints, products of inertia, shapes and materials
/// are common in real files: they are left out with a warning in Model::warnings. A joint whose lower or upper limit is
/// not a number, or whose lower limit is above the upper one, takes no commands (Joint::takes_commands): a joint without
/// limits must not come from a typo. Rounding errors are corrected with a warning: a mass above -1e-9 kg, a moment of inertia above -1e-9 of the link's largest moment or above -1e-12 m2 times its mass, and limits, a
/// velocity or an effort that are wrong by at most 1e-9 of their size (or of 1). If an element is repeated where one is
/// allowed, the first one is used, with a warning.
///
/// @par Errors   The first error, with the element and its line. expected_value: invalid XML; no tree; an invalid
///               number; a missing element or attribute; a duplicate name; an unknown type; xacro that was not
///               expanded. limit_exceeded.
/// @par Threads  Any.
LRT_API Result<Model> parse(std::string_view text, const ParseOptions& options = {});

namespace detail {
/// Whether the members are contiguous. Only some types of Eigen are not.
template <class Container, class = void>
struct IsDense : std::true_type {};
template <class Container>
struct IsDense<Container, std::void_t<decltype(Container::InnerStrideAtCompileTime)>>
    : std::bool_constant<int(Container::InnerStrideAtCompileTime) == 1> {};
}  // namespace detail

/// A view of contiguous numbers for the duration of a call: a std::vector, std::array or Eigen::VectorXd of double. A
/// row of an Eigen matrix is not contiguous and does not compile.
class Numbers {
 public:
  Numbers() = default;
  /// @{
  /// A view of numbers, which must exist during the call.
  Numbers(const double* data, std::size_t size) : data_(data), size_(size) {}
  template <class Container, class = decltype(std::declval<const Container&>().data()), class = std::enable_if_t<detail::IsDense<Container>::value>>
  Numbers(const Container& numbers) : data_(numbers.data()), size_(static_cast<std::size_t>(numbers.size())) {}  // NOLINT: a view
  /// @}
  std::size_t size() const noexcept { return size_; }                   ///< how many
  double operator[](std::size_t i) const noexcept { return data_[i]; }  ///< a number. @pre i < size()

 private:
  const double* data_ = nullptr;
  std::size_t size_ = 0;
};

/// The files of ROS packages that may be served.
struct PackageOptions {
  /// The folder of each package: {"pr2_description", "/opt/ros/noetic/share/pr2_description"}. Files of other packages
  /// are not served.
  std::map<std::string, std::string> folders;
  std::size_t max_bytes = 64 * 1024 * 1024;  ///< of a file; larger files are not served
};

/// The Things of a robot, and its kinematics.
///
/// `/<robot>` is a ros:Robot; its joints and links are `/<robot>/<name>`. A '/' in a name becomes '.'. If two paths
/// would be equal, the link's gets the suffix "_link" and the joint's "_joint".
///
///   robot  dcterms:hasPart: joints and links; lrt:rootLink. Property `positions` (lrt:positions): the positions of all joints that have one, in
///          the order of the list of joints lrt:positionsOf (only up to 512 joints)
///   joint  a ros:Joint and a ros:RevoluteJoint or the like. ros:preceedingLink, ros:succeedingLink, xhv:prev, xhv:next: links;
///          lrt:mimics: a joint. Properties `jointReferenceFrame` (ros:jointReferenceFrame), `axis` (lrt:axis), `limits` (lrt:limits), `dynamics`
///          (lrt:dynamics), `safety` (lrt:safety), `mimic` (lrt:mimic), and, if it has a position, `position` (ros:position), `velocity`
///          (ros:velocity) and `effort` (ros:effort); a revolute or continuous joint also `rotation` (ros:rotation, an Eigen::AngleAxisf as in
///          Figure 3). These have no value before publish()
///   link   a ros:Link. xhv:prev, xhv:next: joints. Properties `pose` (lrt:pose) in the frame of the root link, `inertial` (lrt:inertial),
///          `visual/1` ... (lrt:visual), `collision/1` ... (lrt:collision); these link to meshes (lrt:mesh) and textures (lrt:texture): by IRI if
///          the document has IRIs, by xsd:anyURI literals if it has relative names
///
/// docs/modelling.md lists the predicate of each field. A pose states its frames by spatial:sourceCoordinateSystem
/// and spatial:targetCoordinateSystem; other values whose coordinates refer to a frame name it by lrt:frame. The IRI of
/// a link also denotes its frame.
///
/// @par Threads     Set-up: one thread at a time. publish, move, pose: one thread at a time, for example the control
///                  loop's.
/// @par Implements  R0.3, R1.3, R1.9, paper Figures 2b and 3
class LRT_API Robot {
 public:
  /// Makes the Things of a robot. Every joint starts at 0, or at the nearest limit.
  /// @param path  the path of its Thing; empty: the model's name, or "robot" if that is empty
  /// @pre         the model was returned by parse()
  explicit Robot(Model model, std::string_view path = {});
  Robot(Robot&&) noexcept;
  Robot& operator=(Robot&&) noexcept;
  ~Robot();

  const Model& model() const noexcept;  ///< the description
  /// The path of its Thing, "baxter": without a leading '/' and not encoded, as Thing and Object::resource expect
  /// paths.
  const std::string& path() const noexcept;
  const std::string& joint_path(std::size_t joint) const noexcept;  ///< path of a joint's Thing, "baxter/right_s1"; see path()
  const std::string& link_path(std::size_t link) const noexcept;    ///< path of a link's Thing; see path()

  /// @{
  /// The Things, for adding actions, further properties and triples. Use them before add_to().
  Thing& thing() noexcept;
  Thing& joint(std::size_t joint) noexcept;
  Thing& link(std::size_t link) noexcept;
  /// @}
  /// The property `position`. It is bounded by the joint's limits, unless the joint mimics another. on_write() makes it
  /// writable. Of a joint that takes no commands (Joint::takes_commands) the handle has no effect.
  /// @pre model().joints[joint].has_position()
  PushedProperty<double>& position(std::size_t joint) noexcept;

  /// Serves the meshes that the description names by `package://` IRIs, so that a web client can draw them. They are
  /// files (model::PropertyHandle::as_file) below `<robot>/meshes/<package>/`, one for each mesh, with the media type
  /// that IANA has registered for the ending of the name (model/stl, model/vnd.collada+xml, model/obj,
  /// model/gltf-binary, ...; else application/octet-stream). Shapes link to them by dcat:downloadURL, beside lrt:mesh,
  /// which keeps the IRI of the document.
  ///
  /// Only files that the description names are served, and only regular files below the folder of their package, after
  /// symbolic links are resolved; this is checked again whenever a file is read. A file is read when a client requests
  /// it, on the I/O thread. The bytes of the version that was read last remain in memory.
  /// @pre     add_to() was not called, and neither was this
  /// @return  warnings: the meshes that are not served, and why. Their shapes have no link
  std::vector<std::string> serve_meshes(const PackageOptions& options);

  /// Registers all Things with a server or an engine: all of them, or none.
  /// @pre         it was not called before
  /// @par Errors  duplicate_path, expected_iri, and those of Server::add
  template <class Host>
  Result<void> add_to(Host& host) {
    return host.add(things());
  }

  /// Publishes the positions of the joints: one number for each of model().variables, in that order. The positions of
  /// mimic joints and the poses of all links are computed from them. A missing or non-finite number leaves its joint
  /// unchanged. Missing velocities and efforts are not published.
  /// @par Time  No lock, no allocation: about 10 us for 50 links (tests/bench/urdf_bench.cpp).
  void publish(Numbers positions, Numbers velocities = {}, Numbers efforts = {}) noexcept;
  /// The same for numbers that are older than this call: `at` is the time of all values that they change, see
  /// PushedProperty::publish().
  void publish(Numbers positions, Numbers velocities, Numbers efforts, std::chrono::system_clock::time_point at) noexcept;
  /// Sets the pose of the child of a floating or planar joint in the joint's frame, for the next publish(). Has no
  /// effect on other joints, and for a pose that is not finite or whose quaternion does not have the length 1 (within
  /// 1e-6).
  void move(std::size_t joint, const Pose& to) noexcept;
  /// The pose of a link in the frame of the root link, as of the last publish().
  Pose pose(std::size_t link) const noexcept;

 private:
  class Impl;
  std::vector<Thing> things();
  std::unique_ptr<Impl> impl_;
};

/// Reads a file with parse() and makes a Robot.
/// @par Errors   io_error, and those of parse() with the file's name before the message
/// @par Threads  Any, as parse().
/// @par Time     Reads the file.
LRT_API Result<Robot> load(const std::string& file, const ParseOptions& options = {});

}  // namespace v0
}  // namespace lrt::urdf
