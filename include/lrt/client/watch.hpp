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

/// Options of a watch.
struct WatchOptions {
  Via via = Via::any;  ///< the protocol
  /// Media type of the messages (R0.17), or several with q-values; empty: Options::accept. They are tried one by one,
  /// because a WebSocket and an event stream do not state which of several the server has chosen.
  std::string accept;
  std::chrono::milliseconds minimum_interval{0};  ///< between two messages
  std::size_t queue_length = 0;                   ///< 0: the newest value; otherwise the number of changes that the server queues
  std::chrono::milliseconds poll_period{1'000};   ///< of Via::polling
  /// After a connection is lost the client connects again after first_pause, then after twice that, and so on up to
  /// max_pause, each times a random factor of 0.5 to 1.5, and not before the time of Retry-After or of the stream's
  /// `retry`. A received value resets the pause. If a resource was connected before and is now 404, its server may be
  /// starting: the client tries again for max_pause.
  std::chrono::milliseconds first_pause{200};
  std::chrono::milliseconds max_pause{30'000};  ///< see first_pause
  /// Without a message, a pong or a comment for this time, the connection counts as lost. Via::callback: the client
  /// then reads the subscription.
  std::chrono::milliseconds idle_time{60'000};
  /// Asks the server for a word that often (at most each second; longer times count as that), also when nothing changes,
  /// so that Watch::age() says how old the newest word is. 0: it is not asked. A heartbeat also tells the client the time
  /// of the server, see Options::command_life. Not for Via::callback.
  std::chrono::milliseconds heartbeat{0};
  /// With `heartbeat`: after that time without a word of a server that sends heartbeats, the watch reports
  /// Change::Kind::silent, once until it hears something again.
  std::chrono::milliseconds silence{std::chrono::seconds(3)};
  /// `hybrit:websocketUrl` of the resource, if it is known. Empty: the client tries the URL of the resource, and if the
  /// server refuses, reads its graph.
  std::string websocket_url{};
  /// `hybrit:subscriptions` of the resource's Thing, for Via::callback, if it is known. It must have the resource's
  /// origin. With it, notifications are signed with a secret of the watch.
  std::string subscriptions_url{};
  std::shared_ptr<CallbackReceiver> receiver{};  ///< of Via::callback
};

/// An event that a watch reports.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               `body` is immutable.
struct LRT_API Change {
  /// What happened.
  enum class Kind : unsigned char {
    value,   ///< a representation, the same as GET would have received
    gap,     ///< changes are missing, or may be: see `left_out`. The connection was lost, with the `reason`, and the next
             ///< value is the present one; or, without a reason, the queue at the server was too short
    silent,  ///< with WatchOptions::heartbeat: no word of the server for WatchOptions::silence; what was received last may be
             ///< wrong by now. The watch goes on, and the next change of another kind ends the silence
    heard,   ///< a word has come again: the silence is over
    ended,   ///< the server has ended the subscription, or refuses it; `reason` says why. Nothing follows
  };
  Kind kind = Kind::value;                           ///< what happened
  std::string url{};                                 ///< of the resource
  std::string media_type{};                          ///< without parameters
  std::shared_ptr<const std::string> body{};         ///< of a value: the representation
  std::string entity_tag{};                          ///< if the protocol transfers it
  std::uint64_t dropped = 0;                         ///< values before this one that this program did not take in time
  std::optional<Error> reason{};                     ///< of ended; of a gap: why the connection was lost
  std::chrono::steady_clock::time_point received{};  ///< when this program received it
  std::size_t max_triples = 500'000;                 ///< of graph(): Limits::max_triples
  /// Of a value: when it became what it is, by the clock of the robot. nullopt: the server does not say it (SPEC 3.6).
  std::optional<std::chrono::system_clock::time_point> at{};
  /// Of a value: its number. The server counts the changes of each resource, also those that it sends to nobody. nullopt:
  /// the server does not say it.
  std::optional<std::uint64_t> sequence{};
  /// Values that the server left out just before this one; nullopt: not known. With WatchOptions::queue_length each
  /// value matters, so a gap precedes the value and has the number; that of the value is 0. Without a queue only the newest
  /// value was asked for: the value has the number, and there is no gap. After a lost connection the gap has the number
  /// in both cases, unless the server was started again.
  std::optional<std::uint64_t> left_out{};
  /// Of a value: which numbers its `sequence` can be compared with. A robot that was started again has another series. Empty: the server does not say it.
  std::string series{};

  /// The graph of the body. Each call parses the body.
  /// @par Errors  expected_rdf, limit_exceeded, unsupported_syntax: the body is not RDF
  Result<rdf::Graph> graph() const;
};
/// Called with each change; see Options::callbacks for the thread.
using OnChange = std::function<void(const Change&)>;

/// A running watch. Destroying the handle ends it. A handle that outlives its client has no effect.
///
/// After stop() or destruction the callback is not called again. They wait for a running callback, unless they are
/// called from it. So the caller must not hold a lock that the callback needs.
/// @par Threads  Any.
/// @par Implements  R0.12 to R0.17
class LRT_API Watch {
 public:
  /// Numbers since the watch began.
  struct Counts {
    std::uint64_t values = 0;   ///< received values
    std::uint64_t gaps = 0;     ///< connections after a loss, and values that a queue at the server did not hold
    std::uint64_t dropped = 0;  ///< values that this program did not take in time
    /// Values that the server left out, as far as it says so. With `values`, of which `dropped` are a part, these are all
    /// changes of the resource.
    std::uint64_t left_out = 0;
  };

  Watch() noexcept;
  Watch(Watch&&) noexcept;
  Watch& operator=(Watch&&) noexcept;
  ~Watch();

  void stop() noexcept;                ///< ends the watch
  bool is_connected() const noexcept;  ///< whether the server is connected, as far as this program knows
  /// The protocol that is in use; any: none yet.
  Via via() const noexcept;
  /// URL of the subscription, as the server has named it; empty: not known yet, or it has none.
  std::string subscription() const;
  /// The time since the last word of the server: a value, a heartbeat, or the response of a poll; nullopt: none yet. It is
  /// the age of what this watch shows. Without WatchOptions::heartbeat a server says nothing while nothing changes.
  std::optional<std::chrono::milliseconds> age() const noexcept;
  Counts counts() const noexcept;  ///< numbers since the watch began
  /// The reason why the last connection was lost, or the last attempt failed; nullopt: none, or it is connected again.
  std::optional<Error> last_error() const;

  /// @cond internal
  class Impl;
  explicit Watch(std::shared_ptr<Impl> impl) noexcept;
  /// @endcond

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::client
