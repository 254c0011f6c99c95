// SPDX-License-Identifier: Apache-2.0
// A robot with a SPARQL endpoint, for programs that test one.
//   query_server [--graph PATH FILE]... [--joints N | --things N] [--publish-hz N] [--limit-ms N] [--threads N]
// Prints "listening on URL", and serves until its input ends. --graph adds FILE (N-Triples) as the graph PATH of the World /world. --joints: an
// arm of N joints with position, velocity and limits, which --publish-hz publishes so often. --things: N parts in stock besides.

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/query.hpp>
#include <lrt/server.hpp>
#include <lrt/world.hpp>

namespace {

using Clock = std::chrono::steady_clock;

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

int failed(const lrt::Error& error) { return std::fprintf(stderr, "query_server: %s\n", error.message.c_str()), 1; }

}  // namespace

int main(int argc, char** argv) {
  lrt::World world("world");
  std::vector<lrt::Thing> things;
  std::size_t joints = 0, parts = 0;
  int publish_hz = 0;
  lrt::query::EndpointOptions endpoint;
  lrt::Options options;
  options.listen.port = 0;
  options.threads.dispatch = lrt::Dispatch::io_thread;
  for (int i = 1; i + 1 < argc; ++i) {
    const std::string name = argv[i];
    const char* const value = argv[++i];
    if (name == "--graph" && i + 1 < argc) {
      lrt::GraphOptions of_graph;
      of_graph.turtle = content_of(argv[++i]);
      world.graph(value, std::move(of_graph));
    } else if (name == "--joints") {
      joints = std::strtoull(value, nullptr, 10);
    } else if (name == "--things") {
      parts = std::strtoull(value, nullptr, 10);
    } else if (name == "--publish-hz") {
      publish_hz = std::atoi(value);
    } else if (name == "--limit-ms") {
      endpoint.time = std::chrono::milliseconds(std::atoi(value));
    } else if (name == "--threads") {
      endpoint.threads = static_cast<unsigned>(std::atoi(value));
    } else {
      return std::fprintf(stderr, "query_server: %s is unknown\n", name.c_str()), 2;
    }
  }
  options.query = lrt::query::endpoint(endpoint);
  auto server = lrt::Server::create(std::move(options));
  if (!server) return failed(server.error());

  constexpr lrt::Iri part_of{"http://example.org/robot#partOf"}, lower{"http://example.org/robot#lower"}, upper{"http://example.org/robot#upper"};
  constexpr lrt::Iri joint_type{"http://example.org/robot#Joint"}, position{"http://example.org/robot#position"};
  std::vector<lrt::PushedProperty<double>> positions, velocities;
  for (std::size_t i = 0; i < joints; ++i) {
    lrt::Thing joint{"robot/joint" + std::to_string(i)};
    joint.title("joint " + std::to_string(i)).type(joint_type).add(lower, -1.5).add(upper, 1.5).add(part_of, lrt::Object::resource("robot"));
    joint.add(position, lrt::Object::resource("robot/joint" + std::to_string(i) + "/position"));
    positions.push_back(joint.property<double>("position", lrt::unit::radian));
    velocities.push_back(joint.property<double>("velocity", lrt::unit::radian_per_second));
    things.push_back(std::move(joint));
  }
  if (joints != 0) {
    lrt::Thing robot{"robot"};
    robot.title("A robot");
    things.push_back(std::move(robot));
  }
  for (std::size_t i = 0; i < parts; ++i) {
    lrt::Thing part{"stock/part" + std::to_string(i)};
    part.title("part " + std::to_string(i));
    part.property<double>("position", lrt::unit::metre).publish(static_cast<double>(i));
    things.push_back(std::move(part));
  }
  things.push_back(std::move(world));
  if (auto added = server->add(std::move(things)); !added) return failed(added.error());
  const auto publish = [&](double t) {
    for (std::size_t i = 0; i < joints; ++i) {
      positions[i].publish(static_cast<double>(i % 30) / 10 - 1.45 + t);
      velocities[i].publish(t);
    }
  };
  publish(0);
  std::printf("listening on %s\n", server->url().c_str());
  std::fflush(stdout);

  std::atomic<bool> over{false};
  std::thread robot;
  if (publish_hz > 0) {
    robot = std::thread([&] {
      auto next = Clock::now();
      for (std::uint64_t n = 1; !over; ++n) {
        publish(static_cast<double>(n % 1000) / 100'000);
        std::this_thread::sleep_until(next += std::chrono::nanoseconds(1'000'000'000 / publish_hz));
      }
    });
  }
  while (std::getchar() != EOF) {}
  over = true;
  if (robot.joinable()) robot.join();
  return 0;
}
