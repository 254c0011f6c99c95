#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/engine/handler.hpp>
#include <lrt/http/head.hpp>
#include <lrt/http/message.hpp>
#include <lrt/transport/detail/chunks.hpp>
#include <lrt/transport/transport.hpp>


namespace lrt::transport {

/// Bytes to write, in this order.
struct Output {
  std::string_view first;
  std::string_view second;
  bool empty() const noexcept { return first.empty() && second.empty(); }
};

/// How heads are taken apart and written. As it stands: by http::split_head() and http::write_head().
class Heads {
 public:
  virtual ~Heads() = default;

  /// Takes apart a head that http::check_raw_head() has passed. The views of `request` point into `head` or into `kept`, which belongs to
  /// the request from then on: names and values are as the client sent them, without white space around the values, and fields of one name
  /// keep their order.
  virtual std::optional<http::Refusal> read_head(std::string_view head, std::string& kept, http::Request& request) {
    (void)kept;
    http::split_head(head, request);
    return std::nullopt;
  }
  /// Appends the head of a response: what http::write_head() does, with its arguments, the fields in any order.
  virtual void write_head(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) {
    http::write_head(out, response, date, keep_alive, version);
  }
};

/// What the sessions of one transport have in common.
class SessionContext {
 public:
  explicit SessionContext(const Limits& limits) : heads(plain_heads_), limits_(limits) {}
  SessionContext(const Limits& limits, Heads& given) : heads(given), limits_(limits) {}
  SessionContext(const SessionContext&) = delete;
  SessionContext& operator=(const SessionContext&) = delete;

  const Limits& limits() const noexcept { return limits_; }
  Heads& heads;
  engine::Handler* handler = nullptr;
  bool websockets = false;  ///< the owner goes on with what is upgraded
  bool stopping = false;    ///< every answer is the last of its connection

  /// IMF-fixdate, made once a second.
  std::string_view date(std::chrono::system_clock::time_point utc);

 private:
  Heads plain_heads_;
  const Limits limits_;
  std::chrono::seconds date_second_{-1};
  std::string date_;
};

/// The server's side of one HTTP/1.1 connection without I/O: bytes in, requests to the handler, bytes out. Requests are handled one
/// at a time: the next one when the answer to the last has left.
///
/// The owner calls receive() with what it read while wants_input(), writes output() and reports it by sent(), calls reply() for
/// ticket(), and expire() when the time of phase() is over. It half-closes the connection when the phase becomes `lingering` and
/// closes it when it becomes `closed`. TLS belongs between the owner and the session. This is what a transport is made of:
/// examples/ex_own_transport has one.
///
/// @par Threads     One at a time, also for all sessions of a context.
/// @par Implements  R0.1
class Session {
 public:
  /// What the client or the handler has to do next.
  enum class Phase : unsigned char {
    idle,       ///< the client may send a request; limits.idle_time, for the first one limits.head_time
    head,       ///< the client must complete a head; limits.head_time
    body,       ///< the client must complete a body; limits.body_time
    writing,    ///< the client must take output(); limits.write_time
    lingering,  ///< the client should notice that the connection is over (RFC 9112 9.6); limits.linger_time
    waiting,    ///< the handler must answer ticket(); no limit here
    upgraded,   ///< the owner must go on with take_upgrade(); the session is over. Only with SessionContext::websockets
    closed,
  };

  /// What a WebSocket begins with.
  struct Upgrade {
    engine::Channel channel{};
    http::Response response;  ///< the handler's fields for the 101
    std::string key;          ///< Sec-WebSocket-Key
    std::string early;        ///< what the client sent after the request
  };

  Session(SessionContext& context, std::string peer);

  void receive(std::string_view bytes, TimePoint now);
  /// The client will send no more; it may still want its answer.
  void end_of_input(TimePoint now);
  /// The deferred answer of ticket().
  void reply(http::Response response, TimePoint now);
  /// The deferred answer of ticket(): phase() becomes `upgraded`, if the request allows.
  void upgrade(engine::Channel channel, http::Response response, TimePoint now);
  /// Once, in the phase `upgraded`. Whoever takes it owes the handler closed().
  Upgrade take_upgrade();
  /// Refuses whatever the client wants, with this status, and closes.
  void refuse(int status, std::string reason, TimePoint now);
  /// The same, in these words.
  void refuse(http::Response response, TimePoint now);
  /// Lingers without an answer: there was no request and cannot be one.
  void hang_up() noexcept { enter(input_ended_ ? Phase::closed : Phase::lingering); }
  /// Requests come over TLS, from a client with a certificate of this subject (empty: without one).
  void set_secure(std::string client_certificate);
  /// The time of the present phase is over.
  void expire(TimePoint now);

  /// What to write now; lives until the next call of anything else.
  Output output() const noexcept;
  void sent(std::size_t bytes, TimePoint now);

  bool wants_input() const noexcept;
  Phase phase() const noexcept { return phase_; }
  /// The phase whose limit applies: the head of the first request must be complete within limits.head_time from the beginning.
  Phase timed_phase() const noexcept { return phase_ == Phase::idle && requests_ == 0 ? Phase::head : phase_; }
  /// How long timed_phase() may last; nullopt: there is no limit here.
  std::optional<std::chrono::milliseconds> time() const noexcept;
  /// Changes whenever the time of timed_phase() begins anew.
  std::uint32_t epoch() const noexcept { return epoch_; }
  /// Of the deferred answer that is open.
  std::optional<engine::Ticket> ticket() const noexcept { return ticket_; }
  bool input_ended() const noexcept { return input_ended_; }

 private:
  void run(TimePoint now);
  bool take_head(TimePoint now);
  bool take_body(TimePoint now);
  void begin_body(std::string_view head, TimePoint now);
  std::optional<std::size_t> find_head_end(TimePoint now);
  bool is_line_too_long(std::string_view line, TimePoint now);
  void keep_head(std::string_view head);
  void strip_framing_fields();
  void dispatch(TimePoint now);
  void answer(http::Response response, TimePoint now);
  void finish_answer(TimePoint now);
  void keep_handshake();
  void accept_upgrade(engine::Channel channel, http::Response response, TimePoint now);
  void check_end(TimePoint now);
  void enter(Phase phase) noexcept;

  SessionContext& context_;
  const std::string peer_;
  std::string client_certificate_;
  Phase phase_ = Phase::idle;
  std::uint32_t epoch_ = 0;
  bool input_ended_ = false;

  // Input: what receive() got and nobody has consumed. `rest_` is a view of it while run() works, `in_` holds it in between.
  std::string_view rest_;
  std::string in_;
  std::size_t in_used_ = 0;
  std::size_t discarded_ = 0;

  // The request that is being read.
  http::Request request_;
  http::Framing framing_;
  std::size_t scanned_ = 0;     ///< bytes of the head that find_head_end() has seen
  std::size_t line_begin_ = 0;  ///< of the head's last, incomplete line
  int empty_lines_ = 0;
  std::string head_;  ///< the head's bytes when the body did not come with them
  std::string kept_;  ///< of Protocols::read_head()
  std::string body_;
  ChunkDecoder chunks_;

  // The answer.
  bool keep_alive_ = true;
  bool head_only_ = false;
  int version_ = 11;
  std::size_t requests_ = 0;
  std::optional<engine::Ticket> ticket_;
  std::unique_ptr<Upgrade> upgrade_;  ///< while the open request is an opening handshake
  std::string out_;
  std::shared_ptr<const std::string> out_body_;
  std::size_t out_sent_ = 0;
};

}  // namespace lrt::transport
