// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/incoming.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <utility>

#include "src/base/ascii.hpp"

namespace lrt::libwebsockets {
namespace {

constexpr std::pair<lws_token_indexes, std::string_view> methods[] = {
    {WSI_TOKEN_GET_URI, "GET"}, {WSI_TOKEN_HEAD_URI, "HEAD"},     {WSI_TOKEN_POST_URI, "POST"},
#if defined(LWS_WITH_HTTP_UNCOMMON_HEADERS) || defined(LWS_HTTP_HEADERS_ALL)
    {WSI_TOKEN_PUT_URI, "PUT"}, {WSI_TOKEN_DELETE_URI, "DELETE"}, {WSI_TOKEN_OPTIONS_URI, "OPTIONS"}, {WSI_TOKEN_PATCH_URI, "PATCH"},
#endif
};

#if defined(LWS_WITH_CUSTOM_HEADERS) && LWS_LIBRARY_VERSION_NUMBER < 4003000
/// Fields that libwebsockets has no token for, by name because 4.1 does not list them.
constexpr std::string_view other_names[] = {
    "callback:",
    "prefer:",
    "lrt-notification-of:",
    "last-event-id:",
    "start-before:",
    "control-id:",
    "take-over:",
    "valid-until:",
    "user-agent:",
    "access-control-request-method:",
    "access-control-request-private-network:",
    "forwarded:",
    "x-forwarded-host:",
    "x-forwarded-proto:",
    "x-forwarded-prefix:",
    "x-api-key:",
    "sec-fetch-site:",
    "sec-fetch-mode:",
    "sec-fetch-dest:",
    "traceparent:",
    "dnt:",
    "slug:",
};
#endif

/// The bytes of one of the fragments of a token, which are the fields of one name or the parts of a query; nullopt if there are no more.
/// Appended to `text`.
bool append_fragment(lws* wsi, lws_token_indexes token, int fragment, std::string& text) {
  const auto begin = text.size();
  const auto capacity = static_cast<std::size_t>(std::max(lws_hdr_total_length(wsi, token), 0)) + 1;
  text.resize(begin + capacity);
  const int size = lws_hdr_copy_fragment(wsi, text.data() + begin, static_cast<int>(capacity), token, fragment);
  text.resize(begin + static_cast<std::size_t>(std::max(size, 0)));
  return size >= 0;
}

/// Percent-encodes what libwebsockets has decoded (RFC 3986 3.3, 3.4).
/// @param others  characters that stay as they are, beside unreserved and sub-delims
void append_encoded(std::string& out, std::string_view decoded, std::string_view others) {
  constexpr std::string_view sub_delims = "!$'()*,;=";
  for (const char c : decoded) {
    if (detail::is(c, detail::unreserved) || sub_delims.find(c) != std::string_view::npos || others.find(c) != std::string_view::npos) out += c;
    else detail::append_percent(out, c);
  }
}

bool is_text(std::string_view value) noexcept {
  return std::all_of(value.begin(), value.end(), [](char c) { return detail::is(c, detail::text); });
}

}  // namespace

std::optional<http::Refusal> Incoming::read(lws* wsi, http::Framing& framing) {
  text_.clear();
  lines_.clear();
  request.fields.clear();
  request.body = {};
  Piece target{};
  if (auto refusal = read_request_line(wsi, target)) return refusal;
  read_known_fields(wsi);
  read_other_fields(wsi);
  request.target = view(target);
  for (const auto& line : lines_) {
    request.fields.push_back({view(line.name), detail::trim(view(line.value))});
    if (!is_text(request.fields.back().value))
      return http::Refusal{400, "value of field " + std::string(request.fields.back().name) + ": found a control character"};
  }
  return http::check_request(request, framing);
}

std::optional<http::Refusal> Incoming::read_request_line(lws* wsi, Piece& target) {
  const std::pair<lws_token_indexes, std::string_view>* found = nullptr;
  for (const auto& method : methods) {
    if (lws_hdr_total_length(wsi, method.first) <= 0) continue;
    if (found != nullptr) return http::Refusal{400, "request line: found more than one method"};
    found = &method;
  }
  if (found == nullptr) return http::Refusal{501, "method: expected one that this server knows"};
  request.method = found->second;

  std::string decoded;
  append_fragment(wsi, WSI_TOKEN_HTTP, 0, decoded);
  const auto version = http::spoken_version(decoded);
  if (!version) return http::Refusal{505, "request line: expected HTTP/1.1 or HTTP/1.0"};
  request.version = *version;

  decoded.clear();
  append_fragment(wsi, found->first, 0, decoded);
  append_encoded(text_, decoded, ":@/&");
  if (lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_URI_ARGS) > 0) {
    decoded.clear();
    for (int part = 0; append_fragment(wsi, WSI_TOKEN_HTTP_URI_ARGS, part, decoded); ++part) {
      text_ += part == 0 ? '?' : '&';
      const auto begin = text_.size();
      append_encoded(text_, decoded, ":@/? ");
      std::replace(text_.begin() + static_cast<std::ptrdiff_t>(begin), text_.end(), ' ',
                   '+');  // as it was sent: media types have it
      decoded.clear();
    }
  }
  target = {0, text_.size()};
  return std::nullopt;
}

