// A robot that has one of everything, for the page to show: structs, lists, enums, booleans, a collection, and a property that fails.
//
//   page_robot --port N [PUBLIC BASE]

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include <lrt/lrt.hpp>

#include "tests/support/sample_robot.hpp"

namespace {
volatile std::sig_atomic_t interrupted = 0;
}

int main(int argc, char** argv) {
  lrt::Options options;
  options.port = static_cast<std::uint16_t>(argc >= 3 && std::string(argv[1]) == "--port" ? std::atoi(argv[2]) : 0);
  if (argc == 4) options.engine.public_base = argv[3];
  lrt::Server server = lrt::Server::create(options).value();
  lrt::test::SampleRobot robot;
  bool armed = false;
  lrt::Thing whole{"sample"};
  whole.title("<b>Sample</b> & \"robot\"");
  whole.property("armed", [&] { return armed; }).on_write([&](bool v) { armed = v; });
  whole.property("pose", [&] { return robot.pose; }).on_write([&](lrt::test::Pose v) { robot.pose = std::move(v); });
  whole.property("mode", [&] { return robot.mode; }).on_write([&](lrt::test::Mode v) { robot.mode = v; });
  whole.property("gains", [&] { return robot.gains; }).on_write([&](std::vector<double> v) { robot.gains = std::move(v); });
  whole.action("measure", [] { return 2.5; }).produces(lrt::rdf::Facets{}.unit(lrt::unit::metre));
  server.add(std::move(whole)).value();
  server.add(robot.arm()).value();
  server.add(robot.tool()).value();

  std::signal(SIGTERM, [](int) { interrupted = 1; });
  std::printf("One of everything is at %s (Ctrl-C ends)\n", server.url().c_str());
  std::fflush(stdout);
  while (!interrupted) {
    server.poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  server.stop();
}
