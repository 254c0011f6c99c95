// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/redland/rdf_xml_text.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "src/base/ascii.hpp"
#include "src/base/charset.hpp"
#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"

namespace lrt::rdf {
namespace xml_text {
namespace {

constexpr std::size_t npos = std::string_view::npos;
constexpr std::string_view spaces = " \t\r\n";

bool begins(std::string_view text, std::string_view with) noexcept { return text.substr(0, with.size()) == with; }

/// The encoding that the XML declaration names, as offset and length in the text; length 0: none.
std::pair<std::size_t, std::size_t> declared_encoding(std::string_view text) {
  const std::size_t from = text.size() - utf8::without_mark(text).size();
  if (!begins(text.substr(from), "<?xml")) return {0, 0};
  const std::string_view declaration = text.substr(0, text.find("?>", from));
  std::size_t at = declaration.find("encoding", from);
  if (at == npos) return {0, 0};
  at = declaration.find_first_not_of(spaces, at + 8);
  if (at == npos || declaration[at] != '=') return {0, 0};
  at = declaration.find_first_not_of(spaces, at + 1);
  if (at == npos || (declaration[at] != '"' && declaration[at] != '\'')) return {0, 0};
  const std::size_t end = declaration.find(declaration[at], at + 1);
  return end == npos ? std::pair<std::size_t, std::size_t>{0, 0} : std::pair{at + 1, end - at - 1};
}

/// Removes the declaration of an encoding that the text does not have any more. What follows stays in its place.
void blank_encoding(std::string& text) {
  const auto [at, length] = declared_encoding(text);
  if (length == 0) return;
  const std::size_t from = text.rfind("encoding", at);
  std::fill(text.begin() + static_cast<std::ptrdiff_t>(from), text.begin() + static_cast<std::ptrdiff_t>(at + length + 1), ' ');
}

Result<void> decode_utf16(std::string_view bytes, bool big_endian, std::string& out) {
  out.clear();
  out.reserve(bytes.size());
  const auto wrong = [&](std::size_t at) {
    Error error{Errc::expected_rdf, "byte " + std::to_string(at) + ": invalid UTF-16"};
    error.offset = at;
    return unexpected(std::move(error));
  };
  const auto unit = [&](std::size_t at) {
    const unsigned first = static_cast<unsigned char>(bytes[at]), second = static_cast<unsigned char>(bytes[at + 1]);
    return static_cast<char32_t>(big_endian ? first << 8U | second : second << 8U | first);
  };
  if (bytes.size() % 2 != 0) return wrong(bytes.size() - 1);
  for (std::size_t at = 0; at < bytes.size(); at += 2) {
    char32_t c = unit(at);
    if (c == 0xFEFF && at == 0) continue;
    if (c >= 0xDC00 && c < 0xE000) return wrong(at);
    if (c >= 0xD800 && c < 0xDC00) {
      const char32_t low = at + 4 <= bytes.size() ? unit(at + 2) : 0;
      if (low < 0xDC00 || low >= 0xE000) return wrong(at);
      c = 0x10000 + ((c - 0xD800) << 10U) + (low - 0xDC00);
      at += 2;
    }
    utf8::append(out, c);
  }
  return {};
}

/// The document in UTF-8 (XML 1.0 4.3.3 and F).
Result<std::string_view> in_utf8(std::string_view text, std::string& storage) {
  const bool little = begins(text, "\xFF\xFE") || begins(text, std::string_view("<\0", 2)),
             big = begins(text, "\xFE\xFF") || begins(text, std::string_view("\0<", 2));
  if (little || big) {
    if (Result<void> decoded = decode_utf16(text, big, storage); !decoded) return unexpected(decoded.error());
    blank_encoding(storage);
    return std::string_view(storage);
  }
  const auto [at, length] = declared_encoding(text);
  const std::string_view name = text.substr(at, length);
  if (length == 0 || lrt::detail::iequals_ascii(name, "utf-8") || begins(text, utf8::byte_order_mark)) return text;
  std::string converted;
  const Result<std::string_view> utf8 = charset::to_utf8(text, name, converted);
  if (!utf8) {
    const bool is_known = utf8.error().code == Errc::expected_value;
    return misread(text, is_known ? utf8.error().offset.value_or(at) : at,
                   is_known ? "a character that the encoding " + shortened(name) + " does not have"
                            : "expected one of the encodings UTF-8, UTF-16, US-ASCII and ISO-8859-1, found " + quoted(name));
  }
  storage = *utf8;
  blank_encoding(storage);
  return std::string_view(storage);
}

bool is_predefined(std::string_view name) noexcept { return name == "lt" || name == "gt" || name == "amp" || name == "quot" || name == "apos"; }

/// Writes a document out with its entities.
class Entities {
 public:
  Entities(std::string_view text, const ReadOptions& options)
      : text_(text), max_bytes_(std::max(text.size(), std::min(options.max_bytes, entity_bytes + entity_growth * text.size()))) {}

