// SPDX-License-Identifier: Apache-2.0
// What is looked at before toml++ reads a text.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace lrt::ros2 {

/// The first character outside of ASCII that is in no string and in no comment, where TOML 1.0 has none, or behind the backslash of a line's end
/// within a string. toml++ 3.3 takes it for white space or not by code that is undefined for U+00A1 to U+0499.
inline std::optional<std::size_t> stray_character(std::string_view text) noexcept {
  const auto has = [&](std::size_t at, std::string_view part) { return text.substr(at, part.size()) == part; };
  const auto is_stray = [&](std::size_t at) { return at < text.size() && static_cast<unsigned char>(text[at]) >= 0x80; };
  std::size_t at = has(0, "\xef\xbb\xbf") ? 3 : 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '#') {
      at = text.find('\n', at);
    } else if (c == '"' || c == '\'') {
      const std::string_view quotes = c == '"' ? "\"\"\"" : "'''";
      const bool is_long = has(at, quotes);
      at += is_long ? 3 : 1;
      for (bool inside = true; inside && at < text.size();) {
        if (c == '"' && text[at] == '\\') {
          ++at;
          if (is_long && at < text.size() && std::string_view(" \t\r\n").find(text[at]) != std::string_view::npos) {
            at = text.find_first_not_of(" \t\r\n", at);
            if (is_stray(at)) return at;
          } else {
            ++at;
          }
        } else if (is_long ? has(at, quotes) : text[at] == c || text[at] == '\n') {
          inside = false;
          at += is_long ? 3 : 1;
          while (is_long && at < text.size() && text[at] == c) ++at;  // up to two of the text's own
        } else {
          ++at;
        }
      }
    } else if (is_stray(at)) {
      return at;
    } else {
      ++at;
    }
  }
  return std::nullopt;
}

}  // namespace lrt::ros2
