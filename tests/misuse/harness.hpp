// SPDX-License-Identifier: Apache-2.0
#pragma once

// Runs mistakes of a host and collects what it is told: by a Result, an exception, a check of the headers, the log, or what a client gets.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/base/misuse.hpp>
#include <lrt/lrt.hpp>
#include <lrt/registration.hpp>
#include <lrt/transport/loopback.hpp>

namespace misuse {

/// One mistake: what it is, what the host is told (a part of the text), and the mistake itself, which returns the text.
struct Misuse {
  const char* what;
  const char* expected;
  std::function<std::string()> commit;
};

/// What checks have said since the last call.
inline std::mutex checked_mutex;
inline std::string checked_text;
inline void collect(const char* message) {
  const std::lock_guard lock(checked_mutex);
  checked_text += std::string(checked_text.empty() ? "" : "; ") + message;
}
inline std::string checked() {
  const std::lock_guard lock(checked_mutex);
  return std::exchange(checked_text, {});
}

inline std::string text_of(const lrt::Result<void>& result) {
  return result ? std::string("nothing") : std::string(to_string(result.error().code)) + ": " + result.error().message;
}
/// What a call throws.
template <class F>
std::string thrown(F f) {
  try {
    f();
    return "nothing";
  } catch (const lrt::BadResult& e) { return "throws " + std::string(to_string(e.error().code)) + ": " + e.error().message; }
}

/// A server without a port, whose host polls.
class Host {
 public:
  explicit Host(lrt::Options options = {}) : server(lrt::Server::create(complete(std::move(options))).value()) {}

  lrt::Options complete(lrt::Options options) {
    options.threads.io = lrt::Io::in_poll;
    options.limits.host_timeout = std::chrono::seconds(30);  // a slow machine is no mistake
    options.listen.public_base = "http://robot.example";
    options.log = [log = log_](lrt::LogLevel, std::string_view message) {
      const std::lock_guard lock(log->mutex);
      log->text += std::string(message) + "\n";
    };
    options.listen.transport = [this](lrt::transport::TransportOptions o) {
      auto made = std::make_unique<lrt::transport::Loopback>(std::move(o));
      loopback = made.get();
      return made;
    };
    return options;
  }

  /// "status detail" of the response; polls until it is there.
  std::string ask(std::string_view method, std::string_view target, std::string_view json = {}, std::string_view accept = "application/json") {
    std::optional<lrt::http::Response> got;
    lrt::http::Request request;
    request.method = method;
    request.target = target;
    request.fields = {{"Host", "robot.example"}, {"Accept", accept}};
    if (!json.empty()) request.fields.push_back({"Content-Type", "application/json"});
    request.body = json;
    loopback->submit(request, [&](lrt::http::Response response) { got = std::move(response); });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!got && std::chrono::steady_clock::now() < end) server.poll();
    if (!got) return "no response";
    return std::to_string(got->status) + " " + std::string(got->content());
  }
  std::string log() const {
    const std::lock_guard lock(log_->mutex);
    return log_->text;
  }

 private:
  struct Log {
    std::mutex mutex;
    std::string text;
  };
  std::shared_ptr<Log> log_ = std::make_shared<Log>();

 public:
  lrt::transport::Loopback* loopback = nullptr;
  lrt::Server server;
};

/// What add() returns for a Thing "arm" that is described like this.
template <class F>
std::string add(F describe) {
  Host host;
  lrt::Thing arm("arm");
  describe(arm);
  return text_of(host.server.add(std::move(arm)));
}

/// Waits for another thread.
inline bool wait_for(const std::function<bool()>& is) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!is()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

std::vector<Misuse> of_descriptions();  ///< Things, types, units, bounds, functions
std::vector<Misuse> of_use();           ///< handles, threads, lambdas, servers, life times
/// Ends the process by a check: the number of the mistake, from 0. nullptr: there is none.
const Misuse* fatal(std::size_t number);

}  // namespace misuse
