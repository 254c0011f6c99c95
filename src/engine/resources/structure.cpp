// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/structure.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/engine/contract.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representation_cache.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/vocabulary.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {
inline namespace v0 {

/// A Thing of the document, with those of its resources that it shows.
struct StructureResource::Entry {
  const ThingNode* thing = nullptr;
  const ThingNode* parent = nullptr;  ///< the nearest above it that is in the document; nullptr: none
  std::vector<const PropertyResource*> properties;
  std::vector<const ActionResource*> actions;
  std::vector<const CollectionResource*> collections;

  std::size_t size() const noexcept { return 1 + properties.size() + actions.size() + collections.size(); }
};

/// The document for one audience, in one choice of languages.
struct StructureResource::Made {
  struct Page {
    std::string kinds, things;  ///< what is between the brackets
  };
  std::uint64_t structure = 0;  ///< Registry::structure()
  std::string base;
  Audience audience;
  std::vector<std::string> wanted;  ///< languages
  ChosenTexts texts{nullptr};
  std::string tag;
  std::size_t things = 0;
  std::vector<Page> pages;
};

namespace {

constexpr std::size_t max_searches = 4;  // whose representations are kept

std::string decoded(std::string_view path) {
  Result<std::string> text = iri::decode(path);
  return text ? *std::move(text) : std::string(path);
}

/// Whether a text contains another one, which is in lower case.
bool contains(std::string_view text, const std::string& searched) { return lrt::detail::lower(text).find(searched) != std::string::npos; }

bool any_contains(const rdf::Texts& texts, const std::string& searched) {
  return std::any_of(texts.begin(), texts.end(), [&](const rdf::Text& t) { return contains(t.text, searched); });
}

std::string_view last_segment(std::string_view path) noexcept { return path.substr(path.rfind('/') + 1); }

/// The path of a resource below that of its Thing.
std::string_view below(const Resource& resource, const ThingNode& thing) noexcept {
  return std::string_view(resource.path).substr(thing.self.path.size() + 1);
}

/// Without bounds: they differ between Things that are equal otherwise, and Blueprints have them.
rdf::Facets unbounded(const rdf::Facets& facets) { return rdf::Facets(facets).without_bounds(); }

void write_type(Overview& o, std::string_view key, const rdf::Type* type, const rdf::Facets& facets) {
  if (type) o.schema(key, type, unbounded(facets));
}

/// Datatype and unit of a value, as its Property states them in RDF.
void write_quantity(Overview& o, const rdf::Type& type, const rdf::Facets& facets) {
  const Quantity quantity = quantity_of(type, facets);
  o.text("datatype", quantity.datatype.text);
  std::vector<std::string> units;
  for (const Iri unit : {quantity.unit.qudt, quantity.unit.vom})
    if (!unit.empty()) units.emplace_back(unit.text);
  o.texts("units", units);
}

/// Further names: titles whose language another title has, labels.
/// @param graph  triples about `self`
void write_names(Overview& o, const rdf::Words& words, const std::vector<Statement>& statements, const rdf::Graph& graph = {},
                 const std::string& self = {}) {
  std::vector<std::string> names;
  const auto add = [&](std::string_view name) {
    const auto is_same = [&](const rdf::Text& t) { return t.text == name; };
    if (std::none_of(words.titles.begin(), words.titles.end(), is_same) && std::find(names.begin(), names.end(), name) == names.end())
      names.emplace_back(name);
  };
  for (const Iri predicate : {vocab::dcterms::title, vocab::rdfs::label, vocab::schema::name}) {
    for (const Statement& s : statements)
      if (s.predicate == predicate.text && s.object.kind() == Object::Kind::literal) add(s.object.text());
    if (graph.empty()) continue;
    for (const rdf::TermView& object : graph.objects(rdf::iri(self), rdf::TermView(predicate)))
      if (object.is_literal()) add(object.text);
  }
  o.texts("names", names);
}

rdf::Words words_of(const model::ResourceSpec& spec) {
  return {model::texts_of(spec.statements, vocab::dcterms::title), model::texts_of(spec.statements, vocab::dcterms::description)};
}

/// What people and shapes call a resource.
void write_said(Overview& o, const model::ResourceSpec& spec) {
  const rdf::Words words = words_of(spec);
  o.all_words(words);
  write_names(o, words, spec.statements);
  o.texts("predicates", spec.predicates);
}

void write_property(Overview& o, const PropertyResource& property) {
  const model::PropertySpec& spec = *property.spec;
  o.begin_object(spec.path);
  write_said(o, spec);
  o.types(spec.classes, spec.type);
  write_type(o, "schema", spec.type, spec.facets);
  write_quantity(o, *spec.type, spec.facets);
  std::vector<std::string> formats;
  for (const model::RepresentationSpec& r : spec.representations) formats.push_back(r.media_type);
  if (spec.octets) formats.emplace_back(rdf::media_type(rdf::Plain::octets));
  o.texts("formats", formats);
  if (spec.file) o.json("file", "true");
  if (o.methods(property).put) o.json("writable", "true");
  o.end_object();
}

void write_action(Overview& o, const ActionResource& action, const ThingNode& thing) {
  const model::ActionSpec& spec = *action.spec;
  o.begin_object(spec.path);
  o.text("path", below(action, thing));
  write_said(o, spec);
  o.types(spec.classes, nullptr);
  write_type(o, "input", spec.input, spec.facets);
  if (spec.input) write_quantity(o, *spec.input, spec.facets);
  write_type(o, "output", spec.output, spec.output_facets);
  if (spec.asynchronous) o.json("asynchronous", "true");
  if (spec.stop) o.json("stop", "true");
  if (o.methods(action).post) o.json("invocable", "true");
  o.end_object();
}

void write_collection(Overview& o, const CollectionResource& collection) {
  const model::CollectionSpec& spec = *collection.spec;
  o.begin_object(spec.path);
  write_said(o, spec);
  o.types(spec.classes, nullptr);
  write_type(o, "schema", spec.type, spec.facets);
  if (o.methods(collection).post) o.json("writable", "true");
  o.end_object();
}

/// The classes of a Thing, also those in the user's triples. Not its Blueprints: their names depend on resources that may be hidden.
std::vector<std::string> classes_of(const ThingNode& thing, const std::string& base) {
  std::vector<std::string> all = thing.spec->classes;
  const auto add = [&](std::string type) {
    if (std::find(all.begin(), all.end(), type) == all.end()) all.push_back(std::move(type));
  };
  const rdf::Graph& graph = thing.statements();
  const auto self = graph.find(rdf::iri(std::string(placeholder_base) + thing.self.path)), a = graph.find(vocab::rdf_::type);
  if (!self || !a) return all;
  for (const rdf::Triple& t : graph.match(*self, *a, std::nullopt)) {
    const rdf::TermView type = graph.term(t.object);
    if (!type.is_iri()) continue;
    const bool is_own = type.text.substr(0, placeholder_base.size()) == placeholder_base;
    add(is_own ? base + std::string(type.text.substr(placeholder_base.size())) : std::string(type.text));
  }
  return all;
}

/// Whether a Thing below is in the document.
bool shows_below(const ThingNode& thing, const Audience& audience) {
  return std::any_of(thing.children.begin(), thing.children.end(),
                     [&](const ThingNode* child) { return audience.sees(child->self) || shows_below(*child, audience); });
}

/// Without a title that is only its name.
rdf::Words words_of(const model::ThingSpec& thing) {
  rdf::Words words{model::titles_of(thing), thing.words ? thing.words->descriptions : rdf::Texts()};
  const bool is_name =
      words.titles.size() == 1 && words.titles.begin()->language.empty() && words.titles.begin()->text == decoded(last_segment(thing.path));
  if (is_name) words.titles = {};
  return words;
}

template <class Resources, class Write>
void write_all(Overview& o, std::string_view key, const Resources& resources, Write write) {
  if (resources.empty()) return;
  o.begin_object(key);
  for (const auto* r : resources) write(*r);
  o.end_object();
}

}  // namespace

StructureResource::StructureResource(const Registry& registry, RepresentationCache& cache, const EngineOptions& options, const std::string& text)
    : Resource(location + (text.empty() ? std::string() : "?q=" + percent_encoded(text)), nullptr),
      registry_(registry),
      cache_(cache),
      options_(options),
      text_(lrt::detail::lower(text)) {}

StructureResource::~StructureResource() { cache_.forget(*this); }

Result<Resource*> StructureResource::search(const std::string& text) {
  if (text.empty()) return this;
  if (text.size() > max_text_bytes) return unexpected(Errc::limit_exceeded, "q: expected at most " + std::to_string(max_text_bytes) + " bytes");
  const std::string wanted = location + ("?q=" + percent_encoded(text));
  const auto known = std::find_if(searches_.begin(), searches_.end(), [&](const auto& one) { return one->path == wanted; });
  if (known != searches_.end()) {
    searches_.splice(searches_.begin(), searches_, known);
  } else {
    searches_.push_front(std::make_unique<StructureResource>(registry_, cache_, options_, text));
    if (searches_.size() > max_searches) searches_.pop_back();
  }
  return searches_.front().get();
}

/// @return  false: the document does not have the Thing
bool StructureResource::select(const ThingNode& one, const Audience& audience, Entry& entry) const {
  if (!audience.sees(one.self)) return false;
  entry.thing = &one;
  const bool by_path = text_.find('/') != std::string::npos;
  const std::string own = text_.empty() ? std::string() : decoded(by_path ? std::string_view(one.self.path) : last_segment(one.self.path));
  const bool whole = text_.empty() || contains(own, text_) || any_contains(model::titles_of(*one.spec), text_);
  const auto is_found = [&](const auto& r) {
    if (!audience.sees(*r)) return false;
    if (whole) return true;
    const std::string name = by_path ? own + "/" + decoded(below(*r, one)) : decoded(r->spec->path);
    return contains(name, text_) || any_contains(model::texts_of(r->spec->statements, vocab::dcterms::title), text_);
  };
  for (const auto& p : one.properties)
    if (is_found(p)) entry.properties.push_back(p.get());
  for (const auto& a : one.actions)
    if (is_found(a)) entry.actions.push_back(a.get());
  for (const auto& c : one.collections)
    if (is_found(c)) entry.collections.push_back(c.get());
  return whole || entry.size() > 1;
}

/// Each Thing of the document, breadth first, with the number of its page.
void StructureResource::for_each(const Audience& audience, FunctionRef<void(const Entry&, std::size_t page)> visit) const {
  const std::size_t max = page_factor * options_.max_page_members;
  std::size_t page = 1, on_page = 0;
  std::vector<std::pair<const ThingNode*, const ThingNode*>> all;  // with the nearest above that is in the document
  for (const ThingNode* root : seen_things(registry_.roots(), audience)) all.emplace_back(root, nullptr);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto [one, parent] = all[i];
    Entry entry;
    entry.parent = parent;
    const bool is_in = select(*one, audience, entry);
    for (const ThingNode* child : seen_things(one->children, audience)) all.emplace_back(child, is_in ? one : parent);
    if (!is_in) continue;
    if (on_page != 0 && on_page + entry.size() > max) ++page, on_page = 0;
    on_page += entry.size();
    visit(entry, page);
  }
}

