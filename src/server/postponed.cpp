// SPDX-License-Identifier: Apache-2.0
#include "src/server/postponed.hpp"

#include <algorithm>

#include "src/base/client_key.hpp"

namespace lrt {
namespace {

/// As engine::Context::share_key().
std::string client_of(const Result<engine::Caller>& caller, std::string_view peer) {
  return caller && !caller->client.empty() ? caller->client : client_key(peer);
}

}  // namespace

Postponed::Request::Request(const http::Request& request, const Result<engine::Caller>& its_caller, engine::Ticket its_ticket)
    : head(request),
      body_owner(request.body_owner),
      own_body(body_owner ? std::string_view() : request.body),
      body(body_owner ? request.body : std::string_view(own_body)),
      caller(its_caller),
      client(body.size() > small_body_bytes ? client_of(caller, request.peer) : std::string()),
      reply{its_ticket, {}} {}

http::Request Postponed::Request::view() const {
  http::Request request = head.view();
  request.body = body;
  request.body_owner = body_owner;
  return request;
}

std::optional<engine::Ticket> Postponed::add(const http::Request& request, const Result<engine::Caller>& caller, const engine::Limits& limits) {
  if (requests_.size() >= limits.max_waiting_requests) return std::nullopt;
  const engine::Ticket ticket{own_bit | next_++};
  const std::size_t bytes = request.body.size();
  if (bytes <= small_body_bytes) return requests_.emplace_back(request, caller, ticket), ticket;
  const auto of_client = bytes_of_.try_emplace(client_of(caller, request.peer)).first;
  if (bytes_ + bytes > limits.max_waiting_body_bytes || of_client->second + bytes > limits.max_waiting_body_bytes / 4) {
    if (of_client->second == 0) bytes_of_.erase(of_client);
    return std::nullopt;
  }
  requests_.emplace_back(request, caller, ticket);
  bytes_ += bytes;
  of_client->second += bytes;
  return ticket;
}

/// A request does not wait any more.
void Postponed::uncount(const Request& waiting) noexcept {
  const std::size_t bytes = waiting.body.size();
  if (bytes <= small_body_bytes) return;
  bytes_ -= bytes;
  const auto of_client = bytes_of_.find(waiting.client);
  of_client->second -= bytes;
  if (of_client->second == 0) bytes_of_.erase(of_client);
}

std::optional<engine::Reply> Postponed::take_reply() {
  if (replies_.empty()) return std::nullopt;
  std::optional<engine::Reply> reply(std::move(replies_.front().reply));
  replies_.pop_front();
  return reply;
}

bool Postponed::forget(engine::Ticket ticket) noexcept {
  const auto found = std::find_if(requests_.begin(), requests_.end(), [&](const Request& waiting) { return waiting.reply.ticket == ticket; });
  if (found == requests_.end()) return false;
  uncount(*found);
  requests_.erase(found);
  return true;
}

std::optional<engine::Ticket> Postponed::renamed(engine::Ticket own) const noexcept {
  const auto found = std::find_if(renamed_.begin(), renamed_.end(), [&](const auto& pair) { return pair.second == own; });
  return found == renamed_.end() ? std::nullopt : std::optional(found->first);
}

void Postponed::forget_renamed(engine::Ticket own) noexcept {
  renamed_.erase(std::remove_if(renamed_.begin(), renamed_.end(), [&](const auto& pair) { return pair.second == own; }), renamed_.end());
}

void Postponed::give_back_name(engine::Reply& reply) noexcept {
  const auto found = std::find_if(renamed_.begin(), renamed_.end(), [&](const auto& pair) { return pair.first == reply.ticket; });
  if (found == renamed_.end()) return;
  reply.ticket = found->second;
  renamed_.erase(found);
}

}  // namespace lrt
