// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/tree.hpp"

#include <utility>

#include <lrt/engine/engine.hpp>

#include "src/engine/description.hpp"
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

/// Its value is that of the last refresh.
bool is_readable(const PropertyResource& property) { return !property.is_failing(); }

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
  for (const Resource* part : described_resources()) part->describe(d);
}

std::vector<const Resource*> TreeResource::described_resources() const {
  std::vector<const Resource*> parts;
  for_each_thing([&](const ThingNode& one) {
    parts.push_back(&one.self);
    for (const PropertyResource* p : one.in_state())
      if (is_readable(*p)) parts.push_back(p);
  });
  return parts;
}

std::optional<PlainValue> TreeResource::plain_value(const Audience& audience) const {
  static const rdf::Facets no_facets;
  types_.clear();
  rdf::Type& record = types_.emplace_back(empty_record());
  rdf::Value::Sequence values;
  if (thing) {
    add_to(record, values, *thing, thing->spec->path.size() + 1, audience);
  } else {
    for (const ThingNode* root : registry_->roots()) add_member(record, values, *root, 0, audience);
  }
  return PlainValue{&record, &no_facets, nullptr, rdf::Value(std::move(values))};
}

/// Adds what a Thing's state has, and the Things below it.
/// @param prefix  how much of their paths is left out
void TreeResource::add_to(rdf::Type& record, rdf::Value::Sequence& values, const ThingNode& one, std::size_t prefix, const Audience& audience) const {
  record.fields = one.kind->state_fields(one, audience);
  for (const PropertyResource* p : one.in_state())
    if (audience.sees(*p)) values.push_back(is_readable(*p) ? p->value : rdf::Value());
  for (const ThingNode* child : one.children) add_member(record, values, *child, prefix, audience);
}

/// Adds a Thing as one member.
/// If the audience may not see it, the Things below it are added in its place.
void TreeResource::add_member(rdf::Type& record, rdf::Value::Sequence& values, const ThingNode& member, std::size_t prefix,
                              const Audience& audience) const {
  if (!audience.sees(member.self)) {
    for (const ThingNode* child : member.children) add_member(record, values, *child, prefix, audience);
    return;
  }
  rdf::Type& type = types_.emplace_back(empty_record());
  rdf::Value::Sequence own;
  add_to(type, own, member, member.spec->path.size() + 1, audience);
  const std::string name = member.spec->path.substr(prefix);
  record.fields.push_back({model::plain_name(name), "#" + name, &type, {}});
  values.push_back(rdf::Value(std::move(own)));
}

bool TreeResource::fits_rdf(std::size_t max_values) const {
  bool all = true;
  for_each_property([&](PropertyResource& p) { all = all && (p.only_octets || fits(p.value, max_values)); });
  return all;
}

std::size_t TreeResource::max_bytes(const EngineOptions& options) const noexcept { return options.max_all_bytes; }

bool TreeResource::is_shown_to(const Audience& audience) const {
  bool below = !thing;
  for_each_thing([&](const ThingNode& one) { below = below || (&one != thing && audience.sees(one.self)); });
  return below;
}

std::uint64_t TreeResource::state(std::uint64_t structure) const noexcept {
  std::uint64_t mixed = structure;
  for_each_property([&](PropertyResource& p) { mixed = (mixed ^ (2 * p.revision + (is_readable(p) ? 0 : 1))) * 1099511628211U; });
  return mixed;
}

std::string TreeResource::up() const { return thing ? thing->self.path : "/"; }

void TreeResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for_each_thing([&](const ThingNode& one) {
    for (PropertyResource* p : one.in_state()) visit(*p);
  });
}

}  // namespace lrt::engine
