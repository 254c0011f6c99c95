// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/mark.hpp"

#include <algorithm>
#include <optional>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/client/representation.hpp"

namespace lrt::mirror {

rdf::Graph Mark::graph(const std::string& robot, const std::string& name) const {
  rdf::Graph result;
  for (const std::string& graph : graphs) result.add(rdf::iri(name), vocab::dcterms::hasPart, rdf::iri(graph));
  if (!since.empty()) result.add(rdf::iri(robot), vocab::lrt_::unreachableSince, rdf::literal(since, vocab::xsd::dateTime));
  return result;
}

Mark mark_of(const rdf::Graph& graph, const std::string& robot, const std::string& name, std::size_t max_graphs) {
  Mark mark;
  for (const rdf::TermView& object : graph.objects(rdf::iri(name), vocab::dcterms::hasPart))
    if (mark.graphs.size() < max_graphs && object.is_iri() && object.text != name && client::same_origin(object.text, robot))
      mark.graphs.emplace_back(object.text);
  std::sort(mark.graphs.begin(), mark.graphs.end());
  const std::optional<rdf::TermView> since = graph.object(rdf::iri(robot), vocab::lrt_::unreachableSince);
  if (since && rdf::lexical::parse_instant(since->text)) mark.since = since->text;
  return mark;
}

}  // namespace lrt::mirror
