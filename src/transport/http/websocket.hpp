// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/transport/session.hpp>

#include "src/http/websocket_frames.hpp"
#include "src/transport/http/client.hpp"
#include "src/transport/http/deadlines.hpp"
#include "src/transport/http/loop.hpp"

namespace lrt::transport {

/// A client after its opening handshake: WebSocketFrames on the socket that was a Connection's.
///
/// WebSocketFrames implements RFC 6455. This class owns the socket, orders reads and writes, and sets all deadlines by the clock of the
/// options. A message costs one sendmsg, and no epoll_ctl as long as the client reads.
///
/// @par Implements  R0.12, R0.14, RFC 6455
class WebSocket final : public Client {
 public:
  /// May throw; take() follows.
  WebSocket(Loop& loop, Session::Upgrade upgrade, TimePoint now);
  /// @param tls  nullptr: plain
  void take(Socket socket, Addresses::Place place, std::unique_ptr<TlsStream> tls) noexcept;

  /// To be called when it has its place in the loop's list. Sends the 101.
  void open(engine::Channel channel, TimePoint now);

  void on_ready(std::uint32_t events) override;
  void go_on() override;
  /// Begins the closing handshake with 1001.
  void begin_stop(TimePoint now) override;
  bool is_busy() const noexcept override { return phase_ == Phase::closing; }
  void give_up(TimePoint) override {}
  void close() noexcept override;

 private:
  /// The number of messages that one system call may send.
  static constexpr std::size_t max_messages_at_once = 30;

  enum class Phase : unsigned char {
    opening,  ///< the 101 is being sent
    open,
    closing,    ///< waiting for the client's half of the closing handshake; limits.close_timeout until the end
    lingering,  ///< half-closed: the client should close the connection
    closed,
  };
  struct Timer final : Deadlines::Entry {
    Timer(WebSocket& owner, void (WebSocket::*step)(TimePoint)) : owner_(owner), step_(step) {}
    void expire(TimePoint now) override {
      try {
        (owner_.*step_)(now);
      } catch (const std::exception& e) { owner_.failed(e.what()); } catch (...) {
        owner_.failed("an exception that is not a std::exception");
      }
    }

   private:
    WebSocket& owner_;
    void (WebSocket::*step_)(TimePoint);
  };

  void begin(TimePoint now);

  void read(TimePoint now);
  ssize_t receive(char* to, std::size_t size);
  void take_messages(TimePoint now);
  void count(TimePoint now);
  bool is_too_much() const noexcept;
  bool count_pings(TimePoint now);
  bool must_pause();
  void discard();
  bool is_speaking() const noexcept { return phase_ == Phase::open || phase_ == Phase::closing; }
  bool wants_input() const noexcept;
  bool has_more() const noexcept;

  std::size_t room_for_messages() const noexcept override {
    return phase_ == Phase::open && !blocked_ && !frames_.has_output() ? max_messages_at_once : 0;
  }
  void send_messages(engine::Push* pushes, std::size_t count, TimePoint now, bool later) override;
  bool write(TimePoint now);
  void send_all(TimePoint now);
  bool has_output() const noexcept { return phase_ == Phase::opening ? header_sent_ < header_.size() : frames_.has_output(); }
  void add_output(OutputParts& parts) const noexcept;
  void sent(std::size_t bytes);
  void block(bool anew, TimePoint now);

  void begin_close(std::uint16_t code, std::string_view reason, TimePoint now);
  void follow_state(TimePoint now);
  void enter_closing(TimePoint now);
  void linger();
  void end_channel();

  void heard(TimePoint now);
  void on_silence(TimePoint now);
  void on_stuck(TimePoint) { close(); }
  void update(TimePoint now) override;

  Socket socket_;
  std::unique_ptr<TlsStream> tls_;  ///< nullptr: plain
  Addresses::Place place_;
  http::WebSocketFrames frames_;
  Phase phase_ = Phase::opening;
  std::string header_;  ///< the 101
  std::size_t header_sent_ = 0;
  std::string early_;  ///< bytes that came with the handshake
  std::size_t early_used_ = 0;
  Timer life_{*this, &WebSocket::on_silence};
  Timer progress_{*this, &WebSocket::on_stuck};
  std::chrono::steady_clock::time_point window_{};  ///< its beginning; the client's messages in it are counted
  std::size_t window_messages_ = 0;
  std::size_t pings_ = 0;  ///< that are counted
  std::size_t discarded_ = 0;
  bool blocked_ = false;     ///< the socket takes no more for now
  bool unfinished_ = false;  ///< the frames may have more messages in the bytes received
  bool pinged_ = false;      ///< no byte of the client since the ping
  bool owes_ping_ = false;   ///< a ping waits behind a message
};

}  // namespace lrt::transport