  /// @param from  of "<!DOCTYPE"
  Result<std::string> run(std::size_t from) {
    at_ = from + 9;
    if (document_type()) {
      out_.assign(text_, 0, at_);
      for (std::size_t i = from; i < at_; ++i)
        if (out_[i] != '\n' && out_[i] != '\r') out_[i] = ' ';
      content(text_.substr(at_), true);
    }
    if (error_) return Unexpected{*std::move(error_)};
    return std::move(out_);
  }

 private:
  bool fail(const std::string& sentence, Errc code = Errc::expected_rdf) {
    if (!error_) error_ = misread(text_, std::min(at_, text_.size()), sentence, code).error;
    return false;
  }

  // --- the document type (XML 1.0 2.8)

  std::string_view rest() const noexcept { return text_.substr(std::min(at_, text_.size())); }
  void skip_space() noexcept { at_ = std::min(text_.find_first_not_of(spaces, at_), text_.size()); }
  bool skip_behind(std::string_view end, const char* what) {
    const std::size_t found = text_.find(end, at_);
    if (found == npos) return fail(std::string("unterminated ") + what);
    at_ = found + end.size();
    return true;
  }
  std::string_view word() {
    skip_space();
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n[]<>\"'%&;", at_), text_.size());
    const std::string_view found = text_.substr(at_, end - at_);
    at_ = end;
    return found;
  }
  bool literal(std::string_view& value) {
    skip_space();
    if (at_ == text_.size() || (text_[at_] != '"' && text_[at_] != '\'')) return fail("expected a text in quotes");
    const std::size_t end = text_.find(text_[at_], at_ + 1);
    if (end == npos) return fail("unterminated text");
    value = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    return true;
  }
  bool close() {
    skip_space();
    if (!begins(rest(), ">")) return fail("expected '>'");
    ++at_;
    return true;
  }

  bool document_type() {
    if (word().empty()) return fail("expected the name of the root element");
    std::string_view place;
    skip_space();
    if (begins(rest(), "SYSTEM") || begins(rest(), "PUBLIC")) {  // it is left out
      const bool is_public = word() == "PUBLIC";
      if (!literal(place) || (is_public && !literal(place))) return false;
      skip_space();
    }
    if (begins(rest(), "[")) {
      ++at_;
      if (!declarations()) return false;
    }
    return close();
  }

  bool declarations() {
    for (;;) {
      skip_space();
      if (begins(rest(), "]")) return ++at_, true;
      if (begins(rest(), "%")) return fail("a parameter entity is not accepted");
      bool good = false;
      if (begins(rest(), "<!--")) good = at_ += 4, skip_behind("-->", "comment");
      else if (begins(rest(), "<?")) good = skip_behind("?>", "instruction");
      else if (begins(rest(), "<!ENTITY")) good = entity();
      else if (begins(rest(), "<!ELEMENT") || begins(rest(), "<!ATTLIST") || begins(rest(), "<!NOTATION")) good = declaration();
      else return fail(at_ == text_.size() ? "unterminated document type" : "expected a declaration");
      if (!good) return false;
    }
  }

  /// A declaration that says nothing about the graph.
  bool declaration() {
    const bool has_defaults = begins(rest(), "<!ATTLIST");
    for (;;) {
      at_ = text_.find_first_of("\"'>", at_);
      if (at_ == npos) return at_ = text_.size(), fail("unterminated declaration");
      if (text_[at_] == '>') return ++at_, true;
      if (has_defaults) return fail("a default value of an attribute is not accepted");
      std::string_view ignored;
      if (!literal(ignored)) return false;
    }
  }

