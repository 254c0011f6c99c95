// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include <lrt/transport/session.hpp>

#include "src/transport/http/client.hpp"
#include "src/transport/http/deadlines.hpp"
#include "src/transport/http/loop.hpp"
#include "src/transport/http/tls.hpp"

namespace lrt::transport {

/// A Session on a socket: waits for readiness, reads and writes without blocking, keeps the session's deadline, and pulls the messages of
/// its event stream.
///
/// A request costs one recv and one send, and a share of the waits of the Readiness; a buffer is needed only during a read.
class Connection final : public Client, public Deadlines::Entry, public Linked<IdleTag>, public Linked<ReservedTag> {
 public:
  Connection(Loop& loop, Socket socket, std::string peer, Addresses::Place place, std::unique_ptr<TlsStream> tls);

  /// Begins to read.
  void open(TimePoint now);
  /// Responds with 503 to any request.
  void open_refused(TimePoint now);
  /// Beyond the limit: serves one request that stops the robot, and refuses others.
  /// @param scarce  its descriptor is needed soon: it is closed without lingering
  void open_reserved(TimePoint now, bool scarce);
  /// Refuses the client of a reserved connection whose request is not complete.
  void leave_reserve(TimePoint now);
  /// The reply to the ticket that loop.tickets had for this connection.
  void reply(engine::Reply reply, TimePoint now);

  void expire(TimePoint now) override;
  void on_ready(std::uint32_t events) override;
  void go_on() override;
  void begin_stop(TimePoint now) override;
  bool is_busy() const noexcept override { return session_.ticket().has_value() || !session_.output().empty(); }
  /// Responds with 503 if the handler's reply is still open.
  void give_up(TimePoint now) override;
  void close() noexcept override;

  /// Reads input that on_ready() may not have seen.
  void read_pending() noexcept {
    call([&] { read(false); });
  }
  /// True between requests and before the first, unless there is input that on_ready() has not seen.
  bool is_idle() const noexcept { return !closed_ && !reserved_ && session_.phase() == Session::Phase::idle && !(tls_ && tls_->is_under_way()); }

 private:
  std::size_t room_for_messages() const noexcept override {
    return !closed_ && !blocked_ && !writes_later_ && session_.wants_message() && session_.channel() == channel() ? 1 : 0;
  }
  void send_messages(engine::Push* pushes, std::size_t count, TimePoint now, bool later) override;
  void read(bool broken);
  ssize_t receive(char* to, std::size_t size);
  bool wants_input() const noexcept { return session_.wants_input() || (tls_ && !tls_->is_open() && !half_closed_); }
  void on_tls_failure(TimePoint now);
  void write(TimePoint now);
  void update(TimePoint now) override;
  void write_and_update(TimePoint now);
  void watch();
  void write_later();
  void read_later();
  void update_reserve();
  void keep_ticket();
  void keep_channel();
  void upgrade(TimePoint now);

  Socket socket_;
  Session session_;
  std::unique_ptr<TlsStream> tls_;  ///< nullptr: plain
  Addresses::Place place_;
  std::uint32_t epoch_ = 0;
  std::uint64_t ticket_ = 0;  ///< that loop_.tickets has for this connection; 0: none
  bool blocked_ = false;      ///< the socket is not writable now
  bool writes_later_ = false;
  bool reads_later_ = false;
  bool half_closed_ = false;
  bool reserved_ = false;
  bool scarce_ = false;
  bool refused_ = false;
  bool closed_ = false;
};

}  // namespace lrt::transport
