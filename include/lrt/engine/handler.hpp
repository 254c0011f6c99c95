// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/http/message.hpp>
#include <lrt/subscription/channel.hpp>

namespace lrt::engine {
inline namespace v0 {

/// Identifies a request whose response is deferred. Never 0; a handler never uses a value twice.
enum class Ticket : std::uint64_t {};
using subscription::Channel;

/// The response is deferred: Handler::next_reply() returns it with this ticket.
struct Deferred {
  Ticket ticket;  ///< identifies the request
};
/// The request becomes a WebSocket (RFC 6455); http::check_websocket() has accepted its handshake. The transport sends
/// 101 with the fields of `response` and those of RFC 6455 4.2.2, and then carries the messages of the channel. Only if
/// Request::can_upgrade is set.
struct Upgraded {
  Channel channel;          ///< identifies the subscriber
  http::Response response;  ///< fields of the 101
};
/// The response is an event stream (WHATWG HTML 9.2): the transport sends the header section of `response`, which has
/// status 200 and no body, without Content-Length, and then each message of the channel unchanged, until Push::close or
/// the end of the connection. After limits.ping_interval without a message it sends the comment ":\n\n", so that
/// proxies and clients do not time out. Only if Request::can_stream is set.
struct Streamed {
  Channel channel;          ///< identifies the subscriber
  http::Response response;  ///< the header section
};
/// The result of handling a request: a response, or how the response will come.
using Outcome = std::variant<http::Response, Deferred, Upgraded, Streamed>;

/// A deferred response that is ready. With `channel` it is Upgraded if the status is 101, else Streamed.
struct Reply {
  Ticket ticket;                     ///< of the request
  http::Response response;           ///< the response
  std::optional<Channel> channel{};  ///< nullopt: an ordinary response
};

/// The verdict on a request by its header section, before its body is received.
struct HeaderVerdict {
  std::optional<http::Response> response{};                              ///< final response, the body is not received; nullopt: receive the body
  std::size_t max_body_bytes = std::numeric_limits<std::size_t>::max();  ///< size of the body; more: 413
  bool ignores_body = false;             ///< the transport may discard the body, and handle() gets the request without it
  std::shared_ptr<const void> judged{};  ///< without `response`: for http::Request::judged
};

/// The next item for a subscriber: a message, or the end (`close`). An event stream ends without a code.
struct Push {
  std::shared_ptr<const std::string> message;  ///< shared by all channels with the same bytes; one frame, or one whole event of an event stream
  bool text = true;                            ///< RFC 6455 5.6: UTF-8; else binary
  std::uint16_t close = 0;                     ///< not 0: close with this code (RFC 6455 7.4.1); no further push follows
  std::string reason{};                        ///< reason of the close; UTF-8, at most 123 bytes
};

/// A channel that has a push.
struct ReadyChannel {
  Channel channel;      ///< identifies the subscriber
  bool urgent = false;  ///< a command or a close: to be sent before the others
};

/// How much a transport can send on a channel now.
struct PushRequest {
  Channel channel;            ///< identifies the subscriber
  std::size_t max = 1;        ///< number of pushes that the transport takes
  std::size_t max_bytes = 0;  ///< no further push is taken when the messages have reached this size
  std::size_t given = 0;      ///< set by take_pushes(): number of pushes
  bool more = false;          ///< set by take_pushes(): more may be available. If false, next_ready() will name the channel again
};

/// The application that a transport serves: requests in, responses out, messages to subscribers. It does no I/O.
/// lrt::Server has one.
///
/// Messages are pulled: the handler names a channel once (next_ready), and the transport takes its messages when it can
/// write (next_push) until there are none. Then the handler will name the channel again. A client that does not read
/// costs only the memory of what the transport has taken for it: one message, or a few short ones.
///
/// @par Threads  The transport calls all functions, from one thread at a time.
class LRT_API Handler {
 public:
  virtual ~Handler() = default;

  /// Judges a request whose header section is complete and whose body is not; `request.body` is empty. If the verdict
  /// has a response, the transport sends it before any `100 Continue`, stores no byte of the body and does not call
  /// handle(). Otherwise it receives at most `max_body_bytes`, sets `request.judged` and calls handle(), which checks
  /// again what may have changed. A transport need not call it for a request whose body has arrived already: handle()
  /// checks everything. Never throws.
  /// @param request     the header section
  /// @param body_bytes  Content-Length, more than 0; nullopt: the body is chunked
  /// @param now         the present time
  virtual HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) {
    (void)request, (void)body_bytes, (void)now;
    return {};
  }
  /// Whether a request, by its header section, invokes an action that stops the robot (Action::stop()). A transport
  /// serves it even beyond its limits. Calls no user code.
  virtual bool is_stop(const http::Request& request) noexcept {
    (void)request;
    return false;
  }
  /// Responds to a complete request or defers the response. Never throws, and does not call the transport. The views of
  /// `request` are valid during the call.
  virtual Outcome handle(const http::Request& request, TimePoint now) = 0;
  /// Header fields that each response at `now` has besides its own, also a response that the transport makes itself;
  /// nullptr: none. Valid until the next call.
  virtual const http::Fields* common_fields(TimePoint now) {
    (void)now;
    return nullptr;
  }
  /// The next deferred response that is ready or overdue at `now`. Call it until it returns nullopt, after wake() and
  /// after next_deadline().
  virtual std::optional<Reply> next_reply(TimePoint now) = 0;
  /// When next_reply() and next_ready() must be called next even if nothing wakes the transport; nullopt: not before a
  /// wake. A time of the clock of `now`; it may be in the past, which means at once. It becomes earlier only in calls
  /// of this class, or with a wake.
  virtual std::optional<std::chrono::steady_clock::time_point> next_deadline() const = 0;
  /// Reports that the client of a deferred response has disconnected, or that the transport stops; the ticket is
  /// forgotten. A client that has only half-closed its connection still gets its response.
  virtual void abandon(Ticket ticket) noexcept = 0;
  /// Reports that the client of a deferred response has half-closed its connection, and perhaps has disconnected.
  /// Expensive work, such as a query, is cancelled; other responses are sent as usual. The ticket stays valid.
  virtual void input_ended(Ticket ticket) noexcept { (void)ticket; }

  /// The next channel that has a push at `now`. Call it until it returns nullopt whenever next_reply() is called, and
  /// at every poll while a channel is open: a write of one client changes what others observe, without a wake. Urgent
  /// channels come first. A transport without WebSockets must call it as well: the handler then scans for changes that
  /// web callbacks observe; until it is called, next_deadline() stays in the past.
  virtual std::optional<Channel> next_ready(TimePoint now) {
    (void)now;
    return std::nullopt;
  }
  /// The next push of a channel; nullopt: none now, next_ready() will name the channel again. For an unknown channel: a
  /// close with 1001.
  virtual std::optional<Push> next_push(Channel channel, TimePoint now) {
    (void)channel, (void)now;
    return std::nullopt;
  }
  /// Appends all channels that next_ready() would return. For transports with many clients.
  virtual void take_ready(std::vector<ReadyChannel>& channels, TimePoint now) {
    while (const auto channel = next_ready(now)) channels.push_back({*channel});
  }
  /// As next_push(), for many channels at once: appends the pushes of the first request, then those of the second, and
  /// so on. The last push of a channel may be a close.
  virtual void take_pushes(std::vector<PushRequest>& requests, std::vector<Push>& pushes, TimePoint now) {
    for (PushRequest& request : requests) {
      std::size_t bytes = 0;
      request.given = 0;
      request.more = true;
      while (request.more && request.given < request.max && (request.given == 0 || bytes < request.max_bytes)) {
        if (pushes.size() == pushes.capacity()) pushes.reserve(2 * pushes.size() + 8);  // without room a message that was taken would be lost
        auto push = next_push(request.channel, now);
        request.more = push && push->close == 0;
        if (!push) break;
        bytes += push->message ? push->message->size() : 0;
        ++request.given;
        pushes.push_back(*std::move(push));
      }
    }
  }
  /// Reports a complete message of the client. next_push() may have something afterwards. The engine ignores such
  /// messages, for subscriptions have one direction; a handler of another protocol over the same transports uses them.
  virtual void received(Channel channel, std::string_view message, bool text, TimePoint now) { (void)channel, (void)message, (void)text, (void)now; }
  /// Reports that the connection of a channel has ended; called once for each Upgraded or Streamed. The channel is
  /// forgotten.
  virtual void closed(Channel channel) noexcept { (void)channel; }
};

}  // namespace v0
}  // namespace lrt::engine
