// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "src/check/probe.hpp"
#include "src/http/websocket_frames.hpp"

namespace lrt::check {

/// The client's side of a WebSocket (RFC 6455), as strict about the server as the RFC is.
class WebSocket {
 public:
  struct Message {
    bool text = true;
    std::string payload;
  };

  /// Sends the opening handshake. The response is in exchange(); is_open(): its status is 101.
  WebSocket(Probe& probe, const CheckOptions& options, const std::string& url, const FieldList& fields);

  const Exchange& exchange() const noexcept { return exchange_; }
  bool is_open() const noexcept { return connection_.has_value() && exchange_.reply.status == 101; }
  /// Describes an error in the header fields of the 101 besides Sec-WebSocket-Accept; empty: there is none.
  std::string field_fault() const;
  bool accept_is_right() const;

  /// The next complete message; nullopt: none in time, or fault() or the end. A ping of the server is answered.
  std::optional<Message> message(exchange::Instant until);
  /// Whether a ping has its pong. Messages meanwhile are dropped.
  bool ping(exchange::Instant until);
  /// Whether a close has its close.
  bool close(exchange::Instant until);
  /// The server has closed the WebSocket, or ended the connection.
  bool is_closed() const noexcept { return closed_; }
  /// Describes the error in a frame; empty: there is none.
  const std::string& fault() const noexcept { return fault_; }

 private:
  bool receive(exchange::Instant until);
  void flush(exchange::Instant until);
  bool has_pong() const;

  const CheckOptions& options_;
  Exchange exchange_;
  std::optional<Connection> connection_;
  std::optional<http::WebSocketFrames> frames_;
  std::string key_, fault_;
  bool closed_ = false;
};

}  // namespace lrt::check
