// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include <lrt/rdf/graph.hpp>

namespace lrt::test {

/// The triples of both graphs. Blank nodes of two graphs are two nodes.
inline rdf::Graph together(rdf::Graph graph, const rdf::Graph& other) {
  std::map<rdf::TermId, rdf::TermId> blanks;
  const auto copied = [&](rdf::TermId id) {
    if (!other.term(id).is_blank()) return graph.intern(other.term(id));
    const auto known = blanks.find(id);
    return known != blanks.end() ? known->second : blanks.emplace(id, graph.fresh_blank()).first->second;
  };
  for (const rdf::Triple& t : other.triples()) {
    const rdf::TermId s = copied(t.subject), p = copied(t.predicate), o = copied(t.object);
    graph.add(s, p, o);
  }
  return graph;
}

}  // namespace lrt::test
