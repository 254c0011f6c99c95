// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>

#include "src/base/output_parts.hpp"

namespace lrt::http {

/// One side of a WebSocket (RFC 6455) after its opening handshake, without I/O: the peer's bytes in, its messages out; our messages in,
/// bytes out. Frames and assembles messages, checks UTF-8, responds to pings, carries out the closing handshake. The owner has the socket and
/// the times.
///
/// The frames of a client are masked, and those of a server are not (RFC 6455 5.1). A client also records what the server says beside messages:
/// its close, its last pong, what it has broken.
///
/// No function calls the owner or blocks. The buffers exist only while bytes are pending.
///
/// @par Implements  R0.12, RFC 6455
class LRT_INTERNAL_API WebSocketFrames {
 public:
  enum class Side : unsigned char { server, client };
  enum class State : unsigned char {
    open,
    closing,  ///< one side has sent a close; that of the other is awaited, or still in the output
    closed,   ///< the closing handshake is complete, or the peer has broken RFC 6455, and the output has been sent
  };
  struct Message {
    std::string bytes;
    bool text = true;  ///< RFC 6455 5.6: checked to be UTF-8; else binary
  };

  /// What a server says beside messages.
  struct Remarks {
    std::optional<std::string> pong{};   ///< the payload of the last one
    std::optional<std::string> close{};  ///< the payload of its close: a code and a reason, or nothing
    std::uint16_t fault = 0;             ///< the code of our close, because it has broken RFC 6455 or exceeded the limit; 0: it has not
    const char* reason = "";             ///< of the fault, with the clause
  };

  /// @param max_message_bytes  of one message of the peer, at least 1; more: close 1009
  explicit WebSocketFrames(std::size_t max_message_bytes, Side side = Side::server);
  ~WebSocketFrames();
  WebSocketFrames(const WebSocketFrames&) = delete;
  WebSocketFrames& operator=(const WebSocketFrames&) = delete;

  /// Takes all of these bytes of the peer. To be called when next() has nothing and wants_input().
  void receive(std::string_view bytes);
  /// The next complete message of the peer. Bytes that break RFC 6455 end the connection with a close: 1002, 1007, and 1009 for a message
  /// over the limit.
  std::optional<Message> next();
  /// False while received bytes wait: for next(), or until the output has been sent.
  bool wants_input() const noexcept { return !over_ && !has_unread_ && control_.empty(); }

  /// One message as one frame. Only in the state `open`, and when there is no output but of messages. A server's message is not copied.
  void send(std::shared_ptr<const std::string> message, bool text);
  /// A ping with a payload of at most 125 bytes. Only in the state `open`, and when there is no output.
  void ping(std::string_view payload = {});
  /// Begins the closing handshake after the output. Further messages of the peer are read and dropped.
  /// @param reason  UTF-8; cut after the last character that ends within 123 bytes (RFC 6455 5.5)
  void close(std::uint16_t code, std::string_view reason);

  bool has_output() const noexcept { return !outgoing_.empty() || !control_.empty(); }
  /// Adds bytes to write now; valid until the next call of another function.
  void add_output(OutputParts& parts) const noexcept;
  void sent(std::size_t bytes);

  State state() const noexcept {
    if (over_) return has_output() ? State::closing : State::closed;
    return closing_ ? State::closing : State::open;
  }
  /// How many pings of the peer got a pong until now. The owner limits them.
  std::size_t pings() const noexcept { return pings_; }
  /// @pre this is a client
  const Remarks& remarks() const noexcept { return *remarks_; }

 private:
  static constexpr std::size_t mask_bytes = 4;

  /// A message and its header: a server's frame has no mask, so the bytes of the message are shared by all clients that get it.
  struct Outgoing {
    std::shared_ptr<const std::string> message;
    std::array<char, 10> header;
    unsigned char header_size;
    std::size_t size() const noexcept { return header_size + message->size(); }
  };
  /// A control frame of the peer, whole and unmasked.
  struct Frame {
    unsigned opcode;
    std::string_view payload;
  };

  std::optional<Frame> take_frame();
  std::optional<Message> take_payload();
  bool check_text(bool is_whole);
  bool is_client() const noexcept { return remarks_ != nullptr; }
  const char* broken_rule(unsigned char first, unsigned char second) const noexcept;
  void take_control(const Frame& frame);
  void take_close(std::string_view payload);
  void add_control(unsigned opcode, std::string_view payload);
  void add_close(std::uint16_t code, std::string_view reason);
  void fail(std::uint16_t code, const char* reason);
  void end() noexcept;

  const std::size_t max_message_bytes_;
  std::vector<Outgoing> outgoing_;
  std::size_t first_ = 0;       ///< of outgoing_, not yet sent
  std::size_t first_sent_ = 0;  ///< bytes of that
  std::string control_;         ///< control frames, sent after the messages; all frames of a client
  std::size_t control_sent_ = 0;
  std::string input_;  ///< from a frame on that is not complete or not read
  std::size_t used_ = 0;
  std::string message_;      ///< of the peer, as far as it was received
  std::size_t checked_ = 0;  ///< bytes of it that are whole characters
  std::size_t pings_ = 0;
  std::size_t left_ = 0;                 ///< of the payload of a data frame
  std::size_t mask_at_ = 0;              ///< of mask_, for the next byte
  std::array<char, mask_bytes> mask_{};  ///< zero for a client
  std::unique_ptr<Remarks> remarks_;     ///< nullptr: this is a server
  bool has_unread_ = false;              ///< input_ may have a whole frame
  bool in_payload_ = false;              ///< of a data frame
  bool in_message_ = false;              ///< a continuation must follow
  bool is_text_ = true;                  ///< message_ is
  bool closing_ = false;                 ///< a close of ours is in the output or was sent
  bool over_ = false;                    ///< nothing more is read
};

}  // namespace lrt::http
