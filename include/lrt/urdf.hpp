#pragma once

// A robot whose description is a URDF as Linked Robotic Things. Needs the target lrt::urdf; include it if you use it.
//
//   auto robot = lrt::urdf::load("robot.urdf");        // Result<Robot>
//   robot->add_to(server);                             // a Thing for the robot, each joint and each link
//   robot->publish(positions);                         // in the control loop: joints, and the pose of every link

#include <algorithm>
#include <array>
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

#include <lrt/base/result.hpp>
#include <lrt/property.hpp>
#include <lrt/thing.hpp>

namespace lrt::urdf {

/// Position [m] and orientation of one frame in another; a unit quaternion in the order x y z w. Plain numbers, not an Eigen type: how
/// Eigen aligns those is up to each program's compiler flags. `Eigen::Map<const Eigen::Quaterniond>(p.orientation.data())` is one.
struct Pose {
  std::array<double, 3> position{0, 0, 0};
  std::array<double, 4> orientation{0, 0, 0, 1};
};

enum class JointType : std::uint8_t { revolute, continuous, prismatic, fixed, floating, planar };
/// "revolute"
std::string_view to_string(JointType type) noexcept;

/// What a joint can do: rad, rad/s and N m for revolute and continuous joints, m, m/s and N for others. What a document does not say, or
/// says to be infinite, is without a value.
struct Limits {
  std::optional<double> lower, upper;      ///< of the position of a revolute or prismatic joint; none where lower > upper in the document
  std::optional<double> velocity, effort;  ///< the greatest

  /// The position next to this one that is within.
  double clamp(double position) const noexcept {
    if (lower) position = std::max(position, *lower);
    return upper ? std::min(position, *upper) : position;
  }
};
struct Dynamics {
  double damping = 0;   ///< [N m s/rad], [N s/m]
  double friction = 0;  ///< static [N m], [N]
};
struct Safety {
  double soft_lower_limit = 0, soft_upper_limit = 0;  ///< of the position
  double k_position = 0;                              ///< [1/s]
  double k_velocity = 0;                              ///< [N m s/rad], [N s/m]
};
/// The joint's position is multiplier * that of another + offset.
struct Mimic {
  std::size_t joint = 0;  ///< index in Model::joints
  double multiplier = 1, offset = 0;
};

struct Joint {
  std::string name;
  JointType type = JointType::fixed;
  std::size_t parent = 0, child = 0;    ///< indices in Model::links
  Pose origin;                          ///< of the joint's frame, which is the child's at position 0, in the parent's frame
  std::array<double, 3> axis{1, 0, 0};  ///< unit vector in the joint's frame; of a planar joint the plane's normal
  std::optional<Limits> limits;
  std::optional<Dynamics> dynamics;
  std::optional<Safety> safety;
  std::optional<Mimic> mimic;
  std::uint32_t line = 0;  ///< in the document

  /// Whether its position is one number: revolute, continuous and prismatic joints.
  bool has_position() const noexcept { return type <= JointType::prismatic; }
};

struct Inertial {
  Pose origin;                      ///< of the centre of mass in the link's frame, turned as the tensor's axes
  double mass = 0;                  ///< [kg]
  std::array<double, 6> inertia{};  ///< xx xy xz yy yz zz about the centre of mass [kg m^2]
};
struct Material {
  std::string name;
  std::optional<std::array<double, 4>> colour;  ///< red, green, blue, alpha, 0 to 1
  std::string texture;                          ///< file name or IRI as in the document
};
/// A shape of a link: what is seen, or what collides.
struct Shape {
  enum class Kind : std::uint8_t { box, cylinder, sphere, capsule, mesh };
  std::string name;
  Pose origin;  ///< in the link's frame
  Kind kind = Kind::box;
  std::array<double, 3> size{};   ///< of a box [m]
  double radius = 0, length = 0;  ///< of a cylinder along z, a capsule (its length without its ends), a sphere [m]
  std::string mesh;               ///< file name or IRI as in the document
  std::array<double, 3> scale{1, 1, 1};
  std::optional<Material> material;  ///< of what is seen
};
struct Link {
  std::string name;
  std::optional<Inertial> inertial;
  std::vector<Shape> visuals, collisions;
  std::optional<std::size_t> joint;  ///< the one before it; none: the root
  std::uint32_t line = 0;
};

/// What a URDF says: a tree. Joints and links in the document's order.
struct Model {
  std::string name;
  std::vector<Joint> joints;
  std::vector<Link> links;
  std::size_t root = 0;                ///< index of the link without a joint before it
  std::vector<std::size_t> variables;  ///< joints whose position somebody must say: those that have one and mimic none
  std::vector<std::string> warnings;   ///< what is odd, with its line, and was left out or taken as it could be
};

struct ParseOptions {
  /// Where the robot's Thing is; empty: its name.
  std::string path;
  /// Values for `${name}` and `$(arg name)`. With a value for a name, the xacro:arg and xacro:property of that name are passed over. Other elements
  /// of xacro and other `${...}` are refused; other `$(...)` are words.
  std::map<std::string, std::string> arguments;
  std::size_t max_bytes = 16 * 1024 * 1024;
  std::size_t max_elements = 100'000;
};

/// Reads a description, of URDF 1.0 to 1.2. Elements that URDF does not have (gazebo, transmission, ...) are passed over, and of 1.2 the limits
/// of acceleration, deceleration and jerk.
///
/// What there is of joints, links and masses must be right: names, references, numbers; no mass and none of ixx, iyy, izz below 0. What may be
/// missing or odd, as it is in many a file (limits, mimics of nobody, products of inertia, all of shapes and their materials) is left out, and
/// Model::warnings says so. Of an element that stands twice where one may be, the first counts, with a warning.
///
/// @par Errors   expected_value: what is no XML, no tree, or no number; what is missing, of a name that is taken, or of an unknown kind; xacro
///               that was not expanded: with the element and its line. limit_exceeded. One error, the first.
/// @par Threads  Any. liburdfdom logs by a handler of the whole process: during the call what it says on this thread is taken away from
///               that handler, which is put back.
Result<Model> parse(std::string_view text, const ParseOptions& options = {});

namespace detail {
/// Whether members lie one after the other: everybody's but some of Eigen's.
template <class Container, class = void>
struct IsDense : std::true_type {};
template <class Container>
struct IsDense<Container, std::void_t<decltype(Container::InnerStrideAtCompileTime)>>
    : std::bool_constant<int(Container::InnerStrideAtCompileTime) == 1> {};
}  // namespace detail

/// Numbers of anybody's, one after the other: a std::vector, std::array or Eigen::VectorXd of double, not a row of a matrix of Eigen, which lies
/// apart. For the time of a call.
class Numbers {
 public:
  Numbers() = default;
  Numbers(const double* data, std::size_t size) : data_(data), size_(size) {}
  template <class Container, class = decltype(std::declval<const Container&>().data()), class = std::enable_if_t<detail::IsDense<Container>::value>>
  Numbers(const Container& numbers) : data_(numbers.data()), size_(static_cast<std::size_t>(numbers.size())) {}  // NOLINT: a view
  std::size_t size() const noexcept { return size_; }
  double operator[](std::size_t i) const noexcept { return data_[i]; }

