// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/engine/query_service.hpp>

/// SPARQL 1.1 on a robot. It is a library of its own, lrt::query.
///
///     lrt::Options options;
///     options.query = lrt::query::endpoint();
///     auto server = lrt::Server::create(std::move(options));
///
/// The server then answers queries at /sparql (SPARQL 1.1 Protocol, GET and POST), on the values at the time of the
/// query. Each resource of a Thing is a named graph with the resource's URI as its name; it contains the triples that
/// GET of that URI returns. The default graph is their union. A client sees only what it may read. The same GET with
/// `Upgrade: websocket`, `Upgrade: callback` or `Accept: text/event-stream` makes a standing query: the subscriber gets
/// the result, and again whenever it has changed, at most each `minimumInterval` seconds; with `changes=true` it gets
/// the new rows and the removed rows.
namespace lrt::query {
inline namespace v0 {

/// Limits of an endpoint. A query beyond one of them is refused, with the limit in the message.
struct EndpointOptions : engine::QueryService::Limits {
  std::uint64_t max_steps = 20'000'000;               ///< of one evaluation: triples matched, rows made, expressions evaluated
  std::size_t max_rows = 100'000;                     ///< of a result; of CONSTRUCT and DESCRIBE: triples
  std::size_t max_solution_bytes = 64 * 1024 * 1024;  ///< of the solutions that one evaluation holds at a time; and of its result as a document
  std::size_t max_depth = 64;                         ///< nesting of groups, parentheses, paths and queries
  std::size_t max_triples = 2'000'000;                ///< of the robot; more: its queries get 503
  /// What all queries hold together, of all clients and under all names of the robot: copies of its graphs, solutions, and
  /// results until they are sent; more: 503. At least 1 MiB is used.
  std::size_t max_total_bytes = 256 * 1024 * 1024;
};

/// Makes an endpoint that answers queries of a server, for Options::query. Several servers may use one endpoint.
///
/// Threads of the server evaluate the queries, on immutable graphs: neither the control loop nor other clients wait for
/// them. The graphs are cached from one query to the next, and only resources that have changed are described again.
/// A minute after the last query nothing is cached.
///
/// @par Errors      None here. Server::create() returns invalid_option for a path that is none, for 0 threads, and for a
///                  time of 0.
/// @par Threads     Any.
/// @par Time        100 us for a query over 50 joints, 1 us for each triple that has changed.
/// @par Implements  SPARQL 1.1 Query, SPARQL 1.1 Protocol 2.1
LRT_API std::shared_ptr<const engine::QueryService> endpoint(EndpointOptions options = {});

}  // namespace v0
}  // namespace lrt::query
