#include "src/transport/asio/connection.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <cerrno>
#include <utility>

#include "src/transport/asio/websocket.hpp"

namespace lrt::transport {
namespace {

/// Reads of one turn: a fast sender must not keep the others waiting.
constexpr int reads_per_turn = 4;
/// Pipelined answers of one turn.
constexpr int writes_per_turn = 32;

std::size_t deadline_kind(Session::Phase phase) noexcept { return static_cast<std::size_t>(phase); }

std::chrono::milliseconds time_of(Session::Phase phase, const Limits& limits) noexcept {
  switch (phase) {
    case Session::Phase::idle: return limits.idle_time;
    case Session::Phase::head: return limits.head_time;
    case Session::Phase::body: return limits.body_time;
    case Session::Phase::writing: return limits.write_time;
    case Session::Phase::lingering: return limits.linger_time;
    case Session::Phase::waiting:
    case Session::Phase::upgraded:
    case Session::Phase::closed: break;
  }
  return {};
}

bool has_deadline(Session::Phase phase) noexcept { return deadline_kind(phase) < Deadlines::phases; }
static_assert(static_cast<std::size_t>(Session::Phase::waiting) == Deadlines::phases);
static_assert(static_cast<std::size_t>(Session::Phase::writing) == Deadlines::blocked);

}  // namespace

Connection::Connection(Loop& loop, Socket socket, std::string peer, Addresses::Place place, std::unique_ptr<TlsStream> tls)
    : Client(loop),
      socket_(std::move(socket)),
      session_(loop.context, std::move(peer)),
      tls_(std::move(tls)),
      place_(std::move(place)),
      epoch_(session_.epoch() - 1) {}

void Connection::open(TimePoint now) {
  join();
  update(now);
}

void Connection::open_refused(TimePoint now) {
  refused_ = true;
  ++loop_.refused;
  join();
  session_.refuse(503, "too many connections", now);
  write(now);
  update(now);
}

void Connection::reply(engine::Reply reply, TimePoint now) {
  ticket_ = 0;  // the caller took it out of the loop's table
  if (reply.channel) session_.upgrade(*reply.channel, std::move(reply.response), now);
  else session_.reply(std::move(reply.response), now);
  write(now);
  update(now);
}

void Connection::expire(TimePoint now) {
  session_.expire(now);
  write(now);
  update(now);
}

void Connection::give_up(TimePoint now) {
  const auto ticket = session_.ticket();
  if (!ticket) return;
  loop_.tickets.erase(ticket_);
  ticket_ = 0;
  loop_.context.handler->abandon(*ticket);
  session_.refuse(503, "the server stops", now);
  write(now);
}

void Connection::close() {
  if (closed_) return;
  closed_ = true;
  loop_.deadlines.clear(*this);
  unlink_idle();
  if (const auto ticket = session_.ticket()) {
    loop_.tickets.erase(ticket_);
    loop_.context.handler->abandon(*ticket);
  }
  if (session_.phase() == Session::Phase::upgraded) loop_.context.handler->closed(session_.take_upgrade().channel);
  if (refused_) --loop_.refused;
  if (tls_) tls_->end();
  place_ = {};
  boost::system::error_code ignored;
  socket_.close(ignored);
  leave();
}

void Connection::begin_stop(TimePoint) {
  if (!is_busy() && session_.phase() != Session::Phase::lingering) close();
}

/// The socket, and what came after the head, go to a WebSocket, which takes this one's place.
void Connection::upgrade(TimePoint now) {
  closed_ = true;
  loop_.deadlines.clear(*this);
  unlink_idle();
  auto next = std::make_shared<WebSocket>(loop_, std::move(socket_), session_.take_upgrade(), watched_, std::move(place_), std::move(tls_));
  auto& websocket = *next;
  make_way(std::move(next));
  websocket.open(now);
}

// ------------------------------------------------------------------------------------------------------------- reading

void Connection::on_ready(bool broken) {
  if (closed_) return;
  if (!wants_input()) return broken ? close() : update(loop_.clock.now());
  const auto now = loop_.clock.now();
  auto& scratch = loop_.scratch;
  for (int turn = 0; turn < reads_per_turn; ++turn) {
    const auto got = receive(scratch.data(), scratch.size());
    if (got < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) break;
      if (errno == EPROTO && tls_) return on_tls_failure(now);
      return close();
    }
    if (got == 0) session_.end_of_input(now);
    else session_.receive({scratch.data(), static_cast<std::size_t>(got)}, now);
    write(now);
    if (closed_) return;
    if (static_cast<std::size_t>(got) < scratch.size() || !session_.wants_input()) break;
  }
  if (tls_) write(now);  // what waited for the handshake, or belongs to TLS
  update(now);
}

ssize_t Connection::receive(char* to, std::size_t size) {
  // After close_notify nobody needs to understand what still comes.
  if (!tls_ || half_closed_) return ::recv(socket_.native_handle(), to, size, 0);
  const bool was_open = tls_->is_open();
  const auto got = tls_->receive(to, size);
  const int error = errno;
  if (!was_open && tls_->is_open()) session_.set_secure(tls_->client_certificate());
  return errno = error, got;
}

