#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <lrt/base/result.hpp>
#include <lrt/query/answer.hpp>

#include "src/query/algebra.hpp"
#include "src/query/dataset.hpp"

namespace lrt::query {

/// What one evaluation may use. What it needs beyond that ends it with an error that names the limit and what was reached.
struct Bounds {
  std::chrono::milliseconds time{2'000};
  std::uint64_t steps = 50'000'000;         ///< triples matched, rows made, expressions evaluated
  std::size_t rows = 100'000;               ///< of the answer; of CONSTRUCT and DESCRIBE: triples
  std::size_t bytes = 64 * 1024 * 1024;     ///< of solutions and terms that are kept at once
};

/// Evaluates a query on the graphs of one moment.
/// @param cancelled  looked at every few microseconds
/// @param now        what NOW() gives
/// @par Errors   timed_out, limit_exceeded: a bound; cancelled
/// @par Threads  any number at once on one dataset that nothing changes
Result<Answer> evaluate(const Query& query, const Dataset& dataset, const Bounds& bounds, const std::atomic<bool>& cancelled,
                        std::chrono::system_clock::time_point now);

}  // namespace lrt::query
