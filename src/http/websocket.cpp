// SPDX-License-Identifier: Apache-2.0
#include "src/http/websocket.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

#include "src/base/ascii.hpp"
#include "src/base/base64.hpp"
#include "src/base/random.hpp"
#include "src/base/utf8.hpp"

namespace lrt::http {
namespace {

/// Whether a member of a comma-separated list (RFC 9110 5.6.1) has `name` before the first `end`.
bool lists(std::string_view list, std::string_view name, char end, bool exact = false) noexcept {
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    const std::string_view member = detail::trim(list.substr(0, comma));
    const std::string_view found = member.substr(0, member.find(end));
    if (exact ? found == name : iequals(found, name)) return true;
    list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
  }
  return false;
}

/// The same for any of the fields of that name.
bool has_member(const Request& request, std::string_view field_name, std::string_view name, char end, bool exact = false) noexcept {
  for (const Field& field : request.fields)
    if (iequals(field.name, field_name) && lists(field.value, name, end, exact)) return true;
  return false;
}

/// 16 bytes in base64 (RFC 4648 4): 22 digits and two of padding.
bool is_key(std::string_view text) noexcept {
  if (text.size() != 24 || text.substr(22) != "==") return false;
  for (const char c : text.substr(0, 22)) {
    if (!detail::is_alpha(c) && !detail::is_digit(c) && c != '+' && c != '/') return false;
  }
  return true;
}

constexpr std::uint32_t rotated(std::uint32_t word, unsigned bits) noexcept { return word << bits | word >> (32 - bits); }

/// SHA-1 (RFC 3174). It is not used for security: by RFC 6455 1.3 it shows that the server supports WebSocket.
std::array<unsigned char, 20> sha1(std::string message) {
  const std::uint64_t bits = std::uint64_t{message.size()} * 8;
  message += '\x80';
  while (message.size() % 64 != 56) message += '\0';
  for (int shift = 56; shift >= 0; shift -= 8) message += static_cast<char>(bits >> shift);
  std::array<std::uint32_t, 5> hash{0x67452301, 0xEFCDAB89, 0x98BADCFE, 0x10325476, 0xC3D2E1F0};
  for (std::size_t block = 0; block < message.size(); block += 64) {
    std::array<std::uint32_t, 80> w{};
    for (std::size_t i = 0; i < 64; ++i) w[i / 4] = w[i / 4] << 8 | static_cast<unsigned char>(message[block + i]);
    for (std::size_t i = 16; i < 80; ++i) w[i] = rotated(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
    auto [a, b, c, d, e] = hash;
    for (std::size_t i = 0; i < 80; ++i) {
      std::uint32_t mixed = 0;
      if (i < 20) mixed = ((b & c) | (~b & d)) + 0x5A827999;
      else if (i < 40) mixed = (b ^ c ^ d) + 0x6ED9EBA1;
      else if (i < 60) mixed = ((b & c) | (b & d) | (c & d)) + 0x8F1BBCDC;
      else mixed = (b ^ c ^ d) + 0xCA62C1D6;
      const std::uint32_t next = rotated(a, 5) + mixed + e + w[i];
      e = d;
      d = c;
      c = rotated(b, 30);
      b = a;
      a = next;
    }
    const std::array<std::uint32_t, 5> added{a, b, c, d, e};
    for (std::size_t i = 0; i < 5; ++i) hash[i] += added[i];
  }
  std::array<unsigned char, 20> bytes{};
  for (std::size_t i = 0; i < 20; ++i) bytes[i] = static_cast<unsigned char>(hash[i / 4] >> (24 - 8 * (i % 4)));
  return bytes;
}

}  // namespace

bool requests_upgrade(const Request& request, std::string_view protocol) noexcept { return has_member(request, "Upgrade", protocol, '/'); }

bool offers_subprotocol(const Request& request, std::string_view name) noexcept {
  // RFC 6455 4.2.2: the response repeats it as it was offered.
  return has_member(request, "Sec-WebSocket-Protocol", name, ',', true);
}

std::optional<Refusal> check_websocket(const Request& request) {
  if (request.method != "GET") return Refusal{400, "WebSocket: expected the method GET (RFC 6455 4.1)"};
  if (request.version != 11) return Refusal{400, "WebSocket: expected HTTP/1.1 (RFC 6455 4.1)"};
  if (!request.body.empty()) { return Refusal{400, "WebSocket: expected no body, found one of " + std::to_string(request.body.size()) + " bytes"}; }
  if (!requests_upgrade(request, "websocket")) return Refusal{400, "Upgrade: expected \"websocket\""};
  if (!has_member(request, "Connection", "upgrade", ',')) return Refusal{400, "Connection: expected \"upgrade\" (RFC 9110 7.8)"};
  const std::size_t versions = request.count("Sec-WebSocket-Version");
  if (versions != 1 || request.find("Sec-WebSocket-Version") != "13") {
    return Refusal{426,
                   versions > 1 ? "Sec-WebSocket-Version: expected one, found " + std::to_string(versions) : "Sec-WebSocket-Version: expected 13"};
  }
  const std::size_t keys = request.count("Sec-WebSocket-Key");
  if (keys != 1) return Refusal{400, "Sec-WebSocket-Key: expected one, found " + std::to_string(keys)};
  if (!is_key(*request.find("Sec-WebSocket-Key"))) return Refusal{400, "Sec-WebSocket-Key: expected 16 bytes in base64"};
  return std::nullopt;
}

std::string websocket_accept(std::string_view key) {
  const std::array<unsigned char, 20> digest = sha1(std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11");
  return detail::base64({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

std::string new_websocket_key() {
  std::array<unsigned char, 16> nonce{};
  fill_random(nonce.data(), nonce.size());
  return detail::base64({reinterpret_cast<const char*>(nonce.data()), nonce.size()});
}

std::string opening_fault(const Fields& fields, std::string_view protocol) {
  if (!iequals(fields.find("Upgrade").value_or(std::string_view()), "websocket")) return "Upgrade is not \"websocket\"";
  if (!lists(fields.joined("Connection"), "upgrade", ',')) return "Connection does not name Upgrade";
  if (fields.find("Sec-WebSocket-Extensions")) return "an extension is there that was not offered";
  const std::string chosen = fields.joined("Sec-WebSocket-Protocol");
  if (!chosen.empty() && chosen != protocol) return "a subprotocol is there that was not offered";
  return {};
}

bool is_close_payload(std::string_view payload) noexcept {
  if (payload.empty()) return true;
  if (payload.size() == 1) return false;
  const unsigned code = static_cast<unsigned char>(payload[0]) * 256U + static_cast<unsigned char>(payload[1]);
  const bool may_be_sent = (code >= 1000 && code <= 1003) || (code >= 1007 && code <= 1013) || (code >= 3000 && code <= 4999);
  return may_be_sent && !utf8::find_invalid(payload.substr(2));
}

}  // namespace lrt::http
