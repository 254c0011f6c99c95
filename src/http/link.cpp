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

}  // namespace

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
