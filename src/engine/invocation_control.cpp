// SPDX-License-Identifier: Apache-2.0
#include "src/engine/invocation_control.hpp"

#include <algorithm>
#include <cmath>

namespace lrt::engine {

void InvocationControl::finish(Result<rdf::Value> result) noexcept {
  if (!result && result.error().code == Errc::dropped) {
    std::uint8_t expected = starting;
    if (phase_.compare_exchange_strong(expected, dropped, std::memory_order_acq_rel)) return;  // start_ended() decides
  }
  if (finished_.exchange(true, std::memory_order_acq_rel)) return;
  UniqueFunction<void()> hook;  // destroyed without the lock: its captures are the user's
  {
    const std::lock_guard lock(mutex_);
    hook = std::move(hook_);
  }
  *result_ = std::move(result);
  inbox_->put(std::move(message_));
}

void InvocationControl::start_ended(Result<void> result) noexcept {
  const bool was_dropped = phase_.exchange(idle, std::memory_order_acq_rel) == dropped;
  if (!result) finish(Unexpected{std::move(result).error()});
  else if (was_dropped) finish(unexpected(Errc::dropped, "the responder was destroyed before succeed() or fail()"));
}

void InvocationControl::progress(double fraction) noexcept {
  if (std::isnan(fraction)) return;
  fraction_.store(std::clamp(fraction, 0.0, 1.0), std::memory_order_seq_cst);
  signal();
}

void InvocationControl::on_cancel(UniqueFunction<void()> hook) {
  {
    const std::lock_guard lock(mutex_);
    if (!cancelled()) {
      std::swap(hook_, hook);
      return;  // a hook that was there before is destroyed without the lock
    }
  }
  hook();
}

UniqueFunction<void()> InvocationControl::cancel() noexcept {
  finished_.store(true, std::memory_order_release);
  const std::lock_guard lock(mutex_);
  cancelled_.store(true, std::memory_order_release);
  return std::move(hook_);
}

}  // namespace lrt::engine
