// SPDX-License-Identifier: Apache-2.0
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <memory>
#include <mutex>
#include <thread>
#include <unordered_map>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/urdf/document.hpp"

namespace lrt::urdf {
inline namespace v0 {
namespace {

/// Captures the messages that liburdfdom logs on this thread during its lifetime. Messages of other threads go to the previous handler. The
/// destructor restores the process's handler and its predecessor.
class LogCapture final : public console_bridge::OutputHandler {
 public:
  explicit LogCapture(std::string& messages) : messages_(messages), lock_(one_at_a_time()) {
    now_ = console_bridge::getOutputHandler();
    console_bridge::restorePreviousOutputHandler();  // swaps both handlers
    before_ = console_bridge::getOutputHandler();
    console_bridge::useOutputHandler(this);
  }
  ~LogCapture() override {
    console_bridge::useOutputHandler(before_);
    console_bridge::useOutputHandler(now_);
  }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char* file, int line) override {
    if (std::this_thread::get_id() != thread_) {
      if (now_) now_->log(text, level, file, line);
    } else if (messages_.empty() && level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) {
      messages_ = text;
    }
  }

 private:
  static std::mutex& one_at_a_time() {
    static Immortal<std::mutex> mutex;
    return *mutex;
  }
  std::string& messages_;
  const std::lock_guard<std::mutex> lock_;
  const std::thread::id thread_ = std::this_thread::get_id();
  console_bridge::OutputHandler* now_ = nullptr;
  console_bridge::OutputHandler* before_ = nullptr;
};

/// A link owns its child links. They are detached before destruction: a long chain would recurse once for each link.
struct LinkByLink {
  ::urdf::ModelInterfaceSharedPtr model;
  void operator()(const ::urdf::ModelInterface*) const {
    for (const auto& named : model->links_) named.second->clear();
  }
};

std::shared_ptr<const ::urdf::ModelInterface> build(const std::string& text, std::string& messages) {
  const LogCapture capture(messages);
  try {
    ::urdf::ModelInterfaceSharedPtr model = ::urdf::parseURDF(text);
    if (!model) return nullptr;
    const ::urdf::ModelInterface* const all = model.get();
    return {all, LinkByLink{std::move(model)}};
  } catch (const std::exception& e) {
    messages = e.what();
    return nullptr;
  }
}

std::array<double, 3> numbers(const ::urdf::Vector3& v) { return {v.x, v.y, v.z}; }
Pose pose(const ::urdf::Pose& p) { return {numbers(p.position), {p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w}}; }

template <class VisualOrCollision>
Shape shape(const VisualOrCollision& from) {
  Shape to;
  to.name = from.name;
  to.origin = pose(from.origin);
  if (const auto* box = dynamic_cast<const ::urdf::Box*>(from.geometry.get())) {
    to.kind = Shape::Kind::box;
    to.size = numbers(box->dim);
  } else if (const auto* cylinder = dynamic_cast<const ::urdf::Cylinder*>(from.geometry.get())) {
    to.kind = Shape::Kind::cylinder;
    to.radius = cylinder->radius;
    to.length = cylinder->length;
  } else if (const auto* sphere = dynamic_cast<const ::urdf::Sphere*>(from.geometry.get())) {
    to.kind = Shape::Kind::sphere;
    to.radius = sphere->radius;
  } else if (const auto* mesh = dynamic_cast<const ::urdf::Mesh*>(from.geometry.get())) {
    to.kind = Shape::Kind::mesh;
    to.mesh = mesh->filename;
    to.scale = numbers(mesh->scale);
  }
  return to;
}

Shape visual(const ::urdf::Visual& from) {
  Shape to = shape(from);
  if (from.material) to.material = Material{from.material->name, {}, from.material->texture_filename};
  return to;
}

Joint joint(const ::urdf::Joint& from) {
  Joint to;
  switch (from.type) {
    case ::urdf::Joint::REVOLUTE: to.type = JointType::revolute; break;
    case ::urdf::Joint::CONTINUOUS: to.type = JointType::continuous; break;
    case ::urdf::Joint::PRISMATIC: to.type = JointType::prismatic; break;
    case ::urdf::Joint::FLOATING: to.type = JointType::floating; break;
    case ::urdf::Joint::PLANAR: to.type = JointType::planar; break;
    default: to.type = JointType::fixed;
  }
  to.name = from.name;
  to.origin = pose(from.parent_to_joint_origin_transform);
  const double length = std::hypot(from.axis.x, from.axis.y, from.axis.z);
  if (length > 0) to.axis = {from.axis.x / length, from.axis.y / length, from.axis.z / length};
  if (from.dynamics) to.dynamics = Dynamics{from.dynamics->damping, from.dynamics->friction};
  if (from.safety) to.safety = Safety{from.safety->soft_lower_limit, from.safety->soft_upper_limit, from.safety->k_position, from.safety->k_velocity};
  return to;
}

/// Whether an inertia is physically possible: no principal moment is negative, and none exceeds the sum of the other two.
bool is_of_a_body(const Inertial& inertial) {
  const auto& [xx, xy, xz, yy, yz, zz] = inertial.inertia;
  Eigen::Matrix3d tensor;
  tensor << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  const double scale = tensor.cwiseAbs().maxCoeff();
  if (!(scale > 0)) return true;
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor / scale, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double rounded = 1e-3;  // documents contain few digits
  return moments[0] >= -rounded && moments[2] <= moments[0] + moments[1] + rounded;
}

}  // namespace

std::string_view to_string(JointType type) noexcept {
  constexpr std::string_view names[] = {"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};
  return names[static_cast<std::size_t>(type)];
}

Result<Model> parse(std::string_view text, const ParseOptions& options) {
  Result<Document> document = check(text, options);
  if (!document) return Unexpected{std::move(document).error()};
  std::string messages;
  const std::shared_ptr<const ::urdf::ModelInterface> built = build(document->text, messages);
  if (!built) return unexpected(Errc::expected_value, "liburdfdom: " + (messages.empty() ? "refused without a message" : messages));

  Model model;
  model.name = built->getName();
  model.warnings = std::move(document->warnings);
  std::unordered_map<std::string_view, std::size_t> links, joints;
  std::size_t number = 0;  // index of the shape
  for (const Document::Link& element : document->links) {
    const ::urdf::LinkConstSharedPtr from = built->getLink(element.name);
    if (!from)
      return unexpected(Errc::expected_value, "liburdfdom did not return link \"" + element.name + "\" (line " + std::to_string(element.line) +
                                                  "), which the document has");
    links.emplace(element.name, model.links.size());
    Link& to = model.links.emplace_back();
    to.name = element.name;
    to.line = element.line;
    for (const auto& v : from->visual_array) to.visuals.push_back(visual(*v));
    for (const auto& c : from->collision_array) to.collisions.push_back(shape(*c));
    for (std::vector<Shape>* shapes : {&to.visuals, &to.collisions})
      for (Shape& one : *shapes) {
        const Document::Shape& written = document->shapes[number++];
        if (written.is_capsule) one.kind = Shape::Kind::capsule;
        if (one.material) one.material->colour = written.colour;
      }
    if (!from->inertial) continue;
    const ::urdf::Inertial& i = *from->inertial;
    to.inertial = Inertial{pose(i.origin), i.mass, {i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz}};
    if (!is_of_a_body(*to.inertial))
      model.warnings.push_back("link \"" + to.name + "\" (line " + std::to_string(to.line) + "): the inertia is physically impossible");
  }
  if (number != document->shapes.size())
    return unexpected(Errc::expected_value, "liburdfdom did not return each visual and collision of the document");
  for (const Document::Joint& element : document->joints) joints.emplace(element.name, joints.size());
  for (const Document::Joint& element : document->joints) {
    const ::urdf::JointConstSharedPtr from = built->getJoint(element.name);
    if (!from)
      return unexpected(Errc::expected_value, "liburdfdom did not return joint \"" + element.name + "\" (line " + std::to_string(element.line) +
                                                  "), which the document has");
    Joint& to = model.joints.emplace_back(joint(*from));
    to.line = element.line;
    to.limits = element.limits;
    to.parent = links.at(from->parent_link_name);
    to.child = links.at(from->child_link_name);
    model.links[to.child].joint = model.joints.size() - 1;
    if (from->mimic) to.mimic = Mimic{joints.at(from->mimic->joint_name), from->mimic->multiplier, from->mimic->offset};
    else if (to.has_position()) model.variables.push_back(model.joints.size() - 1);
  }
  while (model.links[model.root].joint) ++model.root;
  return model;
}

}  // namespace v0
}  // namespace lrt::urdf
