// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/http.hpp>

#include <algorithm>
#include <optional>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>

#include "src/base/ascii.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

using lrt::detail::iequals_ascii;
using lrt::detail::is;
using lrt::detail::trim;

constexpr std::size_t max_reason = 500;

/// A quoted-string or a token at the beginning of `text`, which is removed (RFC 9110 5.6).
std::optional<std::string> take_word(std::string_view& text) {
  std::string word;
  if (!text.empty() && text.front() == '"') {
    for (std::size_t at = 1; at < text.size(); ++at) {
      if (text[at] == '"') {
        text.remove_prefix(at + 1);
        return word;
      }
      if (text[at] == '\\' && at + 1 < text.size()) ++at;
      word += text[at];
    }
    return std::nullopt;
  }
  while (!text.empty() && is(text.front(), lrt::detail::tchar)) word += text.front(), text.remove_prefix(1);
  return word;
}

void skip_space(std::string_view& text) noexcept {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
}

/// Removes the text up to and including the next comma outside of quotes and angle brackets.
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

/// One link, up to its comma; nullopt: it is ill-formed, and what was read of it is removed.
std::optional<Link> take_link(std::string_view& text, std::string_view base, std::string& relations) {
  if (text.empty() || text.front() != '<') return std::nullopt;
  const std::size_t end = text.find('>');
  if (end == std::string_view::npos) return std::nullopt;
  Link link;
  const Result<std::string> target = iri::resolve(base, text.substr(1, end - 1));
  text.remove_prefix(end + 1);
  bool anchored = false;  // the link is one of another resource (RFC 8288 3.2)
  while (true) {
    skip_space(text);
    if (text.empty() || text.front() != ';') break;
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
    if (iequals_ascii(*name, "rel") && relations.empty()) relations = value;
    else if (iequals_ascii(*name, "type") && link.type.empty()) link.type = value;
    else if (iequals_ascii(*name, "anchor")) anchored = true;
  }
  if (!target || anchored) return std::nullopt;
  link.target = *target;
  return link;
}

/// The text of the first member of that name in a JSON text, without a parser of JSON: for messages only.
std::string member(std::string_view json, std::string_view name) {
  const std::string key = "\"" + std::string(name) + "\"";
  const std::size_t at = json.find(key);
  if (at == std::string_view::npos) return {};
  json.remove_prefix(at + key.size());
  while (!json.empty() && (json.front() == ' ' || json.front() == ':')) json.remove_prefix(1);
  if (json.empty() || json.front() != '"') return {};
  return take_word(json).value_or(std::string());
}

/// The text after `sh:resultMessage` of a report in Turtle, or after `dcterms:description` of other problems.
std::string report_message(std::string_view turtle) {
  for (const std::string_view name : {"resultMessage", "description"}) {
    const std::size_t at = turtle.find(name);
    if (at == std::string_view::npos) continue;
    turtle.remove_prefix(at);
    turtle.remove_prefix(std::min(turtle.find('"'), turtle.size()));
    return take_word(turtle).value_or(std::string());
  }
  return {};
}

/// Shortens a text and makes it one line without control characters.
std::string one_line(std::string text) {
  if (text.size() > max_reason) text.resize(max_reason);
  if (const std::size_t end = text.find_first_of("\r\n"); end != std::string::npos) text.resize(end);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  return text;
}

}  // namespace

std::string Response::media_type() const {
  const std::string_view field = fields.find("Content-Type").value_or(std::string_view());
  return lrt::detail::lower(trim(field.substr(0, field.find(';'))));
}

std::string Response::reason() const {
  const std::string type = media_type();
  std::string found;
  if (type == "application/problem+json" || type == "application/json") {
    found = member(body, "detail");
    if (found.empty()) found = member(body, "title");
  } else if (type == "text/turtle" || type == "application/n-triples") {
    found = report_message(body);
  } else if (type == "text/plain") {
    found = body;
  }
  found = one_line(std::move(found));
  if (!found.empty()) return found;
  const std::string_view phrase = http::reason_phrase(status);
  return std::to_string(status) + (phrase.empty() ? "" : " ") + std::string(phrase);
}

std::vector<Link> links(const http::Fields& fields, std::string_view base, std::size_t max) {
  std::vector<Link> result;
  const std::string joined = fields.joined("Link");
  std::string_view text = joined;
  while (!text.empty() && result.size() < max) {
    skip_space(text);
    std::string relations;
    if (std::optional<Link> link = take_link(text, base, relations)) {
      std::string_view rest = relations;
      while (!rest.empty() && result.size() < max) {  // each relation is a link of its own (RFC 8288 3.3)
        const std::size_t end = std::min(rest.find(' '), rest.size());
        if (end > 0) {
          const std::string_view name = rest.substr(0, end);  // registered names in lower case, IRIs as they are
          link->relation = name.find(':') == std::string_view::npos ? lrt::detail::lower(name) : std::string(name);
          result.push_back(*link);
        }
        rest.remove_prefix(std::min(end + 1, rest.size()));
      }
    }
    skip_element(text);
  }
  return result;
}

}  // namespace v0
}  // namespace lrt::client