  bool entity() {
    at_ += 8;
    const std::string_view name = word();
    if (begins(rest(), "%")) return fail("a parameter entity is not accepted");
    if (name.empty()) return fail("expected the name of an entity");
    skip_space();
    if (begins(rest(), "SYSTEM") || begins(rest(), "PUBLIC")) return fail("an entity from elsewhere is not accepted");
    std::string_view value;
    const std::size_t from = at_;
    if (!literal(value)) return false;
    if (++declared_ > max_entities) return fail("more than " + std::to_string(max_entities) + " entities", Errc::limit_exceeded);
    std::string replacement;
    if (const char* const wrong = replace_characters(value, replacement)) {
      at_ = from;
      return fail(wrong);
    }
    if (!is_predefined(name)) entities_.emplace(name, std::move(replacement));  // the first declaration counts
    return close();
  }

  /// The text of an entity, in which characters are replaced, but references to entities are not (XML 1.0 4.4). Returns what is wrong with it.
  static const char* replace_characters(std::string_view value, std::string& out) {
    for (std::size_t at = 0; at < value.size(); ++at) {
      if (value[at] == '%') return "a parameter entity is not accepted";
      if (value[at] != '&' || !begins(value.substr(at), "&#")) {
        out += value[at];
        continue;
      }
      const bool is_hex = begins(value.substr(at), "&#x");
      const std::size_t end = value.find(';', at);
      const std::size_t digits = at + (is_hex ? 3 : 2);
      if (end == npos || end == digits || end - digits > 8) return "expected a character reference";
      char32_t c = 0;
      for (std::size_t i = digits; i < end; ++i) {
        if (is_hex ? !lrt::detail::is(value[i], lrt::detail::hex) : !lrt::detail::is_digit(value[i])) return "expected a character reference";
        c = c * (is_hex ? 16 : 10) + lrt::detail::hex_value(value[i]);
        if (c > 0x10FFFF) return "a character that XML does not have";
      }
      const bool is_character = c == 9 || c == 10 || c == 13 || (c >= 0x20 && c < 0xD800) || (c >= 0xE000 && c != 0xFFFE && c != 0xFFFF);
      if (!is_character) return "a character that XML does not have";
      utf8::append(out, c);
      at = end;
    }
    return nullptr;
  }

  // --- the document

  bool append(std::string_view text) {
    if (out_.size() + used_ + text.size() > max_bytes_)
      return fail("entities make the document longer than " + std::to_string(max_bytes_) + " bytes", Errc::limit_exceeded);
    out_ += text;
    return true;
  }

  /// Content of elements: of the document, or of an entity. at_ is the place in the document.
  bool content(std::string_view text, bool is_document) {
    const std::size_t start = at_;
    for (std::size_t at = 0; at < text.size();) {
      if (is_document) at_ = start + at;
      const std::string_view rest = text.substr(at);
      if (rest.front() == '&') {
        if (!reference(rest, at, '\0')) return false;
        continue;
      }
      if (rest.front() != '<') {
        const std::size_t end = std::min(rest.find_first_of("<&"), rest.size());
        if (!append(rest.substr(0, end))) return false;
        at += end;
        continue;
      }
      const std::string_view last = begins(rest, "<!--") ? "-->" : begins(rest, "<![CDATA[") ? "]]>" : begins(rest, "<?") ? "?>" : "";
      if (last.empty()) {
        if (!tag(text, at, is_document, start)) return false;
        continue;
      }
      const std::size_t found = rest.find(last, last == "-->" ? 4 : 2);
      if (found == npos && !is_document) return fail("an entity with a part of an element");
      const std::size_t end = found == npos ? rest.size() : found + last.size();
      if (!append(rest.substr(0, end))) return false;
      at += end;
    }
    return true;
  }

