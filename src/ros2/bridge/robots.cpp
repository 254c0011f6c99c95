// SPDX-License-Identifier: Apache-2.0
// Robot descriptions: a Thing for the robot, each joint and each link, which the topic joint_states moves; and frames of tf.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <lrt/eigen.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/urdf.hpp>

#include "src/ros2/bridge/core.hpp"
#include "src/ros2/bridge/robot.hpp"
#include "src/ros2/types/cdr.hpp"

namespace lrt::ros2 {
namespace {

using Utc = std::chrono::system_clock::time_point;
using Isometry = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

constexpr std::size_t max_frames = 1'024, max_frames_in_all = 4'096;  ///< of one namespace, of all
constexpr std::size_t max_description_bytes = 16 * 1024 * 1024;
constexpr std::uint32_t max_in_sample = 4'096;  ///< names of joints, transforms: a thread of DDS looks each up
constexpr unsigned max_descriptions = 32;       ///< of one robot: each has Blueprints of its own

bool has_field(const Message& m, std::size_t i, std::string_view name, Kind kind, Arity arity) noexcept {
  return i < m.fields.size() && m.fields[i].name == name && m.fields[i].type.kind == kind && m.fields[i].type.arity == arity;
}
bool has_message(const Message& m, std::size_t i, std::string_view name, std::string_view type, Arity arity) noexcept {
  return has_field(m, i, name, Kind::message, arity) && m.fields[i].type.message && m.fields[i].type.message->name == type;
}

/// Numbers of float64 in a payload.
struct Doubles {
  const char* at = nullptr;
  std::uint32_t count = 0;
  bool little = true;

  bool read(Cursor& in) noexcept {
    std::string_view bytes;
    if (!in.read(count)) return false;
    little = in.is_little();
    if (count == 0) return true;
    if (!in.align(8) || in.left() / 8 < count || !in.take(std::size_t{count} * 8, bytes)) return false;
    at = bytes.data();
    return true;
  }
  double operator[](std::size_t i) const noexcept {
    if (i >= count) return std::numeric_limits<double>::quiet_NaN();
    const auto bits = load<std::uint64_t>(at + i * 8, little);
    double d = 0;
    std::memcpy(&d, &bits, sizeof d);
    return d;
  }
};

/// A string of CDR, without its zero.
bool read_text(Cursor& in, std::string_view& text) noexcept {
  std::uint32_t length = 0;
  if (!in.read(length) || !in.take(length, text)) return false;
  if (!text.empty() && text.back() == '\0') text.remove_suffix(1);
  return true;
}

/// std_msgs/msg/Header.
bool read_header(Cursor& in, Utc& stamp, std::string_view& frame) noexcept {
  std::uint32_t seconds = 0, nanoseconds = 0;
  if (!in.read(seconds) || !in.read(nanoseconds)) return false;
  stamp = Utc(
      std::chrono::duration_cast<Utc::duration>(std::chrono::seconds(static_cast<std::int32_t>(seconds)) + std::chrono::nanoseconds(nanoseconds)));
  return read_text(in, frame);
}

// --- joints

/// A robot that moves.
class RobotModel final : public JointSink {
 public:
  explicit RobotModel(urdf::Robot robot) : robot_(std::move(robot)) {
    const urdf::Model& model = robot_.model();
    for (std::size_t i = 0; i < model.variables.size(); ++i) variables_.emplace(model.joints[model.variables[i]].name, i);
    positions_.resize(model.variables.size());
    velocities_ = efforts_ = positions_;
  }

