// SPDX-License-Identifier: Apache-2.0
#include "src/check/websocket.hpp"

#include <algorithm>

#include "src/base/ascii.hpp"
#include "src/base/base64.hpp"
#include "src/base/random.hpp"
#include "src/http/websocket.hpp"

namespace lrt::check {
namespace {

constexpr unsigned text_opcode = 1, binary_opcode = 2, close_opcode = 8, ping_opcode = 9, pong_opcode = 10;
constexpr std::string_view ping_payload = "lrt check";

bool has_token(std::string_view list, std::string_view token) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    if (lrt::detail::iequals_ascii(lrt::detail::trim(list.substr(0, end)), token)) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

}  // namespace

WebSocket::WebSocket(Probe& probe, const CheckOptions& options, const std::string& url, const FieldList& fields) : options_(options) {
  exchange_.url = url;
  const Result<http::Url> parts = url_of(url);
  if (!parts) {
    exchange_.reply.error = parts.error();
    return;
  }
  unsigned char nonce[16];
  fill_random(nonce, sizeof nonce);
  key_ = lrt::detail::base64(std::string_view(reinterpret_cast<const char*>(nonce), sizeof nonce));
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
  if (exchange_.reply.status != 101) connection_.reset();
}

bool WebSocket::accept_is_right() const { return exchange_.reply.field("Sec-WebSocket-Accept") == http::websocket_accept(key_); }

std::string WebSocket::field_fault() const {
  const http::Fields& fields = exchange_.reply.fields;
  if (!lrt::detail::iequals_ascii(exchange_.reply.field("Upgrade"), "websocket")) return "Upgrade is not \"websocket\"";
  if (!has_token(fields.joined("Connection"), "upgrade")) return "Connection does not name Upgrade";
  if (fields.find("Sec-WebSocket-Extensions")) return "an extension is there that was not offered";
  if (fields.find("Sec-WebSocket-Protocol")) return "a subprotocol is there that was not offered";
  return {};
}

std::optional<WebSocket::Frame> WebSocket::frame(exchange::Instant until) {
  if (!connection_ || closed_ || !fault_.empty()) return std::nullopt;
  std::string& in = connection_->received();
  const auto byte = [&in](std::size_t at) { return static_cast<unsigned>(static_cast<unsigned char>(in[at])); };
  const auto have = [&](std::size_t size) {
    while (in.size() < size)
      if (!connection_->receive(until)) return false;
    return true;
  };
  if (!have(2)) {
    if (connection_->ended()) closed_ = true;
    return std::nullopt;
  }
  if ((byte(0) & 0x70U) != 0) fault_ = "a reserved bit is set, and no extension was agreed on (RFC 6455 5.2)";
  if ((byte(1) & 0x80U) != 0) fault_ = "a frame of the server is masked (RFC 6455 5.1)";
  const unsigned opcode = byte(0) & 15U;
  if (opcode > binary_opcode && (opcode < close_opcode || opcode > pong_opcode))
    fault_ = "a frame has the reserved opcode " + std::to_string(opcode) + " (RFC 6455 5.2)";
  if (!fault_.empty()) return std::nullopt;
  std::size_t head = 2;
  std::uint64_t size = byte(1) & 0x7FU;
  if (size >= 126) {
    const std::size_t more = size == 126 ? 2 : 8;
    if (!have(head + more)) return std::nullopt;
    size = 0;
    for (std::size_t i = 0; i < more; ++i) size = (size << 8U) | byte(head + i);
    head += more;
  }
  if (opcode >= close_opcode && (size > 125 || (byte(0) & 0x80U) == 0)) {
    fault_ = "a control frame is longer than 125 bytes or fragmented (RFC 6455 5.5)";
    return std::nullopt;
  }
  if (size > options_.max_body_bytes) {
    fault_ = "a frame has more than " + std::to_string(options_.max_body_bytes) + " bytes, which is this check's limit";
    return std::nullopt;
  }
  if (!have(head + static_cast<std::size_t>(size))) return std::nullopt;
  Frame f{opcode, (byte(0) & 0x80U) != 0, in.substr(head, static_cast<std::size_t>(size))};
  in.erase(0, head + static_cast<std::size_t>(size));
  return f;
}

void WebSocket::send(unsigned opcode, std::string_view payload, exchange::Instant until) {
  unsigned char mask[4];
  fill_random(mask, sizeof mask);
  std::string bytes{static_cast<char>(0x80U | opcode), static_cast<char>(0x80U | payload.size())};  // payloads here have at most 125 bytes
  bytes.append(reinterpret_cast<const char*>(mask), sizeof mask);
  for (std::size_t i = 0; i < payload.size(); ++i) bytes += static_cast<char>(static_cast<unsigned char>(payload[i]) ^ mask[i % 4]);
  (void)connection_->write(bytes, until);
}

std::optional<WebSocket::Message> WebSocket::message(exchange::Instant until) {
  Message message;
  bool begun = false;
  while (auto f = frame(until)) {
    if (f->opcode == ping_opcode) {
      send(pong_opcode, f->payload, until);
    } else if (f->opcode == pong_opcode) {
      pong_ = std::move(f->payload);
      return std::nullopt;
    } else if (f->opcode == close_opcode) {
      closed_ = true;
    } else {
      if (begun != (f->opcode == 0)) {
        fault_ = "a message begins within another, or a continuation without one (RFC 6455 5.4)";
        return std::nullopt;
      }
      if (!begun) message.text = f->opcode == text_opcode;
      begun = true;
      message.payload += f->payload;
      if (message.payload.size() > options_.max_body_bytes) {
        fault_ = "a message has more than " + std::to_string(options_.max_body_bytes) + " bytes, which is this check's limit";
        return std::nullopt;
      }
      if (f->fin) return message;
    }
  }
  return std::nullopt;
}

bool WebSocket::ping(exchange::Instant until) {
  pong_.reset();
  send(ping_opcode, ping_payload, until);
  while (message(until)) {}
  return pong_ && *pong_ == ping_payload;
}

bool WebSocket::close(exchange::Instant until) {
  if (closed_ || !connection_) return false;
  send(close_opcode, std::string_view("\x03\xE8", 2), until);
  while (!closed_ && fault_.empty() && !connection_->ended()) {
    const std::optional<Frame> f = frame(until);
    if (!f) return false;
    if (f->opcode == close_opcode) {
      closed_ = true;
      return true;
    }
  }
  return false;
}

}  // namespace lrt::check
