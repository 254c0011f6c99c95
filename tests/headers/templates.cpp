// SPDX-License-Identifier: Apache-2.0
// Everything that has traits, in one object file: destructors.cmake looks at what its templates leave there.
#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <lrt/lrt.hpp>
#if LRT_HAS_EIGEN
#include <lrt/eigen.hpp>
#endif

namespace {

enum class Mode : std::uint8_t { idle, active };

struct Pose {
  double x = 0;
  double limits[2] = {};
  Mode mode = Mode::idle;
  std::optional<float> tolerance{};
  std::array<std::int32_t, 3> counts{};
  std::map<std::string, bool> flags{};
};

}  // namespace

template <>
struct lrt::rdf::traits<Mode> : lrt::rdf::Enumeration<Mode> {
  static void describe(Enumeration<Mode>& e) { e.name(Mode::idle, "idle").name(Mode::active, "active"); }
};

template <>
struct lrt::rdf::traits<Pose> : lrt::rdf::Record<Pose> {
  static void describe(Record<Pose>& r) {
    r.field("x", &Pose::x);
    r.field("limits", &Pose::limits);
    r.field("mode", &Pose::mode);
    r.field("tolerance", &Pose::tolerance);
    r.field("counts", &Pose::counts);
    r.field("flags", &Pose::flags);
  }
};

void add_all(lrt::Thing& thing);
void add_all(lrt::Thing& thing) {
  thing.property("text", [] { return std::string(); });
  thing.property("poses", [] { return std::vector<Pose>(2); });
  thing.property("map", [] { return std::unordered_map<std::string, Pose>(); });
  thing.property("duration", [] { return std::chrono::milliseconds(1); });
  thing.property("instant", [] { return std::chrono::system_clock::time_point(); });
  thing.action("move", [](const Pose& pose) { return pose.x; });
  thing.collection<Pose>("waypoints");
#if LRT_HAS_EIGEN
  thing.property<Eigen::Vector3d>("vector");
  thing.property<Eigen::VectorXf>("list");
  thing.property<Eigen::Matrix4d>("rows");
  thing.property<Eigen::MatrixXd>("matrix");
  thing.property<Eigen::Quaterniond>("quaternion");
  thing.property<Eigen::AngleAxisd>("axis");
  thing.property<Eigen::Translation3d>("translation");
  thing.property<Eigen::Isometry3d>("isometry");
  thing.property<Eigen::Affine3d>("affine");
#endif
}
