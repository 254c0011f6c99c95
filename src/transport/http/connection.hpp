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

/// A Session on a socket: waits for readiness, reads and writes without blocking, keeps the session's deadline.
///
/// Per request that is recv and send, and a share of the waits of the Readiness; a buffer is needed only while something is being read.
class Connection final : public Client, public Deadlines::Entry, public Linked<IdleTag> {
 public:
  Connection(Loop& loop, Socket socket, std::string peer, Addresses::Place place, std::unique_ptr<TlsStream> tls);

  /// Enters the loop's list and begins to read.
  void open(TimePoint now);
  /// Enters the loop's list only to be told 503.
  void open_refused(TimePoint now);
  /// Of the ticket that loop.tickets had for this connection.
  void reply(engine::Reply reply, TimePoint now);

  void expire(TimePoint now) override;
  void on_ready(std::uint32_t events) override;
  void go_on() override;
  void begin_stop(TimePoint now) override;
  bool is_busy() const noexcept override { return session_.ticket().has_value() || !session_.output().empty(); }
  /// Answers 503 if the handler's answer is still open.
  void give_up(TimePoint now) override;
  void close() override;

  /// Reads what may have arrived.
  void look() { read(false); }
  /// True between requests and before the first, as far as is known: input may have arrived that on_ready() has not seen.
  bool is_idle() const noexcept {
    return !closed_ && session_.phase() == Session::Phase::idle && !(tls_ && tls_->is_under_way());
  }

 private:
  void read(bool broken);
  ssize_t receive(char* to, std::size_t size);
  bool wants_input() const noexcept { return session_.wants_input() || (tls_ && !tls_->is_open() && !half_closed_); }
  void on_tls_failure(TimePoint now);
  void write(TimePoint now);
  void update(TimePoint now);
  void watch();
  void write_later();
  void read_later();
  void keep_ticket();
  void upgrade(TimePoint now);

  Socket socket_;
  Session session_;
  std::unique_ptr<TlsStream> tls_;  ///< nullptr: plain
  Addresses::Place place_;
  std::uint32_t epoch_ = 0;
  std::uint64_t ticket_ = 0;  ///< that loop_.tickets has for this connection; 0: none
  bool blocked_ = false;       ///< the socket takes no more for now
  bool writes_later_ = false;
  bool reads_later_ = false;
  bool half_closed_ = false;
  bool refused_ = false;
  bool closed_ = false;
};

}  // namespace lrt::transport
