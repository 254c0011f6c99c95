// SPDX-License-Identifier: Apache-2.0
#include "src/engine/pending_requests.hpp"

#include <exception>
#include <utility>

namespace lrt::engine {

std::optional<Ticket> PendingRequests::defer(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout, Dispatch where) {
  if (calls_.overloaded(where)) return std::nullopt;
  return keep(context, max_time, std::move(on_timeout), calls_.waits_for_host(where) ? WaitsFor::host : WaitsFor::io_thread);
}

std::optional<Ticket> PendingRequests::defer_for_disk(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout) {
  return keep(context, max_time, std::move(on_timeout), WaitsFor::disk);
}

Ticket PendingRequests::defer_stop(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout) {
  return *keep(context, max_time, std::move(on_timeout), WaitsFor::stop);
}

std::optional<Ticket> PendingRequests::keep(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout, WaitsFor what) {
  std::size_t& waiting = waiting_[static_cast<std::size_t>(what)];
  if (waiting >= max_pending_ && what != WaitsFor::stop) return std::nullopt;
  const auto known = context.ticket ? pending_.find(static_cast<std::uint64_t>(*context.ticket)) : pending_.end();
  const Ticket ticket = known != pending_.end() ? *context.ticket : Ticket{next_ticket_++};
  Pending kept{context.kept(), std::move(on_timeout), nullptr, nullptr, {}, what};
  const auto deadline = deadlines_.emplace(context.now.steady + max_time, ticket);
  kept.deadline = deadline;
  if (known != pending_.end()) {
    --waiting_[static_cast<std::size_t>(known->second.waits_for)];
    deadlines_.erase(known->second.deadline);
    known->second = std::move(kept);
  } else {
    try {
      pending_.emplace(static_cast<std::uint64_t>(ticket), std::move(kept));
    } catch (...) {
      deadlines_.erase(deadline);
      throw;
    }
  }
  ++waiting;
  return ticket;
}

void PendingRequests::waits_for(Ticket ticket, std::shared_ptr<CancelToken> token) {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found != pending_.end()) found->second.token = std::move(token);
}

void PendingRequests::answer_by(Ticket ticket, Instant time) {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found == pending_.end() || found->second.deadline->first <= time) return;
  const auto earlier = deadlines_.emplace(time, ticket);
  deadlines_.erase(std::exchange(found->second.deadline, earlier));
}

void PendingRequests::tell_end(Ticket ticket, std::shared_ptr<std::atomic<bool>> ended) {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found != pending_.end()) found->second.ended = std::move(ended);
}

Context* PendingRequests::resume(Ticket ticket, TimePoint now) {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found == pending_.end()) return nullptr;
  Context& context = found->second.context;
  context.now = now;
  context.ticket = ticket;
  context.resource = registry_.find(context.resource_id);
  return &context;
}

void PendingRequests::respond(Ticket ticket, http::Response response, std::optional<Channel> channel) {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found == pending_.end()) return;
  if (response.status != 101) cors_.add_fields(found->second.context.request(), response);
  replies_.push_back({ticket, std::move(response), channel});
  remove(found);
}

void PendingRequests::respond(Ticket ticket, Outcome outcome) {
  if (auto* response = std::get_if<http::Response>(&outcome)) respond(ticket, std::move(*response));
  else if (auto* upgraded = std::get_if<Upgraded>(&outcome)) respond(ticket, std::move(upgraded->response), upgraded->channel);
  else if (auto* streamed = std::get_if<Streamed>(&outcome)) respond(ticket, std::move(streamed->response), streamed->channel);
}

void PendingRequests::abandon(Ticket ticket) noexcept {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found == pending_.end()) return;
  if (found->second.token) found->second.token->cancel();
  remove(found);
}

void PendingRequests::input_ended(Ticket ticket) noexcept {
  const auto found = pending_.find(static_cast<std::uint64_t>(ticket));
  if (found != pending_.end() && found->second.ended) *found->second.ended = true;
}

void PendingRequests::abandon_from(Ticket first) noexcept {
  for (auto ticket = static_cast<std::uint64_t>(first); ticket < next_ticket_; ++ticket) abandon(Ticket{ticket});
}

void PendingRequests::remove(Requests::iterator request) {
  --waiting_[static_cast<std::size_t>(request->second.waits_for)];
  deadlines_.erase(request->second.deadline);
  if (request->second.ended) *request->second.ended = true;
  pending_.erase(request);
}

void PendingRequests::expire(TimePoint now) {
  while (!deadlines_.empty() && deadlines_.begin()->first <= now.steady) {
    const Ticket ticket = deadlines_.begin()->second;
    Context& context = *resume(ticket, now);
    Pending& pending = pending_.at(static_cast<std::uint64_t>(ticket));
    const bool runs = pending.token && !pending.token->cancel();
    if (Timeout on_timeout = std::move(pending.on_timeout)) try {
        on_timeout(ticket, context, runs);
        continue;
      } catch (const std::exception&) {
        respond_bare(ticket);
        throw;
      }
    respond_bare(ticket);  // there was no memory for that before
  }
}

void PendingRequests::respond_bare(Ticket ticket) {
  http::Response bare;
  bare.status = 503;
  respond(ticket, std::move(bare));
}

std::optional<PendingRequests::Instant> PendingRequests::next_deadline() const {
  if (!replies_.empty()) return Instant{};
  return deadlines_.empty() ? std::nullopt : std::optional(deadlines_.begin()->first);
}

std::optional<Reply> PendingRequests::take_reply() {
  if (replies_.empty()) return std::nullopt;
  Reply first = std::move(replies_.front());
  replies_.pop_front();
  return first;
}

void PendingRequests::end_all(const std::function<http::Response(Context&)>& respond_with, TimePoint now) {
  while (!pending_.empty()) {
    const Ticket ticket{pending_.begin()->first};
    if (const auto& token = pending_.begin()->second.token) token->cancel();
    respond(ticket, respond_with(*resume(ticket, now)));
  }
}

}  // namespace lrt::engine
