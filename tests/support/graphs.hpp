// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::test {

/// Turtle whose prefixes need not be declared.
inline rdf::Graph turtle(std::string_view text, std::string_view base = "http://localhost/") {
  std::string document;
  for (const auto& [prefix, space] : rdf::default_prefixes()) document += "@prefix " + prefix + ": <" + space + "> .\n";
  rdf::ReadOptions options;
  options.base = base;
  return rdf::read(document.append(text), rdf::Syntax::turtle, options).value();
}

namespace detail {

/// Looks for a way to read the blank nodes of a pattern so that each of its triples is in a graph.
class Matcher {
 public:
  Matcher(const rdf::Graph& graph, const rdf::Graph& pattern) : graph_(graph), pattern_(pattern) {}

  bool match() { return from(0); }
  std::size_t furthest() const noexcept { return furthest_; }

 private:
  struct Slot {
    std::optional<rdf::TermId> id;
    bool open = false, absent = false;
  };
  Slot resolve(rdf::TermId in_pattern) const {
    const rdf::TermView term = pattern_.term(in_pattern);
    if (term.is_blank()) {
      const auto bound = bound_.find(in_pattern);
      return bound == bound_.end() ? Slot{std::nullopt, true, false} : Slot{bound->second, false, false};
    }
    const auto id = graph_.find(term);
    return {id, false, !id};
  }
  bool from(std::size_t at) {
    furthest_ = std::max(furthest_, at);
    if (at == pattern_.size()) return true;
    const rdf::Triple& wanted = pattern_.triples()[at];
    const Slot s = resolve(wanted.subject), p = resolve(wanted.predicate), o = resolve(wanted.object);
    if (s.absent || p.absent || o.absent) return false;
    for (const rdf::Triple& found : graph_.match(s.id, p.id, o.id)) {
      if (s.open) bound_[wanted.subject] = found.subject;
      if (o.open) bound_[wanted.object] = found.object;
      if (!(s.open && o.open && wanted.subject == wanted.object && !(found.subject == found.object)) && from(at + 1)) return true;
      if (s.open) bound_.erase(wanted.subject);
      if (o.open) bound_.erase(wanted.object);
    }
    return false;
  }

  const rdf::Graph& graph_;
  const rdf::Graph& pattern_;
  std::map<rdf::TermId, rdf::TermId> bound_;
  std::size_t furthest_ = 0;
};

}  // namespace detail

/// Empty if the graph has all triples of the pattern, whose blank nodes stand for any node; else the first that is not to be had.
inline std::string missing(const rdf::Graph& graph, const rdf::Graph& pattern) {
  detail::Matcher matcher(graph, pattern);
  if (matcher.match()) return {};
  const rdf::Triple& t = pattern.triples()[matcher.furthest()];
  return "missing: " + rdf::to_string(pattern.term(t.subject)) + " " + rdf::to_string(pattern.term(t.predicate)) + " " +
         rdf::to_string(pattern.term(t.object));
}
inline std::string missing(const rdf::Graph& graph, std::string_view pattern, std::string_view base = "http://localhost/") {
  return missing(graph, turtle(pattern, base));
}

}  // namespace lrt::test
