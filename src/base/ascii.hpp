// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

/// ASCII character classes in one table: a scanner needs one load per byte. Private to the library.
namespace lrt::detail {

enum : std::uint8_t {
  tchar = 1,       ///< RFC 9110 5.6.2
  unreserved = 2,  ///< RFC 3986 2.3
  sub_delim = 4,   ///< RFC 3986 2.2
  uri = 8,         ///< allowed somewhere in an RFC 3986 URI: unreserved, gen-delims, sub-delims, '%'
  scheme = 16,     ///< RFC 3986 3.1; the first character must be a letter
  hex = 32,
  text = 64,     ///< field-vchar, SP, HTAB: allowed in a field value (RFC 9110 5.5)
  quoted = 128,  ///< qdtext (RFC 9110 5.6.4)
};

constexpr bool contains(std::string_view set, char c) noexcept { return set.find(c) != std::string_view::npos; }
constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
constexpr bool is_alpha(char c) noexcept { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

constexpr std::array<std::uint8_t, 256> make_classes() noexcept {
  std::array<std::uint8_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    const char c = static_cast<char>(i);
    const bool letter_or_digit = is_alpha(c) || is_digit(c);
    unsigned bits = 0;
    if (i < 0x80) {
      const bool is_sub_delim = contains("!$&'()*+,;=", c);
      const bool is_unreserved = letter_or_digit || contains("-._~", c);
      if (letter_or_digit || contains("!#$%&'*+-.^_`|~", c)) bits |= tchar;
      if (is_unreserved) bits |= unreserved;
      if (is_sub_delim) bits |= sub_delim;
      if (is_unreserved || is_sub_delim || contains(":/?#[]@%", c)) bits |= uri;
      if (letter_or_digit || contains("+-.", c)) bits |= scheme;
      if (is_digit(c) || (i >= 'a' && i <= 'f') || (i >= 'A' && i <= 'F')) bits |= hex;
    }
    if (i == 0x09 || (i >= 0x20 && i != 0x7F)) {
      bits |= text;
      if (c != '"' && c != '\\') bits |= quoted;
    }
    table[i] = static_cast<std::uint8_t>(bits);
  }
  return table;
}

inline constexpr std::array<std::uint8_t, 256> classes = make_classes();

constexpr bool is(char c, std::uint8_t mask) noexcept { return (classes[static_cast<unsigned char>(c)] & mask) != 0; }
constexpr char lower(char c) noexcept { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c; }
inline std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = lower(c);
  return result;
}
constexpr unsigned hex_value(char c) noexcept { return is_digit(c) ? static_cast<unsigned>(c - '0') : static_cast<unsigned>(lower(c) - 'a' + 10); }

inline bool iequals_ascii(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] != b[i] && lower(a[i]) != lower(b[i])) return false;
  }
  return true;
}

constexpr bool is_ows(char c) noexcept { return c == ' ' || c == '\t'; }

/// Removes spaces and tabs at both ends.
inline std::string_view trim(std::string_view value) noexcept {
  while (!value.empty() && is_ows(value.front())) value.remove_prefix(1);
  while (!value.empty() && is_ows(value.back())) value.remove_suffix(1);
  return value;
}

/// Removes spaces, tabs and ends of lines at both ends.
inline std::string_view trim_space(std::string_view text) noexcept {
  constexpr std::string_view space = " \t\r\n";
  const std::size_t first = text.find_first_not_of(space);
  return first == std::string_view::npos ? std::string_view() : text.substr(first, text.find_last_not_of(space) - first + 1);
}

inline void append_percent(std::string& out, char c) {
  static constexpr char digits[] = "0123456789ABCDEF";
  const auto byte = static_cast<unsigned char>(c);
  out += '%';
  out += digits[byte >> 4];
  out += digits[byte & 0x0FU];
}

/// The offset after the quoted-string that begins at `at` (RFC 9110 5.6.4); npos: it is not a quoted-string.
inline std::size_t quoted_end(std::string_view value, std::size_t at) noexcept {
  for (++at; at < value.size(); ++at) {
    if (value[at] == '"') return at + 1;
    if (value[at] == '\\') ++at;
    if (at >= value.size() || !is(value[at], text)) break;
  }
  return std::string_view::npos;
}

/// The text that a well-formed quoted-string, quotes included, stands for.
inline std::string unquote(std::string_view quoted_string) {
  std::string result;
  result.reserve(quoted_string.size());
  for (std::size_t i = 1; i + 1 < quoted_string.size(); ++i) {
    if (quoted_string[i] == '\\') ++i;
    result += quoted_string[i];
  }
  return result;
}

inline std::size_t token_end(std::string_view value, std::size_t at) noexcept {
  while (at < value.size() && is(value[at], tchar)) ++at;
  return at;
}

}  // namespace lrt::detail