  void take(std::string_view payload, Utc at) noexcept override {
    const Encapsulation form = encapsulation_of(payload);
    if (form == Encapsulation::other) return;
    Cursor in(payload, form == Encapsulation::little_endian);
    Utc stamp;
    std::string_view frame;
    std::uint32_t names = 0;
    if (!read_header(in, stamp, frame) || !in.read(names)) return;
    Cursor at_names = in;
    std::string_view name;
    if (names > max_in_sample || names > in.left() / 4) return;
    for (std::uint32_t i = 0; i < names; ++i)
      if (!read_text(in, name)) return;
    Doubles positions, velocities, efforts;
    if (!positions.read(in) || !velocities.read(in) || !efforts.read(in)) return;
    const std::lock_guard lock(mutex_);  // several topics may move one robot
    for (auto* numbers : {&positions_, &velocities_, &efforts_})
      std::fill(numbers->begin(), numbers->end(), std::numeric_limits<double>::quiet_NaN());
    for (std::uint32_t i = 0; i < names; ++i) {
      if (!read_text(at_names, name)) return;
      const auto known = variables_.find(name);
      if (known == variables_.end()) continue;
      positions_[known->second] = positions[i];
      velocities_[known->second] = velocities[i];
      efforts_[known->second] = efforts[i];
    }
    robot_.publish(positions_, velocities_, efforts_, at);
    has_moved_ = true;
  }
  bool has_moved() const {
    const std::lock_guard lock(mutex_);
    return has_moved_;
  }

  urdf::Robot robot_;

 private:
  mutable std::mutex mutex_;
  bool has_moved_ = false;
  std::map<std::string, std::size_t, std::less<>> variables_;
  std::vector<double> positions_, velocities_, efforts_;
};

class RobotPart final : public Part {
 public:
  RobotPart(Core& core, const std::string& ns, std::string robot_path)
      : Part(Listed{Listed::What::topic, ns == "/" ? "/robot_description" : ns + "/robot_description", "std_msgs/msg/String", {}, {}, {}, {}}),
        shared_(core.shared()) {
    wanted_path = std::move(robot_path);
    suffix = "_description";
  }

  void update(Core& core, std::string text) {
    if (text == text_) return;
    if (++descriptions_ > max_descriptions) {
      listed.reason = "the description has changed too often";
      return;
    }
    urdf::ParseOptions options;
    options.max_bytes = max_description_bytes;
    options.path = path.empty() ? wanted_path : path;
    Result<urdf::Model> parsed = urdf::parse(text, options);
    if (!parsed) {
      listed.reason = parsed.error().message;
      core.log(LogLevel::warning, listed.name + ": " + listed.reason);
      return;
    }
    const std::size_t more_bytes = text.size() - text_.size();  // modulo 2^64, as the sum is
    if (shared_->kept_bytes.fetch_add(more_bytes, std::memory_order_relaxed) + more_bytes > shared_->max_kept_bytes && text.size() > text_.size()) {
      shared_->kept_bytes.fetch_sub(more_bytes, std::memory_order_relaxed);
      listed.reason = "all topics together have more bytes than max_kept_bytes";
      return;
    }
    text_ = std::move(text);
    is_available = true;
    listed.reason.clear();
    if (is_served) core.renew(*this);
    else core.serve(*this);
    core.mark_changed();
  }

  std::vector<Thing> make(Core&, const std::string& its_path) override {
    urdf::ParseOptions options;
    options.max_bytes = max_description_bytes;
    options.path = its_path;
    Result<urdf::Model> parsed = urdf::parse(text_, options);
    if (!parsed) return {};
    model_ = std::make_shared<RobotModel>(urdf::Robot(*std::move(parsed), its_path));
    struct Collector {
      std::vector<Thing> things;
      Result<void> add(std::vector<Thing> all) { return things = std::move(all), Result<void>(); }
    } all;
    if (!model_->robot_.add_to(all)) return {};
    listed.path = '/' + its_path;
    listed.as = "Thing of each joint and link";
    properties = all.things.size();
    return std::move(all.things);
  }

  std::shared_ptr<RobotModel> model_;

