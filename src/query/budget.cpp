// SPDX-License-Identifier: Apache-2.0
#include "src/query/budget.hpp"

namespace lrt::query {
namespace {

// Some microseconds.
constexpr std::uint64_t steps_between_checks = 128;

/// With commas: "3,120,000".
std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, 1, ',');
  return text;
}

}  // namespace

void Budget::check() {
  next_check_ = steps_ + steps_between_checks;
  if (turns_) end_ += turns_->rest();
  if (steps_ > bounds_.steps) end(Errc::limit_exceeded, "the query reached its limit of " + grouped(bounds_.steps) + " steps");
  if (cancelled_.load(std::memory_order_relaxed)) end(Errc::cancelled, "the query was cancelled");
  if (std::chrono::steady_clock::now() >= end_)
    end(Errc::timed_out, "the query reached its limit of " + std::to_string(bounds_.time.count()) + " ms");
}

void Budget::allow() {
  constexpr std::size_t block = 256 * 1024;
  if (bytes_ > bounds_.bytes) out_of_bytes();
  if (!bounds_.share) return;
  const std::size_t wanted = (bytes_ + answer_bytes_) / block * block + block;
  if (!bounds_.share->set(std::max(wanted, bounds_.share->bytes())))
    end(Errc::limit_exceeded,
        "all queries together reached their limit of " + grouped(bounds_.share->max()) + " bytes (max_total_bytes); try again later: this one ended");
  allowed_ = std::min(bounds_.bytes, bounds_.share->bytes() - answer_bytes_);
}

void Budget::out_of_bytes() { end(Errc::limit_exceeded, "the query reached its limit of " + grouped(bounds_.bytes) + " bytes"); }

void Budget::out_of_answer() {
  end(Errc::limit_exceeded, "the query reached its limit of " + grouped(bounds_.answer_bytes) + " bytes of its answer");
}

void Budget::out_of_rows() {
  rows_ = bounds_.rows;
  end(Errc::limit_exceeded, "the query reached its limit of " + grouped(bounds_.rows) + " rows");
}

void Budget::out_of_search() { end(Errc::limit_exceeded, "a regular expression of the query reached the limit of its work"); }

void Budget::end(Errc code, const std::string& limit) const {
  throw Ended{
      {code, limit + " after " + grouped(steps_) + (steps_ == 1 ? " step and " : " steps and ") + grouped(rows_) + (rows_ == 1 ? " row" : " rows")}};
}

}  // namespace lrt::query
