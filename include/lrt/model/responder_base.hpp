// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/error.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::model {
inline namespace v0 {
/// @cond internal
/// One invocation, as the user's code sees it. The engine implements it. After the first finish() or a cancellation,
/// calls have no effect.
/// @par Threads  Any.
class LRT_API InvocationLink {
 public:
  virtual ~InvocationLink() = default;
  virtual void finish(Result<rdf::Value> result) noexcept = 0;
  virtual void progress(double fraction) noexcept = 0;
  virtual bool cancelled() const noexcept = 0;
  virtual void on_cancel(UniqueFunction<void()> hook) = 0;
};

/// The state that the copies of a Responder share. Ends the invocation as failed when the last copy is destroyed
/// without a result.
class LRT_API SharedInvocation {
 public:
  explicit SharedInvocation(std::shared_ptr<InvocationLink> link) : link_(std::move(link)) {}
  ~SharedInvocation();
  SharedInvocation(const SharedInvocation&) = delete;
  SharedInvocation& operator=(const SharedInvocation&) = delete;

  /// Only the first call has an effect.
  void finish(Result<rdf::Value> result) noexcept;
  bool finished() const noexcept { return finished_.load(std::memory_order_acquire); }
  InvocationLink& link() const noexcept { return *link_; }

 private:
  const std::shared_ptr<InvocationLink> link_;
  std::atomic<bool> finished_{false};
};

/// @endcond
/// The common part of Responder and ResponderOf: failure, progress and cancellation of an invocation. Copies refer to
/// the same invocation.
/// @par Threads  Any. Several copies may be used at the same time; one copy by one thread at a time.
/// @par Time     progress() and cancelled(): no lock and no allocation. succeed(), fail(), on_cancel() and the end of
///               the last copy: a lock for a moment, which only a cancellation also takes. Each at most one system call.
class ResponderBase {
 public:
  /// An empty responder. Its calls have no effect. Another responder may be assigned to it.
  ResponderBase() = default;
  /// Made by the engine for each invocation.
  explicit ResponderBase(std::shared_ptr<InvocationLink> link) : invocation_(std::make_shared<SharedInvocation>(std::move(link))) {}

  /// True if it refers to an invocation that has not been ended by succeed() or fail(), on this or another copy.
  explicit operator bool() const noexcept { return invocation_ && !invocation_->finished(); }

  /// Ends the invocation as failed, with `error` in its representation. Has no effect on an ended invocation. A waiting
  /// client gets a status by the code: 409 for refused (the robot's state or limits exclude the command), out_of_range
  /// and limit_exceeded, 422 for expected_value, and 500 for another code (the robot tried and failed).
  void fail(Error error) const { finish(Unexpected{std::move(error)}); }
  /// As fail(Error) with Errc::failed.
  void fail(std::string message) const { fail(Error{Errc::failed, std::move(message)}); }
  /// Sets the progress of the invocation, 0 to 1. Other numbers are clamped, NaN is ignored. Observers of the
  /// invocation get it.
  void progress(double fraction) const noexcept {
    if (invocation_) invocation_->link().progress(fraction);
  }
  /// True after the invocation was cancelled (by DELETE, or as the oldest of too many stops) or preempted (by its
  /// policy), or its Thing was removed. Then stop the robot's motion and destroy the responder.
  bool cancelled() const noexcept { return invocation_ && invocation_->link().cancelled(); }
  /// Registers a function that runs once when the invocation is cancelled or preempted or its thing is removed; at once
  /// if that has happened already. It runs where the action's Dispatch says, so possibly after Server::remove() has
  /// returned. It must not hold a copy of this responder: then the last copy would never be destroyed.
  void on_cancel(UniqueFunction<void()> hook) const {
    if (invocation_) invocation_->link().on_cancel(std::move(hook));
  }

 protected:
  /// Ends the invocation. Only the first call has an effect.
  void finish(Result<rdf::Value> result) const {
    if (invocation_) invocation_->finish(std::move(result));
  }

 private:
  std::shared_ptr<SharedInvocation> invocation_;
};
}  // namespace v0
}  // namespace lrt::model
