// SPDX-License-Identifier: Apache-2.0
// toml++, which is the same in each source that reads TOML, and what is done before it reads a text.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
// toml++ 3.3 asserts that the header of a table begins with a key before it has looked, and with NDEBUG it assumes so: "[@" would end the program, or
// be undefined. Its own check behind it reports the fault.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

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

/// Reads a text. A fault has its place in `text`; where characters outside of ASCII are in the line, the column may be further to the right.
inline toml::parse_result parse_toml(std::string_view text) {
  const AsciiToml ascii = ascii_toml(text);
  if (!ascii.stray) return toml::parse(ascii.text);
  const std::string_view before = text.substr(0, *ascii.stray);
  const std::size_t line_begin = before.rfind('\n') + 1;  // 0 if there is none
  toml::source_position place;
  place.line = static_cast<toml::source_index>(1 + std::count(before.begin(), before.end(), '\n'));
  place.column = static_cast<toml::source_index>(1 + before.size() - line_begin);
  return toml::parse_result(toml::parse_error(
      utf8::find_invalid(text) ? "the text is not UTF-8" : "a character outside of ASCII is in comments and texts with \"double quotes\" only",
      place));
}

}  // namespace lrt::ros2
