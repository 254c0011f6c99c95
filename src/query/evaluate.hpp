// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/query/answer.hpp>

#include "src/query/algebra.hpp"
#include "src/query/dataset.hpp"
#include "src/query/memory.hpp"

namespace lrt::query {

/// The limits of one evaluation. At a limit it ends with an error that names the limit and the work done.
struct Bounds {
  std::chrono::milliseconds time{2'000};
  std::uint64_t steps = 20'000'000;      ///< triples matched, rows made, expressions evaluated
  std::size_t rows = 100'000;            ///< of the answer; of CONSTRUCT and DESCRIBE: triples
  std::size_t bytes = 64 * 1024 * 1024;  ///< of solutions and terms that are kept at once
  /// Of the answer as a document, whatever its format: an upper bound that is counted while the answer is made, so that writing, hashing and
  /// comparing it afterwards are bounded, too.
  std::size_t answer_bytes = 64 * 1024 * 1024;
  /// Of what all queries hold together. Null: that has no limit.
  MemoryShare* share = nullptr;
  std::optional<std::chrono::steady_clock::time_point> begin{};  ///< when the time began; nullopt: when the evaluation does
};

/// The graphs that a query reads, by name: default-graph-uri and named-graph-uri of the SPARQL Protocol. Unless both are empty they stand
/// for FROM and FROM NAMED of the query. A name that the dataset does not have is an empty graph.
struct Selection {
  std::vector<std::string> default_graphs, named_graphs;
};

/// Evaluates a query on the graphs of one moment.
///
/// The default graph is the union of all graphs, and all are named, unless the query or the selection says which. DESCRIBE gives the triples
/// with the resource as their subject, and those of the blank nodes that are their objects.
///
/// Integers and decimals are exact up to 100 digits; a quotient of decimals has 18 digits after the point or more. A regular expression has
/// a bound on its work, and ends the query at it.
///
/// @param cancelled  checked every few microseconds
/// @param now        what NOW() gives
/// @par Errors   timed_out, limit_exceeded: a bound; cancelled
/// @par Threads  any number at once on one dataset that nothing changes
/// @par Implements  SPARQL 1.1 Query 15 to 18
Result<Answer> evaluate(const Query& query, const Dataset& dataset, const Bounds& bounds, const std::atomic<bool>& cancelled,
                        std::chrono::system_clock::time_point now, const Selection* selection = nullptr);

}  // namespace lrt::query
