// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/engine/handler.hpp>
#include <lrt/http/request_parser.hpp>
#include <lrt/http/message.hpp>

#include "src/transport/body_buffer.hpp"
#include "src/transport/libwebsockets/incoming.hpp"
#include "src/transport/libwebsockets/websocket.hpp"

struct lws;

namespace lrt::libwebsockets {

class Vhost;

/// A client's connection: one request after another, until it becomes a WebSocket or an event stream. Each function that libwebsockets
/// calls returns 0, or -1: libwebsockets is to close the connection when what was written has left.
///
/// @par Implements  R0.1
class Connection {
 public:
  Connection(Vhost& vhost, lws* wsi);
  ~Connection() { end(); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Events of libwebsockets.
  int on_request();
  int on_body(std::string_view part);
  int on_body_end();
  int on_writable();
  int on_timer();
  int on_upgrade();
  WebSocket* websocket() noexcept { return websocket_.get(); }
  /// Reports the disconnected client to the handler.
  void end() noexcept;

  // Output of the handler.
  void reply(engine::Reply reply);
  /// The channel has a message.
  void push();

  void begin_stop();
  bool is_busy() const noexcept;
  bool is_idle() const noexcept { return phase_ == Phase::idle; }
  bool is_incomplete() const noexcept { return phase_ == Phase::idle || phase_ == Phase::reading; }
  std::chrono::steady_clock::time_point idle_since() const noexcept { return idle_since_; }
  /// Beyond the limit: serves one request that stops the robot, and refuses others.
  void serve_only_stops() noexcept { only_stops_ = true; }
  bool serves_only_stops() const noexcept { return only_stops_; }
  /// Another client needs its place: ends it soon. A stop that arrives before that is served, and another request refused.
  void give_way() noexcept;
  /// Closes it soon, without a response.
  void kill() noexcept;
  bool is_dying() const noexcept { return dying_; }
  const std::string& peer() const noexcept { return peer_; }

 private:
  enum class Phase : unsigned char { idle, reading, waiting, writing, streaming, upgraded };

  std::optional<http::Refusal> read_request();
  bool is_pipelined() const;
  int receive_body();
  int dispatch();
  int respond(http::Response response);
  /// @param retry_after  of a 503, in seconds
  int refuse(http::Refusal refusal, std::string_view retry_after = "0");
  int refuse_size(std::size_t limit);
  void prepare(http::Response response);
  void prepare_stream(engine::Channel channel, const http::Response& response);
  int write();
  int write_stream();
  int finish();
  void stop_reading();
  void wait_for_writable();
  bool has_output() const noexcept;

  Vhost& vhost_;
  lws* const wsi_;
  std::string peer_;
  std::string client_certificate_;
  Phase phase_ = Phase::idle;
  std::chrono::steady_clock::time_point idle_since_;
  std::size_t requests_ = 0;

  Incoming incoming_;
  http::Framing framing_;
  transport::BodyBuffer body_;
  std::optional<http::Response> refusal_;  ///< when the body, which is discarded, is over
  std::size_t discarded_body_bytes_ = 0;

  bool only_stops_ = false;
  bool dying_ = false;
  bool ignores_body_ = false;  ///< the body is discarded, and the request served
  bool reusable_ = false;      ///< another request may follow
  std::optional<engine::Ticket> ticket_;
  std::optional<engine::Channel> stream_;
  bool owes_comment_ = false;  ///< the event stream was silent for long
  std::string out_;
  std::shared_ptr<const std::string> out_body_;  ///< behind out_
  std::size_t written_ = 0;                      ///< of both

  std::unique_ptr<WebSocket> websocket_;
};

}  // namespace lrt::libwebsockets
