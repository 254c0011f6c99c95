// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::client {
inline namespace v0 {

class CallbackReceiver;

/// How a client watches a resource (R0.12 to R0.17).
enum class Via : unsigned char {
  any,           ///< the first of websocket, event_stream and polling that the server accepts
  websocket,     ///< R0.14
  event_stream,  ///< SPEC 3.18
  callback,      ///< R0.16: the server posts to this program, see CallbackReceiver
  polling,       ///< conditional requests; for a server that offers nothing else
};

struct WatchOptions {
  Via via = Via::any;
  /// Media type of the messages (R0.17), or several with q-values; empty: Options::accept. They are tried one by one, because a WebSocket and an
  /// event stream do not say which of several the server has chosen.
  std::string accept;
  std::chrono::milliseconds minimum_interval{0};  ///< between two messages
  std::size_t queue_length = 0;                   ///< 0: the newest value; else the server keeps so many changes
  std::chrono::milliseconds poll_period{1'000};   ///< of Via::polling
  // After a loss the client connects again after first_pause, then after twice that, and so on up to max_pause, each times a random factor of
  // 0.5 to 1.5, and not before what Retry-After or `retry` of the server says. A value counts as a success. A resource that was connected before and is
  // now 404 may belong to a server that is starting: it is tried again for max_pause.
  std::chrono::milliseconds first_pause{200};
  std::chrono::milliseconds max_pause{30'000};
  /// Without a message, a pong or a comment for so long, the connection counts as lost. Via::callback: the subscription is looked at.
  std::chrono::milliseconds idle_time{60'000};
  /// `hybrit:websocketUrl` of the resource, where it is known. Empty: the URL of the resource is tried, and if the server refuses, its graph is read.
  std::string websocket_url{};
  /// `hybrit:subscriptions` of the resource's Thing, for Via::callback, where it is known. It must be of the resource's origin. With it, notifications are signed with a secret of the watch.
  std::string subscriptions_url{};
  std::shared_ptr<CallbackReceiver> receiver{};  ///< of Via::callback
};

/// What a watch reports.
struct LRT_API Change {
  enum class Kind : unsigned char {
    value,  ///< a representation, the same as GET would have received
    gap,    ///< connected again: changes since the last value may be missing. The next value is the present one
    ended,  ///< nothing follows: the server has ended the subscription, or refuses it; `reason` says why
  };
  Kind kind = Kind::value;
  std::string url{};         ///< of the resource
  std::string media_type{};  ///< without parameters
  std::shared_ptr<const std::string> body{};
  std::string entity_tag{};       ///< where the protocol transfers it
  std::uint64_t dropped = 0;      ///< values that this program has not taken in time, before this one
  std::optional<Error> reason{};  ///< of ended; of a gap: why the connection was lost
  std::chrono::steady_clock::time_point received{};
  std::size_t max_triples = 500'000;  ///< of graph(): Limits::max_triples

  /// The graph of the body, which is parsed by each call.
  /// @par Errors  expected_rdf, limit_exceeded, unsupported_syntax: the body is not RDF
  Result<rdf::Graph> graph() const;
};
using OnChange = std::function<void(const Change&)>;

/// A running watch. Destroying the handle ends it. A handle that outlives its client has no effect.
///
/// After stop() or destruction the callback is not called again: they wait for one that runs, unless they are called in it. So the caller must not
/// hold a lock that the callback needs.
/// @par Threads  Any.
class LRT_API Watch {
 public:
  struct Counts {
    std::uint64_t values = 0;  ///< received
    std::uint64_t gaps = 0;
    std::uint64_t dropped = 0;  ///< of the values: not taken in time
  };

  Watch() noexcept;
  Watch(Watch&&) noexcept;
  Watch& operator=(Watch&&) noexcept;
  ~Watch();

  void stop() noexcept;
  bool is_connected() const noexcept;
  /// The protocol that is in use; any: none yet.
  Via via() const noexcept;
  /// URL of the subscription, as the server has named it; empty: not yet, or it has none.
  std::string subscription() const;
  Counts counts() const noexcept;
  /// Why the last connection was lost, or the last attempt failed; nullopt: none was, or it is connected again.
  std::optional<Error> last_error() const;

  class Impl;
  explicit Watch(std::shared_ptr<Impl> impl) noexcept;

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::client
