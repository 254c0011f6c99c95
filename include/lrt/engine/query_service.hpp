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

/// A graph of a snapshot: the representation of a resource, named by its URI.
struct NamedGraph {
  std::string name;                         ///< IRI
  std::shared_ptr<const rdf::Graph> graph;  ///< nullptr: the resource was removed
  /// @{
  /// IRIs that begin with `placeholder` begin with `base` instead; empty: there are none.
  std::string placeholder{}, base{};
  /// @}
};

/// What the result of a query depends on.
struct QueryDependencies {
  bool everything = false;              ///< any triple may matter
  std::vector<std::string> predicates;  ///< without `everything`: only triples with these predicates matter
  std::vector<std::string> graphs{};    ///< only triples of these graphs matter; empty: those of all
  bool time = false;                    ///< NOW(), RAND() and the like: the result changes although no graph does
  /// Without `everything`, of the triples with the predicate rdf:type: only those with these classes matter; empty: those with any.
  std::vector<std::string> types{};
};

/// A parsed query. Immutable.
///
/// @par Threads  Any.
class LRT_API PreparedQuery {
 public:
  virtual ~PreparedQuery() = default;
  /// The media types that its results can have, best first, as http::negotiate() takes them. They are valid until the
  /// process ends.
  virtual const std::vector<std::string_view>& types() const = 0;
  /// What its result depends on.
  virtual const QueryDependencies& dependencies() const = 0;
  /// Whether its results are rows, which QueryAnswer::changes_since() compares.
  virtual bool has_rows() const noexcept = 0;
};

/// The result of a query. Immutable.
///
/// @par Threads  Any.
class LRT_API QueryAnswer {
 public:
  virtual ~QueryAnswer() = default;
  /// The result as a document.
  /// @param type  an index into PreparedQuery::types()
  /// @par Errors  unsupported_syntax: the type cannot carry it
  virtual Result<std::string> write(std::size_t type) const = 0;
  /// A hash. Results with the same rows or triples have the same hash. If the query does not sort them, their order
  /// does not matter.
  virtual std::uint64_t digest() const noexcept = 0;
  /// The difference to another result of the same query, as SPARQL results in JSON: `results` has the new rows, the
  /// member "removed" the rows that are missing now, and "sequence" a number.
  /// @param before    the other result
  /// @param sequence  the number
  /// @pre PreparedQuery::has_rows()
  /// @par Errors  as write()
  virtual Result<std::string> changes_since(const QueryAnswer& before, std::uint64_t sequence) const = 0;
};

/// The graphs that clients with the same rights see, with indexes for queries.
/// @par Threads  Any, concurrently: change() also during QueryService::evaluate(), and several evaluations at a time.
class LRT_API QueryData {
 public:
  virtual ~QueryData() = default;
  /// Records graphs that were made, replaced or removed. Cheap: the next evaluation does the work.
  /// @par Threads  Any.
  virtual void change(std::vector<NamedGraph> graphs) = 0;
};

/// Parses and evaluates queries for an engine. lrt::query::endpoint() makes one.
///
/// @par Threads  Constant functions: any, concurrently.
class LRT_API QueryService {
 public:
  /// Limits of the endpoint.
  struct Limits {
    std::string path = "/sparql";                 ///< of the endpoint: "/" and one or more segments of unreserved characters (RFC 3986)
    unsigned threads = 1;                         ///< queries that are evaluated at a time; those of several clients take turns
    std::chrono::milliseconds time{2'000};        ///< of one evaluation, without the turns of others; more: 503
    std::size_t max_queries = 32;                 ///< under way, without standing ones; more: 503, except for the first query of a client
    std::size_t max_text_bytes = 16 * 1024;       ///< of a query; more: 413
    std::size_t max_standing = 64;                ///< different standing queries; more: 503
    std::size_t max_standing_rows = 1'000;        ///< of the result of a standing query, of 4 KiB on average; more: its subscriptions end
    std::chrono::milliseconds min_interval{100};  ///< between two evaluations of a standing query
    std::chrono::milliseconds max_age{100};       ///< a property that is read by a lambda is read again if its value is older
    std::size_t max_value_members = 1'000;        ///< a property whose value has more scalars is not in the graphs
    std::size_t max_views = 8;                    ///< cached sets of graphs, by rights and Host field; with subscriptions: by principal, too
    std::size_t max_queries_per_client = 16;      ///< of max_queries, those of one client; more: 429. 0: no limit
    std::size_t max_standing_per_client = 32;     ///< of max_standing, those that one client has started; more: 429. 0: no limit
  };

  virtual ~QueryService() = default;
  /// The limits.
  virtual const Limits& limits() const noexcept = 0;
  /// Parses a query.
  /// @param text            the query in UTF-8
  /// @param base            base of relative IRIs
  /// @param default_graphs  with named_graphs: the dataset, instead of the one of the query (SPARQL 1.1 Protocol
  ///                        2.1.4); both empty: that of the query
  /// @param named_graphs    see default_graphs
  /// @par Errors  expected_rdf, whose message states the position; limit_exceeded; unsupported_syntax: SERVICE, an
  ///              update
  virtual Result<std::shared_ptr<const PreparedQuery>> parse(std::string_view text, std::string_view base, std::vector<std::string> default_graphs,
                                                             std::vector<std::string> named_graphs) const = 0;
  /// Makes an empty set of graphs.
  virtual std::shared_ptr<QueryData> make_data() const = 0;
  /// Evaluates a query on the present graphs of `data`, within the service's own limits.
  /// @param query      the query
  /// @param data       the graphs
  /// @param cancelled  set to true by another thread to end the evaluation
  /// @param now        value of NOW()
  /// @param max_rows   nullopt: the service's own limit
  /// @par Errors  timed_out, limit_exceeded, cancelled
  virtual Result<std::shared_ptr<const QueryAnswer>> evaluate(const PreparedQuery& query, QueryData& data, const std::atomic<bool>& cancelled,
                                                              TimePoint now, std::optional<std::size_t> max_rows) const = 0;

  /// What the engine does for a QueryService. The engine derives its own, and only the constructor names that, so that a
  /// linker leaves it out of a program that makes no QueryService.
  class Extension {
   protected:
    ~Extension() = default;
  };
  /// For the engine.
  const Extension& extension() const noexcept { return extension_; }

 protected:
  QueryService() noexcept;

 private:
  const Extension& extension_;
};

}  // namespace v0
}  // namespace lrt::engine
