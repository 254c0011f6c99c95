// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::engine {
inline namespace v0 {

/// A graph of a snapshot: the representation of a resource, by its URI.
struct NamedGraph {
  std::string name;
  std::shared_ptr<const rdf::Graph> graph;  ///< nullptr: the resource is gone
  std::string placeholder{}, base{};        ///< IRIs that begin with `placeholder` begin with `base` instead; empty: there are none
};

/// What a query may depend on besides the graphs that it is asked of.
struct QueryDependencies {
  bool everything = false;              ///< any triple may count
  std::vector<std::string> predicates;  ///< without `everything`: only triples with these count
  std::vector<std::string> graphs{};    ///< only triples of these count; empty: those of all
  bool time = false;                    ///< NOW(), RAND() and the like: the answer changes although no graph does
};

/// A query that was parsed. Immutable.
///
/// @par Threads  any
class LRT_API PreparedQuery {
 public:
  virtual ~PreparedQuery() = default;
  /// The media types that its answers can have, best first, as http::negotiate() takes them. They live as long as the program.
  virtual const std::vector<std::string_view>& types() const = 0;
  virtual const QueryDependencies& dependencies() const = 0;
  /// Its answers are rows, of which QueryAnswer::changes_since() tells.
  virtual bool has_rows() const noexcept = 0;
};

/// The answer to a query. Immutable.
///
/// @par Threads  any
class LRT_API QueryAnswer {
 public:
  virtual ~QueryAnswer() = default;
  /// @param type  an index into PreparedQuery::types()
  /// @par Errors  unsupported_syntax: the type cannot carry it
  virtual Result<std::string> write(std::size_t type) const = 0;
  /// Answers with the same rows or triples have the same. Where the query does not sort them, their order does not count.
  virtual std::uint64_t digest() const noexcept = 0;
  /// The rows that are new since another answer to the same query, and those that are gone, as SPARQL results in JSON: the new ones are the
  /// results; the member "removed" has the others, and "sequence" a number.
  /// @pre PreparedQuery::has_rows()
  virtual Result<std::string> changes_since(const QueryAnswer& before, std::uint64_t sequence) const = 0;
};

/// The graphs that one audience sees, with what makes them fast to query.
class LRT_API QueryData {
 public:
  virtual ~QueryData() = default;
  /// Takes note of graphs that were made or replaced, or are gone. Cheap: the work is done by the next evaluation.
  /// @par Threads  any
  virtual void change(std::vector<NamedGraph> graphs) = 0;
};

/// What an engine needs to answer queries: lrt::query::endpoint() makes one.
///
/// @par Threads  const: any
class LRT_API QueryService {
 public:
  struct Limits {
    std::string path = "/sparql";                 ///< of the endpoint: "/" and one or more segments that are unreserved characters (RFC 3986)
    unsigned threads = 1;                         ///< on which queries run; they start with the first query
    std::chrono::milliseconds time{2'000};        ///< of one evaluation; more: 503. A query waits at most as long again to begin
    std::size_t max_queries = 32;                 ///< that run or wait to run; more: 503
    std::size_t max_text_bytes = 16 * 1024;       ///< of a query; more: 413
    std::size_t max_standing = 64;                ///< different standing queries; more: 503
    std::size_t max_standing_rows = 1'000;        ///< of the answer of one; more: its subscriptions end
    std::chrono::milliseconds min_interval{100};  ///< between two evaluations of a standing query
    std::chrono::milliseconds max_age{100};       ///< a property that is read by a lambda is read again if its value is older
    std::size_t max_value_members = 1'000;        ///< a property whose value has more numbers, texts and so on is not in the graphs
    std::size_t max_views = 8;                    ///< sets of graphs that are kept, for callers with different rights or different Host fields
  };

  virtual ~QueryService() = default;
  virtual const Limits& limits() const noexcept = 0;
  /// @param base            for relative IRIs
  /// @param default_graphs  with named_graphs: the dataset, instead of what the query says (SPARQL 1.1 Protocol 2.1.4); both empty: the query decides
  /// @par Errors  expected_rdf, whose message says where; limit_exceeded; unsupported_syntax: SERVICE, an update
  virtual Result<std::shared_ptr<const PreparedQuery>> parse(std::string_view text, std::string_view base, std::vector<std::string> default_graphs,
                                                             std::vector<std::string> named_graphs) const = 0;
  virtual std::shared_ptr<QueryData> make_data() const = 0;
  /// Evaluates a query on the graphs that `data` has now. Takes as long as the service's own limits say.
  /// @param max_rows  nullopt: as many as the service gives
  /// @par Errors  timed_out, limit_exceeded, cancelled
  virtual Result<std::shared_ptr<const QueryAnswer>> evaluate(const PreparedQuery& query, QueryData& data, const std::atomic<bool>& cancelled,
                                                              TimePoint now, std::optional<std::size_t> max_rows) const = 0;
};

}  // namespace v0
}  // namespace lrt::engine
