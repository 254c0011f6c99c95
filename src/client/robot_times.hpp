// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>

#include "src/http/robot_time.hpp"

namespace lrt::client {
inline namespace v0 {

/// The stamps that servers have sent (SPEC 3.20), and what a command says in them. Clocks are not compared: a stamp was true when it was sent, so with the
/// time added that has passed here since it came, it is older than the server's present time, never newer.
///
/// Several servers may stand behind one origin, each below a path of its own. A stamp belongs to the longest path that is common to the URLs whose
/// responses had its instance.
/// @par Threads  Any.
class LRT_INTERNAL_API RobotTimes {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  using Milliseconds = std::chrono::milliseconds;

  /// A response of this URL's origin has come, with that value of Robot-Time; nullopt: without one.
  /// @param path  of the URL, with or without a query
  void heard(const std::string& origin, std::string_view path, std::optional<std::string_view> field, Instant now);
  /// Whether a request must find out the time before a command is sent there: nothing is known, or it is too old for a command of that life.
  bool must_ask(const std::string& origin, std::string_view path, Milliseconds life, Instant now) const;
  /// The value of Valid-Until for a command that begins now; nullopt: the server has no such field.
  std::optional<std::string> until(const std::string& origin, std::string_view path, Milliseconds life, Instant now) const;

 private:
  struct Server {
    std::string prefix;  ///< common to the paths that it has responded for
    http::RobotTime stamp;
    Instant received;
  };
  struct Origin {
    std::vector<Server> servers;  ///< the newest is the last one
    bool has_none = false;        ///< a response came without a stamp, and no other one has come with one
  };
  const Server* find(const std::string& origin, std::string_view path) const;

  mutable std::mutex mutex_;
  std::map<std::string, Origin> origins_;
};

}  // namespace v0
}  // namespace lrt::client
