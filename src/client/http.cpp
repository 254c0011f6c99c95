// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/http.hpp>

#include <algorithm>
#include <optional>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>

#include "src/base/ascii.hpp"
#include "src/http/link.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

using lrt::detail::trim;

constexpr std::size_t max_reason = 500;

/// The string in quotation marks at the beginning of a text; empty: there is none.
std::string string_at_begin(std::string_view text) {
  if (text.empty() || text.front() != '"') return {};
  const std::size_t end = lrt::detail::quoted_end(text, 0);
  return end == std::string_view::npos ? std::string() : lrt::detail::unquote(text.substr(0, end));
}

/// The text of the first member of that name in a JSON text, without a parser of JSON: for messages only.
std::string member(std::string_view json, std::string_view name) {
  const std::string key = "\"" + std::string(name) + "\"";
  const std::size_t at = json.find(key);
  if (at == std::string_view::npos) return {};
  json.remove_prefix(at + key.size());
  while (!json.empty() && (json.front() == ' ' || json.front() == ':')) json.remove_prefix(1);
  return string_at_begin(json);
}

/// The text after `sh:resultMessage` of a report in Turtle, or after `dcterms:description` of other problems.
std::string report_message(std::string_view turtle) {
  for (const std::string_view name : {"resultMessage", "description"}) {
    const std::size_t at = turtle.find(name);
    if (at == std::string_view::npos) continue;
    turtle.remove_prefix(at);
    turtle.remove_prefix(std::min(turtle.find('"'), turtle.size()));
    return string_at_begin(turtle);
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
    const std::optional<http::WrittenLink> link = http::take_link(text);
    if (!link || link->has_anchor) continue;
    const Result<std::string> target = iri::resolve(base, link->target);
    if (!target) continue;
    std::string_view relations = link->relations;
    for (std::string_view name = http::take_relation(relations); !name.empty() && result.size() < max; name = http::take_relation(relations)) {
      Link found;  // each relation is a link of its own (RFC 8288 3.3)
      found.target = *target;
      found.type = link->type;
      found.relation = name.find(':') == std::string_view::npos ? lrt::detail::lower(name) : std::string(name);  // IRIs as they are
      result.push_back(std::move(found));
    }
  }
  return result;
}

}  // namespace v0
}  // namespace lrt::client
