// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <lrt/http/message.hpp>

#include "tests/support/graphs.hpp"

namespace lrt::test {

/// A request written as text: the request line, fields, and after an empty line the body. Lines end with '\n'. "GET /arm" is enough:
/// `Host: localhost` is added where no Host is given ("Host:" alone: none is sent).
class RequestText {
 public:
  explicit RequestText(std::string text) : text_(std::move(text)) {
    const std::string_view all = text_;
    const std::size_t end = std::min(all.find("\n\n"), all.size());
    if (end != all.size()) request_.body = all.substr(end + 2);
    std::string_view head = all.substr(0, end);
    if (!head.empty() && head.back() == '\n') head.remove_suffix(1);
    std::size_t at = head.find('\n');
    std::string_view line = head.substr(0, at);
    const std::size_t space = line.find(' ');
    request_.method = line.substr(0, space);
    request_.target = line.substr(space + 1);
    request_.peer = "127.0.0.1";
    bool host = false;
    while (at != std::string_view::npos) {
      const std::size_t next = head.find('\n', at + 1);
      line = head.substr(at + 1, next == std::string_view::npos ? next : next - at - 1);
      at = next;
      const std::size_t colon = line.find(':');
      if (colon == std::string_view::npos) throw std::invalid_argument("no field: " + std::string(line));
      std::string_view value = line.substr(colon + 1);
      while (!value.empty() && value.front() == ' ') value.remove_prefix(1);
      const std::string_view name = line.substr(0, colon);
      const bool is_host = http::iequals(name, "Host");
      host |= is_host;
      if (!is_host || !value.empty()) request_.fields.push_back({name, value});
    }
    if (!host) request_.fields.push_back({"Host", "localhost"});
  }
  RequestText(const RequestText&) = delete;
  RequestText& operator=(const RequestText&) = delete;

  http::Request& get() noexcept { return request_; }

 private:
  std::string text_;
  http::Request request_;
};

struct Link {
  std::string target, rel;
  friend bool operator<(const Link& a, const Link& b) { return std::tie(a.target, a.rel) < std::tie(b.target, b.rel); }
};

/// The links of Link fields as lrt writes them.
inline std::vector<Link> parse_links(std::string_view field) {
  std::vector<Link> links;
  while (true) {
    const std::size_t open = field.find('<');
    if (open == std::string_view::npos) return links;
    const std::size_t close = field.find('>', open);
    const std::size_t rel = field.find("rel=\"", close);
    if (close == std::string_view::npos || rel == std::string_view::npos) throw std::runtime_error("bad Link: " + std::string(field));
    const std::size_t end = field.find('"', rel + 5);
    links.push_back({std::string(field.substr(open + 1, close - open - 1)), std::string(field.substr(rel + 5, end - rel - 5))});
    field.remove_prefix(end + 1);
  }
}

/// A response with what tests need.
struct Answer {
  int status = 0;
  http::Fields fields;
  std::string body;

  Answer() = default;
  explicit Answer(const http::Response& response) : status(response.status), fields(response.fields), body(response.content()) {}

  bool has(std::string_view name) const { return fields.find(name).has_value(); }
  /// All of that name, joined; empty if there is none.
  std::string field(std::string_view name) const { return fields.joined(name); }
  std::string tag() const { return field("ETag"); }
  std::vector<Link> links() const { return parse_links(field("Link")); }
  std::vector<std::string> linked(std::string_view rel) const {
    std::vector<std::string> targets;
    for (Link& l : links())
      if (l.rel == rel) targets.push_back(std::move(l.target));
    return targets;
  }
  bool links_to(std::string_view target, std::string_view rel) const {
    const auto all = linked(rel);
    return std::find(all.begin(), all.end(), target) != all.end();
  }
  /// Comma-separated members of a field.
  std::set<std::string> members(std::string_view name) const {
    std::set<std::string> all;
    const std::string value = field(name);
    for (std::size_t start = 0; start < value.size();) {
      const std::size_t end = std::min(value.find(", ", start), value.size());
      all.insert(value.substr(start, end - start));
      start = end + 2;
    }
    return all;
  }
  bool says(std::string_view text) const { return body.find(text) != std::string::npos; }
  rdf::Graph graph() const {
    const std::string type = field("Content-Type");
    const auto syntax = rdf::syntax_of(type.substr(0, type.find(';')));
    if (!syntax) throw std::runtime_error("not RDF: " + field("Content-Type") + ": " + body);
    rdf::ReadOptions options;
    options.base = "http://base.invalid/";
    options.max_triples = 1'000'000;
    constexpr std::string_view before = "{\n  \"@context\": \"";  // JSON-LD that refers to the robot's context
    if (body.compare(0, before.size(), before) == 0)
      options.context = std::string_view(body).substr(before.size(), body.find('"', before.size()) - before.size());
    return rdf::read(body, *syntax, options).value();
  }
};

/// Empty if the body has these triples.
inline std::string missing(const Answer& answer, std::string_view pattern, std::string_view base = "http://localhost/") {
  return missing(answer.graph(), pattern, base);
}

}  // namespace lrt::test
