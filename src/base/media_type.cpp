// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/media_type.hpp>

#include <algorithm>

#include "src/base/ascii.hpp"

namespace lrt {
namespace {

std::string lowered(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = detail::lower(c);
  return result;
}

Unexpected refuse(std::string_view expected, std::size_t offset) {
  Error error{Errc::expected_media_type, "media type: expected "};
  error.message += expected;
  error.message += " at byte " + std::to_string(offset);
  error.offset = offset;
  return unexpected(std::move(error));
}

}  // namespace

Result<MediaType> MediaType::parse(std::string_view text) {
  using namespace detail;
  MediaType result;
  std::size_t end = text.size();
  while (end > 0 && is_ows(text[end - 1])) --end;
  text = text.substr(0, end);
  std::size_t at = 0;
  while (at < end && is_ows(text[at])) ++at;

  const std::size_t slash = token_end(text, at);
  if (slash == at) return refuse("a type", at);
  if (slash == end || text[slash] != '/') return refuse("'/'", slash);
  result.type = lowered(text.substr(at, slash - at));
  at = token_end(text, slash + 1);
  if (at == slash + 1) return refuse("a subtype", at);
  result.subtype = lowered(text.substr(slash + 1, at - slash - 1));

  while (at < end) {
    while (at < end && is_ows(text[at])) ++at;
    if (text[at] != ';') return refuse("';'", at);
    ++at;
    while (at < end && is_ows(text[at])) ++at;
    const std::size_t equals = token_end(text, at);
    if (equals == at) {
      if (at == end || text[at] == ';') continue;  // RFC 9110 5.6.6 allows empty parameters
      return refuse("a parameter name", at);
    }
    if (equals == end || text[equals] != '=') return refuse("'='", equals);
    std::string name = lowered(text.substr(at, equals - at));
    at = equals + 1;
    if (at < end && text[at] == '"') {
      const std::size_t close = quoted_end(text, at);
      if (close == std::string_view::npos) return refuse("a complete quoted string", at);
      result.parameters.emplace_back(std::move(name), unquote(text.substr(at, close - at)));
      at = close;
    } else {
      const std::size_t stop = token_end(text, at);
      if (stop == at) return refuse("a parameter value", at);
      result.parameters.emplace_back(std::move(name), std::string(text.substr(at, stop - at)));
      at = stop;
    }
  }
  return result;
}

std::string MediaType::to_string() const {
  std::string text = essence();
  for (const auto& [name, value] : parameters) {
    text += ";" + name + "=";
    const bool is_token = !value.empty() && std::all_of(value.begin(), value.end(), [](char c) { return detail::is(c, detail::tchar); });
    if (is_token) {
      text += value;
      continue;
    }
    text += '"';
    for (const char c : value) {
      if (c == '"' || c == '\\') text += '\\';
      text += c;
    }
    text += '"';
  }
  return text;
}

std::string_view MediaType::parameter(std::string_view name) const noexcept {
  for (const auto& [key, value] : parameters) {
    if (detail::iequals_ascii(key, name)) return value;
  }
  return {};
}

}  // namespace lrt
