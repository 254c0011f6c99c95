// SPDX-License-Identifier: Apache-2.0
#include "src/base/charset.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <lrt/base/media_type.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"

namespace lrt::charset {
namespace {

/// Whether a text has a byte beyond ASCII.
bool has_wide(std::string_view text) noexcept {
  std::size_t at = 0;
  for (std::uint64_t word; text.size() - at >= sizeof word; at += sizeof word) {
    std::memcpy(&word, text.data() + at, sizeof word);
    if ((word & 0x8080808080808080U) != 0) return true;
  }
  return std::any_of(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
}

}  // namespace

Result<std::string_view> to_utf8(std::string_view text, std::string_view name, std::string& storage) {
  const auto is = [name](std::string_view a, std::string_view b) { return detail::iequals_ascii(name, a) || detail::iequals_ascii(name, b); };
  if (is("utf-8", "utf8")) return text;
  const bool ascii = is("us-ascii", "ascii");
  if (!ascii && !is("iso-8859-1", "latin1"))
    return unexpected(Errc::unsupported_syntax, "charset: expected one of " + std::string(names) + ", found \"" + std::string(name) + "\"");

  const auto first = std::find_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
  if (first == text.end()) return text;
  const auto at = static_cast<std::size_t>(first - text.begin());
  if (ascii) {
    Error error{Errc::expected_value, "byte " + std::to_string(at) + ": expected a character of us-ascii, found a byte above 0x7F"};
    error.offset = at;
    return unexpected(std::move(error));
  }
  storage.assign(text, 0, at);
  storage.reserve(text.size() + text.size() / 8);
  for (const char c : text.substr(at)) utf8::append(storage, static_cast<unsigned char>(c));  // its 256 characters are the first of Unicode
  return std::string_view(storage);
}

std::string content_type(std::string_view media_type, std::string_view body) {
  std::string type(media_type);
  if (!detail::iequals_ascii(media_type.substr(0, 5), "text/") || !has_wide(body) || utf8::find_invalid(body)) return type;
  if (const Result<MediaType> parsed = MediaType::parse(media_type); parsed && !parsed->parameter("charset").empty()) return type;
  return type += "; charset=utf-8";
}

}  // namespace lrt::charset
