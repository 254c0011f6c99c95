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

/// Bytes to write, in this order. An owner may leave `third` out; it is then the first part of the next output.
struct Output {
  std::string_view first;                                                  ///< the first part
  std::string_view second;                                                 ///< the second part
  std::string_view third{};                                                ///< the third part
  bool empty() const noexcept { return first.empty() && second.empty(); }  ///< whether there is nothing to write
};

class BodyBudget;

/// The common state of the sessions of one transport.
/// @par Threads  One thread at a time, together with its sessions.
class LRT_API SessionContext {
 public:
  /// @param limits  limits of each session
  explicit SessionContext(const Limits& limits);
  ~SessionContext();
  SessionContext(const SessionContext&) = delete;
  SessionContext& operator=(const SessionContext&) = delete;

  const Limits& limits() const noexcept;  ///< limits of each session
  /// Memory of the bodies that the sessions receive.
  BodyBudget& bodies() noexcept;
  engine::Handler* handler = nullptr;  ///< gets the requests; set before the first receive()
  bool websockets = false;             ///< the owner carries WebSockets
  bool streams = false;                ///< the owner carries event streams: it calls push() for channel()
  bool stopping = false;               ///< every response is the last of its connection

  /// IMF-fixdate (RFC 9110 5.6.7), made once a second.
  std::string_view date(std::chrono::system_clock::time_point utc);

 private:
  friend class Session;
  struct State;
  std::unique_ptr<State> state_;
};

/// The server's side of one HTTP/1.1 connection (RFC 9112) without I/O: bytes in, requests to the handler, bytes out.
/// Requests are handled one at a time: the next one when the response to the last has been sent.
///
/// The owner calls receive() with the bytes that it reads while wants_input(), writes output() and reports it by
/// sent(), calls reply() for ticket(), and expire() when the time of phase() has passed. It half-closes the connection
/// when the phase becomes `lingering` and closes it when it becomes `closed`. With SessionContext::streams it passes
/// the pushes of channel() to push() whenever wants_message(). When the connection ends it calls abandon(). TLS is the
/// owner's task. examples/ex_own_transport is a transport that uses sessions.
///
/// A session without a request and without output() has no buffers.
///
/// @par Threads     One thread at a time, together with all sessions of the context.
/// @par Implements  R0.1
class LRT_API Session {
 public:
  /// What the session waits for, and for how long.
  enum class Phase : unsigned char {
    idle,       ///< a request; limits.idle_timeout, for the first one limits.header_timeout
    header,     ///< the rest of a header section; limits.header_timeout
    body,       ///< the rest of a body; limits.body_timeout
    writing,    ///< the client, to read output(); limits.write_timeout
    lingering,  ///< the client, to close the connection, which is half-closed (RFC 9112 9.6); limits.linger_timeout
    streaming,  ///< a message for channel(); after limits.ping_interval expire() writes a comment
    waiting,    ///< the handler's reply to ticket(); without a limit
    upgraded,   ///< the owner, to call take_upgrade(); the session has ended. Only with SessionContext::websockets
    closed,     ///< nothing: the connection is to be closed
  };

  /// The opening handshake of a WebSocket.
  struct Upgrade {
    engine::Channel channel{};  ///< identifies the subscriber
    http::Response response;    ///< the handler's fields for the 101
    std::string key;            ///< Sec-WebSocket-Key
    std::string early;          ///< bytes that the client sent after the request
  };

  /// @param context  must outlive the session
  /// @param peer     numeric address of the client
  Session(SessionContext& context, std::string peer);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Processes bytes of the client.
  void receive(std::string_view bytes, TimePoint now);
  /// Reports that the client has half-closed the connection. It still gets the response to what it has sent.
  void end_of_input(TimePoint now);
  /// Processes the deferred response to ticket(): a response, a WebSocket if the request is an opening handshake, or an
  /// event stream.
  void reply(engine::Reply reply, TimePoint now);
  /// The handshake. Call it once, in the phase `upgraded`. Afterwards the caller must call the handler's closed().
  Upgrade take_upgrade();
  /// Processes the next message of the event stream, or its end. Only if wants_message().
  void push(engine::Push push, TimePoint now);
  /// Ends the event stream after the message that is being written. Calls the handler's closed().
  void end_stream(TimePoint now);
  /// Reports that the connection has ended: the handler forgets the open ticket or channel.
  void abandon() noexcept;
  /// Responds with this status whatever the client sent, and closes.
  void refuse(int status, std::string reason, TimePoint now);
  /// Responds with this response whatever the client sent, and closes.
  void refuse(http::Response response, TimePoint now);
  /// Lingers without a response, because there is no request to respond to.
  void hang_up() noexcept;
  /// Marks requests as received over TLS.
  /// @param client_certificate  subject of the client's verified certificate; empty: it has none
  void set_secure(std::string client_certificate);
  /// Serves only one more request, for which Handler::is_stop() returns true; others get 503.
  void serve_only_stops() noexcept;
  /// Reports that the time of the phase has passed.
  void expire(TimePoint now);

  /// The bytes to write now; valid until the next call of another function.
  Output output() const noexcept;
  /// Reports that bytes of output() were written.
  void sent(std::size_t bytes, TimePoint now);

  bool wants_input() const noexcept;  ///< whether the owner should read from the client
  /// Whether the rest of a large body is missing, or input that is only discarded: the owner should serve other
  /// connections first.
  bool expects_much() const noexcept;
  Phase phase() const noexcept;  ///< what the session waits for
  /// The phase whose limit applies: the header section of the first request must be complete within
  /// limits.header_timeout from the beginning.
  Phase timed_phase() const noexcept;
  /// How long timed_phase() may last; nullopt: no limit.
  std::optional<std::chrono::milliseconds> time() const noexcept;
  /// A number that changes whenever the time of timed_phase() begins again.
  std::uint32_t epoch() const noexcept;
  /// Of the deferred response; nullopt: none.
  std::optional<engine::Ticket> ticket() const noexcept;
  /// Of the open event stream; nullopt: none.
  std::optional<engine::Channel> channel() const noexcept;
  bool wants_message() const noexcept;  ///< whether push() may be called
  bool input_ended() const noexcept;    ///< whether the client has half-closed the connection

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace v0
}  // namespace lrt::transport
