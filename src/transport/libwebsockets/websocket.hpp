// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/engine/handler.hpp>
#include <lrt/http/message.hpp>

struct lws;
struct lws_process_html_args;

namespace lrt::libwebsockets {

class Vhost;
class Connection;

/// A connection after the WebSocket handshake: it carries the messages of a channel. libwebsockets handles frames, pings and the closing
/// handshake.
/// Return values are those of Connection.
///
/// @par Implements  R0.12, R0.14, RFC 6455
class WebSocket {
 public:
  WebSocket(Vhost& vhost, Connection& connection, lws* wsi) : vhost_(vhost), connection_(connection), wsi_(wsi) {}
  ~WebSocket() { end(); }
  WebSocket(const WebSocket&) = delete;
  WebSocket& operator=(const WebSocket&) = delete;

  /// Carries the messages of `channel`. If not called before the 101 is sent, the handler's decision is deferred.
  void accept(engine::Channel channel, http::Fields fields);
  /// Carries out a deferred refusal.
  void refuse(const http::Response& response);

  // Events of libwebsockets.
  int add_fields(lws_process_html_args& to);
  int on_open();
  int on_received(const char* bytes, std::size_t size);
  int on_client_close(std::string_view payload);
  int on_writable();
  /// Called when the connection has ended.
  void end() noexcept;

  /// Called when the channel has a message.
  void push();
  /// Closes with 1001.
  void begin_stop();

 private:
  int take_message();
  int close(std::uint16_t code, std::string_view reason);
  void close_later(std::uint16_t code, std::string reason);
  bool is_too_much(TimePoint now);
  /// libwebsockets has sent a Close frame, or is about to, perhaps for a reason of its own, which it does not report.
  bool has_closed() const noexcept;

  Vhost& vhost_;
  Connection& connection_;
  lws* const wsi_;
  std::optional<engine::Channel> channel_;
  http::Fields fields_;   ///< for the 101
  bool open_ = false;     ///< the 101 was sent
  bool pending_ = false;  ///< on_writable() was requested
  bool text_ = true;      ///< of the message that is being received
  std::string message_;
  std::uint16_t close_code_ = 0;  ///< not 0: to be sent next
  std::string close_reason_;
  std::chrono::steady_clock::time_point window_{};  ///< in which the client's messages are counted
  std::size_t window_messages_ = 0;
};

}  // namespace lrt::libwebsockets
