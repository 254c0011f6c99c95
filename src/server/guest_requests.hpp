// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

#include <lrt/engine/handler.hpp>

namespace lrt {
inline namespace v0 {

/// Requests and event streams received by the host's own HTTP server. Their replies and channels are separated from those of the
/// server's transport, and the host's threads wait for them here.
///
/// @par Threads  Any; all functions but wait() are called with the engine's lock.
class GuestRequests {
 public:
  void add(engine::Ticket ticket) { replies_.emplace(static_cast<std::uint64_t>(ticket), std::nullopt); }
  void add(engine::Channel channel) { channels_.emplace(static_cast<std::uint64_t>(channel), false); }
  void remove(engine::Channel channel) { channels_.erase(static_cast<std::uint64_t>(channel)); }

  /// Keeps a reply for the thread that waits for it. False: it belongs to the transport.
  bool take(engine::Reply& reply) {
    const auto found = replies_.find(static_cast<std::uint64_t>(reply.ticket));
    if (found == replies_.end()) return false;
    if (reply.channel) add(*reply.channel);
    found->second = std::move(reply);
    changed_.notify_all();
    return true;
  }
  /// The channel has something to send. False: it belongs to the transport.
  bool take(engine::Channel channel) {
    const auto found = channels_.find(static_cast<std::uint64_t>(channel));
    if (found == channels_.end()) return false;
    found->second = true;
    changed_.notify_all();
    return true;
  }
  std::optional<engine::Reply> reply(engine::Ticket ticket) {
    const auto found = replies_.find(static_cast<std::uint64_t>(ticket));
    if (found == replies_.end() || !found->second) return std::nullopt;
    std::optional<engine::Reply> reply = std::move(found->second);
    replies_.erase(found);
    return reply;
  }
  /// True once after the channel was named.
  bool is_ready(engine::Channel channel) {
    const auto found = channels_.find(static_cast<std::uint64_t>(channel));
    return found != channels_.end() && std::exchange(found->second, false);
  }
  /// Wakes all waiting threads.
  void notify() { changed_.notify_all(); }
  void wait(std::unique_lock<std::mutex>& engine_lock, std::chrono::steady_clock::time_point until) { changed_.wait_until(engine_lock, until); }

 private:
  std::unordered_map<std::uint64_t, std::optional<engine::Reply>> replies_;
  std::unordered_map<std::uint64_t, bool> channels_;  ///< named since the last is_ready()
  std::condition_variable changed_;
};

}  // namespace v0
}  // namespace lrt
