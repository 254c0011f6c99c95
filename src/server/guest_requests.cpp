// SPDX-License-Identifier: Apache-2.0
#include "src/server/guest_requests.hpp"

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "src/http/robot_time.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

/// A thread of a host's HTTP server checks its deadline at least this often.
constexpr std::chrono::milliseconds longest_wait{50};

}  // namespace

http::Response GuestRequests::serve(const http::Request& request, std::optional<engine::Channel>& channel) {
  http::Response response = respond(request, channel);
  if (server_.is_own_process()) response.fields.set(http::robot_time_field, server_.robot_time());
  return response;
}

http::Response GuestRequests::respond(const http::Request& request, std::optional<engine::Channel>& channel) {
  if (!server_.is_own_process()) return closed_response();
  const TimePoint now = server_.clock().now();
  const Result<engine::Caller> caller = server_.admit(request, now);
  engine::Outcome outcome = server_.use([&] {
    engine::Outcome made = server_.handle(request, caller, now);
    // Before the lock is released: a reply may be available at once.
    if (const auto* deferred = std::get_if<engine::Deferred>(&made)) replies_.emplace(number_of(deferred->ticket), std::nullopt);
    if (const auto* streamed = std::get_if<engine::Streamed>(&made)) channels_.emplace(number_of(streamed->channel), false);
    return made;
  });
  server_.loop().wake_io();  // there may be a new deadline, or news for other clients
  if (auto* response = std::get_if<http::Response>(&outcome)) return std::move(*response);
  if (auto* streamed = std::get_if<engine::Streamed>(&outcome)) {
    channel = streamed->channel;
    return std::move(streamed->response);
  }
  engine::Reply reply = wait_for_reply(std::get<engine::Deferred>(outcome).ticket);
  channel = reply.channel;
  return std::move(reply.response);
}

/// The calling thread handles its deadline, because the host may not poll.
engine::Reply GuestRequests::wait_for_reply(engine::Ticket ticket) {
  std::unique_lock lock = server_.lock();
  while (true) {
    const TimePoint now = server_.clock().now();
    server_.end_waits(now);
    if (auto reply = take_reply(ticket)) return *std::move(reply);
    const auto due = server_.engine().next_deadline();
    if (due && *due <= now.steady) {
      server_.collect_replies(now);
      if (auto reply = take_reply(ticket)) return *std::move(reply);
      server_.pass_on(lock);
      server_.loop().wake_io();
      lock.lock();
    }
    changed_.wait_until(lock, std::chrono::steady_clock::now() + longest_wait);
  }
}

engine::HeaderVerdict GuestRequests::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes) {
  if (!server_.is_own_process()) return {closed_response(), 0};
  return server_.judge_header(request, body_bytes, server_.clock().now());
}

std::optional<engine::Push> GuestRequests::next_event(engine::Channel channel, std::chrono::milliseconds max_wait) {
  const auto end = std::chrono::steady_clock::now() + std::min<std::chrono::milliseconds>(max_wait, std::chrono::hours(24));
  while (true) {
    if (!server_.is_open()) {
      engine::Push last;
      last.close = 1001;
      return last;
    }
    if (auto push = server_.next_push(channel, server_.clock().now())) return push;
    std::unique_lock lock = server_.lock();
    while (!is_ready(channel) && !server_.is_stopping()) {
      if (std::chrono::steady_clock::now() >= end) return std::nullopt;
      changed_.wait_until(lock, end);
    }
  }
}

void GuestRequests::close(engine::Channel channel) noexcept {
  if (!server_.is_own_process()) return;
  {
    const auto lock = server_.lock();
    channels_.erase(number_of(channel));
    server_.close(channel);
  }
  server_.flush_log();
}

bool GuestRequests::claim(engine::Reply& reply) {
  const auto found = replies_.find(number_of(reply.ticket));
  if (found == replies_.end()) return false;
  if (reply.channel) channels_.emplace(number_of(*reply.channel), false);
  found->second = std::move(reply);
  changed_.notify_all();
  return true;
}

bool GuestRequests::claim(engine::Channel channel) {
  const auto found = channels_.find(number_of(channel));
  if (found == channels_.end()) return false;
  found->second = true;
  changed_.notify_all();
  return true;
}

std::optional<engine::Reply> GuestRequests::take_reply(engine::Ticket ticket) {
  const auto found = replies_.find(number_of(ticket));
  if (found == replies_.end() || !found->second) return std::nullopt;
  std::optional<engine::Reply> reply = std::move(found->second);
  replies_.erase(found);
  return reply;
}

/// True once after the channel was named.
bool GuestRequests::is_ready(engine::Channel channel) {
  const auto found = channels_.find(number_of(channel));
  return found != channels_.end() && std::exchange(found->second, false);
}

std::unique_ptr<Service> make_guest_requests(SharedEngine& server) { return std::make_unique<GuestRequests>(server); }

}  // namespace lrt
