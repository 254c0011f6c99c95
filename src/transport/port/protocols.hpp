#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/transport/session.hpp>

namespace lrt::transport {

/// The server's side of one WebSocket after its opening handshake, without I/O: the client's bytes in, its messages out; our messages in,
/// bytes out. Frames and assembles, checks UTF-8, answers pings, does the closing handshake. The owner has the socket and the times.
///
/// None of the functions calls the owner back or waits.
///
/// @par Implements  R0.12, RFC 6455
class Frames {
 public:
  enum class State : unsigned char {
    open,
    closing,  ///< one side has sent a close; the other's is awaited, or still in output()
    closed,   ///< the closing handshake is complete, and output() has left
    failed,   ///< the connection is of no use, without more to say
  };
  struct Message {
    std::string bytes;
    bool text = true;  ///< RFC 6455 5.6: checked to be UTF-8; else binary
  };

  virtual ~Frames() = default;
  Frames(const Frames&) = delete;
  Frames& operator=(const Frames&) = delete;

  /// Bytes of the client, taken as a whole. To be called when next() has nothing and wants_input().
  virtual void receive(std::string_view bytes) = 0;
  /// The next complete message of the client. What breaks RFC 6455 begins the closing handshake: 1002, 1007, and 1009 for a message over the limit.
  virtual std::optional<Message> next() = 0;
  /// False while what was received waits for output() to leave.
  virtual bool wants_input() const noexcept = 0;

  /// One message as one frame. Only in the state `open` and when output() is empty. A large one is not copied where that can be avoided.
  virtual void send(std::shared_ptr<const std::string> message, bool text) = 0;
  /// An empty ping, under the same conditions.
  virtual void ping() = 0;
  /// Begins the closing handshake, after what is in output(). What the client still says is read and dropped.
  /// @param reason  UTF-8, at most 123 bytes
  virtual void close(std::uint16_t code, std::string_view reason) = 0;

  /// What to write now; lives until the next call of anything else.
  virtual Output output() const noexcept = 0;
  virtual void sent(std::size_t bytes) = 0;

  virtual State state() const noexcept = 0;
  /// Of the client, answered until now: its owner says how many it may send.
  virtual std::size_t pings() const noexcept = 0;

 protected:
  Frames() = default;
};

/// What third parties do for a port: heads and frames. One thread.
class Protocols : public Heads {
 public:
  /// `frames` is empty when that failed.
  struct Handshake {
    std::string accept;  ///< the value of Sec-WebSocket-Accept
    std::unique_ptr<Frames> frames;
  };

  /// Accepts an opening handshake that passed http::check_websocket().
  /// @param key            Sec-WebSocket-Key
  /// @param message_bytes  of one message of the client; more: close 1009
  virtual Handshake accept(std::string_view key, std::size_t message_bytes) = 0;
};

}  // namespace lrt::transport
