// SPDX-License-Identifier: Apache-2.0
#include "src/engine/pending_saves.hpp"

#include <algorithm>
#include <utility>

namespace lrt::engine {

Outcome PendingSaves::respond_when_saved(Context& context, const std::function<Change()>& make) {
  if (!max_time_) {
    Change made = make();
    made.settle(true);
    return std::move(made.response);
  }
  const bool is_new = !context.ticket;
  if (waiters_.size() >= max_waiting_) return responses_.overloaded(context);
  const auto ticket = pending_.defer_for_disk(context, *max_time_, [this](Ticket late, Context& c, bool) { expire(late, c); });
  if (!ticket) return responses_.overloaded(context);
  try {
    Change made = make();
    waiters_.push_back({revision_, *ticket, std::move(made)});
  } catch (...) {
    if (is_new) pending_.abandon(*ticket);
    throw;
  }
  return Deferred{*ticket};
}

void PendingSaves::saved(std::uint64_t revision, bool written, TimePoint now) {
  while (!waiters_.empty() && waiters_.front().revision <= revision) {
    Waiter first = std::move(waiters_.front());
    waiters_.pop_front();
    first.change.settle(written);
    const Context* const context = pending_.resume(first.ticket, now);
    if (context) pending_.respond(first.ticket, written ? std::move(first.change.response) : not_saved(*context));
  }
}

void PendingSaves::stop() {
  while (!waiters_.empty()) {
    Waiter first = std::move(waiters_.front());
    waiters_.pop_front();
    first.change.settle(false);
  }
}

void PendingSaves::expire(Ticket ticket, const Context& context) {
  const auto found = std::find_if(waiters_.begin(), waiters_.end(), [&](const Waiter& w) { return w.ticket == ticket; });
  if (found != waiters_.end()) {
    Waiter late = std::move(*found);
    waiters_.erase(found);
    late.change.settle(false);
  }
  pending_.respond(ticket, not_saved(context));
}

http::Response PendingSaves::not_saved(const Context& context) const {
  http::Response response = responses_.problem(context, 503, "this change of the subscriptions could not be saved: nothing has changed");
  responses_.add_retry_after(response);
  return response;
}

}  // namespace lrt::engine
