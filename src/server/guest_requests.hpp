// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <unordered_map>

#include <lrt/engine/handler.hpp>

#include "src/server/service.hpp"

namespace lrt {
inline namespace v0 {

/// Requests and event streams received by the host's own HTTP server. Their replies and channels are separated from those of the
/// server's transport, and the host's threads wait for them here.
///
/// @par Threads  Any.
class GuestRequests final : public Service, public Receiver {
 public:
  static constexpr char key = 0;
  const char* identity() const noexcept override { return &key; }
  Receiver* receiver() noexcept override { return this; }

  explicit GuestRequests(SharedEngine& server) : server_(server) {}

  /// Handles a request and waits for its response.
  /// @param channel  set if the response is an event stream
  http::Response serve(const http::Request& request, std::optional<engine::Channel>& channel);
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes);
  /// The next event of an event stream; nullopt: none within the time.
  std::optional<engine::Push> next_event(engine::Channel channel, std::chrono::milliseconds max_wait);
  void close(engine::Channel channel) noexcept;

  bool claim(engine::Reply& reply) override;
  bool claim(engine::Channel channel) override;
  void wake_all() noexcept override { changed_.notify_all(); }

 private:
  http::Response respond(const http::Request& request, std::optional<engine::Channel>& channel);
  engine::Reply wait_for_reply(engine::Ticket ticket);
  std::optional<engine::Reply> take_reply(engine::Ticket ticket);
  bool is_ready(engine::Channel channel);

  SharedEngine& server_;
  std::unordered_map<std::uint64_t, std::optional<engine::Reply>> replies_;
  std::unordered_map<std::uint64_t, bool> channels_;  ///< named since the last is_ready()
  std::condition_variable_any changed_;
};

}  // namespace v0
}  // namespace lrt
