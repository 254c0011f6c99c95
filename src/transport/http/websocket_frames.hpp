#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "src/transport/http/output_parts.hpp"

namespace lrt::transport {

/// The server's side of one WebSocket (RFC 6455) after its opening handshake, without I/O: the client's bytes in, its messages out; our
/// messages in, bytes out. Frames and assembles messages, checks UTF-8, responds to pings, carries out the closing handshake. The owner has the
/// socket and the times.
///
/// None of the functions calls the owner or waits.
///
/// @par Implements  R0.12, RFC 6455
class WebSocketFrames {
 public:
  enum class State : unsigned char {
    open,
    closing,  ///< one side has sent a close; that of the other is awaited, or still in the output
    closed,   ///< the closing handshake is complete, and the output has been sent
    failed,   ///< the connection cannot be used any more
  };
  struct Message {
    std::string bytes;
    bool text = true;  ///< RFC 6455 5.6: checked to be UTF-8; else binary
  };

  virtual ~WebSocketFrames() = default;
  WebSocketFrames(const WebSocketFrames&) = delete;
  WebSocketFrames& operator=(const WebSocketFrames&) = delete;

  /// Takes all of these bytes of the client. To be called when next() has nothing and wants_input().
  virtual void receive(std::string_view bytes) = 0;
  /// The next complete message of the client. Bytes that break RFC 6455 begin the closing handshake: 1002, 1007, and 1009 for a message over
  /// the limit.
  virtual std::optional<Message> next() = 0;
  /// False while received bytes wait until the output has been sent.
  virtual bool wants_input() const noexcept = 0;

  /// One message as one frame. Only in the state `open`, and when there is no output but of messages. The message is not copied.
  virtual void send(std::shared_ptr<const std::string> message, bool text) = 0;
  /// An empty ping. Only in the state `open`, and when there is no output.
  virtual void ping() = 0;
  /// Begins the closing handshake after the output. Further messages of the client are read and dropped.
  /// @param reason  UTF-8; cut after the last character that ends within 123 bytes (RFC 6455 5.5)
  virtual void close(std::uint16_t code, std::string_view reason) = 0;

  virtual bool has_output() const noexcept = 0;
  /// Adds bytes to write now; valid until the next call of another function.
  virtual void add_output(OutputParts& parts) const noexcept = 0;
  virtual void sent(std::size_t bytes) = 0;

  virtual State state() const noexcept = 0;
  /// How many pings of the client got a pong until now. The owner limits them.
  virtual std::size_t pings() const noexcept = 0;

 protected:
  WebSocketFrames() = default;
};

/// Makes the WebSocketFrames of one transport, by Boost.Beast. One thread. Outlives what it makes.
class WebSocketFramer {
 public:
  /// Where Beast's streams post the completions that they do not call at once.
  class Queue;
  struct Handshake {
    std::string accept;                       ///< the value of Sec-WebSocket-Accept (RFC 6455 4.2.2)
    std::unique_ptr<WebSocketFrames> frames;
  };

  WebSocketFramer();
  ~WebSocketFramer();

  /// Accepts an opening handshake that http::check_websocket() has passed.
  /// @param key                Sec-WebSocket-Key
  /// @param max_message_bytes  of one message of the client; more: close 1009
  Handshake accept(std::string_view key, std::size_t max_message_bytes);

 private:
  std::unique_ptr<Queue> queue_;
};

}  // namespace lrt::transport
