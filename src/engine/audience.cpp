// SPDX-License-Identifier: Apache-2.0
#include "src/engine/audience.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "src/engine/named_blank.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {
inline namespace v0 {

using security::Right;
using security::Rights;

Rights Audience::rights(const Resource& resource) const {
  if (!view) return Rights::all();
  if (!resource.is_shown_to(*this)) return {};
  const Rights given = view->at(resource.path_of_rights());
  return resource.thing || !sees_something() ? given : given | Right::read;
}

std::string_view Audience::name_in(const Resource& resource) const noexcept {
  return view && principal && resource.kind().is(Trait::by_principal) ? std::string_view(principal->name) : std::string_view();
}

Methods Audience::methods(const Resource& resource) const {
  if (!may(resource.kind().right_to_change, resource)) return {};
  Methods methods = resource.methods();
  if (methods.put && view)
    if (const GraphStore* const store = resource.graph_store()) methods.put = store->max_put_bytes(*this).has_value();
  // A report about the whole value would show what else is in it.
  if (methods.patch && resource.patch_types() != update_type && !sees(resource)) methods.patch = false;
  return methods;
}

bool Audience::sees_iri(std::string_view iri, const std::string& base, const Registry& registry) const {
  if (!view || iri.size() <= base.size() || iri[base.size()] != '/' || iri.substr(0, base.size()) != base) return true;
  const std::string_view rest = iri.substr(base.size());
  const std::string_view path = rest.substr(0, rest.find_first_of("?#"));
  const Resource* const resource = registry.find(path);
  if (!resource) return view->at(path).has(Right::read);
  if (!sees(*resource)) return false;
  const std::size_t hash = rest.find('#');
  return hash == std::string_view::npos || resource->shows_fragment(rest.substr(hash + 1), *this);
}

bool Audience::may_choose_name(std::string_view path, std::string_view below) const {
  if (!view) return true;
  if (!view->at(path).has(Right::write)) return false;
  for (std::string_view at = path; at.size() > below.size(); at = at.substr(0, at.rfind('/')))
    if (!view->at(at).has(Right::read)) return false;
  return true;
}

rdf::Graph visible_part(const rdf::Graph& all, FunctionRef<bool(std::string_view iri)> is_shown, const UserWords& words) {
  std::vector<bool> is_word(words.empty() ? 0 : all.size());
  for (const auto& [first, end] : words)
    std::fill(is_word.begin() + static_cast<std::ptrdiff_t>(first), is_word.begin() + static_cast<std::ptrdiff_t>(end), true);
  enum class State : unsigned char { unknown, hidden, shown };
  std::vector<State> states(all.term_count());
  const auto shown = [&](rdf::TermId id) {
    State& state = states[static_cast<std::size_t>(id)];
    if (state == State::unknown) {
      const rdf::TermView term = all.term(id);
      state = !term.is_iri() || is_shown(term.text) ? State::shown : State::hidden;
    }
    return state == State::shown;
  };
  const auto is_blank = [&](rdf::TermId id) {
    const rdf::TermView term = all.term(id);
    return term.is_blank() || (term.is_iri() && is_named_blank(term.text));
  };
  const auto is_said = [&](std::size_t i) { return !is_word.empty() && is_word[i]; };
  const auto is_kept = [&](const rdf::Triple& t) { return shown(t.subject) && shown(t.predicate) && shown(t.object); };

  std::vector<bool> led_to(all.term_count()), reached(all.term_count());
  for (const rdf::Triple& t : all.triples())
    if (is_blank(t.object) && t.object != t.subject) led_to[static_cast<std::size_t>(t.object)] = true;
  std::vector<rdf::TermId> open;
  const auto reach = [&](rdf::TermId id) {
    if (reached[static_cast<std::size_t>(id)]) return;
    reached[static_cast<std::size_t>(id)] = true;
    open.push_back(id);
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    const rdf::Triple& t = all.triples()[i];
    if (shown(t.subject) && (!is_blank(t.subject) || !led_to[static_cast<std::size_t>(t.subject)])) reach(t.subject);
    if (!is_said(i)) continue;
    if (is_blank(t.subject)) reach(t.subject);
    if (is_blank(t.object)) reach(t.object);
  }
  const auto reach_all = [&] {
    while (!open.empty()) {
      const rdf::TermId next = open.back();
      open.pop_back();
      for (const rdf::Triple& t : all.match(next, std::nullopt, std::nullopt))
        if (is_kept(t) && is_blank(t.object)) reach(t.object);
    }
  };
  reach_all();

  // The remaining blank nodes: hidden triples lead to them, or they are in cycles and below them.
  std::vector<bool> withheld(all.term_count());
  std::vector<rdf::TermId> hidden;
  const auto withhold = [&](rdf::TermId id) {
    if (!is_blank(id) || reached[static_cast<std::size_t>(id)] || withheld[static_cast<std::size_t>(id)]) return;
    withheld[static_cast<std::size_t>(id)] = true;
    hidden.push_back(id);
  };
  for (const rdf::Triple& t : all.triples())
    if (!is_kept(t)) withhold(t.object);
  while (!hidden.empty()) {
    const rdf::TermId next = hidden.back();
    hidden.pop_back();
    for (const rdf::Triple& t : all.match(next, std::nullopt, std::nullopt)) withhold(t.object);
  }
  for (const rdf::Triple& t : all.triples())
    if (is_blank(t.subject) && !withheld[static_cast<std::size_t>(t.subject)]) reach(t.subject);
  reach_all();

  // Labels of blank nodes may count those that are hidden.
  rdf::Graph part;
  std::vector<std::optional<rdf::TermId>> placed(all.term_count());
  const auto place = [&](rdf::TermId id) {
    std::optional<rdf::TermId>& at = placed[static_cast<std::size_t>(id)];
    if (!at) at = all.term(id).is_blank() ? part.fresh_blank() : part.intern(all.term(id));
    return *at;
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    const rdf::Triple& t = all.triples()[i];
    if (!is_said(i) && !(reached[static_cast<std::size_t>(t.subject)] && is_kept(t))) continue;
    const rdf::TermId subject = place(t.subject), predicate = place(t.predicate), object = place(t.object);
    part.add(subject, predicate, object);
  }
  return part;
}

}  // namespace v0
}  // namespace lrt::engine
