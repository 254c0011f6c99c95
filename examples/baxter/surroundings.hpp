// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include <lrt/eigen.hpp>
#include <lrt/lrt.hpp>

namespace baxter {

/// What the robot sees and has to do, as a World at /world: a table and two boxes with their poses in the graph /world/objects, and a list of tasks in
/// /world/tasks, which clients may change. The control loop publishes the poses.
class Surroundings {
 public:
  /// Registers the World.
  lrt::Result<void> add_to(lrt::Server& server);
  /// Publishes where the boxes are. With `demo` one of them is pushed to and fro.
  /// @par Time  No lock, no allocation.
  void publish(double seconds, bool demo) noexcept;

 private:
  static constexpr std::size_t box_count = 2;
  lrt::WorldGraph objects_, tasks_;
  std::array<lrt::PublishedObject<Eigen::Isometry3d>, box_count> poses_;
};

}  // namespace baxter
