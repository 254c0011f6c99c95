// SPDX-License-Identifier: Apache-2.0
// What is done before toml++ reads a text.
#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

#include "src/base/utf8.hpp"

namespace lrt::ros2 {

/// A text of TOML in ASCII.
struct AsciiToml {
  std::string text;
  /// Where a character outside of ASCII cannot be written otherwise: it is in no "string" and in no comment, or the text is not UTF-8.
  std::optional<std::size_t> stray;
};

/// In a "string" a character outside of ASCII becomes its escape, in a comment a question mark. toml++ 3.3 looks at such characters by code that is
/// undefined for U+00A1 to U+0499.
inline AsciiToml ascii_toml(std::string_view text) {
  const auto has = [&](std::size_t at, std::string_view part) { return text.substr(at, part.size()) == part; };
  const auto is_ascii = [&](std::size_t at) { return static_cast<unsigned char>(text[at]) < 0x80; };
  AsciiToml result;
  std::string& out = result.text;
  result.stray = utf8::find_invalid(text);
  if (result.stray) return result;
  enum class In { none, comment, line, paragraph } in = In::none;
  char quote = 0;           // of the string
  bool is_escaped = false;  // a backslash of a string was the last character
  for (std::size_t at = has(0, "\xef\xbb\xbf") ? 3 : 0; at < text.size();) {
    const char c = text[at];
    const bool is_string = in == In::line || in == In::paragraph;
    if (!is_ascii(at)) {
      if (in == In::none || (is_string && (quote != '"' || is_escaped))) return result.stray = at, result;
      const char32_t character = utf8::decode(text, at);
      char escape[16] = "?";
      if (is_string) std::snprintf(escape, sizeof escape, "\\U%08X", static_cast<unsigned>(character));
      out += escape;
      continue;
    }
    std::size_t length = 1;
    if (is_string && quote == '"' && c == '\\' && at + 1 < text.size() && is_ascii(at + 1)) {
      length = 2;
    } else if (is_string && c == quote && (in == In::line || has(at, std::string(3, quote)))) {
      if (in == In::paragraph)  // up to two of the text's own before its end
        for (length = 3; length < 5 && at + length < text.size() && text[at + length] == quote;) ++length;
      in = In::none;
    } else if (in == In::none && (c == '"' || c == '\'')) {
      quote = c;
      in = has(at, std::string(3, c)) ? In::paragraph : In::line;
      if (in == In::paragraph) length = 3;
    } else if (in == In::none && c == '#') {
      in = In::comment;
    } else if (c == '\n' && in != In::paragraph) {
      in = In::none;
    }
    is_escaped = is_string && quote == '"' && c == '\\' && length == 1;
    out += text.substr(at, length);
    at += length;
  }
  return result;
}

}  // namespace lrt::ros2
