// SPDX-License-Identifier: Apache-2.0
#include "src/server/postponed.hpp"

#include <algorithm>

namespace lrt {

Postponed::Request::Request(const http::Request& request, const Result<engine::Caller>& its_caller, engine::Ticket its_ticket)
    : head(request),
      body_owner(request.body_owner),
      own_body(body_owner ? std::string_view() : request.body),
      body(body_owner ? request.body : std::string_view(own_body)),
      caller(its_caller),
      reply{its_ticket, {}} {}

http::Request Postponed::Request::view() const {
  http::Request request = head.view();
  request.body = body;
  request.body_owner = body_owner;
  return request;
}

engine::Ticket Postponed::add(const http::Request& request, const Result<engine::Caller>& caller) {
  const engine::Ticket ticket{own_bit | next_++};
  requests_.emplace_back(request, caller, ticket);
  return ticket;
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
