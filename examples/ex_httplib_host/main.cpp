// SPDX-License-Identifier: Apache-2.0
// A program that has an httplib::Server already serves its robot there, below /robot: on the same port, with the same threads, beside its own
// routes.
//
//   ex_httplib_host &  curl http://127.0.0.1:8080/robot/arm/angle

#include <httplib.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <lrt/httplib.hpp>
#include <lrt/lrt.hpp>
#include <lrt/transport/loopback.hpp>

namespace {

volatile std::sig_atomic_t ended = 0;
void on_signal(int) { ended = 1; }

}  // namespace

int main(int argc, char** argv) {
  const int port = argc > 1 ? std::atoi(argv[1]) : 8080;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  double angle = 12.5, target = angle;
  lrt::Thing arm{"arm"};
  auto published = arm.property<double>("angle", lrt::unit::degree);
  arm.property(
         "target", [&] { return target; }, lrt::unit::degree)
      .on_write([&](double written) { target = written; });
  arm.action("home", [&] { target = 0; });

  lrt::Options options;
  options.listen.transport = lrt::transport::no_network;  // uses the host's port
  auto server = lrt::Server::create(std::move(options));
  if (!server || !server->add(std::move(arm))) return 1;

  httplib::Server host;
  host.Get("/health", [](const httplib::Request&, httplib::Response& response) { response.set_content("fine\n", "text/plain"); });
  lrt::mount(host, *server, "/robot");
  const int bound = port != 0 ? (host.bind_to_port("127.0.0.1", port) ? port : -1) : host.bind_to_any_port("127.0.0.1");
  if (bound < 0) return 1;
  std::thread serving([&] { host.listen_after_bind(); });
  std::printf("listening on http://127.0.0.1:%d/robot/\n", bound);
  std::fflush(stdout);

  // The control loop: lambdas run in poll(), on this thread.
  while (ended == 0) {
    angle += (target - angle) * 0.05;
    published.publish(angle);
    server->poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  server->stop();  // open event streams end
  host.stop();
  serving.join();
}