 private:
  const double* data_ = nullptr;
  std::size_t size_ = 0;
};

/// The Things of a robot, and its kinematics.
///
/// `/<robot>` is a ros:Robot; its joints and links are `/<robot>/<name>`. A '/' in a name becomes '.', and where two would have one path
/// the link's gets "_link", the joint's "_joint" behind it.
///
///   robot  dcterms:hasPart: joints and links; lrt:rootLink. Property `positions`: those of all joints that have one, in the order that
///          lrt:positionsOf gives, a list of joints (not of more than 512)
///   joint  a ros:Joint and a ros:RevoluteJoint or the like. ros:preceedingLink, ros:succeedingLink, xhv:prev, xhv:next: links;
///          lrt:mimics: a joint. Properties `jointReferenceFrame` (ros:jointReferenceFrame), `axis`, `limits`, `dynamics`, `safety`, `mimic`,
///          and where it has a position `position` (ros:position), of a revolute or continuous joint also as `rotation` (ros:rotation, an
///          Eigen::AngleAxisf as in Figure 3), `velocity` (ros:velocity), `effort` (ros:effort), each without a value until one is published
///   link   a ros:Link. xhv:prev, xhv:next: joints. Properties `pose` (lrt:pose) in the frame of the root link, `inertial`,
///          `visual/1` ..., `collision/1` ...; the last two have links to meshes (lrt:mesh) and textures (lrt:texture), where the document
///          has IRIs, and xsd:anyURI literals where it has relative names
///
/// Each property whose value is about a frame names it: lrt:frame, a link.
///
/// @par Threads     Set-up: one at a time. publish, move, pose: one at a time, the control loop's.
/// @par Implements  R0.3, R1.3, R1.9, paper Figures 2b and 3
class Robot {
 public:
  /// Every joint is at 0, or at the limit next to it.
  /// @param path  where its Thing is; empty: the model's name, or "robot" if it has none
  /// @pre         the model is one that parse() gives
  explicit Robot(Model model, std::string_view path = {});
  Robot(Robot&&) noexcept;
  Robot& operator=(Robot&&) noexcept;
  ~Robot();

  const Model& model() const noexcept;
  /// "baxter", "baxter/right_s1": without a leading '/', not encoded, as Thing and Object::resource take them.
  const std::string& path() const noexcept;
  const std::string& joint_path(std::size_t joint) const noexcept;
  const std::string& link_path(std::size_t link) const noexcept;

  /// The Things, for more to be said of them: actions, further properties and triples. Before add_to().
  Thing& thing() noexcept;
  Thing& joint(std::size_t joint) noexcept;
  Thing& link(std::size_t link) noexcept;
  /// The property `position`, bounded by the joint's limits unless it mimics another; on_write() makes it writable.
  /// @pre model().joints[joint].has_position()
  Property<double>& position(std::size_t joint) noexcept;

  /// Registers all Things with a server (or an engine), or none of them.
  /// @pre         not called before
  /// @par Errors  duplicate_path, expected_iri, and those of Server::add
  template <class Host>
  Result<void> add_to(Host& host) {
    return host.add(things());
  }

  /// Hands over where the joints are: one number for each of model().variables, in that order. Mimic joints follow, and the poses of all
  /// links. What is missing or not finite leaves its joint as it was; velocities and efforts that are not given are not published.
  /// @par Time  No lock, no allocation: some 10 us for 50 links (tests/bench/urdf_bench.cpp).
  void publish(Numbers positions, Numbers velocities = {}, Numbers efforts = {}) noexcept;
  /// Where the child of a floating or planar joint is in the joint's frame, from the next publish() on. Nothing of other joints, and of a
  /// pose that is not finite or whose quaternion has not the length 1 (within 1e-6).
  void move(std::size_t joint, const Pose& to) noexcept;
  /// Where a link is in the frame of the root link, as of the last publish().
  Pose pose(std::size_t link) const noexcept;

 private:
  class Impl;
  std::vector<Thing> things();
  std::unique_ptr<Impl> impl_;
};

/// parse() of a file, as a Robot.
/// @par Errors  io_error, and those of parse(), with the file's name in front
Result<Robot> load(const std::string& file, const ParseOptions& options = {});

}  // namespace lrt::urdf
