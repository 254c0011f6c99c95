// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include <lrt/base/unique_function.hpp>
#include <lrt/engine/handler.hpp>

#include "src/engine/context.hpp"
#include "src/engine/pending_requests.hpp"
#include "src/engine/responses.hpp"

namespace lrt::engine {

/// Changes of the web callbacks, and the requests whose responses wait until the file has them.
class PendingSaves {
 public:
  /// A change that was made provisionally.
  struct Change {
    http::Response response;                  ///< if it is saved
    UniqueFunction<void(bool saved)> settle;  ///< called once: makes the change final, or reverts it
  };

  /// @param max_time  nullopt: responses do not wait, and each change is final at once
  PendingSaves(std::optional<std::chrono::milliseconds> max_time, std::size_t max_waiting, PendingRequests& pending, const Responses& responses)
      : max_time_(max_time), max_waiting_(max_waiting), pending_(pending), responses_(responses) {}

  /// Something that is saved has changed.
  void changed() noexcept { ++revision_; }
  /// Incremented with every change.
  std::uint64_t revision() const noexcept { return revision_; }

  /// Makes a change and responds when it is saved. 503, and no change: it cannot be saved, or too many requests wait.
  Outcome respond_when_saved(Context& context, const std::function<Change()>& make);
  /// The changes up to a revision are saved, or saving them failed.
  void saved(std::uint64_t revision, bool written, TimePoint now);
  /// Reverts the changes that are not saved. The requests remain pending.
  void stop();

 private:
  struct Waiter {
    std::uint64_t revision;
    Ticket ticket;
    Change change;
  };
  http::Response not_saved(const Context& context) const;
  void expire(Ticket ticket, const Context& context);

  const std::optional<std::chrono::milliseconds> max_time_;
  const std::size_t max_waiting_;
  PendingRequests& pending_;
  const Responses& responses_;
  std::uint64_t revision_ = 0;
  std::deque<Waiter> waiters_;  ///< by revision
};

}  // namespace lrt::engine
