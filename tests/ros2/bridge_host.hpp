// SPDX-License-Identifier: Apache-2.0
// A server with a bridge to a graph without DDS.
#pragma once

#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/ros2.hpp>
#include <lrt/ros2/definitions.hpp>
#include <lrt/served.hpp>
#include <lrt/server.hpp>
#include <lrt/transport/loopback.hpp>

#include "src/ros2/bridge/core.hpp"
#include "src/ros2/types/cdr.hpp"
#include "tests/ros2/fake_graph.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

namespace lrt::test {

/// Whether a condition holds before 30 s have passed.
inline bool comes_true(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// Writes payloads by hand.
class Cdr {
 public:
  explicit Cdr(bool little = true) : out_(little) {}
  Cdr& text(std::string_view s) {
    out_.write(static_cast<std::uint32_t>(s.size() + 1));
    out_.bytes(s);
    out_.bytes(std::string_view("\0", 1));
    return *this;
  }
  Cdr& u8(std::uint8_t n) { return out_.write(n), *this; }
  Cdr& u32(std::uint32_t n) { return out_.write(n), *this; }
  Cdr& f32(float f) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &f, sizeof bits);
    return u32(bits);
  }
  Cdr& f64(double d) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &d, sizeof bits);
    return out_.write(bits), *this;
  }
  Cdr& f64s(const std::vector<double>& all) {
    u32(static_cast<std::uint32_t>(all.size()));
    for (const double d : all) f64(d);
    return *this;
  }
  Cdr& bytes(std::string_view b) {
    u32(static_cast<std::uint32_t>(b.size()));
    out_.bytes(b);
    return *this;
  }
  Cdr& header(std::uint32_t seconds, std::uint32_t nanoseconds, std::string_view frame) { return u32(seconds).u32(nanoseconds).text(frame); }
  std::string take() { return out_.take(); }

 private:
  ros2::Writer out_;
};

struct BridgeHost {
  explicit BridgeHost(ros2::Options options = {}, std::function<void(BridgeHost&)> before = {}) {
    lrt::Options server_options;
    server_options.listen.transport = transport::no_network;
    server_options.threads.executor = [](std::function<void()> f) { f(); };
    server_options.log = [this](LogLevel, std::string_view text) {
      const std::lock_guard lock(log_mutex);
      log += std::string(text) + '\n';
    };
    server.emplace(Server::create(std::move(server_options)).value());
    server->start();
    if (before) before(*this);
    options.graph.settle = std::chrono::milliseconds(0);
    core.emplace(*server, std::move(options), graph, definitions);
    core->start().value();
  }
  ~BridgeHost() {
    core.reset();
    server->stop();
    graph->close();
  }

  Answer ask(const std::string& text) {
    RequestText request(text);
    return Answer(server->serve(request.get()).response);
  }
  std::string json(const std::string& path) { return ask("GET " + path + "\nAccept: application/json").body; }
  Answer put(const std::string& path, const std::string& body) { return ask("PUT " + path + "\nContent-Type: application/json\n\n" + body); }
  /// Tells the bridge what the test has said of the graph, and waits until it has looked.
  void settle() {
    graph->announce();
    REQUIRE(core->wait_until_settled(std::chrono::seconds(30)));
  }
  bool comes(const std::string& path, const std::string& text) {
    return comes_true([&] { return json(path).find(text) != std::string::npos; });
  }
  std::optional<ros2::Listed> listed(const std::string& name, ros2::Listed::What what) {
    for (const ros2::Listed& l : core->list())
      if (l.name == name && l.what == what) return l;
    return std::nullopt;
  }
  std::string reason(const std::string& name, ros2::Listed::What what = ros2::Listed::What::topic) {
    const auto l = listed(name, what);
    return l ? l->reason : "not listed";
  }

  std::mutex log_mutex;
  std::string log;
  std::shared_ptr<FakeGraph> graph = std::make_shared<FakeGraph>();
  ros2::Definitions definitions;
  std::optional<Server> server;
  std::optional<ros2::Core> core;
};

}  // namespace lrt::test
