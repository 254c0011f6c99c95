// SPDX-License-Identifier: Apache-2.0
// A host with a cpp-httplib server of its own.
#include <lrt/httplib.hpp>
#include <lrt/lrt.hpp>
#include <lrt/transport/loopback.hpp>

#include <thread>

int main() {
  lrt::Options options;
  options.listen.transport = lrt::transport::no_network;
  lrt::Server server = lrt::Server::create(options).value();
  httplib::Server host;
  lrt::mount(host, server, "/robot");
  const int port = host.bind_to_any_port("127.0.0.1");
  std::thread serving([&] { host.listen_after_bind(); });
  const httplib::Result response = httplib::Client("127.0.0.1", port).Get("/robot/");
  host.stop();
  serving.join();
  return response && response->status == 200 ? 0 : 1;
}
