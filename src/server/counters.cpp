// SPDX-License-Identifier: Apache-2.0
#include "src/server/counters.hpp"

#include <memory>
#include <variant>

#include "src/server/shared_engine.hpp"

namespace lrt {

void Counters::response(int status, http::Denial denial) noexcept {
  if (status >= 100 && status < 600) responses_[static_cast<std::size_t>(status) / 100 - 1].fetch_add(1, std::memory_order_relaxed);
  if (denial != http::Denial::none) refusals_[static_cast<std::size_t>(denial)].fetch_add(1, std::memory_order_relaxed);
}

void Counters::handled(const http::Request&, const Result<engine::Caller>&, engine::Outcome& outcome, TimePoint) {
  requests_.fetch_add(1, std::memory_order_relaxed);
  if (const auto* at_once = std::get_if<http::Response>(&outcome)) response(at_once->status, at_once->denial);
  else if (const auto* streamed = std::get_if<engine::Streamed>(&outcome)) response(streamed->response.status, http::Denial::none);
  else if (std::holds_alternative<engine::Upgraded>(outcome)) response(101, http::Denial::none);
}

void Counters::refused(const http::Request&, const Result<engine::Caller>&, const http::Response& refusal, TimePoint) {
  requests_.fetch_add(1, std::memory_order_relaxed);
  response(refusal.status, refusal.denial);
}

void Counters::count(ServerCounters& all) const {
  all.requests = requests_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < responses_.size(); ++i) all.responses[i] = responses_[i].load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < refusals_.size(); ++i) all.refusals[i] = refusals_[i].load(std::memory_order_relaxed);
  all.poll = poll_.read();
  all.poll_interval = interval_.read();
  all.started = started_;
}

std::unique_ptr<Service> make_counters(SharedEngine& server) { return std::make_unique<Counters>(server.clock().utc()); }

}  // namespace lrt
