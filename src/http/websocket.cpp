#include <lrt/http/websocket.hpp>

#include <string>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

/// Whether a member of a comma-separated list (RFC 9110 5.6.1) in any of the fields of that name has `name` before the first `end`.
bool has_member(const Request& request, std::string_view field_name, std::string_view name, char end) noexcept {
  for (const Field& field : request.fields) {
    if (!iequals(field.name, field_name)) continue;
    for (std::string_view list = field.value; !list.empty();) {
      const std::size_t comma = list.find(',');
      const std::string_view member = detail::trim(list.substr(0, comma));
      if (iequals(member.substr(0, member.find(end)), name)) return true;
      list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
    }
  }
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

}  // namespace

bool requests_upgrade(const Request& request, std::string_view protocol) noexcept {
  return has_member(request, "Upgrade", protocol, '/');
}

std::optional<Refusal> check_websocket(const Request& request) {
  if (request.method != "GET") return Refusal{400, "WebSocket: expected the method GET (RFC 6455 4.1)"};
  if (request.version != 11) return Refusal{400, "WebSocket: expected HTTP/1.1 (RFC 6455 4.1)"};
  if (!request.body.empty()) {
    return Refusal{400, "WebSocket: expected no body, found one of " + std::to_string(request.body.size()) + " bytes"};
  }
  if (!requests_upgrade(request, "websocket")) return Refusal{400, "Upgrade: expected \"websocket\""};
  if (!has_member(request, "Connection", "upgrade", ',')) return Refusal{400, "Connection: expected \"upgrade\" (RFC 9110 7.8)"};
  const std::size_t versions = request.count("Sec-WebSocket-Version");
  if (versions != 1 || request.find("Sec-WebSocket-Version") != "13") {
    return Refusal{426, versions > 1 ? "Sec-WebSocket-Version: expected one, found " + std::to_string(versions)
                                     : "Sec-WebSocket-Version: expected 13"};
  }
  const std::size_t keys = request.count("Sec-WebSocket-Key");
  if (keys != 1) return Refusal{400, "Sec-WebSocket-Key: expected one, found " + std::to_string(keys)};
  if (!is_key(*request.find("Sec-WebSocket-Key"))) return Refusal{400, "Sec-WebSocket-Key: expected 16 bytes in base64"};
  return std::nullopt;
}

}  // namespace lrt::http
