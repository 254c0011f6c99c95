// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/iri.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"

namespace lrt::iri {
inline namespace v0 {
namespace {

using detail::is;
constexpr std::size_t npos = std::string_view::npos;

/// RFC 3987 2.2 for one code point beyond ASCII. Simplified: private use characters, which RFC 3987 allows in queries, are refused.
bool is_ucschar(char32_t c) noexcept {
  if (c < 0xA0) return false;                    // C1 controls
  if (c >= 0xE000 && c <= 0xF8FF) return false;  // private use
  if (c >= 0xFDD0 && c <= 0xFDEF) return false;  // noncharacters
  if ((c & 0xFFFE) == 0xFFFE) return false;      // noncharacters, the last two of each plane
  return c < 0xF0000;                            // private use planes
}

/// The offset of the first byte that is not allowed in an IRI, or npos.
std::size_t find_disallowed(std::string_view text) noexcept {
  bool ascii = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is(c, detail::uri)) {
      if (c == '%' && (text.size() - i < 3 || !is(text[i + 1], detail::hex) || !is(text[i + 2], detail::hex))) return i;
    } else if (static_cast<unsigned char>(c) < 0x80) {
      return i;
    } else {
      ascii = false;
    }
  }
  if (ascii) return npos;
  if (const auto invalid = utf8::find_invalid(text)) return *invalid;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t at = i;
    const char32_t c = utf8::decode(text, i);
    if (c >= 0x80 && !is_ucschar(c)) return at;
  }
  return npos;
}

/// The length of a well-formed scheme that ends at a ':', or npos.
std::size_t scheme_length(std::string_view text) noexcept {
  if (text.empty() || !detail::is_alpha(text[0])) return npos;
  std::size_t i = 1;
  while (i < text.size() && is(text[i], detail::scheme)) ++i;
  return i < text.size() && text[i] == ':' ? i : npos;
}

/// The offset of the first byte that makes `text` invalid as an IRI reference, or npos. A first segment with a colon must be a scheme
/// (RFC 3986 4.2).
std::size_t find_reference_fault(std::string_view text) noexcept {
  if (scheme_length(text) == npos) {
    const std::size_t colon = text.find_first_of(":/?#");
    if (colon != npos && text[colon] == ':') return colon;
  }
  return find_disallowed(text);
}

Unexpected refuse(std::string_view what, std::string_view text, std::size_t offset) {
  Error error{Errc::expected_iri, std::string(what)};
  if (offset < text.size()) {
    const char c = text[offset];
    error.message += ": found ";
    if (c > ' ' && c < 0x7F) error.message += {'\'', c, '\''};
    else detail::append_percent(error.message += "byte ", c);
    error.message += " at byte " + std::to_string(offset);
  }
  error.offset = offset == npos ? 0 : offset;
  return unexpected(std::move(error));
}

/// Appends `path` to `out` without its dot segments (RFC 3986 5.2.4). Bytes of `out` before `floor` are never removed.
void append_without_dots(std::string& out, std::string_view path) {
  const std::size_t floor = out.size();
  const auto take_back = [&] {
    const std::size_t slash = out.rfind('/');
    out.resize(slash == npos || slash < floor ? floor : slash);
  };
  while (!path.empty()) {
    if (path.substr(0, 3) == "../") {
      path.remove_prefix(3);
    } else if (path.substr(0, 2) == "./" || path.substr(0, 3) == "/./") {
      path.remove_prefix(2);
    } else if (path == "/.") {
      out += '/';
      return;
    } else if (path.substr(0, 4) == "/../") {
      path.remove_prefix(3);
      take_back();
    } else if (path == "/..") {
      take_back();
      out += '/';
      return;
    } else if (path == "." || path == "..") {
      return;
    } else {
      const std::size_t next = path.find('/', 1);
      out += path.substr(0, next);
      path.remove_prefix(next == npos ? path.size() : next);
    }
  }
}

}  // namespace

Parts split(std::string_view reference) noexcept {
  Parts parts;
  std::size_t at = reference.find_first_of(":/?#");
  if (at != npos && at > 0 && reference[at] == ':') {
    parts.has_scheme = true;
    parts.scheme = reference.substr(0, at);
    reference.remove_prefix(at + 1);
  }
  at = reference.find('#');
  if (at != npos) {
    parts.has_fragment = true;
    parts.fragment = reference.substr(at + 1);
    reference = reference.substr(0, at);
  }
  at = reference.find('?');
  if (at != npos) {
    parts.has_query = true;
    parts.query = reference.substr(at + 1);
    reference = reference.substr(0, at);
  }
  if (reference.substr(0, 2) == "//") {
    parts.has_authority = true;
    reference.remove_prefix(2);
    at = reference.find('/');
    parts.authority = reference.substr(0, at);
    reference.remove_prefix(at == npos ? reference.size() : at);
  }
  parts.path = reference;
  return parts;
}

bool is_absolute(std::string_view text) noexcept { return scheme_length(text) != npos && find_disallowed(text) == npos; }

bool is_reference(std::string_view text) noexcept { return find_reference_fault(text) == npos; }

Result<std::string> resolve(std::string_view base, std::string_view reference) {
  if (!is_absolute(base)) return refuse("the base is not an absolute IRI", base, find_reference_fault(base));
  if (const std::size_t fault = find_reference_fault(reference); fault != npos) {
    return refuse("the text is not an IRI reference", reference, fault);
  }
  const Parts b = split(base);
  const Parts r = split(reference);
  std::string result;
  result.reserve(base.size() + reference.size() + 3);

  // RFC 3986 5.2.2: missing parts of the reference are taken from the base.
  const bool own_authority = r.has_scheme || r.has_authority;
  const Parts& front = own_authority ? r : b;
  result += r.has_scheme ? r.scheme : b.scheme;
  result += ':';
  if (front.has_authority) {
    result += "//";
    result += front.authority;
  }
  const std::size_t path_at = result.size();
  bool query_of_base = false;
  if (own_authority || (!r.path.empty() && r.path.front() == '/')) {
    append_without_dots(result, r.path);
  } else if (r.path.empty()) {
    result += b.path;
    query_of_base = !r.has_query;
  } else {
    std::string merged;
    if (b.has_authority && b.path.empty()) merged = "/";
    else if (const std::size_t slash = b.path.rfind('/'); slash != npos) merged = b.path.substr(0, slash + 1);
    merged += r.path;
    append_without_dots(result, merged);
  }
  // Without an authority a path must not begin with "//" (RFC 3986 3.3). The prefix "/." avoids that.
  if (!front.has_authority && result.compare(path_at, 2, "//") == 0) result.insert(path_at, "/.");

  const Parts& asker = query_of_base ? b : r;
  if (asker.has_query) {
    result += '?';
    result += asker.query;
  }
  if (r.has_fragment) {
    result += '#';
    result += r.fragment;
  }
  return result;
}

std::string encode_segment(std::string_view name) {
  std::string result;
  result.reserve(name.size());
  for (const char c : name) {
    if (is(c, detail::unreserved | detail::sub_delim) || c == ':' || c == '@') result += c;
    else detail::append_percent(result, c);
  }
  return result;
}

Result<std::string> decode(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
    } else if (text.size() - i < 3 || !is(text[i + 1], detail::hex) || !is(text[i + 2], detail::hex)) {
      return refuse("incomplete percent escape", text, i);
    } else {
      result += static_cast<char>(detail::hex_value(text[i + 1]) * 16 + detail::hex_value(text[i + 2]));
      i += 2;
    }
  }
  return result;
}

}  // namespace v0
}  // namespace lrt::iri
