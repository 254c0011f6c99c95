// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

#include "src/client/watches.hpp"
#include "tests/support/catch.hpp"

namespace lrt::test {

/// The changes of a watch, for a test that waits for them.
class Changes {
 public:
  using Kind = client::Change::Kind;

  client::OnChange callback() {
    return [this](const client::Change& change) {
      const std::lock_guard lock(mutex_);
      all_.push_back(change);
      changed_.notify_all();
    };
  }
  /// Waits until there are so many.
  std::vector<client::Change> wait(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return all_.size() >= count; });
    return all_;
  }
  template <class F>
  std::vector<client::Change> wait_for(F condition) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return condition(all_); });
    return all_;
  }
  /// Waits for a value whose body contains a text, which must not be a part of a time.
  client::Change wait_value(const std::string& text) {
    client::Change found;
    wait_for([&](const auto& all) {
      for (const client::Change& change : all) {
        if (change.kind != Kind::value || change.body->find(text) == std::string::npos) continue;
        found = change;
        return true;
      }
      return false;
    });
    return found;
  }
  client::Change wait_end() {
    return wait_for([](const auto& all) { return !all.empty() && all.back().kind == Kind::ended; }).back();
  }
  std::vector<client::Change> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<client::Change> all_;
};

/// A robot with an arm whose angle is pushed: it needs no poll(). It can begin again on its port.
class PushingRobot {
 public:
  explicit PushingRobot(std::string_view transport = {}, std::uint16_t port = 0, Options options = {}) {
    options.listen.port = port;
    options.listen.transport = [name = std::string(transport)](transport::TransportOptions o) { return transport::make_named(name, std::move(o)); };
    server.emplace(Server::create(std::move(options)).value());
    Thing thing("arm");
    angle = thing.property<double>("angle");
    server->add(std::move(thing)).value();
  }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(server->port()) + "/arm/angle"; }

  std::optional<Server> server;
  PushedProperty<double> angle;
};

/// Options of a client whose callbacks run in the background and whose pauses are short.
inline client::Options background() {
  client::Options options;
  options.callbacks = client::Callbacks::in_background;
  return options;
}
inline client::WatchOptions by(client::Via via) {
  client::WatchOptions options;
  options.via = via;
  options.first_pause = std::chrono::milliseconds(10);
  options.max_pause = std::chrono::milliseconds(100);
  options.poll_period = std::chrono::milliseconds(10);
  return options;
}

inline std::shared_ptr<client::HttpClient> http_client(const client::Options& options) { return client::HttpClient::create(options).value(); }

}  // namespace lrt::test
