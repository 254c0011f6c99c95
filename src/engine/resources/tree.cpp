// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/tree.hpp"

#include <algorithm>
#include <utility>

#include <lrt/engine/engine.hpp>

#include "src/engine/description.hpp"
#include "src/engine/identity.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/plain_name.hpp"

namespace lrt::engine {

namespace {

void visit_tree(const ThingNode& thing, FunctionRef<void(const ThingNode&)> visit) {
  visit(thing);
  for (const ThingNode* child : thing.children) visit_tree(*child, visit);
}

rdf::Type empty_record() {
  rdf::Type record;
  record.kind = rdf::Type::Kind::record;
  return record;
}

}  // namespace

void TreeResource::for_each_thing(FunctionRef<void(const ThingNode&)> visit) const {
  if (thing) return visit_tree(*thing, visit);
  for (const ThingNode* root : registry_->roots()) visit_tree(*root, visit);
}

void TreeResource::describe(const Description& d) const {
  About(d.graph, d.base + path).a(vocab::ldp::RDFSource);
  std::size_t left = d.engine.options.max_value_members;
  for (const Resource* part : described_resources(d.audience))
    if (d.audience.sees(*part)) describe_in_whole(*part, d, left);
  // Of the robot, and only for those who could read it at the root.
  if (const Resource* const root = thing ? nullptr : registry_->find("/"); root && d.audience.sees(*root)) describe_identity(d.base + path, d);
}

std::vector<const Resource*> TreeResource::described_resources(const Audience& audience) const {
  std::vector<const Resource*> parts;
  const auto add = [&](const ThingNode& one) {
    parts.push_back(&one.self);
    for (const PropertyResource* p : one.in_state()) parts.push_back(p);
  };
  // A property may be seen where its Thing is not.
  for_each_thing([&](const ThingNode& one) {
    if (!audience.sees(one.self)) add(one);
  });
  if (thing && audience.sees(thing->self)) add(*thing);
  std::vector<ThingNode*> open = seen_things(thing ? thing->children : registry_->roots(), audience);
  std::reverse(open.begin(), open.end());
  while (!open.empty()) {
    const ThingNode& next = *open.back();
    open.pop_back();
    add(next);
    const std::vector<ThingNode*> below = seen_things(next.children, audience);
    open.insert(open.end(), below.rbegin(), below.rend());
  }
  return parts;
}

std::optional<PlainValue> TreeResource::plain_value(const Audience& audience) const {
  static const rdf::Facets no_facets;
  types_.clear();
  rdf::Type& record = types_.emplace_back(empty_record());
  PlainState state;
  if (thing) {
    state.add(*thing, audience);
    add_children(state, *thing, thing->spec->path.size() + 1, audience);
  } else {
    for (const ThingNode* root : seen_things(registry_->roots(), audience)) add_member(state, *root, 0, audience);
  }
  state.add_failures(types_);
  record.fields = std::move(state.fields);
  return PlainValue{&record, &no_facets, nullptr, rdf::Value(std::move(state.values))};
}

/// @param prefix  how much of their paths is left out
void TreeResource::add_children(PlainState& state, const ThingNode& one, std::size_t prefix, const Audience& audience) const {
  for (const ThingNode* child : seen_things(one.children, audience)) add_member(state, *child, prefix, audience);
}

/// Adds a Thing that the audience sees, with the Things below it, as one member.
void TreeResource::add_member(PlainState& state, const ThingNode& member, std::size_t prefix, const Audience& audience) const {
  rdf::Type& type = types_.emplace_back(empty_record());
  PlainState own;
  own.add(member, audience);
  add_children(own, member, member.spec->path.size() + 1, audience);
  own.add_failures(types_);
  type.fields = std::move(own.fields);
  const std::string name = member.spec->path.substr(prefix);
  state.fields.push_back({model::plain_name(name), "#" + name, &type, {}});
  state.values.push_back(rdf::Value(std::move(own.values)));
}

std::size_t TreeResource::max_bytes(const EngineOptions& options) const noexcept { return options.max_all_bytes; }

bool TreeResource::is_shown_to(const Audience& audience) const {
  bool below = !thing;
  for_each_thing([&](const ThingNode& one) { below = below || (&one != thing && audience.sees(one.self)); });
  return below;
}

std::uint64_t TreeResource::state(std::uint64_t structure) const noexcept {
  std::uint64_t mixed = structure * 1099511628211U;  // or one step of both would cancel out
  for_each_property([&](PropertyResource& p) { mixed = (mixed ^ (p.revision + p.failure_changes())) * 1099511628211U; });
  return mixed;
}

std::string TreeResource::up() const { return thing ? thing->self.path : "/"; }

void TreeResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for_each_thing([&](const ThingNode& one) {
    for (PropertyResource* p : one.in_state()) visit(*p);
  });
}

}  // namespace lrt::engine
