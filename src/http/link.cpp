// SPDX-License-Identifier: Apache-2.0
#include "src/http/link.hpp"

#include <algorithm>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

constexpr std::size_t line_limit = 4096;  // with name and CRLF
constexpr std::size_t line_overhead = sizeof("Link: \r\n") - 1;

/// Characters that RFC 3986 allows, and percent escapes, are copied; all others are percent-encoded. So a link contains no '<'
/// except the first character.
void append_uri(std::string& out, std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool stray_percent = c == '%' && (text.size() - i < 3 || !detail::is(text[i + 1], detail::hex) || !detail::is(text[i + 2], detail::hex));
    if (detail::is(c, detail::uri) && !stray_percent) out += c;
    else detail::append_percent(out, c);
  }
}

std::string format_link(std::string_view target, std::string_view rel, std::string_view type = {}) {
  std::string link;
  link.reserve(target.size() + rel.size() + 10);
  link += '<';
  append_uri(link, target);
  link += ">; rel=\"";
  for (;;) {  // relation types are registered names or URIs, several apart by spaces (RFC 8288 3.3)
    const std::size_t space = rel.find(' ');
    append_uri(link, rel.substr(0, space));
    if (space == std::string_view::npos) break;
    link += ' ';
    rel.remove_prefix(space + 1);
  }
  link += '"';
  if (!type.empty()) {
    link += "; type=\"";
    for (const char c : type)
      if (c != '"' && c != '\\' && c != '<') link += c;  // take_back() searches for the '<' that begins a link
    link += '"';
  }
  return link;
}

void skip_space(std::string_view& text) noexcept {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
}

/// Removes a quoted-string or a token (RFC 9110 5.6), which may be empty. nullopt: a quoted-string that is not complete.
std::optional<std::string> take_word(std::string_view& text) {
  const bool quoted = !text.empty() && text.front() == '"';
  const std::size_t end = quoted ? detail::quoted_end(text, 0) : detail::token_end(text, 0);
  if (end == std::string_view::npos) return std::nullopt;
  std::string word = quoted ? detail::unquote(text.substr(0, end)) : std::string(text.substr(0, end));
  text.remove_prefix(end);
  return word;
}

/// Removes the text up to and including the next comma outside of quotes.
void skip_element(std::string_view& text) noexcept {
  bool quoted = false;
  while (!text.empty()) {
    const char c = text.front();
    text.remove_prefix(1);
    if (quoted && c == '\\' && !text.empty()) text.remove_prefix(1);
    else if (c == '"') quoted = !quoted;
    else if (c == ',' && !quoted) return;
  }
}

/// Removes a link up to its comma, or what could be read of it.
std::optional<WrittenLink> take_well_formed_link(std::string_view& text) {
  if (text.empty() || text.front() != '<') return std::nullopt;
  const std::size_t end = text.find('>');
  if (end == std::string_view::npos) return std::nullopt;
  WrittenLink link;
  link.target = text.substr(1, end - 1);
  text.remove_prefix(end + 1);
  bool has_rel = false, has_type = false;
  while (true) {
    skip_space(text);
    if (text.empty() || text.front() != ';') return link;
    text.remove_prefix(1);
    skip_space(text);
    const std::optional<std::string> name = take_word(text);
    skip_space(text);
    std::string value;
    if (!text.empty() && text.front() == '=') {
      if (!name || name->empty()) return std::nullopt;
      text.remove_prefix(1);
      skip_space(text);
      std::optional<std::string> found = take_word(text);
      if (!found) return std::nullopt;
      value = *std::move(found);
    }
    if (!name) return std::nullopt;
    if (detail::iequals_ascii(*name, "rel") && !has_rel) link.relations = std::move(value), has_rel = true;
    else if (detail::iequals_ascii(*name, "type") && !has_type) link.type = std::move(value), has_type = true;
    else if (detail::iequals_ascii(*name, "anchor")) link.has_anchor = true;
  }
}

}  // namespace

std::optional<WrittenLink> take_link(std::string_view& value) {
  skip_space(value);
  std::optional<WrittenLink> link = take_well_formed_link(value);
  skip_element(value);
  return link;
}

std::string_view take_relation(std::string_view& relations) {
  relations.remove_prefix(std::min(relations.find_first_not_of(' '), relations.size()));
  const std::string_view relation = relations.substr(0, relations.find(' '));
  relations.remove_prefix(relation.size());
  return relation;
}

bool LinkWriter::put(const std::string& link) {
  const bool joins = !lines_.empty() && lines_.back().size() + 2 + link.size() + line_overhead <= line_limit;
  const std::size_t cost = link.size() + (joins ? 2 : line_overhead);
  if (link.size() + line_overhead > line_limit || used_ + cost > budget_) return false;
  if (joins) (lines_.back() += ", ") += link;
  else lines_.push_back(link);
  used_ += cost;
  ++count_;
  return true;
}

void LinkWriter::take_back() {
  --count_;
  std::string& line = lines_.back();
  const std::size_t at = line.rfind('<');
  if (at < 2) {
    used_ -= line.size() + line_overhead;
    lines_.pop_back();
  } else {
    used_ -= line.size() - (at - 2);
    line.resize(at - 2);
  }
}

void LinkWriter::add(std::string_view target, std::string_view rel, std::string_view type) {
  if (hidden_ && hidden_(target)) return;
  if (left_to_skip_ > 0) return void(--left_to_skip_);
  if (!cut_) cut_ = !put(format_link(target, rel, type));  // links after the cut are left out, too: the list is truncated at one place
}

void LinkWriter::finish(Fields& fields, std::string_view rest, std::string_view rest_rel) {
  if (cut_) {
    const std::string link = format_link(rest, rest_rel);
    const bool fits_at_all = link.size() + line_overhead <= std::min(budget_, line_limit);
    while (fits_at_all && !put(link)) take_back();
  }
  flush(fields);
}

void LinkWriter::skip(std::size_t n) {
  skipped_ = left_to_skip_ = n;
  required_ = count_;
}

void LinkWriter::finish_in_parts(Fields& fields, const std::function<std::string(std::size_t)>& rest) {
  while (cut_ && count_ > required_) {
    const std::string link = format_link(rest(skipped_ + count_ - required_), "next");
    if (put(link)) break;
    take_back();
  }
  flush(fields);
}

void LinkWriter::flush(Fields& fields) {
  for (const std::string& line : lines_) fields.add("Link", line);
  lines_.clear();
  used_ = 0;
}

}  // namespace lrt::http
