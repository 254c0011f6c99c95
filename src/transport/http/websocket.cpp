// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/websocket.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include <lrt/base/immortal.hpp>

#include "src/http/websocket.hpp"

namespace lrt::transport {
namespace {

/// Taken from the client at once.
constexpr std::size_t piece_bytes = 8 * 1024;
/// The message of a push that has none.
const std::shared_ptr<const std::string>& empty_message() {
  static const Immortal<std::shared_ptr<const std::string>> empty(std::make_shared<const std::string>());
  return *empty;
}

}  // namespace

WebSocket::WebSocket(Loop& loop, Session::Upgrade upgrade, TimePoint now)
    : Client(loop), frames_(loop.options.limits.max_websocket_message_bytes), early_(std::move(upgrade.early)) {
  http::Response& response = upgrade.response;
  response.status = 101;
  response.close = false;
  response.fields.set("Sec-WebSocket-Accept", http::websocket_accept(upgrade.key));
  response.fields.set("Upgrade", "websocket");
  const http::Fields* const more = loop.context.handler ? loop.context.handler->common_fields(now) : nullptr;
  http::write_response_header(header_, response, loop.context.date(now.utc), true, 11, http::BodyEnd::length, more);
}

void WebSocket::take(Socket socket, Addresses::Place place, std::unique_ptr<TlsStream> tls) noexcept {
  socket_ = std::move(socket);
  place_ = std::move(place);
  tls_ = std::move(tls);
}

// -------------------------------------------------------------------------------------------------------------- beginning

void WebSocket::open(engine::Channel channel, TimePoint now) {
  open_channel(channel, socket_);
  if (write(now)) begin(now);
  update(now);
}

void WebSocket::begin(TimePoint now) {
  phase_ = Phase::open;
  std::string().swap(header_);
  window_ = now.steady;
  heard(now);
  if (has_more()) read(now);
  push_some(now);
}

// ---------------------------------------------------------------------------------------------------------------- reading

void WebSocket::on_ready(std::uint32_t events) {
  if (phase_ == Phase::closed) return;
  if (phase_ == Phase::lingering) return discard();
  const auto now = loop_.clock.now();
  const bool broken = (events & (EPOLLERR | EPOLLHUP)) != 0;
  if (blocked_ && (broken || (events & EPOLLOUT) != 0)) {
    blocked_ = false;
    if (write(now)) {
      if (phase_ == Phase::opening) begin(now);
      take_messages(now);
      push_some(now);
    }
  }
  if (!wants_input() && broken) return close();
  if (wants_input() && ((events & ~static_cast<std::uint32_t>(EPOLLOUT)) != 0 || has_more())) read(now);
  update(now);
}

/// For input that the socket does not report: bytes in the TLS stream, and those that the budget has left over.
void WebSocket::go_on() {
  if (!is_speaking()) return;
  const auto now = loop_.clock.now();
  if (std::exchange(unfinished_, false)) take_messages(now);
  if (wants_input()) read(now);
  update(now);
}

bool WebSocket::wants_input() const noexcept { return is_speaking() && !unfinished_ && frames_.wants_input(); }

/// There may be input that the socket does not report.
bool WebSocket::has_more() const noexcept { return early_used_ < early_.size() || (tls_ && tls_->has_more()); }

void WebSocket::read(TimePoint now) {
  auto& scratch = loop_.scratch;
  bool drained = false;
  for (int turn = 0; turn < reads_per_turn && !drained && wants_input(); ++turn) {
    const auto got = receive(scratch.data(), piece_bytes);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (got <= 0) return close();
    heard(now);
    frames_.receive({scratch.data(), static_cast<std::size_t>(got)});
    count_pings(now);
    take_messages(now);
    drained = static_cast<std::size_t>(got) < piece_bytes && !has_more();
    if (loop_.readiness.is_over()) break;
  }
  if (!drained && wants_input()) loop_.readiness.later(*this);
}

ssize_t WebSocket::receive(char* to, std::size_t size) {
  if (early_used_ < early_.size()) {
    const auto got = early_.copy(to, size, early_used_);
    early_used_ += got;
    if (early_used_ == early_.size()) std::string().swap(early_), early_used_ = 0;
    return static_cast<ssize_t>(got);
  }
  return tls_ ? tls_->receive(to, size) : ::recv(socket_.descriptor(), to, size, 0);
}

/// Passes received messages to the handler, and sends the replies to each before the next. This continues while the client does not read:
/// it needs no memory, and a message may change the output.
void WebSocket::take_messages(TimePoint now) {
  while (is_speaking()) {
    auto message = frames_.next();
    if (message && phase_ == Phase::open) count(now);
    count_pings(now);
    if (is_too_much()) begin_close(1008, "too many messages", now);
    else if (message && phase_ == Phase::open) loop_.context.handler->received(*channel(), message->bytes, message->text, now);
    const bool had_output = has_output();
    const bool free = write(now);
    if (message && free) push_some(now);
    if (!message && !(had_output && free)) return;
    if (loop_.readiness.is_over()) {
      unfinished_ = true;
      return loop_.readiness.later(*this);
    }
  }
}

/// Counts a message or ping. The window begins with the first after the end of the last one.
void WebSocket::count(TimePoint now) {
  if (now.steady - window_ >= loop_.options.limits.ping_interval) {
    window_ = now.steady;
    window_messages_ = 0;
  }
  ++window_messages_;
}

bool WebSocket::is_too_much() const noexcept { return phase_ == Phase::open && window_messages_ > loop_.options.limits.max_websocket_messages; }

/// Reads and drops, so that closing does not reset the connection while the client's last bytes are on their way.
void WebSocket::discard() {
  auto& scratch = loop_.scratch;
  for (int turn = 0; turn < reads_per_turn; ++turn) {
    const auto got = ::recv(socket_.descriptor(), scratch.data(), scratch.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (got <= 0) return close();
    discarded_ += static_cast<std::size_t>(got);
    if (discarded_ >= loop_.options.limits.max_linger_bytes) return update(loop_.clock.now());  // TCP flow control stops the client
    if (static_cast<std::size_t>(got) < scratch.size()) return;
  }
}

// ---------------------------------------------------------------------------------------------------------------- writing

void WebSocket::send_messages(engine::Push* pushes, std::size_t count, TimePoint now, bool later) {
  for (engine::Push* push = pushes; push != pushes + count; ++push) {
    if (push->close != 0) return begin_close(push->close, push->reason, now);
    if (!push->message) push->message = empty_message();
    frames_.send(std::move(push->message), push->text);
  }
  if (later && has_output()) block(true, now);
  else write(now);
}

void WebSocket::add_output(OutputParts& parts) const noexcept {
  if (phase_ == Phase::opening) parts.add(std::string_view(header_).substr(header_sent_));
  else frames_.add_output(parts);
}

/// Sends the output and updates the phase. Returns true if all of it was sent and the connection is open.
bool WebSocket::write(TimePoint now) {
  if (phase_ > Phase::closing) return false;
  if (!blocked_) send_all(now);
  follow_state(now);
  return !blocked_ && phase_ <= Phase::closing;
}

void WebSocket::send_all(TimePoint now) {
  bool anew = !progress_.is_linked();
  for (;;) {
    OutputParts output;
    add_output(output);
    if (output.empty()) {
      if (tls_ && tls_->owes() && tls_->flush() != 0) return block(anew, now);
      if (!owes_ping_ || phase_ != Phase::open) return loop_.deadlines.clear(progress_);
      owes_ping_ = false;
      frames_.ping();
      continue;
    }
    const auto bytes = send(socket_, tls_.get(), output);
    if (bytes > 0) {
      sent(static_cast<std::size_t>(bytes));
      anew = true;
      if (phase_ != Phase::opening && count_pings(now) && must_pause()) return;
      if (has_output() && loop_.readiness.is_over()) return block(anew, now);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return block(anew, now);
    } else if (errno != EINTR) {
      return close();
    }
  }
}

/// Returns true if the client has sent pings since the last call.
bool WebSocket::count_pings(TimePoint now) {
  const std::size_t pings = frames_.pings();
  if (pings == pings_) return false;
  for (; pings_ != pings; ++pings_) count(now);
  return true;
}

/// A pong has been sent, and the next ping was found: many pings of a client are not one step.
bool WebSocket::must_pause() {
  if (!is_too_much() && !loop_.readiness.is_over()) return false;
  unfinished_ = true;
  loop_.readiness.later(*this);
  return true;
}

void WebSocket::sent(std::size_t bytes) {
  if (phase_ == Phase::opening) header_sent_ += bytes;
  else frames_.sent(bytes);
}

/// Until the socket takes more, or, if it takes more already, until the next turn.
/// @param anew  restarts write_timeout, because the client has read some bytes
void WebSocket::block(bool anew, TimePoint now) {
  blocked_ = true;
  if (anew) loop_.deadlines.set(progress_, Deadlines::blocked, now.steady + loop_.options.limits.write_timeout);
}

// ---------------------------------------------------------------------------------------------------------------- closing

void WebSocket::begin_stop(TimePoint now) {
  if (phase_ == Phase::opening) return close();
  begin_close(1001, {}, now);
  update(now);
}

void WebSocket::begin_close(std::uint16_t code, std::string_view reason, TimePoint now) {
  if (phase_ != Phase::open) return;
  enter_closing(now);
  frames_.close(code, reason);
  write(now);
}

/// Follows the state of the frames.
void WebSocket::follow_state(TimePoint now) {
  if (!is_speaking()) return;
  switch (frames_.state()) {
    case http::WebSocketFrames::State::open: break;
    case http::WebSocketFrames::State::closing: enter_closing(now); break;
    case http::WebSocketFrames::State::closed:
      enter_closing(now);
      linger();
      break;
  }
}

void WebSocket::enter_closing(TimePoint now) {
  if (phase_ != Phase::open) return;
  phase_ = Phase::closing;
  loop_.deadlines.set(life_, Deadlines::closing, now.steady + loop_.options.limits.close_timeout);
}

/// RFC 6455 7.1.1: the server closes the TCP connection first, and waits for the client to close its side.
void WebSocket::linger() {
  phase_ = Phase::lingering;
  loop_.deadlines.clear(progress_);
  end_channel();
  if (tls_) tls_->end();
  ::shutdown(socket_.descriptor(), SHUT_WR);
}

void WebSocket::close() noexcept {
  if (phase_ == Phase::closed) return;
  phase_ = Phase::closed;
  loop_.deadlines.clear(life_);
  loop_.deadlines.clear(progress_);
  end_channel();
  if (tls_) tls_->end();
  loop_.readiness.close(socket_);
  place_ = {};
  leave();
}

void WebSocket::end_channel() {
  const auto ended = channel();
  close_channel();
  if (ended) loop_.context.handler->closed(*ended);
}

// ------------------------------------------------------------------------------------------------------------------- time

/// Any byte of the client shows that it is alive.
void WebSocket::heard(TimePoint now) {
  if (phase_ != Phase::open) return;
  pinged_ = owes_ping_ = false;
  loop_.deadlines.set(life_, Deadlines::silent, now.steady + loop_.options.limits.ping_interval);
}

void WebSocket::on_silence(TimePoint now) {
  if (phase_ != Phase::open || pinged_) return close();
  pinged_ = owes_ping_ = true;
  loop_.deadlines.set(life_, Deadlines::unanswered, now.steady + loop_.options.limits.pong_timeout);
  write(now);
  update(now);
}

/// Says which events to wait for; errors are always reported.
void WebSocket::update(TimePoint) {
  if (phase_ == Phase::closed) return;
  const bool wanted = phase_ == Phase::lingering ? discarded_ < loop_.options.limits.max_linger_bytes : is_speaking() && frames_.wants_input();
  if (loop_.readiness.watch(socket_, *this, (wanted ? EPOLLIN : 0U) | (blocked_ && phase_ != Phase::lingering ? EPOLLOUT : 0U))) return;
  loop_.log(LogLevel::warning, "a WebSocket is closed: the system cannot poll another descriptor");
  close();
}

}  // namespace lrt::transport
