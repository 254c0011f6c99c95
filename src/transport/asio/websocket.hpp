#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "src/transport/asio/client.hpp"
#include "src/transport/asio/deadlines.hpp"
#include "src/transport/asio/loop.hpp"
#include "src/transport/asio/session.hpp"

namespace lrt::transport {

/// A client after its opening handshake: Beast's websocket stream on the socket that was a Connection's, messages pulled from the
/// handler, one on its way at a time.
///
/// Beast frames, assembles, answers pings and does the closing handshake. Its timers are off: all times are Deadlines by the clock of
/// the options. It stands on a Wire of ours, which sends in the call that asks for it: per message that is one sendmsg, without
/// a post, an allocation or an epoll_ctl, as long as the client reads.
///
/// @par Implements  R0.12, R0.14, RFC 6455
class WebSocket final : public Client, public TurnEntry {
 public:
  /// @param watched  whether the loop's Readiness has the socket already
  /// @param tls  nullptr: plain
  WebSocket(Loop& loop, Socket socket, Session::Upgrade upgrade, bool watched, Addresses::Place place, std::unique_ptr<TlsStream> tls);
  ~WebSocket() override;

  /// Its place in the loop's list is taken. Answers 101.
  void open(TimePoint now);
  /// Sends what the handler has, as long as the client takes it and for its turn.
  void push(TimePoint now);

  void on_ready(bool broken) override;
  /// Begins the closing handshake with 1001.
  void begin_stop(TimePoint now) override;
  bool is_busy() const noexcept override { return phase_ == Phase::closing; }
  void give_up(TimePoint) override {}
  void close() override;

 private:
  struct Stream;  // Beast's part, which nobody else needs to compile
  class Wire;
  enum class Phase : unsigned char {
    opening,    ///< the 101 is being sent
    open,
    closing,    ///< the client's half of the closing handshake is awaited; limits.close_time from here to the end
    lingering,  ///< half-closed: the client should notice that the connection is over
    closed,
  };
  struct Timer final : Deadlines::Entry {
    Timer(WebSocket& owner, void (WebSocket::*step)(TimePoint)) : owner_(owner), step_(step) {}
    void expire(TimePoint now) override { (owner_.*step_)(now); }

   private:
    WebSocket& owner_;
    void (WebSocket::*step_)(TimePoint);
  };

  std::string take_head(TimePoint now);
  void begin(TimePoint now);
  void read();
  void on_read();
  bool is_too_much(TimePoint now);
  void send(engine::Push next);
  void begin_close(std::uint16_t code, std::string_view reason, TimePoint now);
  void finish(const boost::system::error_code& error);
  void release_channel();

  void heard(TimePoint now);
  void on_silence(TimePoint now);
  void on_stuck(TimePoint) { close(); }
  void on_blocked();
  void read_later();
  void wait_writable();
  void on_writable();
  void watch(bool wanted);
  void discard();
  /// For what Beast completes, perhaps after this object's end.
  template <class Step>
  auto alive(Step step);

  Session::Upgrade upgrade_;
  Addresses::Place place_;
  const engine::Channel channel_;
  std::unique_ptr<Stream> stream_;
  Phase phase_ = Phase::opening;
  std::shared_ptr<const std::string> message_;  ///< on its way
  std::string head_;
  Timer life_{*this, &WebSocket::on_silence};
  Timer progress_{*this, &WebSocket::on_stuck};
  std::chrono::steady_clock::time_point window_{};  ///< in which the client's messages are counted
  std::size_t window_messages_ = 0;
  std::size_t discarded_ = 0;
  bool writing_ = false;
  bool sending_ = false;  ///< send() is under way
  bool pinged_ = false;   ///< and heard nothing since
  bool pinging_ = false;  ///< the ping is being sent
  bool reads_later_ = false;
  bool watched_;
  bool input_watched_ = false;
  bool owes_closed_ = true;  ///< to the handler
};

}  // namespace lrt::transport
