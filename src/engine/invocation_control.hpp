// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/detail/wake_signal.hpp>
#include <lrt/responder.hpp>

#include "src/engine/host_calls.hpp"

namespace lrt::engine {

/// The part of an invocation that user threads touch.
class InvocationControl final : public model::InvocationLink, public model::ChangeSource {
 public:
  /// @param on_finish  runs on the engine's thread with the result; at most once
  using Finished = std::function<void(Result<rdf::Value>, TimePoint)>;
  InvocationControl(std::shared_ptr<Inbox> inbox, Finished on_finish)
      : inbox_(std::move(inbox)),
        result_(std::make_shared<Result<rdf::Value>>(rdf::Value())),
        message_(Inbox::reserve([result = result_, on_finish = std::move(on_finish)](TimePoint now) { on_finish(std::move(*result), now); })) {}

  void finish(Result<rdf::Value> result) noexcept override;
  void progress(double fraction) noexcept override;
  bool cancelled() const noexcept override { return cancelled_.load(std::memory_order_acquire); }
  void on_cancel(UniqueFunction<void()> hook) override;

  /// Set around the user's start function: if that throws, the destruction of its Responder is ignored.
  void start_begins() noexcept { phase_.store(starting, std::memory_order_relaxed); }
  void start_ended(Result<void> result) noexcept;

  /// Called by the engine: later results are ignored.
  /// @return the hook of on_cancel(), to be run as a call into the host
  UniqueFunction<void()> cancel() noexcept;
  double fraction() const noexcept { return fraction_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::uint8_t idle = 0, starting = 1, dropped = 2;

  const std::shared_ptr<Inbox> inbox_;
  // The memory for the result is allocated before the lambda starts, so that the result is delivered even when memory is exhausted.
  const std::shared_ptr<Result<rdf::Value>> result_;
  Inbox::Reserved message_;
  std::atomic<std::uint8_t> phase_{idle};
  std::atomic<bool> finished_{false}, cancelled_{false};
  std::atomic<double> fraction_{0};
  std::mutex mutex_;  ///< guards hook_ against a cancellation at the same time
  UniqueFunction<void()> hook_;
};

}  // namespace lrt::engine
