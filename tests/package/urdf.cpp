// SPDX-License-Identifier: Apache-2.0
// A host of lrt::urdf. Its argument is a URDF.
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/urdf.hpp>

int main(int, char** argv) {
  lrt::Options options;
  options.listen.port = 0;
  lrt::Server server = lrt::Server::create(options).value();
  auto robot = lrt::urdf::load(argv[1]).value();
  robot.add_to(server).value();
  std::vector<double> positions(robot.model().variables.size());
  robot.publish(positions);
}
