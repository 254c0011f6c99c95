// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/http/message.hpp>
#include <lrt/transport/detail/body_buffer.hpp>
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

/// A request that is being received and the response to it, with their buffers.
struct Exchange;

/// What the sessions of one transport share.
class LRT_API SessionContext {
 public:
  explicit SessionContext(const Limits& limits);
  ~SessionContext();
  SessionContext(const SessionContext&) = delete;
  SessionContext& operator=(const SessionContext&) = delete;

  const Limits& limits() const noexcept { return limits_; }
  /// Of the bodies that the sessions receive.
  BodyBudget& bodies() noexcept { return bodies_; }
  engine::Handler* handler = nullptr;
  bool websockets = false;  ///< the owner carries WebSockets
  bool streams = false;     ///< the owner carries event streams: it calls push() for channel()
  bool stopping = false;    ///< every response is the last of its connection

  /// IMF-fixdate (RFC 9110 5.6.7), made once a second.
  std::string_view date(std::chrono::system_clock::time_point utc);

 private:
  friend class Session;
  std::unique_ptr<Exchange> take_exchange();
  void give_back(std::unique_ptr<Exchange> exchange) noexcept;

  const Limits limits_;
  BodyBudget bodies_;
  std::vector<std::unique_ptr<Exchange>> spare_;  ///< of sessions that are idle now
  std::chrono::seconds date_second_{-1};
  std::string date_;
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
  void hang_up() noexcept { enter(input_ended_ ? Phase::closed : Phase::lingering); }
  /// Requests come over TLS.
  /// @param client_certificate  subject of the client's verified certificate; empty: it has none
  void set_secure(std::string client_certificate);
  /// From now on only a request that Handler::is_stop() is served, and it is the last one; others get 503.
  void serve_only_stops() noexcept { only_stops_ = true; }
  /// The time of the phase is over.
  void expire(TimePoint now);

  /// The bytes to write now; valid until the next call of another function.
  Output output() const noexcept;
  void sent(std::size_t bytes, TimePoint now);

  bool wants_input() const noexcept;
  /// Wanted is the rest of a large body, or what is only discarded: the owner serves others first.
  bool expects_much() const noexcept;
  Phase phase() const noexcept { return phase_; }
  /// The phase whose limit applies: the header section of the first request must be complete within limits.header_timeout from the beginning.
  Phase timed_phase() const noexcept { return phase_ == Phase::idle && requests_ == 0 ? Phase::header : phase_; }
  /// How long timed_phase() may last; nullopt: no limit.
  std::optional<std::chrono::milliseconds> time() const noexcept;
  /// Changes whenever the time of timed_phase() begins again.
  std::uint32_t epoch() const noexcept { return epoch_; }
  /// Of the deferred response.
  std::optional<engine::Ticket> ticket() const noexcept { return ticket_; }
  /// Of the open event stream.
  std::optional<engine::Channel> channel() const noexcept { return channel_; }
  bool wants_message() const noexcept { return phase_ == Phase::streaming; }
  bool input_ended() const noexcept { return input_ended_; }

 private:
  void run(TimePoint now);
  void drop_consumed() noexcept;
  bool take_header(TimePoint now);
  bool take_body(TimePoint now);
  void begin_body(std::string_view header, TimePoint now);
  bool judge_header(TimePoint now);
  void refuse_size(const std::string& found, TimePoint now);
  void refuse_for_memory(TimePoint now);
  bool take_sized_body(TimePoint now);
  bool take_chunked_body(TimePoint now);
  std::optional<std::size_t> parse_at_once();
  std::optional<std::size_t> find_header_end(TimePoint now);
  bool is_line_too_long(std::string_view line, TimePoint now);
  void keep_header(std::string_view header);
  void remove_framing_fields();
  void dispatch(TimePoint now);
  void respond(http::Response response, TimePoint now);
  void finish_response(TimePoint now);
  void keep_handshake();
  void accept_upgrade(engine::Channel channel, http::Response response, TimePoint now);
  void accept_stream(engine::Channel channel, http::Response response, TimePoint now);
  void write_chunk(std::string_view text);
  void write_chunk(std::shared_ptr<const std::string> message);
  bool must_end_stream() const noexcept { return input_ended_ || context_.stopping; }
  void finish_stream(TimePoint now);
  void check_end(TimePoint now);
  void enter(Phase phase) noexcept;
  void need_exchange();
  void rest() noexcept;

  SessionContext& context_;
  const std::string peer_;
  std::string client_certificate_;
  std::unique_ptr<Exchange> exchange_;  ///< nullptr: there is nothing to read or write
  std::uint32_t epoch_ = 0;
  Phase phase_ = Phase::idle;
  bool secure_ = false;
  bool input_ended_ = false;
  bool only_stops_ = false;
  bool keep_alive_ = true;
  bool header_only_ = false;
  std::uint8_t version_ = 11;     ///< of the request
  std::uint8_t empty_lines_ = 0;  ///< before the request
  std::size_t discarded_ = 0;     ///< while lingering
  std::size_t requests_ = 0;
  std::optional<engine::Ticket> ticket_;
  std::optional<engine::Channel> channel_;  ///< of the open event stream
};

}  // namespace v0
}  // namespace lrt::transport
