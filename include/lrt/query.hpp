// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/engine/query_service.hpp>

/// SPARQL 1.1 on a robot: a library of its own, lrt::query.
///
///     lrt::Options options;
///     options.query = lrt::query::endpoint();
///     auto server = lrt::Server::create(std::move(options));
///
/// The server then answers queries at /sparql (SPARQL 1.1 Protocol, GET and POST), of the values of the moment at which the query comes. Each resource of a
/// Thing is a named graph by its URI: the triples that GET of that URI gives. The default graph is their union. Who asks sees in them what they may read.
/// The same GET with `Upgrade: websocket`, `Upgrade: callback` or `Accept: text/event-stream` leaves the query standing: the subscriber gets the answer,
/// and again whenever it has changed, at most each `minimumInterval` seconds; with `changes=true` the rows that are new and those that are gone.
namespace lrt::query {
inline namespace v0 {

/// Limits of an endpoint. What reaches one of them is refused with the limit and what was reached.
struct EndpointOptions : engine::QueryService::Limits {
  std::uint64_t max_steps = 20'000'000;               ///< of one evaluation: triples matched, rows made, expressions evaluated
  std::size_t max_rows = 100'000;                     ///< of an answer; of CONSTRUCT and DESCRIBE: triples
  std::size_t max_solution_bytes = 64 * 1024 * 1024;  ///< of the solutions that one evaluation keeps at once
  std::size_t max_depth = 64;                         ///< of groups, parentheses, paths and queries in each other
  std::size_t max_triples = 2'000'000;                ///< of the robot; more: its queries get 503
};

/// Answers queries for a server: for Options::query. One endpoint may be used by several servers.
///
/// The evaluation runs on threads of its own, on graphs that nothing changes meanwhile: neither the control loop nor other clients wait for it.
/// The graphs are kept from one query to the next, and only resources that have changed are described again. Nothing is kept while nobody asks.
///
/// @par Time        100 us for a query over 50 joints, 1 us for each triple that has changed.
/// @par Implements  SPARQL 1.1 Query, SPARQL 1.1 Protocol 2.1
LRT_API std::shared_ptr<const engine::QueryService> endpoint(EndpointOptions options = {});

}  // namespace v0
}  // namespace lrt::query
