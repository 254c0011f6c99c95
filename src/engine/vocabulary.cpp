// SPDX-License-Identifier: Apache-2.0
#include "src/engine/vocabulary.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/engine/description.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/documents.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

using Kind = rdf::Type::Kind;

/// The name for links of Things.
constexpr std::string_view of_things = "Thing";

void collect(const rdf::Type* type, std::vector<const rdf::Type*>& found) {
  if (!type) return;
  if (type->element) return collect(type->element, found);
  if (!type->has_fields() || std::find(found.begin(), found.end(), type) != found.end()) return;
  found.push_back(type);
  for (const rdf::FieldType& field : type->fields) collect(field.type, found);
}

/// The records with terms of their own among the Thing's types, each once.
std::vector<const rdf::Type*> own_types(const model::ThingSpec& thing) {
  std::vector<const rdf::Type*> found;
  for (const auto& p : thing.properties) collect(p->type, found);
  for (const auto& a : thing.actions) collect(a->input, found), collect(a->output, found);
  for (const auto& c : thing.collections) collect(c->type, found);
  found.erase(std::remove_if(found.begin(), found.end(), [](const rdf::Type* t) { return t->name.empty(); }), found.end());
  return found;
}

/// The terms that an audience finds in resources that it sees.
struct SeenTerms {
  std::set<std::string> types, linked;

  SeenTerms(const Registry& registry, const Audience& audience) {
    std::vector<const rdf::Type*> found;
    for (const auto& [path, thing] : registry.things()) {
      for (const auto& p : thing->properties)
        if (audience.sees(*p)) collect(p->spec->type, found), linked.insert(p->spec->path);
      for (const auto& a : thing->actions)
        if (audience.sees(*a)) collect(a->spec->input, found), collect(a->spec->output, found);
      for (const auto& c : thing->collections)
        if (audience.sees(*c)) collect(c->spec->type, found);
    }
    for (const rdf::Type* type : found) types.insert(type->name);
  }
};

/// Whether two types give the terms below their name the same meaning.
bool mean_the_same(const rdf::Type& a, const rdf::Type& b) {
  if (&a == &b) return true;
  if (a.kind != b.kind || a.datatype != b.datatype || a.name != b.name || a.classes != b.classes || a.fields.size() != b.fields.size()) return false;
  if ((a.element != nullptr) != (b.element != nullptr) || (a.element && !mean_the_same(*a.element, *b.element))) return false;
  return std::equal(a.fields.begin(), a.fields.end(), b.fields.begin(), [](const rdf::FieldType& x, const rdf::FieldType& y) {
    return x.predicate == y.predicate && x.facets.unit() == y.facets.unit() && mean_the_same(*x.type, *y.type);
  });
}

bool is_own(std::string_view term) { return !term.empty() && term.front() == '#'; }

/// The class of the nodes that have the fields of a record; empty if they have none.
std::string domain_of(const rdf::Type& record, const std::string& vocabulary) {
  const std::vector<std::string>& classes = record.value_predicate.empty() ? record.classes : record.value_classes;
  return classes.empty() ? std::string() : rdf::term_iri(classes.front(), vocabulary);
}

/// rdfs:range of the field, and its unit. A number that takes the unit of the record has no range: it is a node where there is a unit, else a literal.
void describe_range(About& term, const rdf::FieldType& field, const std::string& vocabulary) {
  const rdf::Type* type = field.type;
  while (type->kind == Kind::optional) type = type->element;
  if (type->is_number() && field.takes_unit) return describe_unit(term, field.facets.unit());
  const auto range = [&](Iri iri) { term.add(vocab::rdfs::range, rdf::TermView(iri)); };
  switch (type->kind) {
    case Kind::list:
    case Kind::map: range(vocab::rdf_::List); break;
    case Kind::record:
    case Kind::variant:
      if (const std::string its_class = rdf::target_class(*type, vocabulary); !its_class.empty()) term.link(vocab::rdfs::range, its_class);
      break;
    default: range(type->is_number() && !field.facets.unit().empty() ? vocab::maths::Scalar : type->datatype);
  }
  describe_unit(term, field.facets.unit());
}