 private:
  const std::shared_ptr<Shared> shared_;
  std::string text_;
  unsigned descriptions_ = 0;
};

std::string robot_key(const std::string& ns) { return "robot " + ns; }

// --- frames

/// Finds the transform of a child frame in a payload.
class FrameReader final : public PayloadReader {
 public:
  FrameReader(std::string child, std::shared_ptr<Shared> shared) : child_(std::move(child)), shared_(std::move(shared)) {}
  Result<rdf::Value> read(const std::string& payload) const override;

 private:
  std::string child_;
  std::shared_ptr<Shared> shared_;
};

/// Calls `f(child, parent, stamp, numbers)` for each transform; `numbers` are x y z, x y z w. False: the payload is malformed.
template <class F>
bool for_each_transform(std::string_view payload, F f) {
  const Encapsulation form = encapsulation_of(payload);
  if (form == Encapsulation::other) return false;
  Cursor in(payload, form == Encapsulation::little_endian);
  std::uint32_t count = 0;
  if (!in.read(count) || count > max_in_sample || in.left() / 64 < count) return false;
  for (std::uint32_t i = 0; i < count; ++i) {
    Utc stamp;
    std::string_view parent, child;
    double numbers[7];
    if (!read_header(in, stamp, parent) || !read_text(in, child)) return false;
    for (double& n : numbers) {
      std::uint64_t bits = 0;
      if (!in.read(bits)) return false;
      std::memcpy(&n, &bits, sizeof n);
    }
    f(child, parent, stamp, numbers);
  }
  return true;
}

Result<rdf::Value> FrameReader::read(const std::string& payload) const {
  std::optional<Isometry> pose;
  const bool good = for_each_transform(payload, [&](std::string_view child, std::string_view, Utc, const double* n) {
    if (child != child_) return;
    const Eigen::Quaterniond turned(n[6], n[3], n[4], n[5]);
    if (!std::isfinite(n[0]) || !std::isfinite(n[1]) || !std::isfinite(n[2]) || !(std::abs(turned.norm() - 1) < 1e-3)) return;
    pose = Isometry::Identity();
    pose->linear() = turned.normalized().toRotationMatrix();
    pose->translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  });
  if (!good || !pose) {
    shared_->malformed.fetch_add(1, std::memory_order_relaxed);
    return unexpected(Errc::expected_value, "the transform is not finite, or its rotation has not the length 1");
  }
  shared_->decoded.fetch_add(1, std::memory_order_relaxed);
  return rdf::traits<Isometry>::encode(*pose);
}

class FramePart;

class Frames final : public FrameSink, public std::enable_shared_from_this<Frames> {
 public:
  Frames(Core& core, std::string ns) : core_(core), shared_(core.shared()), ns_(std::move(ns)) {}

  void take(const Bytes& payload, std::string_view topic) noexcept override {
    try {
      const std::lock_guard lock(mutex_);
      const bool good = for_each_transform(*payload, [&](std::string_view child, std::string_view parent, Utc stamp, const double*) {
        auto known = frames_.find(child);
        if (known == frames_.end()) {
          if (frames_.size() >= max_frames || !is_clean_name(child) || !is_clean_name(parent)) return;
          if (shared_->frames.fetch_add(1, std::memory_order_relaxed) >= max_frames_in_all) {
            shared_->frames.fetch_sub(1, std::memory_order_relaxed);
            return;
          }
          known = frames_.emplace(std::string(child), Frame()).first;
          known->second.reader = std::make_shared<FrameReader>(std::string(child), shared_);
        }
        Frame& frame = known->second;
        frame.last = payload;
        frame.stamp = stamp.time_since_epoch().count() > 0 ? stamp : std::chrono::system_clock::now();
        frame.topic = std::string(topic);
        frame.missing.clear();
        if (frame.parent != parent && is_clean_name(parent)) {
          frame.parent = std::string(parent);
          if (std::exchange(frame.is_announced, true)) return pass(frame);  // its job will find this parent
          shared_->put([self = shared_from_this(), name = known->first] { self->announce(name); });
        }
        pass(frame);
      });
      if (!good) shared_->malformed.fetch_add(1, std::memory_order_relaxed);
    } catch (...) {}  // no memory: this sample is left out
  }

