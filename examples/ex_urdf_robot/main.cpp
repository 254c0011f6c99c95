// SPDX-License-Identifier: Apache-2.0
// Any robot with a URDF as Linked Robotic Things, moved by a recording of its joints or by clients.
//
//   ex_urdf_robot [URDF] [CSV] [--port N] [--bind ADDRESS] [--public-base URL] [--allowed-host HOST]... [--cors ORIGIN]... [--argument NAME=VALUE]...
//                 [--package NAME=DIR]...
//
// URDF                    the robot; default: the picker beside this file
// CSV                     a recording of its joints (trajectory.hpp); without it positions can be written, and joints have an action `move`
// --argument NAME=VALUE   the value of ${NAME} in a URDF that still contains xacro
// --package NAME=DIR      the folder of the ROS package NAME: the meshes that the URDF names as package://NAME/... are served

#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>
#include <utility>

#ifdef EX_URDF_ROBOT_HAS_QUERY
#include <lrt/query.hpp>
#endif

#include "examples/ex_urdf_robot/moving_robot.hpp"

namespace {

volatile std::sig_atomic_t interrupted = 0;

int failed(const lrt::Error& error) { return std::fprintf(stderr, "ex_urdf_robot: %s\n", error.message.c_str()), 1; }

}  // namespace

int main(int argc, char** argv) {
  lrt::Options options;
#ifdef EX_URDF_ROBOT_HAS_QUERY
  options.query = lrt::query::endpoint();  // SPARQL at /sparql
#endif
  lrt::urdf::ParseOptions urdf_options;
  lrt::urdf::PackageOptions packages;
  std::string files[2] = {EX_URDF_ROBOT_DEFAULT, ""};
  std::size_t count = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg.compare(0, 1, "-") != 0 && count < 2) {
      files[count++] = arg;
    } else if (arg == "--bind" && i + 1 < argc) {
      options.listen.address = argv[++i];
    } else if (arg == "--public-base" && i + 1 < argc) {
      options.listen.public_base = argv[++i];
    } else if (arg == "--allowed-host" && i + 1 < argc) {
      options.security.allowed_hosts.emplace_back(argv[++i]);
    } else if (arg == "--cors" && i + 1 < argc) {
      options.security.read_origins.emplace_back(argv[++i]);
    } else if ((arg == "--argument" || arg == "--package") && i + 1 < argc) {
      const std::string given = argv[++i];
      const std::size_t equals = given.find('=');
      if (equals == std::string::npos) return std::fprintf(stderr, "ex_urdf_robot: %s needs NAME=VALUE\n", arg.c_str()), 2;
      (arg == "--package" ? packages.folders : urdf_options.arguments)[given.substr(0, equals)] = given.substr(equals + 1);
    } else if (arg == "--port" && i + 1 < argc) {
      const std::string text = argv[++i];
      const char* const end = text.data() + text.size();
      const auto [read_to, error] = std::from_chars(text.data(), end, options.listen.port);
      if (error != std::errc() || read_to != end) return std::fprintf(stderr, "ex_urdf_robot: --port wants 0 to 65535\n"), 2;
    } else {
      std::fprintf(stderr,
                   "usage: ex_urdf_robot [URDF] [CSV] [--port N] [--bind ADDRESS] [--public-base URL] [--allowed-host HOST]...\n"
                   "                     [--cors ORIGIN]... [--argument NAME=VALUE]... [--package NAME=DIR]...\n");
      return arg == "--help" ? 0 : 2;
    }
  }

  auto robot = lrt::urdf::load(files[0], urdf_options);
  if (!robot) return failed(robot.error());
  for (const std::string& warning : robot->model().warnings) std::fprintf(stderr, "ex_urdf_robot: %s\n", warning.c_str());
  if (!packages.folders.empty())
    for (const std::string& warning : robot->serve_meshes(packages)) std::fprintf(stderr, "ex_urdf_robot: %s\n", warning.c_str());
  std::optional<ex_urdf_robot::Trajectory> trajectory;
  if (!files[1].empty()) {
    auto loaded = ex_urdf_robot::Trajectory::load(files[1], robot->model());
    if (!loaded) return failed(loaded.error());
    trajectory = *std::move(loaded);
  }
  const std::string robot_name = robot->model().name;
  ex_urdf_robot::MovingRobot moving(*std::move(robot), std::move(trajectory));

  options.title = {"The robot " + robot_name, "en"};
  auto server = lrt::Server::create(options);
  if (!server) return failed(server.error());
  moving.step();  // so that all properties have a value
  if (auto added = moving.add_to(*server); !added) return failed(added.error());

  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  const lrt::urdf::Model& model = moving.robot().model();
  std::printf("%s, %zu links and %zu joints, is /%s at %s (Ctrl-C ends)\n", model.name.c_str(), model.links.size(), model.joints.size(),
              moving.robot().path().c_str(), server->url().c_str());
  std::fflush(stdout);

  auto next = std::chrono::steady_clock::now();
  while (!interrupted) {
    moving.step();
    server->poll();
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
  server->stop();
}