/// The triples that every term has.
About described_term(const Description& d, const std::string& vocabulary, const std::string& term, Iri type, const std::string& label) {
  About about(d.graph, rdf::term_iri(term, vocabulary));
  about.a(type).add(vocab::rdfs::label, rdf::literal(label));
  about.link(vocab::rdfs::isDefinedBy, vocabulary.back() == '#' ? vocabulary.substr(0, vocabulary.size() - 1) : vocabulary);
  return about;
}

}  // namespace

std::string link_term(std::string_view name) { return "#" + std::string(of_things) + "/" + std::string(name); }

Result<void> Vocabulary::check(const model::ThingSpec& thing) const {
  std::vector<const rdf::Type*> known;
  for (const rdf::Type* type : own_types(thing)) {
    const auto use = types_.find(type->name);
    const auto here = std::find_if(known.begin(), known.end(), [&](const rdf::Type* t) { return t->name == type->name; });
    const rdf::Type* const other = use != types_.end() ? use->second.type : here != known.end() ? *here : nullptr;
    if (type->name == of_things || (other && !mean_the_same(*type, *other)))
      return unexpected(Errc::duplicate_path, "thing \"" + thing.path + "\": another C++ type is named \"" + type->name +
                                                  "\" in the server's vocabulary, too; give this one a name with r.named(\"...\") in its describe()");
    known.push_back(type);
  }
  return {};
}

void Vocabulary::add(const model::ThingSpec& thing) {
  for (const rdf::Type* type : own_types(thing)) {
    Use& use = types_[type->name];
    use.type = type;
    ++use.count;
  }
  for (const auto& p : thing.properties)
    if (p->predicates.empty()) ++linked_[p->path];
}

void Vocabulary::remove(const model::ThingSpec& thing) {
  for (const rdf::Type* type : own_types(thing))
    if (const auto use = types_.find(type->name); --use->second.count == 0) types_.erase(use);
  for (const auto& p : thing.properties)
    if (p->predicates.empty())
      if (const auto use = linked_.find(p->path); --use->second == 0) linked_.erase(use);
}

void Vocabulary::describe(const Description& d) const {
  const std::string vocabulary = d.engine.vocabulary(d.base);
  About self(d.graph, vocabulary.back() == '#' ? vocabulary.substr(0, vocabulary.size() - 1) : vocabulary);
  self.a(vocab::owl::Ontology).add(vocab::dcterms::title, rdf::tagged_literal("Terms of this robot", "en"));
  self.link(vocab::rdfs::seeAlso, d.base + TermsResource::location);
  std::optional<SeenTerms> seen;
  if (d.audience.is_restricted()) seen.emplace(d.engine.registry, d.audience);
  for (const auto& [name, use] : types_) {
    if (seen && seen->types.count(name) == 0) continue;
    const rdf::Type& type = *use.type;
    if (!type.classes.empty() && is_own(type.classes.front())) described_term(d, vocabulary, type.classes.front(), vocab::rdfs::Class, name);
    for (const rdf::FieldType& field : type.fields) {
      if (!is_own(field.predicate)) continue;
      About term = described_term(d, vocabulary, field.predicate, vocab::rdf_::Property, field.name);
      if (field.facets.has_words()) {
        const rdf::Words words = field.facets.words();
        term.texts(vocab::dcterms::title, words.titles).texts(vocab::dcterms::description, words.descriptions);
      }
      if (const std::string domain = domain_of(type, vocabulary); !domain.empty()) term.link(vocab::rdfs::domain, domain);
      describe_range(term, field, vocabulary);
    }
  }
  for (const auto& [name, count] : linked_) {
    if (seen && seen->linked.count(name) == 0) continue;
    described_term(d, vocabulary, link_term(name), vocab::rdf_::Property, name)
        .add(vocab::rdfs::domain, rdf::TermView(vocab::hybrit::RoboticThing))
        .add(vocab::rdfs::range, rdf::TermView(vocab::hybrit::Property));
  }
}

}  // namespace v0
}  // namespace lrt::engine
