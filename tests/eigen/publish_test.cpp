// SPDX-License-Identifier: Apache-2.0
#include <lrt/eigen.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <thread>
#include <type_traits>

#include <lrt/model/detail/slot.hpp>
#include <lrt/thing.hpp>

#include "tests/support/allocations.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using rdf::traits;
using rdf::Value;
using test::allocations;

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Bounded6d = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
using Utc = std::chrono::system_clock::time_point;

struct Grasp {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// Whether the two are different values, without an allocation.
template <class T>
bool differ(const T& a, const T& b) {
  static_assert(noexcept(traits<T>::same(a, b)));
  const std::size_t before = allocations;
  const bool told_apart = traits<T>::same(a, a) && traits<T>::same(b, b) && !traits<T>::same(a, b) && !traits<T>::same(b, a);
  return told_apart && allocations == before;
}

/// Whether a slot, whose cells are aligned as T requires, does not allocate and gives the newest value.
template <class T>
bool publishes_without_allocation(const T& one, const T& other) {
  const auto slot = std::make_shared<model::Slot<T>>();
  CHECK(reinterpret_cast<std::uintptr_t>(slot.get()) % alignof(T) == 0);
  slot->keep(8);
  slot->start_keeping(0, 0);
  const std::size_t before = allocations;
  for (int i = 0; i < 1000; ++i) slot->publish(i % 2 ? one : other);
  const bool none = allocations == before;
  Value value;
  Utc since;
  while (slot->take(value, since)) {}
  return none && rdf::same(value, traits<T>::encode(one));
}

}  // namespace

template <>
struct lrt::rdf::traits<Grasp> : lrt::rdf::Record<Grasp> {
  static void describe(Record<Grasp>& r) {
    r.field("point", &Grasp::point);
    r.field("orientation", &Grasp::orientation);
  }
};

TEST_CASE("same compares bits and does not allocate", "[eigen][R0.11]") {
  const double not_a_number = std::numeric_limits<double>::quiet_NaN();
  CHECK(differ(Eigen::Vector2d(0.0, 1), Eigen::Vector2d(-0.0, 1)));
  CHECK(differ(Eigen::Vector2d(not_a_number, 1), Eigen::Vector2d(not_a_number, 2)));
  CHECK(differ(Eigen::VectorXd(Eigen::Vector2d(1, 2)), Eigen::VectorXd(Eigen::Vector3d(1, 2, 3))));
  CHECK(differ(Eigen::MatrixXd(2, 0), Eigen::MatrixXd(0, 2)));
  CHECK(differ(Eigen::MatrixXd(Eigen::MatrixXd::Zero(2, 3)), Eigen::MatrixXd(Eigen::MatrixXd::Zero(3, 2))));
  CHECK(differ(Eigen::Quaterniond(1, 0, 0, 0), Eigen::Quaterniond(-1, 0, 0, 0)));
  CHECK(differ(Eigen::AngleAxisd(0.0, Eigen::Vector3d::UnitX()), Eigen::AngleAxisd(-0.0, Eigen::Vector3d::UnitX())));
  CHECK(differ(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()), Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY())));
  CHECK(differ(Eigen::Translation3d(0, 0, 0), Eigen::Translation3d(0, 0, -0.0)));
  Eigen::Isometry3d a = Eigen::Isometry3d::Identity(), b = a;
  b(2, 3) = -0.0;
  CHECK(differ(a, b));
  Eigen::AffineCompact3f c = Eigen::AffineCompact3f::Identity(), d = c;
  d(0, 2) = 1e-45F;
  CHECK(differ(c, d));
}

TEST_CASE("publish of a fixed size does not allocate", "[eigen][model]") {
  static_assert(!std::is_trivially_copyable_v<Eigen::Isometry3d>);  // the slot requires another property
  const Eigen::Quaterniond turn(0.5, 0.5, 0.5, 0.5);
  const Eigen::Isometry3d pose = Eigen::Translation3d(1, 2, 3) * turn;
  CHECK(publishes_without_allocation(Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(4, 5, 6)));
  CHECK(publishes_without_allocation(Eigen::Vector4d(1, 2, 3, 4), Eigen::Vector4d(5, 6, 7, 8)));
  CHECK(publishes_without_allocation(Eigen::Vector4f(1, 2, 3, 4), Eigen::Vector4f(5, 6, 7, 8)));
  CHECK(publishes_without_allocation(Vector6d(Vector6d::Ones()), Vector6d(Vector6d::Zero())));
  CHECK(publishes_without_allocation(Eigen::Matrix4d(Eigen::Matrix4d::Ones()), Eigen::Matrix4d(Eigen::Matrix4d::Zero())));
  CHECK(publishes_without_allocation(Bounded6d(Bounded6d::Ones(4)), Bounded6d(Bounded6d::Ones(6))));
  CHECK(publishes_without_allocation(turn, turn.conjugate()));
  CHECK(publishes_without_allocation(Eigen::Quaternionf(turn.cast<float>()), Eigen::Quaternionf::Identity()));
  CHECK(publishes_without_allocation(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()), Eigen::AngleAxisd(2, Eigen::Vector3d::UnitX())));
  CHECK(publishes_without_allocation(Eigen::Translation3d(1, 2, 3), Eigen::Translation3d(4, 5, 6)));
  CHECK(publishes_without_allocation(pose, Eigen::Isometry3d(pose.inverse())));
  CHECK(publishes_without_allocation(Eigen::Affine3f(Eigen::Scaling(2.0F)), Eigen::Affine3f(Eigen::Scaling(3.0F))));
  CHECK(publishes_without_allocation(Grasp{{1, 2, 3}, turn}, Grasp{}));
  CHECK(publishes_without_allocation(std::array<Eigen::Vector4d, 2>{Eigen::Vector4d(1, 2, 3, 4), Eigen::Vector4d(5, 6, 7, 8)},
                                     std::array<Eigen::Vector4d, 2>{Eigen::Vector4d(0, 0, 0, 0), Eigen::Vector4d(0, 0, 0, 0)}));
  Thing arm{"arm"};
  auto property = arm.property<Eigen::Isometry3d>("pose", unit::metre);
  const std::size_t before = allocations;
  property.publish(pose);
  CHECK(allocations == before);
}

TEST_CASE("a dynamic size is published too, in memory of its own", "[eigen][model]") {
  model::Slot<Eigen::VectorXd> slot;
  const Eigen::VectorXd vector = Eigen::Vector3d(1, 2, 3);
  slot.publish(vector);
  const std::size_t before = allocations;
  slot.publish(vector);  // unchanged
  CHECK(allocations == before);
  Value value;
  Utc since;
  REQUIRE(slot.take(value, since));
  CHECK(rdf::same(value, traits<Eigen::VectorXd>::encode(vector)));
}

TEST_CASE("another thread takes published transforms intact and in order", "[eigen][model]") {
  model::Slot<Eigen::Affine3d> slot;
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (int i = 1; !stop; ++i) {
      Eigen::Affine3d t = Eigen::Affine3d::Identity();
      t.affine().setConstant(i);
      slot.publish(t);
    }
  });
  double last = 0;
  for (int taken = 0; taken < 5'000;) {
    Value value;
    Utc since;
    if (!slot.take(value, since)) continue;
    ++taken;
    const Eigen::Affine3d t = traits<Eigen::Affine3d>::decode(value).value();
    if (t(0, 0) <= last) FAIL("out of order");
    last = t(0, 0);
    if ((t.affine().array() != last).any()) FAIL("torn");
  }
  stop = true;
  writer.join();
}
