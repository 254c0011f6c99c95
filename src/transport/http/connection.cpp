// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/connection.hpp"

#include <sys/socket.h>

#include <cerrno>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "src/transport/http/websocket.hpp"

namespace lrt::transport {
namespace {

/// Bytes per turn of a connection with much input.
constexpr int large_reads_per_turn = 1;
/// The number of pipelined responses in one turn. The further requests of a client wait until other clients were served.
constexpr int writes_per_turn = 4;

std::size_t deadline_kind(Session::Phase phase) noexcept { return static_cast<std::size_t>(phase); }

static_assert(static_cast<std::size_t>(Session::Phase::waiting) == Deadlines::phases);
static_assert(static_cast<std::size_t>(Session::Phase::streaming) == Deadlines::silent);
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
  call([&] { update(now); });
}

void Connection::open_refused(TimePoint now) {
  join();
  refused_ = true;
  ++loop_.refused;
  call([&] {
    session_.refuse(503, "too many connections", now);
    write_and_update(now);
  });
}

void Connection::open_reserved(TimePoint now, bool scarce) {
  join();
  reserved_ = true;
  scarce_ = scarce;
  ++loop_.reserved_count;
  session_.serve_only_stops();
  call([&] { update(now); });
}

void Connection::leave_reserve(TimePoint now) {
  if (tls_ && !tls_->is_open()) return close();
  call([&] {
    session_.refuse(503, "too many connections", now);
    write_and_update(now);
  });
}

void Connection::reply(engine::Reply reply, TimePoint now) {
  ticket_ = 0;  // the caller removed it from the loop's table
  session_.reply(std::move(reply), now);
  write_and_update(now);
}

void Connection::expire(TimePoint now) {
  call([&] {
    session_.expire(now);
    write_and_update(now);
  });
}

void Connection::give_up(TimePoint now) {
  if (!session_.ticket()) return;
  loop_.tickets.erase(ticket_);
  ticket_ = 0;
  session_.abandon();
  session_.refuse(503, "the server is stopping", now);
  write(now);
}

void Connection::close() noexcept {
  if (closed_) return;
  closed_ = true;
  loop_.deadlines.clear(*this);
  Linked<IdleTag>::unlink();
  if (session_.ticket()) loop_.tickets.erase(ticket_);
  close_channel();
  session_.abandon();
  Linked<ReservedTag>::unlink();
  if (reserved_) --loop_.reserved_count;
  if (refused_) --loop_.refused;
  if (tls_) tls_->end();
  place_ = {};
  loop_.readiness.close(socket_);
  leave();
}

void Connection::begin_stop(TimePoint now) {
  if (session_.channel()) {
    session_.end_stream(now);
    return write_and_update(now);
  }
  if (!is_busy() && session_.phase() != Session::Phase::lingering) close();
}

/// Hands the socket, and the bytes behind the header section, to a WebSocket, which takes the place of this in the loop.
void Connection::upgrade(TimePoint now) {
  Session::Upgrade upgrade = session_.take_upgrade();
  const auto opened = upgrade.channel;
  std::shared_ptr<WebSocket> next;
  try {
    next = std::make_shared<WebSocket>(loop_, std::move(upgrade), now);
  } catch (const std::exception& e) {
    loop_.context.handler->closed(opened);
    return failed(e.what());
  }
  closed_ = true;
  close_channel();
  loop_.deadlines.clear(*this);
  Linked<IdleTag>::unlink();
  next->take(std::move(socket_), std::move(place_), std::move(tls_));
  auto& websocket = *next;
  make_way(std::move(next));
  websocket.call([&] { websocket.open(opened, now); });
}

// ------------------------------------------------------------------------------------------------------------- reading

void Connection::on_ready(std::uint32_t events) {
  if (closed_) return;
  const bool broken = (events & (EPOLLERR | EPOLLHUP)) != 0;
  if (blocked_ && (broken || (events & EPOLLOUT) != 0)) {
    blocked_ = false;
    const auto now = loop_.clock.now();
    write(now);
    push_some(now);
    update(now);
    if (closed_ || !broken) return;
  }
  if (!broken && session_.expects_much()) return read_later();
  read(broken);
}

/// Continues after the others have had their turn.
void Connection::go_on() {
  if (closed_) return;
  const bool reads = std::exchange(reads_later_, false);
  if (std::exchange(writes_later_, false)) {
    const auto now = loop_.clock.now();
    write(now);
    push_some(now);
    update(now);
  }
  if (reads) read(false);
}

void Connection::read(bool broken) {
  if (closed_) return;
  if (!wants_input()) return broken ? close() : update(loop_.clock.now());
  const auto now = loop_.clock.now();
  auto& scratch = loop_.scratch;
  bool drained = false;
  for (int turn = 0; turn < reads_per_turn && !drained; ++turn) {
    if (turn >= large_reads_per_turn && session_.expects_much()) break;
    const auto got = receive(scratch.data(), scratch.size());
    if (got < 0) {
      if (errno == EINTR) continue;
      drained = errno == EAGAIN || errno == EWOULDBLOCK;
      if (drained) break;
      if (errno == EPROTO && tls_) return on_tls_failure(now);
      return close();
    }
    if (got == 0) session_.end_of_input(now);
    else session_.receive({scratch.data(), static_cast<std::size_t>(got)}, now);
    write(now);
    if (closed_) return;
    drained = static_cast<std::size_t>(got) < scratch.size();
    if (!session_.wants_input()) break;
  }
  if (!drained && wants_input()) read_later();
  if (tls_) write(now);  // output that waited for the handshake, and records of TLS itself
  update(now);
}

ssize_t Connection::receive(char* to, std::size_t size) {
  // Bytes after close_notify are discarded.
  if (!tls_ || half_closed_) return ::recv(socket_.descriptor(), to, size, 0);
  const bool was_open = tls_->is_open();
  const auto got = tls_->receive(to, size);
  const int error = errno;
  if (!was_open && tls_->is_open()) session_.set_secure(tls_->client_certificate());
  return errno = error, got;
}

void Connection::on_tls_failure(TimePoint now) {
  if (tls_->is_plain()) {  // nothing was sent yet: the client gets a plain response
    tls_.reset();
    http::Response response;
    response.status = 400;
    response.fields.add("Content-Type", "text/plain");
    response.set_body("This port serves HTTPS: use a URL that begins with https://\n");
    session_.refuse(std::move(response), now);
    write(now);
  } else if (tls_->is_open()) {
    return close();
  } else {
    session_.hang_up();  // so that the client reads the alert
  }
  update(now);
}

/// For input that the socket does not report (bytes in the TLS stream, and those that the turn has left over), and for much input, so that small requests
/// of others come first.
void Connection::read_later() {
  reads_later_ = true;
  loop_.readiness.later(*this);
}

// ------------------------------------------------------------------------------------------------------------- writing

void Connection::write_and_update(TimePoint now) {
  write(now);
  update(now);
}

void Connection::send_messages(engine::Push* pushes, std::size_t count, TimePoint now, bool later) {
  if (count == 0) return;
  session_.push(std::move(*pushes), now);
  if (later && !session_.output().empty()) write_later();
  else write(now);
}

/// Sends the output of the session, one response after the other, until the socket is full or the session has none.
void Connection::write(TimePoint now) {
  if (closed_ || blocked_ || writes_later_) return;
  for (int turn = 0; turn < writes_per_turn; ++turn) {
    const auto output = session_.output();
    if (output.empty()) {
      if (tls_ && tls_->owes() && tls_->flush() != 0) blocked_ = true;
      return;
    }
    OutputParts parts;
    for (const std::string_view part : {output.first, output.second, output.third}) parts.add(part);
    const auto sent = send(socket_, tls_.get(), parts);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno == EINPROGRESS && tls_) return;  // on_ready() continues
      if (errno != EAGAIN && errno != EWOULDBLOCK) return close();
      blocked_ = true;
      return;
    }
    session_.sent(static_cast<std::size_t>(sent), now);
    if (!session_.output().empty() && loop_.readiness.is_over()) break;
  }
  if (!session_.output().empty()) write_later();
}

