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

/// Names a request whose response is deferred. Never 0, never used twice by one handler.
enum class Ticket : std::uint64_t {};
using subscription::Channel;

/// The response comes from Handler::next_reply() under this ticket.
struct Deferred {
  Ticket ticket;
};
/// The request becomes a WebSocket (RFC 6455); its handshake passed http::check_websocket(). The transport sends 101 with the fields of
/// `response` and those of RFC 6455 4.2.2, and from then on carries the messages of the channel. Never without `can_upgrade`.
struct Upgraded {
  Channel channel;
  http::Response response;
};
/// The response is an event stream (WHATWG HTML 9.2): the transport sends the header section of `response`, which has status 200 and no body,
/// without Content-Length, and then each message of the channel as it is, until Push::close or the end of the connection. After
/// limits.ping_interval without a message it sends the comment ":\n\n", so that proxies and peers see the connection alive. Never without
/// `can_stream`.
struct Streamed {
  Channel channel;
  http::Response response;
};
/// The result of handling a request: a response, or how the response will come.
using Outcome = std::variant<http::Response, Deferred, Upgraded, Streamed>;

/// A deferred response that is ready. With `channel` it is Upgraded where the status is 101, else Streamed.
struct Reply {
  Ticket ticket;
  http::Response response;
  std::optional<Channel> channel{};
};

/// The verdict on a request by its header section, before its body is received.
struct HeaderVerdict {
  std::optional<http::Response> response{};                              ///< final: the body is not received; nullopt: it may be
  std::size_t max_body_bytes = std::numeric_limits<std::size_t>::max();  ///< of the body; more: 413
  bool ignores_body = false;             ///< the transport may discard the body, and handle() gets the request without it
  std::shared_ptr<const void> judged{};  ///< without `response`: for http::Request::judged
};

/// What goes to a subscriber next: one message, or with `close` the end. An event stream just ends there.
struct Push {
  std::shared_ptr<const std::string> message;  ///< shared by all channels with the same bytes; one frame, or one whole event of an event stream
  bool text = true;                            ///< RFC 6455 5.6: UTF-8; else binary
  std::uint16_t close = 0;                     ///< RFC 6455 7.4.1: not 0: close with this code; no further push follows
  std::string reason{};                        ///< of the close; UTF-8, at most 123 bytes
};

/// A channel that has a push.
struct ReadyChannel {
  Channel channel;
  bool urgent = false;  ///< a command or a close: before the others
};

/// What a transport can send on a channel now, and how much of that there is.
struct PushRequest {
  Channel channel;
  std::size_t max = 1;        ///< pushes that the transport takes
  std::size_t max_bytes = 0;  ///< after a push by which their messages reach this, it takes no more
  std::size_t given = 0;      ///< set by take_pushes()
  bool more = false;          ///< the same: there may be more. If not, next_ready() will name the channel again
};

/// What a transport serves: requests in, responses out, messages to subscribers; no I/O.
///
/// Messages are pulled: the handler says once that a channel has something (next_ready), the transport takes it when it can write
/// (next_push), until there is nothing more; then the handler will name the channel anew. A client that does not read costs what the
/// transport has taken for it, which is one message or a few short ones, and nothing else.
///
/// @par Threads  all functions are called by the transport, from one thread at a time.
class LRT_API Handler {
 public:
  virtual ~Handler() = default;

  /// Judges a request whose header section is complete and whose body is not; `request.body` is empty. If the verdict has a response, the
  /// transport sends it before any `100 Continue`, stores no byte of the body and does not call handle(). Otherwise it receives at most
  /// `max_body_bytes`, sets `request.judged` and calls handle(), which judges again what may have changed meanwhile. Not needed for a
  /// request whose body is there already: handle() judges everything. Never throws.
  /// @param body_bytes  Content-Length, more than 0; nullopt: the body is chunked
  virtual HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) {
    (void)request, (void)body_bytes, (void)now;
    return {};
  }
  /// Whether a request, by its header section, invokes an action that stops the robot (Action::stop()). A transport serves it beyond its own
  /// limits. Calls no user code.
  virtual bool is_stop(const http::Request& request) noexcept {
    (void)request;
    return false;
  }
  /// Responds to a complete request or defers the response. Never throws, and does not call the transport. The views of `request` live for the call.
  virtual Outcome handle(const http::Request& request, TimePoint now) = 0;
  /// The next deferred response that is ready or overdue by `now`; call until nullopt after wake() and after next_deadline().
  virtual std::optional<Reply> next_reply(TimePoint now) = 0;
  /// When next_reply() and next_ready() should be called next even if nothing wakes the transport; nullopt: not before a wake. By the
  /// clock that `now` is of; may be past, which means at once. It becomes earlier only in calls of this class, or with a wake.
  virtual std::optional<std::chrono::steady_clock::time_point> next_deadline() const = 0;
  /// The client of a deferred response is gone, or the transport stops; the ticket is forgotten. A client that has only ended its sending
  /// still gets its response.
  virtual void abandon(Ticket ticket) noexcept = 0;
  /// The client of a deferred response sends nothing more: perhaps it is gone, which the end of its sending does not tell. What costs much, such as
  /// a query, is given up; other responses are sent as usual. The ticket remains.
  virtual void input_ended(Ticket ticket) noexcept { (void)ticket; }

  /// The next channel that has a push by `now`; call until nullopt when next_reply() is called, and at every poll while a channel is open:
  /// what one client writes changes what others observe, without a wake. Urgent ones come first. A transport without WebSockets
  /// calls it as well: here the handler scans for changes that web callbacks observe, and until then next_deadline() stays past.
  virtual std::optional<Channel> next_ready(TimePoint now) {
    (void)now;
    return std::nullopt;
  }
  /// What to send on a channel now; nullopt: nothing, next_ready() will name it again. An unknown channel: a close with 1001.
  virtual std::optional<Push> next_push(Channel channel, TimePoint now) {
    (void)channel, (void)now;
    return std::nullopt;
  }
  /// next_ready() until nullopt: appends them all. For transports with many clients.
  virtual void take_ready(std::vector<ReadyChannel>& channels, TimePoint now) {
    while (const auto channel = next_ready(now)) channels.push_back({*channel});
  }
  /// next_push() for many channels at once: appends the pushes of the first request, then those of the second, and so on. The last push of a
  /// channel may be a close.
  virtual void take_pushes(std::vector<PushRequest>& requests, std::vector<Push>& pushes, TimePoint now) {
    for (PushRequest& request : requests) {
      std::size_t bytes = 0;
      request.given = 0;
      request.more = true;
      while (request.more && request.given < request.max && (request.given == 0 || bytes < request.max_bytes)) {
        auto push = next_push(request.channel, now);
        request.more = push && push->close == 0;
        if (!push) break;
        bytes += push->message ? push->message->size() : 0;
        ++request.given;
        pushes.push_back(*std::move(push));
      }
    }
  }
  /// A complete message of the client. next_push() may have something afterwards.
  virtual void received(Channel channel, std::string_view message, bool text, TimePoint now) { (void)channel, (void)message, (void)text, (void)now; }
  /// The connection of a channel has ended, whoever ended it; called once for each Upgraded or Streamed, the channel is forgotten.
  virtual void closed(Channel channel) noexcept { (void)channel; }
};

}  // namespace v0
}  // namespace lrt::engine
