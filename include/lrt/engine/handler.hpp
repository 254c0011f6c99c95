#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <variant>

#include <lrt/base/clock.hpp>
#include <lrt/http/message.hpp>

namespace lrt::engine {

/// Names a request whose answer comes later. Never 0, never used twice by one handler.
enum class Ticket : std::uint64_t {};

/// The answer is known.
using Answered = http::Response;
/// The answer comes from Handler::next_reply() under this ticket.
struct Deferred {
  Ticket ticket;
};
/// What becomes of a request. (Accepted upgrades join with subscriptions.)
using Outcome = std::variant<Answered, Deferred>;

/// A deferred answer that has become ready.
struct Reply {
  Ticket ticket;
  http::Response response;
};

/// What a transport serves: requests in, answers out, no I/O.
///
/// @par Threads  handle, next_reply, next_deadline and abandon are called by the transport, from one thread at a time.
class Handler {
 public:
  virtual ~Handler() = default;

  /// Answers a complete request or promises to. Never throws.
  virtual Outcome handle(const http::Request& request, TimePoint now) = 0;
  /// The next deferred answer that is ready or overdue by `now`; call until nullopt after wake() and after next_deadline().
  virtual std::optional<Reply> next_reply(TimePoint now) = 0;
  /// When next_reply() should be called next even if nothing wakes the transport; nullopt: not before a wake.
  virtual std::optional<std::chrono::steady_clock::time_point> next_deadline() const = 0;
  /// The client of a deferred answer is gone; the ticket is forgotten.
  virtual void abandon(Ticket ticket) noexcept = 0;
};

}  // namespace lrt::engine