void Connection::on_tls_failure(TimePoint now) {
  if (tls_->is_plain()) {  // nothing was sent yet: the client is answered as it asked
    tls_.reset();
    http::Response response;
    response.status = 400;
    response.fields.add("Content-Type", "text/plain");
    response.set_body("This port speaks HTTPS: the URL begins with https://\n");
    session_.refuse(std::move(response), now);
    write(now);
  } else if (tls_->is_open()) {
    return close();
  } else {
    session_.hang_up();  // so that the client reads the alert
  }
  update(now);
}

/// What receive() has left in the TLS stream comes without an event of the socket.
void Connection::read_later() {
  if (reads_later_) return;
  reads_later_ = true;
  loop_.later([self = self()] {
    self->reads_later_ = false;
    self->on_ready(false);
  });
}

// ------------------------------------------------------------------------------------------------------------- writing

/// Sends what the session has, answer by answer, until the client or the session needs time.
void Connection::write(TimePoint now) {
  if (closed_ || waits_writable_) return;
  for (int turn = 0; turn < writes_per_turn; ++turn) {
    const auto output = session_.output();
    if (output.empty()) {
      if (tls_ && tls_->owes() && tls_->flush() != 0) wait_writable();
      return;
    }
    const auto sent = send(output);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno == EINPROGRESS && tls_) return;  // on_ready() goes on
      if (errno != EAGAIN && errno != EWOULDBLOCK) return close();
      return wait_writable();
    }
    session_.sent(static_cast<std::size_t>(sent), now);
    if (!session_.output().empty() && loop_.readiness.is_over()) break;
  }
  if (!session_.output().empty()) continue_later();
}

ssize_t Connection::send(const Session::Output& output) {
  if (output.second.empty() && !tls_) return ::send(socket_.native_handle(), output.first.data(), output.first.size(), MSG_NOSIGNAL);
  iovec parts[2] = {{const_cast<char*>(output.first.data()), output.first.size()},
                    {const_cast<char*>(output.second.data()), output.second.size()}};
  if (tls_) return tls_->send(parts, 2);
  msghdr message{};
  message.msg_iov = parts;
  message.msg_iovlen = 2;
  return ::sendmsg(socket_.native_handle(), &message, MSG_NOSIGNAL);
}

/// Lets the others have their turn.
void Connection::continue_later() {
  waits_writable_ = true;
  loop_.later([self = self()] {
    self->waits_writable_ = false;
    if (self->closed_) return;
    const auto now = self->loop_.clock.now();
    self->write(now);
    self->update(now);
  });
}

// --------------------------------------------------------------------------------------------------------------- waiting

/// Does what the session's phase asks for.
void Connection::update(TimePoint now) {
  if (closed_) return;
  const auto phase = session_.phase();
  if (phase == Session::Phase::closed) return close();
  if (phase == Session::Phase::upgraded) return upgrade(now);
  if (phase == Session::Phase::waiting) keep_ticket();
  if (phase == Session::Phase::lingering && !half_closed_) {
    half_closed_ = true;
    if (tls_) tls_->end();
    ::shutdown(socket_.native_handle(), SHUT_WR);
  }
  const bool anew = epoch_ != session_.epoch();
  if (anew || phase != Session::Phase::idle) unlink_idle();
  if (phase == Session::Phase::idle && !IdleEntry::is_linked()) loop_.idle.push_back(*this);
  if (anew) {
    epoch_ = session_.epoch();
    const auto timed = session_.timed_phase();
    if (has_deadline(timed)) {
      loop_.deadlines.set(*this, deadline_kind(timed), now.steady + time_of(timed, loop_.options.limits));
    } else {
      loop_.deadlines.clear(*this);
    }
  }
  watch();
}

void Connection::unlink_idle() {
  if (IdleEntry::is_linked()) IdleEntry::unlink();
}

void Connection::keep_ticket() {
  const auto ticket = static_cast<std::uint64_t>(*session_.ticket());
  if (ticket_ == ticket) return;
  ticket_ = ticket;
  loop_.tickets.emplace(ticket, this);
}

/// Tells the loop whether input is wanted; that a client is gone it tells anyway.
void Connection::watch() {
  const bool wanted = wants_input();
  if (wanted && tls_ && tls_->has_more() && !half_closed_) read_later();
  if (watched_ && wanted == input_watched_) return;
  input_watched_ = wanted;
  loop_.readiness.watch(*this, socket_.native_handle(), wanted, watched_);
}

void Connection::wait_writable() {
  if (waits_writable_) return;
  waits_writable_ = true;
  socket_.async_wait(Socket::wait_write, [self = self()](const boost::system::error_code& error) {
    self->waits_writable_ = false;
    if (error || self->closed_) return;
    const auto now = self->loop_.clock.now();
    self->write(now);
    self->update(now);
  });
}

}  // namespace lrt::transport
