// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/json_canonical.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/rdf/lexical.hpp>

#include "src/base/utf8.hpp"
#include "src/rdf/representable.hpp"

namespace lrt::rdf::json {
namespace {

using Id = Document::Id;
using Kind = Document::Kind;

/// Lower-case digits, and U+007F as it is (RFC 8785 3.2.2.2), unlike append_json_string().
void append_string(std::string& out, std::string_view text) {
  out += '"';
  for (const char c : text) {
    switch (c) {
      case '"': out += "\\\""; break;
      case '\\': out += "\\\\"; break;
      case '\b': out += "\\b"; break;
      case '\t': out += "\\t"; break;
      case '\n': out += "\\n"; break;
      case '\f': out += "\\f"; break;
      case '\r': out += "\\r"; break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20) {
          out += c;
        } else {
          out += "\\u00";
          out += c < 0x10 ? '0' : '1';
          out += "0123456789abcdef"[c & 15];
        }
    }
  }
  out += '"';
}

std::u16string utf16(std::string_view text) {
  std::u16string units;
  for (std::size_t at = 0; at < text.size();) {
    const char32_t c = utf8::decode(text, at);
    if (c >= 0x10000) units += static_cast<char16_t>(0xD7C0 + (c >> 10));
    units += static_cast<char16_t>(c >= 0x10000 ? 0xDC00 + (c & 0x3FF) : c);
  }
  return units;
}

/// The depth of a document is limited.
void append(std::string& out, const Document& document, Id value) {
  switch (document.kind(value)) {
    case Kind::null: out += "null"; return;
    case Kind::false_: out += "false"; return;
    case Kind::true_: out += "true"; return;
    case Kind::number: {  // one that no double can hold keeps its digits
      const std::optional<double> number = lexical::representable_double(document.text(value));
      out += number ? canonical_number(*number) : std::string(document.text(value));
      return;
    }
    case Kind::string: return append_string(out, document.text(value));
    case Kind::array: {
      out += '[';
      for (const Id item : Children(document, value)) {
        if (item != document.first(value)) out += ',';
        append(out, document, item);
      }
      out += ']';
      return;
    }
    case Kind::object: {
      std::vector<std::pair<std::u16string, Id>> members;
      for (const Id member : Children(document, value)) members.emplace_back(utf16(document.key(member)), member);
      std::sort(members.begin(), members.end());
      out += '{';
      for (const auto& [name, member] : members) {
        if (member != members.front().second) out += ',';
        append_string(out, document.key(member));
        out += ':';
        append(out, document, member);
      }
      out += '}';
    }
  }
}

}  // namespace

std::string canonical_number(double value) {
  if (value == 0) return "0";
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific).ptr;
  std::string_view text(buffer, static_cast<std::size_t>(end - buffer));
  std::string out;
  if (text.front() == '-') {
    out += '-';
    text.remove_prefix(1);
  }
  const std::size_t e = text.find('e');
  std::string digits(text.substr(0, e));
  if (digits.size() > 1) digits.erase(1, 1);  // the point
  int exponent = 0;
  std::from_chars(text.data() + e + (text[e + 1] == '+' ? 2 : 1), text.data() + text.size(), exponent);
  const int size = static_cast<int>(digits.size()), point = exponent + 1;  // digits before the point
  if (point > 21 || point < -5) {
    out += digits[0];
    if (size > 1) out.append(".").append(digits, 1);
    return out + (exponent < 0 ? "e-" : "e+") + std::to_string(exponent < 0 ? -exponent : exponent);
  }
  if (point <= 0) return out.append("0.").append(static_cast<std::size_t>(-point), '0') + digits;
  if (point >= size) return out.append(digits).append(static_cast<std::size_t>(point - size), '0');
  return out.append(digits, 0, static_cast<std::size_t>(point)).append(".").append(digits, static_cast<std::size_t>(point));
}

std::string canonical(const Document& document, Id value) {
  std::string out;
  append(out, document, value);
  return out;
}

}  // namespace lrt::rdf::json
