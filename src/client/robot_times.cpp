// SPDX-License-Identifier: Apache-2.0
#include "src/client/robot_times.hpp"

#include <algorithm>

namespace lrt::client {
inline namespace v0 {

namespace {

using std::chrono::duration_cast;
using std::chrono::milliseconds;

constexpr std::size_t max_origins = 1'000, max_servers = 32;
/// A stamp that is older than this many lives of a command is renewed first. Clocks of two machines drift apart by less than a thousandth, which is
/// subtracted from the time that has passed: at most a tenth of the life is lost to it.
constexpr int longest_in_lives = 100, drift = 1000;
/// An older stamp that promises more is kept that long: the newer one was delayed on its way.
constexpr std::chrono::seconds kept{30};

std::string_view path_only(std::string_view path) noexcept { return path.substr(0, path.find_first_of("?#")); }

/// "/arm" is at or above "/arm" and "/arm/angle"; "/" is above all.
bool is_above(std::string_view above, std::string_view path) noexcept {
  if (!above.empty() && above.back() == '/') above.remove_suffix(1);
  return path.substr(0, above.size()) == above && (path.size() == above.size() || path[above.size()] == '/');
}

/// The longest path at or above both.
std::string_view common(std::string_view a, std::string_view b) noexcept {
  while (!is_above(a, b)) a = a.substr(0, a.find_last_of('/'));
  return a;
}

}  // namespace

void RobotTimes::heard(const std::string& origin, std::string_view path, std::optional<std::string_view> field, Instant now) {
  const auto stamp = field ? http::RobotTime::parse(*field) : std::nullopt;
  path = path_only(path);
  const std::lock_guard lock(mutex_);
  auto found = origins_.find(origin);
  if (found == origins_.end()) {
    if (origins_.size() >= max_origins) origins_.erase(origins_.begin());
    found = origins_.emplace(origin, Origin()).first;
  }
  Origin& known = found->second;
  if (!stamp) {
    known.has_none = known.servers.empty();
    return;
  }
  known.has_none = false;
  auto& servers = known.servers;
  const auto at = std::find_if(servers.begin(), servers.end(), [&](const Server& s) { return s.stamp.instance == stamp->instance; });
  Server heard{std::string(path), *stamp, now};
  if (at != servers.end()) {
    heard.prefix = std::string(common(at->prefix, path));
    const auto passed = duration_cast<milliseconds>(now - at->received);
    const bool was_delayed =
        stamp->milliseconds + 1 < at->stamp.milliseconds + static_cast<std::uint64_t>(std::max<milliseconds::rep>(passed.count(), 0));
    if (was_delayed && passed < kept) {
      heard.stamp = at->stamp;
      heard.received = at->received;
    }
    servers.erase(at);
  }
  // What this run has responded for is not another run's any more.
  servers.erase(std::remove_if(servers.begin(), servers.end(), [&](const Server& other) { return is_above(path, other.prefix); }), servers.end());
  if (servers.size() >= max_servers) servers.erase(servers.begin());
  servers.push_back(std::move(heard));
}

const RobotTimes::Server* RobotTimes::find(const std::string& origin, std::string_view path) const {
  const auto known = origins_.find(origin);
  if (known == origins_.end()) return nullptr;
  const Server* best = nullptr;
  for (const Server& server : known->second.servers)
    if (is_above(server.prefix, path) && (!best || server.prefix.size() >= best->prefix.size())) best = &server;
  return best;
}

bool RobotTimes::must_ask(const std::string& origin, std::string_view path, Milliseconds life, Instant now) const {
  const std::lock_guard lock(mutex_);
  const auto known = origins_.find(origin);
  if (known != origins_.end() && known->second.has_none) return false;
  const Server* const server = find(origin, path_only(path));
  return !server || now - server->received > longest_in_lives * life;
}

std::optional<std::string> RobotTimes::until(const std::string& origin, std::string_view path, Milliseconds life, Instant now) const {
  const std::lock_guard lock(mutex_);
  const Server* const server = find(origin, path_only(path));
  if (!server) return std::nullopt;
  const auto passed = std::max(duration_cast<milliseconds>(now - server->received), milliseconds(0));
  http::RobotTime until = server->stamp;
  until.milliseconds += static_cast<std::uint64_t>((passed - passed / drift + life).count());
  return until.text();
}

}  // namespace v0
}  // namespace lrt::client
