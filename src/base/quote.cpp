// SPDX-License-Identifier: Apache-2.0
#include "src/base/quote.hpp"

#include <algorithm>
#include <array>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"

namespace lrt {
namespace {

constexpr std::array<bool, 256> escaped_bytes() {
  std::array<bool, 256> table{};
  for (std::size_t i = 0; i < 0x20; ++i) table[i] = true;
  table['"'] = table['\\'] = table[0x7F] = true;
  return table;
}
constexpr std::array<bool, 256> escaped = escaped_bytes();

constexpr char digits[] = "0123456789ABCDEF";

void append_escaped(std::string& out, std::string_view text) {
  std::size_t from = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (!escaped[c]) continue;
    out.append(text, from, i - from);
    from = i + 1;
    out.push_back('\\');
    switch (c) {
      case '"': out.push_back('"'); break;
      case '\\': out.push_back('\\'); break;
      case '\n': out.push_back('n'); break;
      case '\r': out.push_back('r'); break;
      case '\t': out.push_back('t'); break;
      case '\b': out.push_back('b'); break;
      case '\f': out.push_back('f'); break;
      default: out.append("u00").append({digits[c >> 4], digits[c & 15]});
    }
  }
  out.append(text, from);
}

void append_unit(std::string& out, unsigned unit) {
  out += "\\u";
  for (int shift = 12; shift >= 0; shift -= 4) out += digits[(unit >> shift) & 15U];
}

template <class IsShown>
std::string shown(std::string_view text, std::size_t longest, IsShown is_shown) {
  std::string_view rest = utf8::prefix(text, longest);
  const bool is_cut = rest.size() < text.size();
  std::string result;
  while (!rest.empty()) {
    const std::size_t valid = utf8::find_invalid(rest).value_or(rest.size());
    for (std::size_t i = 0; i < rest.size() && i < valid + 1; ++i) {
      const auto byte = static_cast<unsigned char>(rest[i]);
      if (i < valid && is_shown(byte)) result += rest[i];
      else result += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
    }
    rest.remove_prefix(std::min(rest.size(), valid + 1));
  }
  return is_cut ? result + " (cut)" : result;
}

std::string in_quotes(const std::string& text, bool is_cut) {
  constexpr std::size_t mark = std::string_view(" (cut)").size();
  return is_cut ? '"' + text.substr(0, text.size() - mark) + "\" (cut)" : '"' + text + '"';
}

}  // namespace

void append_quoted(std::string& out, std::string_view text) {
  out.push_back('"');
  append_escaped(out, text);
  out.push_back('"');
}

void append_json_string(std::string& out, std::string_view text) {
  out.push_back('"');
  while (!text.empty()) {
    const std::size_t valid = utf8::find_invalid(text).value_or(text.size());
    append_escaped(out, text.substr(0, valid));
    text.remove_prefix(valid);
    if (text.empty()) break;
    utf8::append(out, 0xFFFD);
    text.remove_prefix(1);
  }
  out.push_back('"');
}

std::string json_string(std::string_view text) {
  std::string result;
  result.reserve(text.size() + 2);
  append_json_string(result, text);
  return result;
}

void append_ascii_json_string(std::string& out, std::string_view text) {
  const std::size_t valid = utf8::find_invalid(text).value_or(text.size());
  out += '"';
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c >= 0x20 && c < 0x7F) {
      if (c == '"' || c == '\\') out += '\\';
      out += c;
      ++at;
    } else if (at >= valid) {
      append_unit(out, static_cast<unsigned char>(text[at++]));
    } else if (const char32_t point = utf8::decode(text, at); point < 0x10000) {
      append_unit(out, static_cast<unsigned>(point));
    } else {
      append_unit(out, 0xD800U + static_cast<unsigned>((point - 0x10000) >> 10));
      append_unit(out, 0xDC00U + static_cast<unsigned>((point - 0x10000) & 0x3FFU));
    }
  }
  out += '"';
}

std::string shortened(std::string_view text, std::size_t longest) {
  return shown(text, longest, [](unsigned char c) { return c >= 0x20 && c != 0x7F; });
}

std::string quoted(std::string_view text, std::size_t longest) { return in_quotes(shortened(text, longest), text.size() > longest); }

std::string quoted_ascii(std::string_view text, std::size_t longest) {
  return in_quotes(shown(text, longest, [](unsigned char c) { return c >= 0x20 && c < 0x7F && c != '"' && c != '\\'; }), text.size() > longest);
}

std::string quoted_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result += '"';
}

std::string percent_encoded(std::string_view text, std::string_view also) {
  std::string result;
  for (const char c : text) {
    if (detail::is(c, detail::unreserved) || detail::contains(also, c)) result += c;
    else detail::append_percent(result, c);
  }
  return result;
}

}  // namespace lrt
