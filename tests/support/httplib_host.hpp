// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <httplib.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include <lrt/httplib.hpp>

namespace lrt::test {

/// A host's cpp-httplib server, listening on a port of 127.0.0.1 on a thread of its own.
class HttplibHost {
 public:
  /// @param prepare  adds routes and whatever else before it listens
  explicit HttplibHost(const std::function<void(httplib::Server&)>& prepare) : HttplibHost(std::make_unique<httplib::Server>(), prepare) {}
  HttplibHost(std::unique_ptr<httplib::Server> server, const std::function<void(httplib::Server&)>& prepare) : server_(std::move(server)) {
    server_->set_keep_alive_max_count(1'000'000);
    server_->set_tcp_nodelay(true);
    prepare(*server_);
    const int port = server_->bind_to_any_port("127.0.0.1");
    if (port <= 0) throw std::runtime_error("cpp-httplib does not listen");
    port_ = static_cast<std::uint16_t>(port);
    thread_ = std::thread([this] { server_->listen_after_bind(); });
    while (!server_->is_running()) std::this_thread::yield();
  }
  ~HttplibHost() { stop(); }
  HttplibHost(const HttplibHost&) = delete;
  HttplibHost& operator=(const HttplibHost&) = delete;

  void stop() {
    server_->stop();
    if (thread_.joinable()) thread_.join();
  }
  std::uint16_t port() const noexcept { return port_; }

 private:
  std::unique_ptr<httplib::Server> server_;
  std::thread thread_;
  std::uint16_t port_ = 0;
};

}  // namespace lrt::test
