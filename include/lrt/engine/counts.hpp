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
};

}  // namespace v0
}  // namespace lrt::engine
