// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <lrt/base/language.hpp>

namespace lrt::engine {
inline namespace v0 {

/// Present numbers of an engine, and messages since it was created.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct EngineCounts {
  /// @{
  /// Present subscriptions.
  std::size_t websockets = 0, event_streams = 0, callbacks = 0;
  /// @}
  std::uint64_t messages_sent = 0;     ///< taken by transports, or confirmed by receivers of web callbacks
  std::uint64_t messages_dropped = 0;  ///< changes that a subscriber did not get one by one
  std::size_t queued_bytes = 0;        ///< of messages for subscribers
  std::size_t waiting_requests = 0;    ///< requests whose response is deferred
  std::size_t waiting_calls = 0;       ///< calls of lambdas that the host has not run
  std::size_t feeds = 0;               ///< subscriptions of lrt::Feed, for example of an MQTT bridge
  std::uint64_t queries = 0;           ///< of clients, begun; without the evaluations of standing queries
  std::uint64_t failed_queries = 0;    ///< of those, ended without a result: too long, too large, cancelled
  std::uint64_t refused_queries = 0;   ///< not begun, or not observed: too many are under way, or stand
  std::size_t running_queries = 0;     ///< begun and not ended
  std::size_t standing_queries = 0;    ///< present ones
  double query_seconds = 0;            ///< [s] from the beginning to the end of all that have ended
};

}  // namespace v0
}  // namespace lrt::engine
