// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <lrt/http/message.hpp>
#include <lrt/server_thing.hpp>

#include "src/server/service.hpp"

namespace lrt {

/// TimeCounts written by one thread at a time and read by any.
class AtomicTimeCounts {
 public:
  void add(std::chrono::steady_clock::duration time) noexcept {
    const double seconds = std::chrono::duration<double>(time).count();
    const auto bound = std::lower_bound(TimeCounts::bounds.begin(), TimeCounts::bounds.end(), seconds);
    increase(counts_[static_cast<std::size_t>(bound - TimeCounts::bounds.begin())], std::uint64_t{1});
    increase(sum_, seconds);
    newest_.store(seconds, std::memory_order_relaxed);
    if (seconds > maximum_.load(std::memory_order_relaxed)) maximum_.store(seconds, std::memory_order_relaxed);
  }
  TimeCounts read() const noexcept {
    TimeCounts all;
    for (std::size_t i = 0; i < counts_.size(); ++i) all.counts[i] = counts_[i].load(std::memory_order_relaxed);
    all.sum = sum_.load(std::memory_order_relaxed);
    all.newest = newest_.load(std::memory_order_relaxed);
    all.maximum = maximum_.load(std::memory_order_relaxed);
    return all;
  }

 private:
  template <class T>
  static void increase(std::atomic<T>& value, T by) noexcept {
    value.store(value.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
  }
  std::array<std::atomic<std::uint64_t>, TimeCounts::bounds.size() + 1> counts_{};
  std::atomic<double> sum_{0}, newest_{0}, maximum_{0};
};

/// The counters of a server. Writing neither locks nor waits.
///
/// @par Threads  any; Poll: one at a time
class Counters final : public Service, public RequestObserver {
 public:
  explicit Counters(std::chrono::system_clock::time_point started) noexcept : started_(started) {}

  static constexpr char key = 0;
  const char* identity() const noexcept override { return &key; }
  RequestObserver* observer() noexcept override { return this; }

  void handled(const http::Request& request, const Result<engine::Caller>& caller, engine::Outcome& outcome, TimePoint now) override;
  void refused(const http::Request& request, const Result<engine::Caller>& caller, const http::Response& refusal, TimePoint now) override;
  bool replied(engine::Reply& reply) override {
    response(reply.response.status, reply.response.denial);
    return true;
  }
  void count(ServerCounters& all) const override;
  /// Measures a call of Server::poll().
  class Poll {
   public:
    Poll(Counters& counters, std::chrono::steady_clock::time_point begin) noexcept : counters_(counters), begin_(begin) {
      if (counters.last_poll_ != std::chrono::steady_clock::time_point()) counters.interval_.add(begin - counters.last_poll_);
      counters.last_poll_ = begin;
    }
    ~Poll() { counters_.poll_.add(std::chrono::steady_clock::now() - begin_); }
    Poll(const Poll&) = delete;
    Poll& operator=(const Poll&) = delete;

   private:
    Counters& counters_;
    const std::chrono::steady_clock::time_point begin_;
  };

 private:
  void response(int status, http::Denial denial) noexcept;

  const std::chrono::system_clock::time_point started_;
  std::atomic<std::uint64_t> requests_{0};
  std::array<std::atomic<std::uint64_t>, 5> responses_{};
  std::array<std::atomic<std::uint64_t>, http::denial_count> refusals_{};
  AtomicTimeCounts poll_, interval_;
  std::chrono::steady_clock::time_point last_poll_{};
};

}  // namespace lrt