  void lose(std::string_view topic, const std::string& reason) override {
    const std::lock_guard lock(mutex_);
    for (auto& [name, frame] : frames_) {
      if (frame.topic != topic) continue;
      frame.last = nullptr;
      frame.missing = reason;
      pass(frame);
    }
  }

  /// Makes the Thing of a frame, or makes it again because its parent has changed. On the bridge's thread.
  void announce(const std::string& name);

  std::string parent_of(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    const auto known = frames_.find(name);
    return known == frames_.end() ? std::string() : known->second.parent;
  }
  /// The parent that the job of announce() has seen; a further one makes a further job.
  std::string take_parent(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto known = frames_.find(name);
    if (known == frames_.end()) return {};
    known->second.is_announced = false;
    return known->second.parent;
  }
  void connect(const std::string& name, PushedProperty<RosValue> property) {
    const std::lock_guard lock(mutex_);
    const auto known = frames_.find(name);
    if (known == frames_.end()) return;
    known->second.pose = std::move(property);
    known->second.is_connected = true;
    pass(known->second);
  }
  const std::string& ns() const noexcept { return ns_; }

 private:
  struct Frame {
    std::string parent, topic, missing;
    Bytes last;
    Utc stamp{};
    std::shared_ptr<const PayloadReader> reader;
    PushedProperty<RosValue> pose;
    bool is_connected = false;
    bool is_announced = false;  ///< a job of announce() waits
  };
  static void pass(Frame& frame) {
    if (!frame.is_connected) return;
    if (!frame.last) return frame.pose.publish(RosValue::none(frame.missing));
    RosValue value;
    value.payload = frame.last;
    value.reader = frame.reader;
    frame.pose.publish(value, frame.stamp);
  }

  Core& core_;  // used on the bridge's thread only
  const std::shared_ptr<Shared> shared_;
  const std::string ns_;
  mutable std::mutex mutex_;
  std::map<std::string, Frame, std::less<>> frames_;
};

class FramePart final : public Part {
 public:
  FramePart(Core& core, std::shared_ptr<Frames> frames, const std::string& name)
      : Part(Listed{Listed::What::topic, name, "geometry_msgs/msg/Transform", {}, {}, {}, {}}), frames_(std::move(frames)), frame_(name) {
    std::string segment = name;
    std::replace(segment.begin(), segment.end(), '/', '.');
    if (segment == "." || segment == "..") segment += '_';
    wanted_path = core.path_of((frames_->ns() == "/" ? "" : frames_->ns()) + "/frames/" + segment);
    suffix = "_frame";
    is_available = true;
  }

  std::vector<Thing> make(Core& core, const std::string& its_path) override {
    std::vector<Thing> made;
    Thing& thing = made.emplace_back(its_path);
    thing.default_title(frame_).type(vocab::maths::CoordinateSystem);
    const std::string parent = frames_->parent_of(frame_);
    pose_ = thing.pushed<RosValue>("pose", rdf::DynamicType(rdf::traits<Isometry>::type()), unit::metre);
    pose_.title("Pose", "en").description("Where the frame is, seen from its parent.", "en").dispatch(Dispatch::io_thread);
    const std::string its_parent = thing_of_frame(core, frames_->ns(), parent);
    pose_.frame(its_parent.empty() ? Object(parent) : Object::resource(its_parent));
    pose_.add(vocab::spatial::targetCoordinateSystem, Object::resource(its_path));
    listed.path = '/' + its_path + "/pose";
    listed.as = "pose of a frame";
    properties = 1;
    return made;
  }
  void was_served(Core&) override { frames_->connect(frame_, pose_); }

  std::string stated_parent;
  unsigned renewals = 0;

