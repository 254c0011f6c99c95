// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

#include "tests/support/sample_robot.hpp"

namespace lrt::test {

/// A server on loopback with a port of its own, polled on a thread.
class RobotHost {
 public:
  /// @param transport  a name; empty: the default
  explicit RobotHost(std::vector<Thing> things, std::string_view transport = {}, Options options = {})
      : server_(make(std::move(things), transport, std::move(options))), url_(server_.url()), thread_([this] { run(); }) {}
  ~RobotHost() {
    ended_ = true;
    server_.wake();
    thread_.join();
  }
  RobotHost(const RobotHost&) = delete;
  RobotHost& operator=(const RobotHost&) = delete;

  /// "http://127.0.0.1:4711/"
  const std::string& url() const noexcept { return url_; }
  Server& server() noexcept { return server_; }

 private:
  static Server make(std::vector<Thing> things, std::string_view transport, Options options) {
    options.listen.port = 0;
    options.listen.transport = [name = std::string(transport)](transport::TransportOptions o) { return transport::make_named(name, std::move(o)); };
    Server server = Server::create(std::move(options)).value();
    server.add(std::move(things)).value();
    return server;
  }
  void run() {
    while (!ended_) {
      const auto wait = std::min(server_.poll(), std::chrono::milliseconds(20));
      pollfd work{server_.descriptor(), POLLIN, 0};
      ::poll(&work, 1, static_cast<int>(wait.count()));
    }
  }

  Server server_;
  const std::string url_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

inline std::vector<Thing> one_thing(Thing thing) {
  std::vector<Thing> things;
  things.push_back(std::move(thing));
  return things;
}

}  // namespace lrt::test
