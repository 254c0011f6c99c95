// SPDX-License-Identifier: Apache-2.0
// Code of the guide's pages about URDF. It is compiled, not run.
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/urdf.hpp>

namespace docs {

lrt::Result<void> serve_robot(lrt::Server& server) {
  auto loaded = lrt::urdf::load("robot.urdf");
  if (!loaded) return lrt::Unexpected{loaded.error()};  // one sentence with the element and its line
  lrt::urdf::Robot& robot = *loaded;
  if (auto added = robot.add_to(server); !added) return added;
  std::vector<double> positions(robot.model().variables.size());  // in the order of the document; mimic joints follow
  robot.publish(positions);                                       // in each period: joints and the poses of all links
  return {};
}

}  // namespace docs
