#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::client {

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
  std::string accept;                            ///< media type of the messages (R0.17); empty: Options::accept
  std::chrono::milliseconds minimum_interval{0};  ///< between two messages
  std::size_t queue_length = 0;                  ///< 0: the newest value; else the server keeps so many changes
  std::chrono::milliseconds poll_period{1'000};  ///< of Via::polling
  // After a loss the client connects again after first_pause, then after twice that, and so on up to max_pause, each times a random factor of
  // 0.5 to 1.5. A connection that is open counts as a success.
  std::chrono::milliseconds first_pause{200};
  std::chrono::milliseconds max_pause{30'000};
  std::chrono::milliseconds idle_time{60'000};   ///< without a message, a ping or a comment for so long, the connection counts as lost
};

/// What a watch reports.
struct Change {
  enum class Kind : unsigned char {
    value,  ///< a representation, the same as GET would have received
    gap,    ///< connected again: changes since the last value may be missing. The next value is the present one
    ended,  ///< nothing follows: the server has ended the subscription, or refuses it; `reason` says why
  };
  Kind kind = Kind::value;
  std::string url{};         ///< of the resource
  std::string media_type{};  ///< without parameters
  std::shared_ptr<const std::string> body{};
  std::string entity_tag{};  ///< where the protocol transfers it
  std::uint64_t dropped = 0;  ///< values that this program has not taken in time, before this one
  std::optional<Error> reason{};
  std::chrono::steady_clock::time_point received{};

  /// The graph of the body.
  /// @par Errors  expected_rdf, limit_exceeded, unsupported_syntax: the body is not RDF
  Result<rdf::Graph> graph() const;
};
using OnChange = std::function<void(const Change&)>;

/// A running watch. Destroying the handle ends it.
/// @par Threads  Any. After stop() or destruction on the thread that runs callbacks, or outside of callbacks, the callback is not called again.
class Watch {
 public:
  struct Counts {
    std::uint64_t values = 0, gaps = 0, dropped = 0;
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

  class Impl;
  explicit Watch(std::shared_ptr<Impl> impl) noexcept;

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace lrt::client
