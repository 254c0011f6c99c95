// SPDX-License-Identifier: Apache-2.0
// What audiences see of the graphs of a World if a part is hidden from them.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/engine/description.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/world.hpp"
#include "src/http/etag.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {

namespace {

using model::GraphState;

rdf::Graph part_for(const Audience& audience, const rdf::Graph& all, const Registry& registry) {
  const std::string base(placeholder_base);
  return visible_part(all, [&](std::string_view iri) { return audience.sees_iri(iri, base, registry); });
}

std::string text_of(const rdf::Graph& graph) {
  Result<std::string> text = rdf::write(graph, rdf::Syntax::n_triples, {});
  return text ? *std::move(text) : std::string();
}

std::size_t bytes_of(const rdf::Graph& graph) {
  std::size_t bytes = 0;
  for (const rdf::Triple& t : graph.triples())
    for (const rdf::TermId id : {t.subject, t.predicate, t.object})
      if (const rdf::TermView term = graph.term(id); !term.is_blank()) bytes += term.text.size();
  return bytes;
}

}  // namespace

WorldGraphResource::Seen& WorldGraphResource::look(const Audience& audience, const GraphState::Version& version) const {
  Seen& seen = seen_.of(
      audience, [] { return Seen(); }, [](const Seen&) {});
  const std::uint64_t structure = view_->registry.structure();
  if (seen.revision == version.revision && seen.structure == structure && !seen.digest.empty()) return seen;
  const rdf::Graph part = audience.sees(*this) ? part_for(audience, *version.graph, view_->registry) : rdf::Graph();
  std::string digest = http::entity_tag({}, text_of(part));
  if (digest != seen.digest) seen.changed = version.revision;
  if (part.size() != seen.size) seen.resized = version.revision;
  seen.digest = std::move(digest);
  seen.size = part.size();
  seen.bytes = bytes_of(part);
  seen.revision = version.revision;
  seen.structure = structure;
  return seen;
}

const WorldGraphResource::Seen& WorldGraphResource::seen_by(const Audience& audience) const { return look(audience, version_); }

/// The present triples and values.
std::uint64_t WorldGraphResource::digest_of_all(const Seen& seen, const Audience& audience) const {
  std::uint64_t digest = rdf::hash_bytes(seen.digest, 1);
  for (const Published& published : published_) {
    const PropertyResource& p = *published.resource;
    if (!p.value.is_null() && audience.sees(p)) digest = rdf::hash_bytes(p.path, digest ^ static_cast<std::uint64_t>(p.id)) + p.revision;
  }
  return digest | 1;
}

/// While nobody observes the graph, its changes are one when the number is next needed.
std::uint64_t WorldGraphResource::change_number(const Audience& audience) const {
  Seen& seen = look(audience, version_);
  const std::uint64_t digest = digest_of_all(seen, audience);
  if (seen.counted != digest && seen.counted != 0) ++seen.number;
  seen.counted = digest;
  return seen.number;
}

void WorldGraphResource::count_change(SeenBy seen_change) {
  if (observers.empty()) return;
  for (const Audience& audience : seen_.audiences()) {
    if (!seen_change(audience)) continue;
    Seen& seen = look(audience, version_);
    ++seen.number;
    seen.counted = digest_of_all(seen, audience);
  }
}

/// @param before    the version before, if `has_more`
/// @param gone      paths of what is not published any more
/// @param has_more  the version is another one
void WorldGraphResource::mark_stored_changed(const GraphState::Version& before, const std::vector<std::string>& gone, bool has_more) {
  const auto look_again = [&](const Audience& audience) -> const Seen& {
    const Seen& seen = seen_.of(
        audience, [] { return Seen(); }, [](const Seen&) {});
    if (seen.revision != version_.revision) look(audience, before);
    return look(audience, version_);
  };
  const auto sees_size = [&](const Audience& audience) {
    if (!audience.sees(*this)) return false;
    return audience.hides_something() ? look_again(audience).resized == version_.revision : before.graph->size() != version_.graph->size();
  };
  if (has_more) world.mark_resized(sees_size, before.graph->size() != version_.graph->size());  // its JSON has the number
  mark_changed([&](const Audience& audience) {
    if (!audience.hides_something()) return true;
    if (!audience.sees(*this)) return false;
    if (has_more && look_again(audience).changed == version_.revision) return true;
    return std::any_of(gone.begin(), gone.end(), [&](const std::string& at) { return audience.view->at(at).has(security::Right::read); });
  });
}

/// For the entity tag: changes with the published values that the audience sees. Empty if there are none.
std::string WorldGraphResource::published_digits(const Audience& audience) const {
  if (!audience.sees(*this)) return {};
  rdf::Graph all;
  const std::string base(placeholder_base);
  describe_published({all, base, 1, *view_, audience});
  const rdf::Graph part = part_for(audience, all, view_->registry);
  return part.empty() ? std::string() : "." + std::to_string(rdf::hash_bytes(text_of(part), 1));
}

void WorldResource::mark_resized(SeenBy seen, bool for_all) {
  if (for_all) return mark_changed(seen);
  count_change(seen);  // only for those from whom a part of the graph is hidden
  notify_observers(seen);
}

}  // namespace lrt::engine