  /// From '<' to '>'. Entities are in the values of attributes only.
  bool tag(std::string_view text, std::size_t& at, bool is_document, std::size_t start) {
    char quote = '\0';
    while (at < text.size()) {
      if (is_document) at_ = start + at;
      const std::string_view rest = text.substr(at);
      if (quote != '\0' && rest.front() == '&') {
        if (!reference(rest, at, quote)) return false;
        continue;
      }
      const std::size_t end = quote == '\0' ? rest.find_first_of("\"'>") : rest.find_first_of(quote == '"' ? "\"&" : "'&");
      if (end == npos) {
        if (!is_document) return fail("an entity with a part of an element");
        at = text.size();
        return append(rest);
      }
      const char c = rest[end];
      const std::size_t length = c == '&' ? end : end + 1;
      if (!append(rest.substr(0, length))) return false;
      at += length;
      if (c == '>') return true;
      if (c != '&') quote = quote == '\0' ? c : '\0';
    }
    return true;
  }

  /// A reference at the beginning of `rest`; `at` is advanced behind it. What is not declared is left to libxml2.
  /// @param quote  of the attribute; U+0000: in content
  bool reference(std::string_view rest, std::size_t& at, char quote) {
    constexpr std::size_t longest_name = 256;
    const std::size_t end = rest.substr(0, longest_name).find_first_of("; \t\r\n<\"'", 1);
    const std::string_view name = end == npos || rest[end] != ';' ? std::string_view() : rest.substr(1, end - 1);
    const auto found = name.empty() || name.front() == '#' || is_predefined(name) ? entities_.end() : entities_.find(name);
    if (found == entities_.end()) {
      ++at;
      return append("&");
    }
    at += end + 1;
    used_ += reference_bytes;
    if (!append({})) return false;
    if (std::find(open_.begin(), open_.end(), &found->first) != open_.end()) return fail("the entity " + shortened(name) + " contains itself");
    if (open_.size() >= max_entity_depth)
      return fail("entities in entities, more than " + std::to_string(max_entity_depth) + " deep", Errc::limit_exceeded);
    open_.push_back(&found->first);
    const bool good = quote == '\0' ? content(found->second, false) : value(found->second, quote);
    open_.pop_back();
    return good;
  }

  /// The text of an entity in the value of an attribute, where its quotes end nothing.
  bool value(std::string_view text, char quote) {
    for (std::size_t at = 0; at < text.size();) {
      const std::string_view rest = text.substr(at);
      if (rest.front() == '&') {
        if (!reference(rest, at, quote)) return false;
        continue;
      }
      if (rest.front() == '<') return fail("'<' in the value of an attribute");
      const std::size_t end = rest.front() == quote ? 1 : std::min(rest.find_first_of(quote == '"' ? "<&\"" : "<&'"), rest.size());
      if (!append(rest.front() != quote ? rest.substr(0, end) : quote == '"' ? "&quot;" : "&apos;")) return false;
      at += end;
    }
    return true;
  }

  const std::string_view text_;
  const std::size_t max_bytes_;
  std::size_t at_ = 0, used_ = 0, declared_ = 0;
  std::map<std::string, std::string, std::less<>> entities_;
  std::vector<const std::string*> open_;  // the entities that are being written out
  std::string out_;
  std::optional<Error> error_;
};

/// The document type declaration in the prolog, or npos.
std::size_t document_type_in(std::string_view text) noexcept {
  std::size_t at = text.size() - utf8::without_mark(text).size();
  for (;;) {
    at = text.find_first_not_of(spaces, at);
    if (at == npos) return npos;
    const std::string_view rest = text.substr(at);
    if (begins(rest, "<!DOCTYPE")) return at;
    const std::string_view end = begins(rest, "<?") ? "?>" : begins(rest, "<!--") ? "-->" : "";
    const std::size_t found = end.empty() ? npos : rest.find(end, end.size() + 1);
    if (found == npos) return npos;
    at += found + end.size();
  }
}

}  // namespace
}  // namespace xml_text

Result<std::string_view> plain_rdf_xml(std::string_view text, const ReadOptions& options, std::string& storage) {
  Result<std::string_view> decoded = xml_text::in_utf8(text, storage);
  if (!decoded) return decoded;
  if (const auto at = utf8::find_invalid(*decoded)) return misread(*decoded, *at, "invalid UTF-8");
  const std::size_t at = xml_text::document_type_in(*decoded);
  if (at == std::string_view::npos) return decoded;
  Result<std::string> plain = xml_text::Entities(*decoded, options).run(at);
  if (!plain) return unexpected(plain.error());
  storage = *std::move(plain);
  return std::string_view(storage);
}

}  // namespace lrt::rdf