std::size_t StructureResource::pages(const Audience& audience) const {
  std::size_t last = 1;
  for_each(audience, [&](const Entry&, std::size_t page) { last = page; });
  return last;
}

void StructureResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.add(vocab::dcterms::title, rdf::tagged_literal("What the robot is", "en"));
  for_each(d.audience, [&](const Entry& entry, std::size_t page) {
    if (page != d.page) return;
    about.link(vocab::dcterms::hasPart, d.base + entry.thing->self.path);
    entry.thing->self.describe(d);
  });
}

void StructureResource::describe_types(About& about, const Description&) const { about.a(vocab::ldp::RDFSource); }

StructureResource::Made StructureResource::make(Overview& o) const {
  Made made;
  made.structure = registry_.structure();
  made.base = o.base();
  made.audience = o.audience();
  made.wanted = o.texts().wanted();
  Made::Page* page = &made.pages.emplace_back();
  std::unordered_map<std::string, std::string> names;  // of the kinds of this page, by their texts
  std::unordered_set<std::string> taken;
  const auto append = [](std::string& list, const std::string& more) { list.append(list.empty() ? "" : ",").append(more); };
  for_each(o.audience(), [&](const Entry& entry, std::size_t number) {
    if (number > made.pages.size()) {
      page = &made.pages.emplace_back();
      names.clear();
      taken.clear();
    }
    const ThingNode& one = *entry.thing;
    std::string kind = o.apart([&] {
      o.text("label", one.kind->name);
      o.texts("types", classes_of(one, made.base));
      o.text("state", below(one.state, one));
      o.text("subscriptions", below(one.subscriptions, one));
      if (one.spec->world) o.json("world", "true");
      write_all(o, "properties", entry.properties, [&](const PropertyResource& p) { write_property(o, p); });
      write_all(o, "actions", entry.actions, [&](const ActionResource& a) { write_action(o, a, one); });
      write_all(o, "collections", entry.collections, [&](const CollectionResource& c) { write_collection(o, c); });
    });
    const auto found = names.emplace(std::move(kind), std::string());
    std::string& kind_name = found.first->second;
    if (found.second) {
      const std::string& text = found.first->first;
      const std::string first = one.kind->name + "-" + short_hash(text);
      std::string name = first;
      for (unsigned n = 2; !taken.insert(name).second; ++n) name = first + "-" + std::to_string(n);
      append(page->kinds, json_string(name) + ":" + text);
      kind_name = std::move(name);
    }
    append(page->things, o.apart([&] {
      o.text("path", one.self.path);
      const rdf::Words words = words_of(*one.spec);
      o.all_words(words);
      write_names(o, words, one.spec->statements, one.statements(), std::string(placeholder_base) + one.self.path);
      o.text("kind", kind_name);
      if (entry.parent) o.text("parent", entry.parent->self.path);
      if (shows_below(one, o.audience())) o.text("all", below(one.tree, one));
    }));
    ++made.things;
  });
  std::uint64_t hash = made.things;
  for (const Made::Page& one : made.pages) hash = rdf::hash_bytes(one.things, rdf::hash_bytes(one.kinds, hash));
  constexpr std::string_view digits = "0123456789abcdef";
  for (int shift = 60; shift >= 0; shift -= 4) made.tag += digits[(hash >> shift) & 15];
  made.texts.take(o.texts());
  return made;
}

/// The pages of a document are made at once, because each has the tag of all.
const StructureResource::Made& StructureResource::made_for(Overview& o) const {
  const bool is_same = made_ && made_->structure == registry_.structure() && made_->base == o.base() && made_->audience.has_rights_of(o.audience()) &&
                       made_->wanted == o.texts().wanted();
  if (is_same) o.texts().take(made_->texts);
  else made_ = std::make_unique<const Made>(make(o));
  return *made_;
}

void StructureResource::overview(Overview& o) const {
  const Made& made = made_for(o);
  o.text("structure", made.tag);
  o.words({options_.title, {}});
  o.text("vocabulary", rdf::term_iri(link_term({}), o.vocabulary()));
  o.number("count", made.things);
  const std::size_t page = std::min(std::max<std::size_t>(o.page(), 1), made.pages.size());
  const Made::Page& shown = made.pages[page - 1];
  o.json("kinds", "{" + shown.kinds + "}");
  o.json("things", "[" + shown.things + "]");
  o.pages_around(*this, page, made.pages.size());
  if (made.pages.size() == 1) made_ = nullptr;
}

}  // namespace v0
}  // namespace lrt::engine
