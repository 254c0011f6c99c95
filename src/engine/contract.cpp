// SPDX-License-Identifier: Apache-2.0
#include "src/engine/contract.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/registry.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

bool is_number(const rdf::Type& type) { return type.kind == rdf::Type::Kind::optional ? is_number(*type.element) : type.is_number(); }

/// A shape of a list has property paths of blank nodes.
bool has_list(const rdf::Type& type) {
  using Kind = rdf::Type::Kind;
  if (type.kind == Kind::list || type.kind == Kind::map) return true;
  if (type.element) return has_list(*type.element);
  return std::any_of(type.fields.begin(), type.fields.end(), [](const rdf::FieldType& field) { return has_list(*field.type); });
}

std::string bounds_text(const rdf::Facets& f) {
  std::string text;
  if (f.min()) text += (f.min_exclusive() ? ">" : ">=") + rdf::lexical::format(*f.min());
  if (f.max()) text += (f.max_exclusive() ? "<" : "<=") + rdf::lexical::format(*f.max());
  return text;
}

/// Texts of any content, one after the other.
class Signature {
 public:
  Signature& text(std::string_view s) {
    out_ += std::to_string(s.size());
    out_ += ':';
    out_ += s;
    return *this;
  }
  Signature& number(std::size_t n) { return text(std::to_string(n)); }
  Signature& texts(const std::vector<std::string>& all) {
    number(all.size());
    for (const std::string& s : all) text(s);
    return *this;
  }
  Signature& value(const rdf::Type* type, const rdf::Facets& f) {
    number(reinterpret_cast<std::uintptr_t>(type)).text(f.unit().qudt.text).text(f.unit().vom.text);
    number(f.allows_non_finite()).number(f.min_length()).number(f.max_length());
    return type && !is_number(*type) ? text(bounds_text(f)) : *this;
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

}  // namespace

bool ValueShape::has_bounds() const noexcept { return is_number(*type) && (facets->min() || facets->max()); }

std::vector<ValueShape> value_shapes(const ThingNode& thing) {
  std::vector<ValueShape> all;
  for (const auto& p : thing.properties)
    all.push_back({p->spec->path, p->spec->type, &p->spec->facets, static_cast<bool>(p->spec->write), false, p.get(), p.get()});
  for (const auto& a : thing.actions) {
    if (a->spec->input) all.push_back({a->input_shape(), a->spec->input, &a->spec->facets, true, !has_list(*a->spec->input), a.get(), nullptr});
    if (a->spec->output)
      all.push_back({a->output_shape(), a->spec->output, &a->spec->output_facets, false, !has_list(*a->spec->output), a.get(), nullptr});
  }
  for (const auto& c : thing.collections) all.push_back({c->spec->path, c->spec->type, &c->spec->facets, true, false, c.get(), nullptr});
  return all;
}

std::string bounds_of(const ThingNode& thing) {
  Signature bounds;
  for (const ValueShape& values : value_shapes(thing))
    if (values.has_bounds()) bounds.text(values.name).text(bounds_text(*values.facets));
  return bounds.take();
}

std::map<std::string, Links> links_of(const ThingNode& thing, const Registry& registry, const Audience& audience) {
  std::map<std::string, Links> links;
  const auto add = [&](std::string_view predicate, bool is_iri) {
    if (predicate == vocab::rdf_::type.text) return;
    Links& l = links[std::string(predicate)];
    ++l.count;
    (is_iri ? l.literals : l.iris) = false;
  };
  // Where it may not read, nothing is shown of a link, whether something is there or not.
  for (const Statement& s : thing.spec->statements) {
    if (audience.is_restricted() && s.object.kind() == Object::Kind::resource) {
      const Result<std::string> path = model::encode_path_from_root(s.object.text());
      if (path && !audience.sees_iri("/" + *path, {}, registry)) continue;
    }
    add(s.predicate, s.object.kind() != Object::Kind::literal);
  }
  const rdf::Graph& graph = thing.statements();
  const std::string base(placeholder_base);
  if (const auto self = graph.find(rdf::iri(base + "/" + thing.spec->path)))
    for (const rdf::Triple& t : graph.match(*self, std::nullopt, std::nullopt)) {
      const rdf::TermView object = graph.term(t.object);
      if (object.is_iri() && !audience.sees_iri(object.text, base, registry)) continue;
      add(graph.term(t.predicate).text, object.is_iri());
    }
  return links;
}

std::string signature_of(const ThingNode& thing, const Registry& registry) {
  Signature s;
  const model::ThingSpec& spec = *thing.spec;
  s.texts(spec.classes)
      .texts(spec.shapes)
      .text(spec.blueprint ? std::string_view(*spec.blueprint) : std::string_view())
      .number(spec.path.find('/') != std::string::npos);
  s.number(spec.properties.size());
  for (const auto& p : thing.properties) s.number(p->promises_value);
  for (const auto& p : spec.properties) {
    s.text(p->path).texts(p->predicates).texts(p->classes).number(p->file).number(p->octets).number(p->frame != nullptr);
    s.number(static_cast<bool>(p->write)).value(p->type, p->facets);
    if (p->life) s.text("life").number(static_cast<std::size_t>(p->life->life().count()));
    s.number(p->statements.size());
    for (const Statement& statement : p->statements) {
      s.text(statement.predicate);
      // The Blueprint has the words.
      const bool is_text = statement.predicate == vocab::dcterms::title.text || statement.predicate == vocab::dcterms::description.text;
      if (is_text) s.text(statement.object.text()).text(statement.object.language());
    }
  }
  if (spec.control) s.text("control");
  s.number(spec.actions.size());
  for (const auto& a : spec.actions)
    s.text(a->path).texts(a->predicates).texts(a->classes).number(a->stop).value(a->input, a->facets).value(a->output, a->output_facets);
  s.number(spec.collections.size());
  for (const auto& c : spec.collections) s.text(c->path).texts(c->predicates).value(c->type, c->facets);
  for (const auto& [predicate, links] : links_of(thing, registry))
    s.text(predicate).number(links.count == 1).number(links.iris).number(links.literals);
  return s.take();
}

std::string short_hash(std::string_view text) {
  constexpr std::string_view digits = "0123456789abcdef";
  auto hash = static_cast<std::uint32_t>(rdf::hash_bytes(text, 0));
  std::string shown(8, '0');
  for (std::size_t i = shown.size(); i-- > 0; hash >>= 4) shown[i] = digits[hash & 15];
  return shown;
}

}  // namespace v0
}  // namespace lrt::engine
