// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/http/message.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt::transport {
inline namespace v0 {

/// Bytes to write, in this order. An owner may leave `third` out: then it is the first part of the next output.
struct Output {
  std::string_view first;
  std::string_view second;
  std::string_view third{};
  bool empty() const noexcept { return first.empty() && second.empty(); }
};

class BodyBudget;

/// What the sessions of one transport share.
class LRT_API SessionContext {
 public:
  explicit SessionContext(const Limits& limits);
  ~SessionContext();
  SessionContext(const SessionContext&) = delete;
  SessionContext& operator=(const SessionContext&) = delete;

  const Limits& limits() const noexcept;
  /// Of the bodies that the sessions receive.
  BodyBudget& bodies() noexcept;
  engine::Handler* handler = nullptr;
  bool websockets = false;  ///< the owner carries WebSockets
  bool streams = false;     ///< the owner carries event streams: it calls push() for channel()
  bool stopping = false;    ///< every response is the last of its connection

  /// IMF-fixdate (RFC 9110 5.6.7), made once a second.
  std::string_view date(std::chrono::system_clock::time_point utc);

 private:
  friend class Session;
  struct State;
  std::unique_ptr<State> state_;
};

/// The server's side of one HTTP/1.1 connection (RFC 9112) without I/O: bytes in, requests to the handler, bytes out. Requests are handled
/// one at a time: the next one when the response to the last has been sent.
///
/// The owner calls receive() with the bytes that it reads while wants_input(), writes output() and reports it by sent(), calls reply() for
/// ticket(), and expire() when the time of phase() is over. It half-closes the connection when the phase becomes `lingering` and
/// closes it when it becomes `closed`. With SessionContext::streams it gives push() what the handler has for channel(), whenever
/// wants_message(). When the connection ends it calls abandon(). TLS belongs between the owner and the session. examples/ex_own_transport is a transport that is made
/// of sessions.
///
/// A session without a request and without output() has no buffers.
///
/// @par Threads     One at a time, also for all sessions of a context.
/// @par Implements  R0.1
class LRT_API Session {
 public:
  /// What the session waits for.
  enum class Phase : unsigned char {
    idle,       ///< a request; limits.idle_timeout, for the first one limits.header_timeout
    header,     ///< the rest of a header section; limits.header_timeout
    body,       ///< the rest of a body; limits.body_timeout
    writing,    ///< the client, to read output(); limits.write_timeout
    lingering,  ///< the client, to close the connection, which is half-closed (RFC 9112 9.6); limits.linger_timeout
    streaming,  ///< a message for channel(); after limits.ping_interval expire() writes a comment
    waiting,    ///< the handler's reply to ticket(); no limit here
    upgraded,   ///< the owner, to call take_upgrade(); the session is over. Only with SessionContext::websockets
    closed,
  };

  /// The opening handshake of a WebSocket.
  struct Upgrade {
    engine::Channel channel{};
    http::Response response;  ///< the handler's fields for the 101
    std::string key;          ///< Sec-WebSocket-Key
    std::string early;        ///< bytes that the client sent after the request
  };

  Session(SessionContext& context, std::string peer);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void receive(std::string_view bytes, TimePoint now);
  /// The client has ended its sending. It still gets the response to what it has sent.
  void end_of_input(TimePoint now);
  /// The deferred response to ticket(): a response, a WebSocket if the request is an opening handshake, or an event stream.
  void reply(engine::Reply reply, TimePoint now);
  /// Once, in the phase `upgraded`. From then on the caller must call the handler's closed().
  Upgrade take_upgrade();
  /// The next message of the event stream, or its end. Only if wants_message().
  void push(engine::Push push, TimePoint now);
  /// Ends the event stream, after the message that is being written. The handler's closed() is called.
  void end_stream(TimePoint now);
  /// The connection has ended: the handler forgets the open ticket or channel.
  void abandon() noexcept;
  /// Responds with this status to whatever the client sent, and closes.
  void refuse(int status, std::string reason, TimePoint now);
  /// The same with this response.
  void refuse(http::Response response, TimePoint now);
  /// Lingers without a response: there was no request and cannot be one.
  void hang_up() noexcept;
  /// Requests come over TLS.
  /// @param client_certificate  subject of the client's verified certificate; empty: it has none
  void set_secure(std::string client_certificate);
  /// From now on only a request that Handler::is_stop() is served, and it is the last one; others get 503.
  void serve_only_stops() noexcept;
  /// The time of the phase is over.
  void expire(TimePoint now);

  /// The bytes to write now; valid until the next call of another function.
  Output output() const noexcept;
  void sent(std::size_t bytes, TimePoint now);

  bool wants_input() const noexcept;
  /// Wanted is the rest of a large body, or what is only discarded: the owner serves others first.
  bool expects_much() const noexcept;
  Phase phase() const noexcept;
  /// The phase whose limit applies: the header section of the first request must be complete within limits.header_timeout from the beginning.
  Phase timed_phase() const noexcept;
  /// How long timed_phase() may last; nullopt: no limit.
  std::optional<std::chrono::milliseconds> time() const noexcept;
  /// Changes whenever the time of timed_phase() begins again.
  std::uint32_t epoch() const noexcept;
  /// Of the deferred response.
  std::optional<engine::Ticket> ticket() const noexcept;
  /// Of the open event stream.
  std::optional<engine::Channel> channel() const noexcept;
  bool wants_message() const noexcept;
  bool input_ended() const noexcept;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace v0
}  // namespace lrt::transport
