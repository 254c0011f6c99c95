// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include <lrt/base/error.hpp>

#include "src/base/turns.hpp"
#include "src/query/evaluate.hpp"

namespace lrt::query {

/// Ends an evaluation, or the update of its graphs, from any depth. Thrown by Budget only.
struct Ended {
  Error error;
};

/// The resources that one evaluation has used. The functions throw Ended when a bound is reached.
class Budget {
 public:
  Budget(const Bounds& bounds, const std::atomic<bool>& cancelled) noexcept
      : bounds_(bounds),
        cancelled_(cancelled),
        allowed_(bounds.share ? 0 : bounds.bytes),
        end_((bounds.begin ? *bounds.begin : std::chrono::steady_clock::now()) + bounds.time) {}
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;
  /// The share has the answer from now on.
  ~Budget() {
    if (bounds_.share) (void)bounds_.share->set(std::min(answer_bytes_, bounds_.share->bytes()));
  }

  /// Counts steps. Checks the clock and the cancellation every few microseconds.
  void step(std::uint64_t count = 1) {
    steps_ += count;
    if (steps_ >= next_check_) check();
  }
  /// Counts the steps for reading or writing that many bytes at once.
  void work(std::size_t bytes) { step(1 + bytes / 64); }
  /// Counts memory that is kept.
  void take(std::size_t bytes) {
    bytes_ += bytes;
    if (bytes_ > allowed_) allow();
  }
  void give(std::size_t bytes) noexcept { bytes_ -= std::min(bytes, bytes_); }
  /// Refuses a text that would not fit, before it is created.
  void expect(std::size_t bytes) {
    if (bytes > bounds_.bytes - std::min(bytes_, bounds_.bytes)) out_of_bytes();
  }
  /// Counts what the answer needs at most as a document, and the steps for copying and writing it.
  void answer(std::size_t bytes) {
    step(bytes / 64);
    answer_bytes_ += bytes;
    if (answer_bytes_ > bounds_.answer_bytes) out_of_answer();
    if (bounds_.share && bytes_ + answer_bytes_ > bounds_.share->bytes()) allow();
  }
  /// Counts a row, or a triple of a graph, of the answer.
  void row() {
    if (++rows_ > bounds_.rows) out_of_rows();
  }
  /// Checks the clock and the cancellation now. If it is the turn of another query, waits, which does not count as time of this one.
  void check();
  /// A regular expression needs more work than it may.
  [[noreturn]] void out_of_search();

 private:
  [[noreturn]] void end(Errc code, const std::string& limit) const;
  /// Takes more of what all queries hold together.
  void allow();
  [[noreturn]] void out_of_bytes();
  [[noreturn]] void out_of_answer();
  [[noreturn]] void out_of_rows();

  const Bounds& bounds_;
  const std::atomic<bool>& cancelled_;
  Turns* const turns_ = Turns::current();
  std::size_t allowed_;  ///< of bytes_, before allow() is called
  std::chrono::steady_clock::time_point end_;
  std::uint64_t steps_ = 0, next_check_ = 0;
  std::size_t bytes_ = 0, answer_bytes_ = 0, rows_ = 0;
};

}  // namespace lrt::query
