// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/difference.hpp"

#include <algorithm>

#include "src/rdf/shared_graph.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

bool has(const Graph& graph, const Graph& other, const Triple& t) noexcept {
  return graph.contains(other.term(t.subject), other.term(t.predicate), other.term(t.object));
}

}  // namespace

std::optional<Difference> shared_difference(const Graph& before, const Graph& after) {
  const SharedGraph* const old = SharedGraph::in(before);
  const SharedGraph* const present = SharedGraph::in(after);
  if (!old || !present || !old->is_related(*present)) return std::nullopt;
  Difference result;
  const auto used = [](const SharedGraph& graph, std::uint32_t place) { return place < graph.place_limit() && graph.is_used(place); };
  const auto same = [&](TermId a, TermId b) {
    const TermView term = old->term(static_cast<std::uint32_t>(a)), other = present->term(static_cast<std::uint32_t>(b));
    // No two versions have written the same bytes, but empty texts have no bytes.
    return (a == b && !term.text.empty() && term.text.data() == other.text.data()) || term == other;
  };
  SharedGraph::for_each_changed_place(*old, *present, [&](std::uint32_t place) {
    const bool was = used(*old, place), is = used(*present, place);
    if (was && is) {
      const Triple &a = old->at(place), &b = present->at(place);
      if (same(a.subject, b.subject) && same(a.predicate, b.predicate) && same(a.object, b.object)) return;
    }
    if (was) result.removed.push_back(old->at(place));
    if (is) result.added.push_back(present->at(place));
  });
  // A triple that was removed and added again has another place.
  const auto erase = [](std::vector<Triple>& list, auto is_kept) { list.erase(std::remove_if(list.begin(), list.end(), is_kept), list.end()); };
  erase(result.removed, [&](const Triple& t) { return has(after, before, t); });
  erase(result.added, [&](const Triple& t) { return has(before, after, t); });
  return result;
}

Difference difference(const Graph& before, const Graph& after) {
  if (auto shared = shared_difference(before, after)) return *std::move(shared);
  Difference result;
  for (const Triple& t : before.match(std::nullopt, std::nullopt, std::nullopt))
    if (!has(after, before, t)) result.removed.push_back(t);
  for (const Triple& t : after.match(std::nullopt, std::nullopt, std::nullopt))
    if (!has(before, after, t)) result.added.push_back(t);
  return result;
}

}  // namespace v0
}  // namespace lrt::rdf
