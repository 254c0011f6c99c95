// SPDX-License-Identifier: Apache-2.0
#include "src/check/websocket.hpp"

#include <utility>

#include "src/http/websocket.hpp"

namespace lrt::check {
namespace {

using http::WebSocketFrames;

constexpr std::string_view ping_payload = "lrt check";
constexpr std::uint16_t normal = 1000, too_large = 1009;

}  // namespace

WebSocket::WebSocket(Probe& probe, const CheckOptions& options, const std::string& url, const FieldList& fields) : options_(options) {
  exchange_.url = url;
  const Result<http::Url> parts = url_of(url);
  if (!parts) {
    exchange_.reply.error = parts.error();
    return;
  }
  key_ = http::new_websocket_key();
  http::Fields own;
  for (const auto& [name, value] : fields) own.add(name, value);
  const std::string bytes = "GET " + parts->target + " HTTP/1.1\r\n" + probe.own_fields(url) +
                            "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + key_ + "\r\n" +
                            own.block() + "\r\n";
  exchange_.sent = probe.shown(url, bytes);
  Result<Connection> connection = probe.connect(url);
  if (!connection) {
    exchange_.reply.error = connection.error();
    return;
  }
  connection_.emplace(*std::move(connection));
  (void)connection_->write(bytes, probe.until());
  exchange_.reply = connection_->read("GET", probe.until(), false, options.close_time);
  if (exchange_.reply.status != 101) {
    connection_.reset();
    return;
  }
  frames_.emplace(options.max_body_bytes, WebSocketFrames::Side::client);
  frames_->receive(std::exchange(connection_->received(), {}));
}

bool WebSocket::accept_is_right() const { return exchange_.reply.field("Sec-WebSocket-Accept") == http::websocket_accept(key_); }

std::string WebSocket::field_fault() const { return http::opening_fault(exchange_.reply.fields); }

/// More bytes for the frames. False: none in time, or the end.
bool WebSocket::receive(exchange::Instant until) {
  if (!connection_->receive(until)) {
    closed_ = closed_ || connection_->ended();
    return false;
  }
  frames_->receive(std::exchange(connection_->received(), {}));
  return true;
}

void WebSocket::flush(exchange::Instant until) {
  while (frames_->has_output()) {
    OutputParts parts;
    frames_->add_output(parts);
    std::size_t size = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      (void)connection_->write({static_cast<const char*>(parts.data()[i].iov_base), parts.data()[i].iov_len}, until);
      size += parts.data()[i].iov_len;
    }
    frames_->sent(size);
  }
}

bool WebSocket::has_pong() const { return frames_->remarks().pong == ping_payload; }

std::optional<WebSocket::Message> WebSocket::message(exchange::Instant until) {
  while (connection_ && !closed_ && fault_.empty()) {
    if (std::optional<WebSocketFrames::Message> found = frames_->next()) return Message{found->text, std::move(found->bytes)};
    const WebSocketFrames::Remarks& remarks = frames_->remarks();
    if (remarks.fault == too_large)
      fault_ = "a message has more than " + std::to_string(options_.max_body_bytes) + " bytes, which is this check's limit";
    else if (remarks.fault != 0) fault_ = remarks.reason;
    if (remarks.close) closed_ = true;
    if (frames_->has_output()) flush(until);
    else if (has_pong() || (fault_.empty() && !closed_ && !receive(until))) break;
  }
  return std::nullopt;
}

bool WebSocket::ping(exchange::Instant until) {
  if (!connection_ || closed_ || frames_->state() != WebSocketFrames::State::open) return false;
  frames_->ping(ping_payload);
  flush(until);
  while (message(until)) {}
  return has_pong();
}

bool WebSocket::close(exchange::Instant until) {
  if (!connection_ || closed_ || frames_->state() != WebSocketFrames::State::open) return false;
  frames_->close(normal, {});
  flush(until);
  do {
    while (frames_->next()) {}
  } while (!frames_->remarks().close && frames_->remarks().fault == 0 && receive(until));
  closed_ = frames_->remarks().close.has_value();
  if (frames_->remarks().fault != 0) fault_ = frames_->remarks().reason;
  return closed_;
}

}  // namespace lrt::check