 private:
  std::shared_ptr<Frames> frames_;
  std::string frame_;
  PushedProperty<RosValue> pose_;
};

std::string frame_key(const std::string& ns, const std::string& frame) { return "frame " + ns + ' ' + frame; }

void Frames::announce(const std::string& name) {
  const std::string parent = take_parent(name);
  FramePart& part = core_.part_of<FramePart>(frame_key(ns_, name), core_, shared_from_this(), name);
  if (part.is_served && part.stated_parent == parent) return;
  part.stated_parent = parent;
  core_.mark_changed();
  if (!part.is_served) (void)core_.serve(part);
  else if (++part.renewals < 8) core_.renew(part);
}

/// Keeps the frames of a namespace: it has no Thing of its own.
class FramesPart final : public Part {
 public:
  FramesPart(Core& core, const std::string& ns)
      : Part(Listed{Listed::What::topic, ns == "/" ? "/tf" : ns + "/tf", {}, {}, {}, {}, {}}), frames(std::make_shared<Frames>(core, ns)) {
    is_listed = false;
  }
  std::vector<Thing> make(Core&, const std::string&) override { return {}; }
  std::shared_ptr<Frames> frames;
};

}  // namespace

bool is_joint_state(const Message& m) noexcept {
  return m.name == "sensor_msgs/msg/JointState" && m.fields.size() == 5 && has_message(m, 0, "header", "std_msgs/msg/Header", Arity::single) &&
         has_field(m, 1, "name", Kind::string, Arity::sequence) && has_field(m, 2, "position", Kind::float64, Arity::sequence) &&
         has_field(m, 3, "velocity", Kind::float64, Arity::sequence) && has_field(m, 4, "effort", Kind::float64, Arity::sequence);
}

bool is_tf_message(const Message& m) noexcept {
  if (m.name != "tf2_msgs/msg/TFMessage" || m.fields.size() != 1 ||
      !has_message(m, 0, "transforms", "geometry_msgs/msg/TransformStamped", Arity::sequence))
    return false;
  const Message& t = *m.fields[0].type.message;
  return t.fields.size() == 3 && has_message(t, 0, "header", "std_msgs/msg/Header", Arity::single) &&
         has_field(t, 1, "child_frame_id", Kind::string, Arity::single) &&
         has_message(t, 2, "transform", "geometry_msgs/msg/Transform", Arity::single);
}

std::shared_ptr<JointSink> joints_of(Core& core, const std::string& ns) {
  Part* const part = core.find(robot_key(ns));
  return part ? static_cast<RobotPart*>(part)->model_ : nullptr;
}

void lose_joints(Core& core, const std::string& ns) {
  Part* const part = core.find(robot_key(ns));
  if (part && part->is_served && static_cast<RobotPart*>(part)->model_->has_moved()) core.renew(*part), core.mark_changed();
}

std::shared_ptr<FrameSink> frames_of(Core& core, const std::string& ns) { return core.part_of<FramesPart>("frames " + ns, core, ns).frames; }

void update_robot(Core& core, const std::string& ns, std::string text) {
  const std::string robot_path = core.path_of((ns == "/" ? "" : ns) + "/robot");
  core.part_of<RobotPart>(robot_key(ns), core, ns, robot_path).update(core, std::move(text));
}

std::string thing_of_frame(Core& core, const std::string& ns, const std::string& frame) {
  for (const std::string& at : {ns, std::string("/")}) {
    if (Part* const part = core.find(robot_key(at)); part && part->is_served) {
      const urdf::Robot& robot = static_cast<RobotPart*>(part)->model_->robot_;
      for (std::size_t i = 0; i < robot.model().links.size(); ++i)
        if (robot.model().links[i].name == frame) return robot.link_path(i);
    }
    if (Part* const part = core.find(frame_key(at, frame)); part && part->is_served) return part->path;
  }
  return {};
}

}  // namespace lrt::ros2