void Incoming::read_known_fields(lws* wsi) {
  for (int index = 0; index < WSI_TOKEN_COUNT; ++index) {
    const auto token = static_cast<lws_token_indexes>(index);
    const auto* const known = reinterpret_cast<const char*>(lws_token_to_string(token));
    const auto name = std::string_view(known != nullptr ? known : "");
    if (name.size() < 2 || name.front() == ':' || name.back() != ':') continue;  // a method, a query, a pseudo-field of HTTP/2
    Piece named{};
    for (int fragment = 0;; ++fragment) {  // a field with an empty value has one, too
      const auto begin = text_.size();
      if (!append_fragment(wsi, token, fragment, text_)) break;
      const Piece value{begin, text_.size() - begin};
      if (fragment == 0) {
        named = {text_.size(), name.size() - 1};
        text_ += name.substr(0, named.size);
      }
      lines_.push_back({named, value});
    }
  }
}

#if defined(LWS_WITH_CUSTOM_HEADERS)

void Incoming::read_other_field(lws* wsi, std::string_view name_with_colon) {
  const int name_size = static_cast<int>(name_with_colon.size());
  const int size = lws_hdr_custom_length(wsi, name_with_colon.data(), name_size);
  if (size < 0) return;
  const Piece named{text_.size(), name_with_colon.size() - 1};
  text_ += name_with_colon.substr(0, named.size);
  const auto begin = text_.size();
  text_.resize(begin + static_cast<std::size_t>(size) + 1);
  const int got = lws_hdr_custom_copy(wsi, text_.data() + begin, size + 1, name_with_colon.data(), name_size);
  text_.resize(begin + static_cast<std::size_t>(std::max(got, 0)));
  if (got >= 0) lines_.push_back({named, {begin, text_.size() - begin}});
}

void Incoming::read_other_fields(lws* wsi) {
#if LWS_LIBRARY_VERSION_NUMBER >= 4003000
  std::vector<std::string> names;
  lws_hdr_custom_name_foreach(
      wsi,
      [](const char* name, int size, void* to) { static_cast<std::vector<std::string>*>(to)->emplace_back(name, static_cast<std::size_t>(size)); },
      &names);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  for (const auto& name : names)
    if (name.size() > 1) read_other_field(wsi, name);
#else
  for (const auto name : other_names) read_other_field(wsi, name);
#endif
}

#else

void Incoming::read_other_fields(lws*) {}

#endif

void Incoming::strip_framing_fields() {
  auto& fields = request.fields;
  fields.erase(std::remove_if(fields.begin(), fields.end(),
                              [](const http::Field& field) {
                                return http::iequals(field.name, "Content-Length") || http::iequals(field.name, "Transfer-Encoding");
                              }),
               fields.end());
}

}  // namespace lrt::libwebsockets