/// Continues after the others have had their turn.
void Connection::write_later() {
  writes_later_ = true;
  loop_.readiness.later(*this);
}

// --------------------------------------------------------------------------------------------------------------- waiting

/// A reserved connection is released when its response was sent.
void Connection::update_reserve() {
  const auto phase = session_.phase();
  if (phase == Session::Phase::idle || phase == Session::Phase::header || phase == Session::Phase::body) {
    if (!Linked<ReservedTag>::is_linked()) loop_.reserved.push_back(*this);
    return;
  }
  Linked<ReservedTag>::unlink();
  if (phase != Session::Phase::lingering) return;
  reserved_ = false;
  --loop_.reserved_count;
  if (scarce_ || loop_.refused >= max_refused) return close();
  refused_ = true;
  ++loop_.refused;
}

/// Acts on the phase of the session.
void Connection::update(TimePoint now) {
  if (closed_) return;
  if (reserved_) update_reserve();
  if (closed_) return;
  const auto phase = session_.phase();
  if (phase == Session::Phase::closed) return close();
  if (phase == Session::Phase::upgraded) return upgrade(now);
  if (phase == Session::Phase::waiting) keep_ticket();
  keep_channel();
  if (phase == Session::Phase::lingering && !half_closed_) {
    half_closed_ = true;
    if (tls_) tls_->end();
    ::shutdown(socket_.descriptor(), SHUT_WR);
  }
  const bool anew = epoch_ != session_.epoch();
  if (phase != Session::Phase::idle) Linked<IdleTag>::unlink();
  else if (!reserved_ && (anew || !Linked<IdleTag>::is_linked())) loop_.idle.push_back(*this);
  if (anew) {
    epoch_ = session_.epoch();
    if (const auto time = session_.time()) {
      loop_.deadlines.set(*this, deadline_kind(session_.timed_phase()), now.steady + *time);
    } else {
      loop_.deadlines.clear(*this);
    }
  }
  watch();
}

void Connection::keep_ticket() {
  const auto ticket = static_cast<std::uint64_t>(*session_.ticket());
  if (ticket_ == ticket) return;
  ticket_ = ticket;
  loop_.tickets.emplace(ticket, this);
}

/// A stream that has begun gets its first turn.
void Connection::keep_channel() {
  if (session_.channel() == channel()) return;
  close_channel();
  if (!session_.channel()) return;
  open_channel(*session_.channel(), socket_);
  loop_.turns.push_back(*this);
}

/// Sets the events to wait for. Errors are always reported.
void Connection::watch() {
  const bool wanted = wants_input();
  if (wanted && tls_ && tls_->has_more() && !half_closed_) read_later();
  if (loop_.readiness.watch(socket_, *this, (wanted ? EPOLLIN : 0U) | (blocked_ ? EPOLLOUT : 0U))) return;
  loop_.log(LogLevel::warning, "a connection is closed: the system cannot poll another descriptor");
  close();
}

}  // namespace lrt::transport
