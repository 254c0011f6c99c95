// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/websocket.hpp"

#include <libwebsockets.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "src/base/utf8.hpp"
#include "src/http/websocket.hpp"
#include "src/transport/libwebsockets/vhost.hpp"

namespace lrt::libwebsockets {
namespace {

/// Bytes of a close's reason (RFC 6455 5.5).
constexpr std::size_t max_reason_bytes = 123;
/// Bytes that the system may accept beyond the client's window: with more, a slow client gets old values.
constexpr int unsent_bytes = 32 * 1024;

}  // namespace

void WebSocket::accept(engine::Channel channel, http::Fields fields) {
  channel_ = channel;
  fields_ = std::move(fields);
  fields_.remove("Sec-WebSocket-Protocol");  // libwebsockets adds it
  vhost_.channels.emplace(static_cast<std::uint64_t>(channel), &connection_);
  push();
}

void WebSocket::refuse(const http::Response& response) {
  const std::uint16_t code = response.status == 503 ? 1013 : response.status >= 500 ? 1011 : 1008;
  close_later(code, "HTTP " + std::to_string(response.status) + " " + std::string(http::reason_phrase(response.status)));
}

int WebSocket::add_fields(lws_process_html_args& to) {
  const TimePoint now = vhost_.now();
  fields_.set("Date", vhost_.date(now));
  if (const http::Fields* const more = vhost_.common_fields(now)) fields_.append(*more);
  const std::string& block = fields_.block();
  if (static_cast<std::size_t>(std::max(to.max_len, 0)) < block.size() + 2) return -1;
  std::memcpy(to.p, block.data(), block.size());
  to.p += block.size();
  return 0;
}

int WebSocket::on_open() {
  open_ = true;
  fields_ = {};
  ::setsockopt(lws_get_socket_fd(wsi_), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof unsent_bytes);
  window_ = vhost_.now().steady;
  push();
  return 0;
}

int WebSocket::on_received(const char* bytes, std::size_t size) {
  if (close_code_ != 0 || has_closed()) return 0;
  if (lws_is_first_fragment(wsi_) == 1) {
    text_ = lws_frame_is_binary(wsi_) == 0;
    message_.clear();
  }
  const auto limit = vhost_.options().limits.max_websocket_message_bytes;
  if (size + lws_remaining_packet_payload(wsi_) > limit - std::min(limit, message_.size()))
    return close(1009, "at most " + std::to_string(limit) + " bytes");
  if (size > 0) message_.append(bytes, size);
  if (lws_is_final_fragment(wsi_) == 0 || lws_remaining_packet_payload(wsi_) != 0) return 0;
  return take_message();
}

/// libwebsockets responds to a close with the same payload, and does not see whether that is allowed.
int WebSocket::on_client_close(std::string_view payload) { return http::is_close_payload(payload) ? 0 : close(1002, {}); }

int WebSocket::take_message() {
  const auto now = vhost_.now();
  if (is_too_much(now)) return close(1008, "too many messages");
  if (text_ && utf8::find_invalid(message_)) return close(1007, "not UTF-8");
  if (channel_) vhost_.handler().received(*channel_, message_, text_, now);
  message_.clear();
  push();
  return 0;
}

/// Counts messages in windows of ping_interval. A window begins with the first message after the previous one.
bool WebSocket::is_too_much(TimePoint now) {
  const auto& limits = vhost_.options().limits;
  if (now.steady - window_ >= limits.ping_interval) {
    window_ = now.steady;
    window_messages_ = 0;
  }
  return ++window_messages_ > limits.max_websocket_messages;
}

int WebSocket::on_writable() {
  pending_ = false;
  if (has_closed()) return 0;  // nothing follows a Close frame (RFC 6455 5.5.1); the time for the client's is running
  lws_set_timeout(wsi_, NO_PENDING_TIMEOUT, 0);
  if (close_code_ != 0) return close(close_code_, close_reason_);
  if (!channel_) return 0;
  const auto push = vhost_.handler().next_push(*channel_, vhost_.now());
  if (!push) return 0;
  if (push->close != 0) return close(push->close, push->reason);
  const std::string_view message = push->message ? std::string_view(*push->message) : std::string_view();
  unsigned char* const bytes = vhost_.scratch(message.size());
  std::copy(message.begin(), message.end(), bytes);
  if (lws_write(wsi_, bytes, message.size(), push->text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY) < 0) return -1;
  this->push();
  return 0;
}

/// libwebsockets sends the reason when the callback returns what this returns.
int WebSocket::close(std::uint16_t code, std::string_view reason) {
  const std::string_view text = utf8::prefix(reason, max_reason_bytes);
  std::string bytes(text);
  lws_close_reason(wsi_, static_cast<lws_close_status>(code), reinterpret_cast<unsigned char*>(bytes.data()), bytes.size());
  end();
  return -1;
}

void WebSocket::close_later(std::uint16_t code, std::string reason) {
  close_code_ = code;
  close_reason_ = std::move(reason);
  push();
}

void WebSocket::push() {
  if (!open_ || has_closed() || std::exchange(pending_, true)) return;
  // A client that does not read is disconnected. Each sent message restarts the time.
  lws_set_timeout(wsi_, PENDING_TIMEOUT_USER_OK, to_seconds(vhost_.options().limits.write_timeout));
  lws_callback_on_writable(wsi_);
}

bool WebSocket::has_closed() const noexcept { return open_ && lws_get_close_length(wsi_) > 0; }

void WebSocket::begin_stop() { close_later(1001, {}); }

void WebSocket::end() noexcept {
  if (!channel_) return;
  vhost_.channels.erase(static_cast<std::uint64_t>(*channel_));
  if (vhost_.is_open()) vhost_.handler().closed(*channel_);
  channel_.reset();
}

}  // namespace lrt::libwebsockets
