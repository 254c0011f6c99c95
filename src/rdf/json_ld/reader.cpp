// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/base/turns.hpp"
#include "src/rdf/codecs.hpp"
#include "src/rdf/json_canonical.hpp"
#include "src/rdf/json_ld/context.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/representable.hpp"

// JSON-LD 1.1 to triples: context processing (4.1, 4.2), expansion (5.1-5.3) and deserialisation to RDF (8.1) of its API, in one pass over
// the document and without intermediate documents.

namespace lrt::rdf {
inline namespace v0 {
namespace {

using json::Children;
using json::Document;
using Id = Document::Id;
using Kind = Document::Kind;

constexpr std::size_t max_depth = 256;      // of objects and arrays
constexpr std::size_t max_terms = 4000;     // defined by the contexts of a document
constexpr std::size_t max_contexts = 32;    // in one array, or nested
constexpr std::size_t max_dependency = 64;  // of a term on the prefix of its prefix ...
constexpr std::size_t max_references = 16;  // of contexts to contexts

constexpr Iri json_datatype{"http://www.w3.org/1999/02/22-rdf-syntax-ns#JSON"};

/// Thrown to end the reading early, inside this file only.
struct Refused {
  Error error;
};

constexpr std::string_view keywords[] = {"@base",      "@container", "@context",  "@direction", "@graph", "@id",      "@import", "@included",
                                         "@index",     "@json",      "@language", "@list",      "@nest",  "@none",    "@prefix", "@propagate",
                                         "@protected", "@reverse",   "@set",      "@type",      "@value", "@version", "@vocab"};

bool is_keyword(std::string_view text) noexcept {
  return !text.empty() && text.front() == '@' && std::find(std::begin(keywords), std::end(keywords), text) != std::end(keywords);
}
/// "@" and letters: reserved for future keywords and ignored (JSON-LD-API 1.1, 4.2.2).
bool looks_like_keyword(std::string_view text) noexcept {
  return text.size() > 1 && text.front() == '@' && std::all_of(text.begin() + 1, text.end(), [](char c) { return lrt::detail::is_alpha(c); });
}
bool is_blank_node(std::string_view text) noexcept { return text.substr(0, 2) == "_:"; }

/// A document: the one that is read, or a registered context.
struct Source {
  const Document* document;
  std::string iri;  // that references in contexts are relative to; empty: none
  bool is_registered = false;
};

struct Definition {
  std::optional<std::string> iri;  // or a keyword; nullopt: the term is ignored
  enum class Type : std::uint8_t { absent, none, id, vocab, json, datatype } type = Type::absent;
  std::string datatype;
  std::optional<std::string> language;  // "": none, also if there is a default
  bool list = false, language_map = false, index_map = false, id_map = false, type_map = false, reverse = false, prefix = false;
  bool graph = false, is_protected = false;
  std::string index;               // the property of the names in an index_map; "": they are no data
  Id scoped = Document::none;      // the context of its values, or of the nodes that have it as type
  const Source* source = nullptr;  // where `scoped` is
};

/// Equal but for @protected (JSON-LD-API 1.1, 4.2.2, 27).
bool is_same(const Definition& a, const Definition& b) {
  const auto all = [](const Definition& d) {
    return std::tie(d.iri, d.type, d.datatype, d.language, d.list, d.language_map, d.index_map, d.id_map, d.type_map, d.reverse, d.prefix, d.graph,
                    d.index);
  };
  const auto scope = [](const Definition& d) { return d.source == nullptr ? std::string() : json::canonical(*d.source->document, d.scoped); };
  return all(a) == all(b) && (a.source == nullptr) == (b.source == nullptr) && scope(a) == scope(b);
}

/// An active context: the changes of a local context and the context that it is based on. What contexts have in common is shared.
struct Layer {
  using Terms = std::map<std::string, Definition, std::less<>>;
  std::shared_ptr<const Layer> below;
  Terms before_own;                  // defined before the reference to lrt's own context, if there is one: its terms hide them
  std::shared_ptr<const Layer> own;  // lrt's own context
  Terms terms;
  std::shared_ptr<const std::string> base, vocab;
  std::string language;
  std::shared_ptr<const Layer> previous;           // that nodes in this node have; nullptr: this one
  bool has_protected = false, has_scoped = false;  // of any term
  std::size_t height = 0;

  const Definition* find(std::string_view term) const noexcept {
    for (const Layer* layer = this; layer != nullptr; layer = layer->below.get()) {
      if (const auto found = layer->terms.find(term); found != layer->terms.end()) return &found->second;
      if (layer->own == nullptr) continue;
      if (const Definition* found = layer->own->find(term)) return found;
      if (const auto found = layer->before_own.find(term); found != layer->before_own.end()) return &found->second;
    }
    return nullptr;
  }

  /// Adds lrt's own context. Each term moves at most once, however often the context is referred to.
  void add(const std::shared_ptr<const Layer>& own_context) {
    own = own_context;
    if (before_own.empty()) {
      before_own.swap(terms);
      return;
    }
    for (auto& [term, definition] : terms) before_own.insert_or_assign(term, std::move(definition));
    terms.clear();
  }
};
using Context = std::shared_ptr<const Layer>;

std::string exact_double(double value) {
  std::string rounded = json_ld::canonical_double(value);
  if (lexical::parse_double(rounded) == value) return rounded;
  char buffer[48];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific).ptr;
  const std::string_view text(buffer, static_cast<std::size_t>(end - buffer));
  const std::size_t e = text.find('e');
  int exponent = 0;
  std::from_chars(text.data() + e + (text[e + 1] == '+' ? 2 : 1), text.data() + text.size(), exponent);
  return std::string(text.substr(0, e)) + "E" + std::to_string(exponent);  // it has 17 digits, so there is a point
}

/// How a context applies.
struct How {
  bool propagates = true;  // to the nodes in a node, too
  bool overrides = false;  // protected terms
};

class Reader {
 public:
  Reader(const Document& document, const ReadOptions& options, bool reads_dataset = false)
      : options_(options),
        reads_dataset_(reads_dataset),
        initial_base_(options.base.empty() ? nullptr : shared(options.base)),
        self_{&document, std::string(options.base)} {}

  Dataset read() {
    auto start = std::make_shared<Layer>();
    start->base = initial_base_;
    const Id root = document().root();
    const Kind kind = document().kind(root);
    if (kind != Kind::object && kind != Kind::array) refuse(root, "expected an object or an array");
    if (kind == Kind::array) top(start, root);
    else whole(start, root);
    Dataset all;
    all.default_graph = std::move(default_.graph);
    for (auto& [name, target] : named_) all.named.emplace_back(std::move(name), std::move(target->graph));
    return all;
  }

  /// The active context of lrt's own document, parsed once. It depends on the options of a server, so there are few.
  static Context own_context(const Prefixes& prefixes) {
    struct Known {
      std::mutex mutex;
      std::vector<std::pair<Prefixes, Context>> contexts;
    };
    static Immortal<Known> known;
    constexpr std::size_t max_known = 16;
    const std::lock_guard lock(known->mutex);
    for (const auto& [of, context] : known->contexts)
      if (of == prefixes) return context;
    Context made = parse_own_context(prefixes);
    if (known->contexts.size() < max_known) known->contexts.emplace_back(prefixes, made);
    return made;
  }

  static Context parse_own_context(const Prefixes& prefixes) {
    const std::string text = json_ld_context(prefixes);
    const Result<Document> parsed = Document::parse(text, {100'000, max_depth});
    if (!parsed) throw Refused{parsed.error()};
    const ReadOptions options;
    Reader reader(*parsed, options);
    return reader.with_context(std::make_shared<Layer>(), parsed->root());
  }

 private:
  /// The members of a context during its processing. A term may depend on terms that come later.
  struct Local {
    struct Term {
      const Source* source;
      Id member;
      enum class State : std::uint8_t { open, begun, done } state = State::open;
    };
    std::map<std::string_view, Term> terms;
    bool is_protected = false;  // what its terms are unless they say it
    bool overrides = false;     // it may redefine protected terms
  };
  /// Another document is read for a while.
  class Within {
   public:
    Within(Reader& reader, const Source* source) : reader_(reader), before_(std::exchange(reader.source_, source)) {}
    ~Within() { reader_.source_ = before_; }
    Within(const Within&) = delete;
    Within& operator=(const Within&) = delete;

   private:
    Reader& reader_;
    const Source* before_;
  };
  /// The triples of one graph, and the blank nodes in it.
  struct Target {
    Graph graph;
    std::map<std::string, TermId, std::less<>> labels;
    std::size_t blanks = 0;
  };

  const Document& document() const noexcept { return *source_->document; }

  [[noreturn]] void refuse(Id at, const std::string& sentence, Errc code = Errc::expected_rdf) const {
    const std::string where = source_->is_registered ? "in the context <" + shortened(source_->iri) + "> at \"" : "at \"";
    throw Refused{Error{code, where + document().pointer(at) + "\": " + sentence}};
  }
  [[noreturn]] void unsupported(Id at, const std::string& what) const { refuse(at, what + " is not supported", Errc::unsupported_syntax); }

  std::string_view string_at(Id at, const char* what) const {
    if (document().kind(at) != Kind::string) refuse(at, std::string("expected ") + what + " as a string");
    return document().text(at);
  }

  // --- contexts

  Context with_context(const Context& active, Id object) {
    const Id local = document().member(object, "@context");
    return local == Document::none ? active : with_local(active, local);
  }

  /// The context of a term's values (JSON-LD-API 1.1, 5.1.2, 8).
  Context with_scope(const Context& active, const Definition* term) { return with_scoped(active, term, {true, true}); }
  /// The context of nodes of a type (JSON-LD-API 1.1, 5.1.2, 11).
  Context with_type(const Context& active, const Definition* term) { return with_scoped(active, term, {false, false}); }

  /// A context is processed once for each active context.
  Context with_scoped(const Context& active, const Definition* term, How how) {
    if (term == nullptr || term->source == nullptr) return active;
    Scope& scope = scopes_[{active.get(), term->source, term->scoped, how.propagates}];
    if (!scope.made) {
      scope.active = active;
      const Within within(*this, term->source);
      scope.made = with_local(active, term->scoped, how);
    }
    return scope.made;
  }

  /// A registered context, as with_scoped().
  Context with_registered(const Context& active, Id local, const Source& source) {
    Scope& scope = scopes_[{active.get(), &source, Document::none, true}];
    if (!scope.made) {
      scope.active = active;
      auto layer = layer_on(active, local);
      add_registered(*layer, local, source, {});
      scope.made = std::move(layer);
    }
    return scope.made;
  }

  std::shared_ptr<Layer> layer_on(const Context& active, Id local) const {
    auto layer = std::make_shared<Layer>();
    layer->below = active;
    layer->base = active->base;
    layer->vocab = active->vocab;
    layer->language = active->language;
    layer->previous = active->previous;
    layer->has_protected = active->has_protected;
    layer->has_scoped = active->has_scoped;
    layer->height = active->height + 1;
    if (layer->height > max_contexts)
      refuse(local, "contexts in contexts, more than " + std::to_string(max_contexts) + " deep", Errc::limit_exceeded);
    return layer;
  }

  /// JSON-LD-API 1.1, 4.1.2.
  Context with_local(const Context& outer, Id local, How how = {}) {
    if (document().kind(local) != Kind::array) {
      if (how.propagates && !how.overrides && document().kind(local) == Kind::string)
        if (const Source* source = registered(name_at(local))) return with_registered(outer, local, *source);
      auto layer = layer_on(outer, local);
      const bool propagates = propagation(local).value_or(how.propagates);
      if (!propagates && !layer->previous) layer->previous = outer;
      add_context(*layer, local, {propagates, how.overrides});
      return layer;
    }
    // Documents often begin with the same context of others, and then have one of their own.
    Context active = outer;
    std::size_t count = 0;
    std::shared_ptr<Layer> layer;
    for (const Id item : Children(document(), local)) {
      if (++count > max_contexts) refuse(item, "more than " + std::to_string(max_contexts) + " contexts", Errc::limit_exceeded);
      if (count == 1 && how.propagates && !how.overrides && document().kind(item) == Kind::string) {
        if (const Source* source = registered(name_at(item))) {
          active = with_registered(outer, item, *source);
          continue;
        }
      }
      if (!layer) {
        layer = layer_on(active, local);
        if (!how.propagates && !layer->previous) layer->previous = outer;
      }
      (void)propagation(item);
      add_context(*layer, item, how);
    }
    return layer ? layer : active;
  }

  /// What a context says of it.
  std::optional<bool> propagation(Id local) const {
    if (document().kind(local) != Kind::object) return std::nullopt;
    const Id given = document().member(local, "@propagate");
    return given == Document::none ? std::nullopt : std::optional(flag_at(given));
  }

  bool flag_at(Id at) const {
    const Kind kind = document().kind(at);
    if (kind != Kind::true_ && kind != Kind::false_) refuse(at, "expected true or false");
    return kind == Kind::true_;
  }

  void add_context(Layer& layer, Id local, How how) {
    switch (document().kind(local)) {
      case Kind::null:
        if (layer.has_protected && !how.overrides) refuse(local, "null would remove protected terms");
        layer.below = nullptr;
        layer.before_own.clear();
        layer.own = nullptr;
        layer.terms.clear();
        layer.base = initial_base_;
        layer.vocab = nullptr;
        layer.language.clear();
        layer.has_protected = layer.has_scoped = false;
        if (how.propagates) layer.previous = nullptr;
        return;
      case Kind::string: return add_named(layer, local, how);
      case Kind::object: return add_definitions(layer, local, how);
      default: refuse(local, "expected a context: an object, an IRI or null");
    }
  }

  static std::shared_ptr<const std::string> shared(std::string_view text) { return std::make_shared<const std::string>(text); }

  static std::string_view without_query(std::string_view iri) noexcept { return iri.substr(0, iri.find_first_of("?#")); }

  /// The IRI of a context that a document refers to.
  std::string name_at(Id at) const {
    const std::string_view text = string_at(at, "an IRI");
    if (!source_->iri.empty())
      if (Result<std::string> resolved = iri::resolve(source_->iri, text)) return *std::move(resolved);
    return std::string(text);
  }

  /// nullptr: there is none.
  const Source* registered(const std::string& name);

  [[noreturn]] void refuse_name(Id at, const std::string& name) const {
    const std::string_view ours = options_.context.empty() ? json_ld_context_iri : options_.context;
    refuse(at,
           "the context <" + shortened(name) + "> is not registered, and lrt fetches none: embed it in the document, use <" + std::string(ours) +
               ">, or have the host register its text (rdf::Contexts::add)",
           Errc::unsupported_syntax);
  }

  void add_named(Layer& layer, Id local, How how) {
    const std::string name = name_at(local);
    if (const Source* source = registered(name)) return add_registered(layer, local, *source, how);
    const std::string_view plain = without_query(name);
    if (plain != json_ld_context_iri && (options_.context.empty() || plain != without_query(options_.context))) refuse_name(local, name);
    if (!own_) own_ = own_context(options_.context_prefixes != nullptr ? *options_.context_prefixes : default_prefixes());
    if (layer.has_protected && !how.overrides)
      for (const auto& [term, definition] : own_->terms)
        if (const Definition* before = layer.find(term); before != nullptr && before->is_protected && !is_same(*before, definition))
          refuse(local, "the term \"" + term + "\" is protected, and <" + shortened(name) + "> defines it in another way");
    layer.add(own_);
  }

  void add_registered(Layer& layer, Id local, const Source& source, How how) {
    if (++references_ > max_references)
      refuse(local, "contexts that refer to contexts, more than " + std::to_string(max_references) + " deep", Errc::limit_exceeded);
    const Within within(*this, &source);
    const Id context = document().member(document().root(), "@context");
    if (document().kind(context) == Kind::array) {
      for (const Id item : Children(document(), context)) add_context(layer, item, how);
    } else {
      const bool propagates = propagation(context).value_or(how.propagates);
      if (!propagates && !layer.previous) layer.previous = std::make_shared<Layer>(layer);
      add_context(layer, context, {propagates, how.overrides});
    }
    --references_;
  }

  /// A member of a context, or of one that it imports.
  struct Member {
    const Source* source;
    Id id;
  };
  /// JSON-LD-API 1.1, 4.1.2, 5.6: what the context itself says has precedence over what it imports.
  std::vector<Member> members_of(Id local) {
    std::vector<Member> all;
    if (const Id import = document().member(local, "@import"); import != Document::none) {
      const std::string name = name_at(import);
      const Source* source = registered(name);
      if (source == nullptr) refuse_name(import, name);
      const Document& theirs = *source->document;
      const Id context = theirs.member(theirs.root(), "@context");
      if (theirs.kind(context) != Kind::object) refuse(import, "expected the IRI of a context that is one object");
      if (theirs.member(context, "@import") != Document::none) refuse(import, "the context <" + shortened(name) + "> imports another one");
      for (const Id member : Children(theirs, context))
        if (document().member(local, theirs.key(member)) == Document::none) all.push_back({source, member});
    }
    for (const Id member : Children(document(), local))
      if (document().key(member) != "@import") all.push_back({source_, member});
    return all;
  }

  void add_definitions(Layer& layer, Id local, How how) {
    const std::vector<Member> members = members_of(local);
    Local terms;
    terms.overrides = how.overrides;
    // Keywords first: terms may depend on them.
    for (const Member& m : members) {
      const Within within(*this, m.source);
      const Id member = m.id;
      const std::string_view key = document().key(member);
      const Kind kind = document().kind(member);
      if (key == "@propagate") (void)flag_at(member);
      if (key == "@protected") terms.is_protected = flag_at(member);
      if (key == "@direction") check_direction(member);
      if (key == "@version" && (kind != Kind::number || document().text(member) != "1.1")) refuse(member, "expected 1.1 as @version");
      if (key == "@base" && !source_->is_registered) {
        if (kind == Kind::null) {
          layer.base = nullptr;
        } else {
          std::string base(string_at(member, "an IRI"));
          if (!iri::is_absolute(base)) base = resolved(layer, base, member);
          if (!iri::is_absolute(base) || base.size() > max_iri) refuse(member, "expected an IRI as @base, found \"" + shortened(base) + "\"");
          layer.base = shared(base);
        }
      }
    }
    for (const Member& m : members) {
      const Within within(*this, m.source);
      const Id member = m.id;
      const std::string_view key = document().key(member);
      if (key == "@vocab") {
        if (document().kind(member) == Kind::null) {
          layer.vocab = nullptr;
          continue;
        }
        const std::string_view text = string_at(member, "an IRI");
        std::optional<std::string> vocab = expand_iri(layer, text, true, true, member);
        if (!vocab || !(iri::is_absolute(*vocab) || is_blank_node(*vocab)))
          refuse(member, "expected an IRI as @vocab, found \"" + shortened(text) + "\"");
        if (is_blank_node(*vocab)) unsupported(member, "a blank node as @vocab");
        layer.vocab = shared(*vocab);
      } else if (key == "@language") {
        layer.language = document().kind(member) == Kind::null ? std::string() : language_at(member);
      }
    }
    for (const Member& m : members) {
      const Within within(*this, m.source);
      static constexpr std::string_view ours[] = {"@base", "@vocab", "@language", "@version", "@protected", "@direction", "@propagate"};
      const std::string_view key = document().key(m.id);
      if (std::find(std::begin(ours), std::end(ours), key) != std::end(ours)) continue;
      if (++terms_ > max_terms) refuse(m.id, "more than " + std::to_string(max_terms) + " terms", Errc::limit_exceeded);
      terms.terms.emplace(key, Local::Term{m.source, m.id});
    }
    for (auto& [key, term] : terms.terms) define(layer, terms, term, 0);
  }

  /// The base direction of texts, which has no place in RDF: it is checked and dropped (rdfDirection null, JSON-LD-API 1.1, 8.2.2).
  void check_direction(Id at) const {
    if (document().kind(at) == Kind::null) return;
    const std::string_view text = string_at(at, "\"ltr\" or \"rtl\"");
    if (text != "ltr" && text != "rtl") refuse(at, "expected \"ltr\" or \"rtl\", found \"" + shortened(text) + "\"");
  }

  std::string language_at(Id at) const {
    std::string tag(string_at(at, "a language tag"));
    if (!is_language_tag(tag)) refuse(at, "expected a language tag, found \"" + shortened(tag) + "\"");
    for (char& c : tag) c = lrt::detail::lower(c);
    return tag;
  }

  /// JSON-LD-API 1.1, 4.2.2.
  void define(Layer& layer, Local& local, Local::Term& one, std::size_t depth) {
    const Within within(*this, one.source);
    const Id member = one.member;
    const std::string_view term = document().key(member);
    if (one.state == Local::Term::State::done) return;
    if (one.state == Local::Term::State::begun) refuse(member, "the term \"" + shortened(term) + "\" depends on itself");
    one.state = Local::Term::State::begun;
    if (depth > max_dependency) refuse(member, "terms that depend on each other, more than " + std::to_string(max_dependency), Errc::limit_exceeded);
    if (term.empty()) refuse(member, "expected a term, found nothing");
    if (term == "@type") {
      check_type_term(member);
    } else if (is_keyword(term)) {
      refuse(member, "the keyword " + std::string(term) + " cannot be defined");
    } else if (!looks_like_keyword(term)) {
      Definition made = definition(layer, local, one, depth);
      if (made.iri && made.iri->size() > max_iri) refuse(member, "IRI of more than " + std::to_string(max_iri) + " bytes", Errc::limit_exceeded);
      const Id given = document().kind(member) == Kind::object ? document().member(member, "@protected") : Document::none;
      made.is_protected = given == Document::none ? local.is_protected : flag_at(given);
      const Definition* before = layer.has_protected && !local.overrides ? layer.find(term) : nullptr;
      if (before != nullptr && before->is_protected) {
        if (!is_same(*before, made)) refuse(member, "the term \"" + shortened(term) + "\" is protected, and means something else here");
        made = *before;
      }
      layer.has_protected = layer.has_protected || made.is_protected;
      layer.has_scoped = layer.has_scoped || made.source != nullptr;
      layer.terms.insert_or_assign(std::string(term), std::move(made));
    }
    one.state = Local::Term::State::done;
  }

  /// @type may only be a set, and protected (JSON-LD-API 1.1, 4.2.2, 4).
  void check_type_term(Id member) const {
    bool is_allowed = document().kind(member) == Kind::object && document().first(member) != Document::none;
    for (const Id part : Children(document(), member)) {
      if (document().key(part) == "@protected") (void)flag_at(part);
      else
        is_allowed = is_allowed && document().key(part) == "@container" && document().kind(part) == Kind::string && document().text(part) == "@set";
    }
    if (!is_allowed) refuse(member, "the keyword @type cannot be defined, except with @set as @container");
  }

  Definition definition(Layer& layer, Local& local, Local::Term& one, std::size_t depth) {
    const Id member = one.member;
    const std::string_view term = document().key(member);
    Definition made;
    const Kind kind = document().kind(member);
    if (kind == Kind::null) return made;
    if (kind != Kind::string && kind != Kind::object) refuse(member, "expected the definition of a term: an IRI, an object or null");
    const bool simple = kind == Kind::string;
    const auto part = [&](std::string_view name) { return simple ? Document::none : document().member(member, name); };
    const auto expand = [&](Id at, std::string_view text) { return expand_iri(layer, text, true, false, at, &local, depth); };
    if (!simple) {
      for (const Id p : Children(document(), member)) {
        const std::string_view name = document().key(p);
        if (name == "@direction") check_direction(p);
        static constexpr std::string_view known[] = {"@id",   "@reverse",   "@container", "@language", "@nest", "@prefix",
                                                     "@type", "@protected", "@direction", "@context",  "@index"};
        if (std::find(std::begin(known), std::end(known), name) == std::end(known))
          refuse(p, "\"" + shortened(name) + "\" is not part of a term definition");
      }
    }

    if (const Id p = part("@type"); p != Document::none) {
      const std::optional<std::string> type = expand(p, string_at(p, "an IRI"));
      if (!type) refuse(p, "expected an IRI as @type");
      if (*type == "@json") made.type = Definition::Type::json;
      else if (*type == "@id") made.type = Definition::Type::id;
      else if (*type == "@vocab") made.type = Definition::Type::vocab;
      else if (*type == "@none") made.type = Definition::Type::none;
      else if (iri::is_absolute(*type)) made.type = Definition::Type::datatype, made.datatype = *type;
      else refuse(p, "expected an IRI as @type, found \"" + shortened(*type) + "\"");
    }
    const Id reverse = part("@reverse"), given = simple ? member : part("@id");
    if (reverse != Document::none) {
      if (part("@id") != Document::none || part("@nest") != Document::none) refuse(member, "@reverse excludes @id and @nest");
      made.iri = expand(reverse, string_at(reverse, "an IRI"));
      if (!made.iri || !iri::is_absolute(*made.iri)) refuse(reverse, "expected an IRI as @reverse");
      made.reverse = true;
    } else if (given != Document::none && document().kind(given) == Kind::null) {
      return Definition();
    } else if (given != Document::none && document().kind(given) == Kind::string && document().text(given) != term) {
      const std::string_view text = document().text(given);
      if (looks_like_keyword(text) && !is_keyword(text)) return Definition();
      made.iri = expand(given, text);
      if (!made.iri || !(is_keyword(*made.iri) || is_blank_node(*made.iri) || iri::is_absolute(*made.iri)))
        refuse(given, "expected an IRI or a keyword for the term \"" + shortened(term) + "\", found \"" + shortened(text) + "\"");
      if (*made.iri == "@context") refuse(given, "@context must not have an alias");
      const bool is_compact = term.substr(1).find(':') != std::string_view::npos && term.back() != ':';
      if (is_compact || term.find('/') != std::string_view::npos) {
        one.state = Local::Term::State::done;
        if (expand(member, term) != made.iri) refuse(member, "the term \"" + shortened(term) + "\" stands for another IRI already");
      } else if (term.find(':') == std::string_view::npos) {
        made.prefix = simple && (is_blank_node(*made.iri) || std::string_view(":/?#[]@").find(made.iri->back()) != std::string_view::npos);
      }
    } else if (given != Document::none && document().kind(given) != Kind::string) {
      refuse(given, "expected an IRI as @id of a term");
    } else if (const std::size_t colon = term.find(':', 1); colon != std::string_view::npos) {
      // The term itself is an IRI, with or without a prefix.
      made.iri = expand_prefixed(layer, term, colon, &local, depth, true);
      if (!made.iri) made.iri = std::string(term);
      if (!is_blank_node(*made.iri) && !iri::is_absolute(*made.iri)) refuse(member, "expected a term, found \"" + shortened(term) + "\"");
    } else if (layer.vocab) {
      made.iri = *layer.vocab + std::string(term);
    } else {
      refuse(member, "the term \"" + shortened(term) + "\" has no IRI: there is neither @id nor @vocab");
    }

    if (const Id p = part("@container"); p != Document::none && document().kind(p) != Kind::null) container(made, p);
    if (made.type_map && made.type == Definition::Type::absent) made.type = Definition::Type::id;
    if (made.type_map && made.type != Definition::Type::id && made.type != Definition::Type::vocab)
      refuse(member, "@type as a container excludes another @type than @id and @vocab");
    if (const Id p = part("@index"); p != Document::none) {
      if (!made.index_map) refuse(p, "expected @index as @container, too");
      const std::optional<std::string> index = expand(p, string_at(p, "an IRI"));
      if (!index || !iri::is_absolute(*index)) refuse(p, "expected an IRI as @index");
      made.index = std::string(document().text(p));
    }
    if (const Id p = part("@context"); p != Document::none) made.scoped = p, made.source = source_;
    if (const Id p = part("@language"); p != Document::none && made.type == Definition::Type::absent)
      made.language = document().kind(p) == Kind::null ? std::string() : language_at(p);
    if (const Id p = part("@nest"); p != Document::none) {
      const std::string_view nest = string_at(p, "@nest or a term");
      if (is_keyword(nest) && nest != "@nest") refuse(p, "expected @nest or a term");
    }
    if (const Id p = part("@prefix"); p != Document::none) {
      const Kind flag = document().kind(p);
      if (flag != Kind::true_ && flag != Kind::false_) refuse(p, "expected true or false");
      if (term.find_first_of(":/") != std::string_view::npos) refuse(p, "the term \"" + shortened(term) + "\" cannot be a prefix");
      made.prefix = flag == Kind::true_;
      if (made.prefix && is_keyword(*made.iri)) refuse(p, "a keyword cannot be a prefix");
    }
    return made;
  }

  void container(Definition& made, Id at) {
    bool set = false;
    const auto one = [&](Id item) {
      const std::string_view name = string_at(item, "a keyword");
      if (name == "@list") made.list = true;
      else if (name == "@set") set = true;
      else if (name == "@language") made.language_map = true;
      else if (name == "@index") made.index_map = true;
      else if (name == "@id") made.id_map = true;
      else if (name == "@type") made.type_map = true;
      else if (name == "@graph") made.graph = true;
      else refuse(item, "expected @list, @set, @language, @index, @id, @type or @graph as @container, found \"" + shortened(name) + "\"");
    };
    if (document().kind(at) == Kind::array) {
      for (const Id item : Children(document(), at)) one(item);
    } else {
      one(at);
    }
    if (made.list + made.language_map + made.index_map + made.id_map + made.type_map > 1 || (made.list && (set || made.reverse)) ||
        (made.graph && (made.list || made.language_map || made.type_map)) ||
        (made.reverse && (made.language_map || made.id_map || made.type_map || made.graph)))
      refuse(at, "these containers exclude each other");
  }

  // --- IRIs

  void count_expanded(std::size_t size) {
    expanded_ += size;
    if (expanded_ > options_.max_bytes)
      throw Refused{Error{Errc::limit_exceeded, "IRIs of more than " + std::to_string(options_.max_bytes) + " bytes when written out"}};
  }

  std::string resolved(const Layer& layer, std::string_view text, Id at) {
    if (!layer.base) refuse(at, "relative IRI <" + shortened(text) + "> and no base");
    count_expanded((layer.base->size() + text.size()) * (layer.base->size() > long_base ? 5 : 1));
    Result<std::string> made = iri::resolve(*layer.base, text);
    if (!made) refuse(at, "expected an IRI, found \"" + shortened(text) + "\"");
    return *std::move(made);
  }

  /// The IRI of "prefix:name"; nullopt: it is not a prefix.
  std::optional<std::string> expand_prefixed(const Layer& layer, std::string_view text, std::size_t colon, Local* local, std::size_t depth,
                                             bool by_any_term = false) {
    const std::string_view prefix = text.substr(0, colon), name = text.substr(colon + 1);
    if (prefix == "_" || name.substr(0, 2) == "//") return std::nullopt;
    if (local != nullptr) define_first(layer, *local, prefix, depth);
    const Definition* found = layer.find(prefix);
    if (found == nullptr || !found->iri || !(found->prefix || by_any_term)) return std::nullopt;
    count_expanded(found->iri->size() + name.size());
    return *found->iri + std::string(name);
  }

  void define_first(const Layer& layer, Local& local, std::string_view term, std::size_t depth) {
    const auto found = local.terms.find(term);
    if (found != local.terms.end()) define(const_cast<Layer&>(layer), local, found->second, depth + 1);
  }

  /// JSON-LD-API 1.1, 5.2. nullopt: null. With `local`, during context processing: terms that come later are defined first.
  std::optional<std::string> expand_iri(const Layer& layer, std::string_view text, bool vocab, bool document_relative, Id at, Local* local = nullptr,
                                        std::size_t depth = 0) {
    if (is_keyword(text)) return std::string(text);
    if (looks_like_keyword(text)) return std::nullopt;
    if (local != nullptr) define_first(layer, *local, text, depth);
    if (const Definition* found = layer.find(text); found != nullptr && (vocab || (found->iri && is_keyword(*found->iri)))) return found->iri;
    if (const std::size_t colon = text.empty() ? std::string_view::npos : text.find(':', 1); colon != std::string_view::npos) {
      if (std::optional<std::string> whole = expand_prefixed(layer, text, colon, local, depth)) return whole;
      if (is_blank_node(text) || is_scheme(text.substr(0, colon))) return std::string(text);
    }
    if (vocab && layer.vocab) {
      count_expanded(layer.vocab->size() + text.size());
      return *layer.vocab + std::string(text);
    }
    if (document_relative) return resolved(layer, text, at);
    return std::string(text);
  }

  static bool is_scheme(std::string_view text) noexcept {
    return !text.empty() && lrt::detail::is_alpha(text.front()) &&
           std::all_of(text.begin(), text.end(), [](char c) { return lrt::detail::is(c, lrt::detail::scheme); });
  }

  /// An IRI or blank node from an expanded text.
  TermId node_of(Id at, const std::string& expanded) {
    if (is_blank_node(expanded)) return blank_node(expanded);
    if (expanded.size() > max_iri) refuse(at, "IRI of more than " + std::to_string(max_iri) + " bytes", Errc::limit_exceeded);
    if (is_keyword(expanded) || !iri::is_absolute(expanded)) refuse(at, "expected an absolute IRI, found \"" + shortened(expanded) + "\"");
    return graph().intern(iri(expanded));
  }

  Graph& graph() noexcept { return target_->graph; }
  TermId fresh_blank() { return graph().intern(blank("b" + std::to_string(target_->blanks++))); }
  TermId blank_node(const std::string& label) {
    auto& labels = target_->labels;
    const auto known = labels.find(label);
    return known != labels.end() ? known->second : labels.emplace(label, fresh_blank()).first->second;
  }

  // --- graphs

  /// Runs the function while triples go to the graph that the node names.
  template <class F>
  void in_graph(Id at, TermId node, F&& run) {
    if (!reads_dataset_) unsupported(at, std::string(named_graph));
    const TermView name = graph().term(node);
    if (!name.is_iri()) unsupported(at, "a graph whose name is a blank node");
    auto known = by_name_.find(name.text);
    if (known == by_name_.end()) {
      known = by_name_.emplace(std::string(name.text), named_.size()).first;
      named_.emplace_back(known->first, std::make_unique<Target>());
    }
    Target* const before = std::exchange(target_, named_[known->second].second.get());
    run();
    target_ = before;
  }

  // --- triples

  void emit(TermId subject, TermId predicate, TermId object) {
    if (++triples_ > options_.max_triples)
      throw Refused{Error{Errc::limit_exceeded, "more than " + std::to_string(options_.max_triples) + " triples"}};
    if (triples_ % Turns::units_between_rests == 0) Turns::rest_now();
    const auto size = [&](TermId id) {
      const TermView term = graph().term(id);
      return term.is_blank() ? 0 : term.text.size() + (term.datatype != vocab::xsd::string.text ? term.datatype.size() : 0);
    };
    bytes_ += size(subject) + size(predicate) + size(object);
    if (bytes_ > options_.max_bytes)
      throw Refused{Error{Errc::limit_exceeded, "IRIs and literals of more than " + std::to_string(options_.max_bytes) + " bytes when written out"}};
    graph().add(subject, predicate, object);
  }

  // --- the document

  struct Entry {
    Id value;
    std::string name;  // the keyword or IRI of its key
    const Definition* term;
  };

  /// The members that are not ignored: keywords, and keys that are IRIs.
  std::vector<Entry> entries(const Context& context, Id object) {
    std::vector<Entry> all;
    for (const Id member : Children(document(), object)) {
      const std::string_view key = document().key(member);
      if (key == "@context") continue;
      std::optional<std::string> name = expand_iri(*context, key, true, false, member);
      if (!name || (!is_keyword(*name) && name->find(':') == std::string::npos)) continue;
      const bool is_only_once = is_keyword(*name) && *name != "@type" && *name != "@included" && *name != "@nest" && *name != "@reverse";
      if (is_only_once && std::any_of(all.begin(), all.end(), [&](const Entry& e) { return e.name == *name; })) refuse(member, "a second " + *name);
      all.push_back({member, *std::move(name), context->find(key)});
    }
    return all;
  }
  static const Entry* find(const std::vector<Entry>& entries, std::string_view name) noexcept {
    const auto found = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.name == name; });
    return found == entries.end() ? nullptr : &*found;
  }

  /// The context of a value: that of the node around it, with what the term of its property says.
  struct Place {
    Context outer;           // without the context of the term
    std::string_view key;    // "": none
    const Definition* term;  // of `key`
    Context context;
    bool is_mapped = false;  // it is a member of a map, where contexts of types around it hold
  };
  Place place(const Context& outer, std::string_view key, bool is_mapped = false) {
    const Definition* term = key.empty() ? nullptr : outer->find(key);
    return {outer, key, term, with_scope(outer, term), is_mapped};
  }

  /// An object with its contexts (JSON-LD-API 1.1, 5.1.2, 7-11).
  struct Object {
    Context context, of_types;  // the second one has no contexts of its types, which are looked up in it
  };
  Object enter(const Place& at, Id object) {
    Context context = at.outer;
    if (context->previous && !at.is_mapped && !keeps_types(*context, object)) context = context->previous;
    context = with_context(with_scope(context, at.term), object);
    Object entered{context, context};
    if (!context->has_scoped) return entered;
    std::vector<Id> of_type;
    for (const Id member : Children(document(), object))
      if (document().key(member) != "@context" && expand_iri(*context, document().key(member), true, false, member) == "@type")
        of_type.push_back(member);
    std::sort(of_type.begin(), of_type.end(), [&](Id a, Id b) { return document().key(a) < document().key(b); });
    for (const Id member : of_type) {
      std::vector<std::string_view> names;
      const auto add = [&](Id item) {
        if (document().kind(item) == Kind::string) names.push_back(document().text(item));
      };
      if (document().kind(member) == Kind::array) {
        for (const Id item : Children(document(), member)) add(item);
      } else {
        add(member);
      }
      std::sort(names.begin(), names.end());
      for (const std::string_view name : names) entered.context = with_type(entered.context, entered.of_types->find(name));
    }
    return entered;
  }

  /// The object is no node of its own: the context of the node around it holds.
  bool keeps_types(const Layer& context, Id object) {
    bool is_value = false, is_reference = false;
    std::size_t members = 0;
    for (const Id member : Children(document(), object)) {
      const std::optional<std::string> name = expand_iri(context, document().key(member), true, false, member);
      is_value = is_value || name == "@value";
      is_reference = is_reference || name == "@id";
      ++members;
    }
    return is_value || (is_reference && members == 1);
  }

  /// The outermost object: a node or the default graph.
  void whole(const Context& outer, Id object) {
    const Object entered = enter(place(outer, {}), object);
    const std::vector<Entry> members = entries(entered.context, object);
    const Entry* graph = find(members, "@graph");
    if (graph == nullptr || members.size() > 1) return top_object(entered, members);
    top(place(entered.context, {}), graph->value);
  }

  void top(const Context& context, Id value) { top(place(context, {}), value); }
  void top(const Place& at, Id value) {
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) top(at, item);
    } else if (document().kind(value) == Kind::object) {
      const Object entered = enter(at, value);
      top_object(entered, entries(entered.context, value));
    }  // a value without a subject and property is ignored
  }

  void top_object(const Object& object, const std::vector<Entry>& members) {
    if (const Entry* set = find(members, "@set")) return top(object.context, set->value);
    if (find(members, "@value") != nullptr || find(members, "@list") != nullptr) return;
    (void)node(object, members);
  }

  /// @param known  the node's name if it has no @id
  TermId node(const Object& object, const std::vector<Entry>& members, std::optional<TermId> known = std::nullopt) {
    std::optional<TermId> subject = known;
    if (const Entry* id = find(members, "@id")) {
      const std::optional<std::string> name = expand_iri(*object.context, string_at(id->value, "an IRI"), false, true, id->value);
      subject = name ? std::optional(node_of(id->value, *name)) : std::nullopt;
    }
    const TermId self = subject ? *subject : fresh_blank();
    properties(object, self, members);
    return self;
  }

  void properties(const Object& object, TermId self, const std::vector<Entry>& members) {
    for (const Entry& e : members) {
      if (e.name.front() == '@') keyword(object, self, e);
      else property(object.context, self, e);
    }
  }

  void keyword(const Object& object, TermId self, const Entry& e) {
    if (e.name == "@id") return;
    if (e.name == "@index") return void(string_at(e.value, "an index"));
    if (e.name == "@type") return types(object.of_types, self, e.value);
    if (e.name == "@graph") return in_graph(e.value, self, [&] { top(object.context, e.value); });
    if (e.name == "@reverse") return reverse(object.context, self, e.value);
    if (e.name == "@included") return included(object.context, e.value);
    if (e.name == "@nest") return nested({with_scope(object.context, e.term), object.of_types}, self, e.value);
    refuse(e.value, e.name + " has no meaning in a node");
  }

  void types(const Context& context, TermId self, Id value) {
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) types(context, self, item);
      return;
    }
    const std::optional<std::string> type = expand_iri(*context, string_at(value, "a type"), true, true, value);
    if (type) emit(self, graph().intern(vocab::rdf_::type), node_of(value, *type));
  }

  void included(const Context& context, Id value) {
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) included(context, item);
      return;
    }
    if (document().kind(value) != Kind::object) refuse(value, "expected nodes in @included");
    const Object inner = enter(place(context, {}), value);
    const std::vector<Entry> members = entries(inner.context, value);
    if (find(members, "@value") != nullptr || find(members, "@list") != nullptr || find(members, "@set") != nullptr)
      refuse(value, "expected nodes in @included");
    (void)node(inner, members);
  }

  void nested(const Object& object, TermId self, Id value) {
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) nested(object, self, item);
      return;
    }
    if (document().kind(value) != Kind::object) refuse(value, "expected an object in @nest");
    if (document().member(value, "@context") != Document::none) refuse(value, "@context has no meaning in @nest");
    const std::vector<Entry> members = entries(object.context, value);
    if (find(members, "@value") != nullptr || find(members, "@id") != nullptr) refuse(value, "@value and @id have no meaning in @nest");
    properties(object, self, members);
  }

  void reverse(const Context& outer, TermId self, Id value) {
    if (document().kind(value) != Kind::object) refuse(value, "expected an object in @reverse");
    const Context context = enter(place(outer, {}), value).context;
    for (const Entry& e : entries(context, value)) {
      if (e.name.front() == '@') refuse(e.value, e.name + " has no meaning in @reverse");
      relate(context, self, e, e.term == nullptr || !e.term->reverse);
    }
  }

  void property(const Context& context, TermId self, const Entry& e) { relate(context, self, e, e.term != nullptr && e.term->reverse); }

  /// Adds a property of a node; for a reverse property, of its values.
  void relate(const Context& outer, TermId self, const Entry& e, bool reversed) {
    const bool is_json = e.term != nullptr && e.term->type == Definition::Type::json;
    if (document().kind(e.value) == Kind::null && !is_json) return;
    if (is_blank_node(e.name)) unsupported(e.value, "a blank node as predicate");
    const TermId predicate = node_of(e.value, e.name);
    const Place at = place(outer, document().key(e.value));
    const auto one = [&](Id where, TermId object) {
      if (!reversed) return emit(self, predicate, object);
      if (graph().term(object).is_literal()) refuse(where, "expected nodes as values of a reversed property");
      emit(object, predicate, self);
    };
    if (is_json) {  // before any container (JSON-LD-API 1.1, 5.1.2, 13.6)
      const TermId value = json_literal(e.value);
      return one(e.value, e.term->list && !reversed ? list_of({value}) : value);
    }
    if (e.term != nullptr && document().kind(e.value) == Kind::object) {
      if (e.term->language_map) return language_map(at.context, e.value, one);
      if (e.term->id_map) return id_map(at, *e.term, e.value, one);
      if (e.term->type_map || !e.term->index.empty()) return described_map(at, *e.term, e.value, one);
      if (e.term->index_map) {
        const Place mapped = place(outer, at.key, true);
        for (const Id item : Children(document(), e.value)) graphs_or_values(mapped, *e.term, item, one);
        return;
      }
    }
    if (e.term != nullptr && e.term->list && !is_list_object(at, e.value)) {
      if (reversed) refuse(e.value, "a list cannot be reversed");
      return one(e.value, list(at, e.value));
    }
    if (e.term != nullptr && e.term->graph && !e.term->id_map && !e.term->index_map) refuse_unnamed_graph(e.value);
    if (reversed) refuse_lists(at, e.value);
    values(at, e.value, one);
  }

  void refuse_lists(const Place& at, Id value) {
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) refuse_lists(at, item);
    } else if (is_list_object(at, value)) {
      refuse(value, "a list cannot be reversed");
    }
  }

  [[noreturn]] void refuse_unnamed_graph(Id at) const {
    unsupported(at, reads_dataset_ ? "a graph whose name is a blank node" : std::string(named_graph));
  }

  bool is_list_object(const Place& at, Id value) {
    if (document().kind(value) != Kind::object) return false;
    return find(entries(enter(at, value).context, value), "@list") != nullptr;
  }

  /// Only what stands in @graph, with a name (JSON-LD-API 1.1, graph object).
  static bool is_graph_object(const std::vector<Entry>& members) noexcept {
    return find(members, "@graph") != nullptr &&
           std::all_of(members.begin(), members.end(), [](const Entry& e) { return e.name == "@graph" || e.name == "@id" || e.name == "@index"; });
  }

  /// The items of a map that may make graphs of them.
  template <class F>
  void graphs_or_values(const Place& at, const Definition& term, Id value, F& one) {
    if (!term.graph) return values(at, value, one);
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) graphs_or_values(at, term, item, one);
      return;
    }
    if (document().kind(value) == Kind::null) return;
    if (document().kind(value) != Kind::object || !is_graph_object(entries(enter(at, value).context, value))) refuse_unnamed_graph(value);
    values(at, value, one);
  }

  template <class F>
  void language_map(const Context& context, Id map, F& one) {
    for (const Id member : Children(document(), map)) {
      const std::optional<std::string> name = expand_iri(*context, document().key(member), true, false, member);
      std::string tag;
      if (!name || *name != "@none") {
        tag = std::string(document().key(member));
        if (!is_language_tag(tag)) refuse(member, "expected a language tag, found \"" + shortened(tag) + "\"");
        for (char& c : tag) c = lrt::detail::lower(c);
      }
      const auto text = [&](Id at) {
        if (document().kind(at) == Kind::null) return;
        const std::string_view value = string_at(at, "a text");
        one(at, graph().intern(tag.empty() ? literal(value) : tagged_literal(value, tag)));
      };
      if (document().kind(member) == Kind::array) {
        for (const Id item : Children(document(), member)) text(item);
      } else {
        text(member);
      }
    }
  }

  /// A map from the names of nodes to what is said of them; or from the names of graphs to what is in them.
  template <class F>
  void id_map(const Place& at, const Definition& term, Id map, F& one) {
    const Place mapped = place(at.outer, at.key, true);
    for (const Id member : Children(document(), map)) {
      const std::string_view text = document().key(member);
      const std::optional<std::string> none = expand_iri(*at.context, text, true, false, member);
      const std::optional<std::string> name = none && *none == "@none" ? std::nullopt : expand_iri(*at.context, text, false, true, member);
      const std::optional<TermId> known = name ? std::optional(node_of(member, *name)) : std::nullopt;
      const auto item = [&](Id value) {
        if (document().kind(value) == Kind::null) return;
        if (document().kind(value) != Kind::object) refuse(value, "expected nodes in a map of @id");
        const Object inner = enter(mapped, value);
        const std::vector<Entry> members = entries(inner.context, value);
        if (find(members, "@value") != nullptr || find(members, "@list") != nullptr || find(members, "@set") != nullptr)
          refuse(value, "expected nodes in a map of @id");
        if (!term.graph || is_graph_object(members)) return one(value, node(inner, members, known));
        if (!known) refuse_unnamed_graph(value);
        in_graph(value, *known, [&] { (void)node(inner, members); });
        one(value, *known);
      };
      if (document().kind(member) == Kind::array) {
        for (const Id value : Children(document(), member)) item(value);
      } else {
        item(member);
      }
    }
  }

  /// A map from types, or values of another property, to nodes that have them.
  template <class F>
  void described_map(const Place& at, const Definition& term, Id map, F& one) {
    if (term.graph) refuse_unnamed_graph(map);
    for (const Id member : Children(document(), map)) {
      const std::string_view text = document().key(member);
      const std::optional<std::string> name = expand_iri(*at.context, text, true, term.type_map, member);
      std::optional<TermId> predicate, value;
      Context context = at.outer;
      if (name && *name != "@none" && term.type_map) {
        // The type stands for a node of its own (JSON-LD-API 1.1, 5.1.2, 13.8.3).
        const Context& around = at.outer->previous ? at.outer->previous : at.outer;
        if (const Definition* type = around->find(text); type != nullptr && type->source != nullptr) context = with_type(around, type);
        predicate = graph().intern(vocab::rdf_::type);
        value = node_of(member, *name);
      } else if (!term.type_map && !(name && *name == "@none")) {
        predicate = node_of(member, expand_iri(*at.context, term.index, true, false, member).value_or(std::string()));
        value = text_value(at.context, term.index, member, text);
      }
      const auto described = [&](Id where, TermId object) {
        if (graph().term(object).is_literal()) refuse(where, "expected nodes in a map of " + std::string(term.type_map ? "@type" : term.index));
        if (value) emit(object, *predicate, *value);
        one(where, object);
      };
      values(place(context, at.key, true), member, described);
    }
  }

  /// Passes on the objects of a value. The definition of the property's key says how strings are read.
  template <class F>
  void values(const Place& at, Id value, F& one) {
    switch (document().kind(value)) {
      case Kind::null: return;
      case Kind::array:
        for (const Id item : Children(document(), value)) values(at, item, one);
        return;
      case Kind::object: return object(at, value, one);
      default:
        if (const std::optional<TermId> term = scalar(at.context, at.key, value)) one(value, *term);
    }
  }

  template <class F>
  void object(const Place& at, Id object, F& one) {
    const Object entered = enter(at, object);
    const Context& context = entered.context;
    const std::vector<Entry> members = entries(context, object);
    const Entry* container = find(members, "@list");
    if (container == nullptr) container = find(members, "@set");
    if (find(members, "@value") != nullptr) {
      if (const std::optional<TermId> term = value_object(entered, members)) one(object, *term);
      return;
    }
    if (container == nullptr) return one(object, node(entered, members));
    for (const Entry& e : members)
      if (&e != container && e.name != "@index") refuse(e.value, e.name + " has no meaning beside " + container->name);
    const Place inner = place(context, at.key);
    if (container->name == "@set") return values(inner, container->value, one);
    one(object, list(inner, container->value));
  }

  TermId list(const Place& at, Id value) {
    std::vector<TermId> members;
    const auto one = [&](Id, TermId member) { members.push_back(member); };
    const Definition* term = at.context->find(at.key);
    const auto item_of = [&](Id item) {
      if (document().kind(item) == Kind::object && term != nullptr && term->list) {  // a set in it is a list, too (5.1.2, 5.2.2)
        const Object entered = enter(at, item);
        const std::vector<Entry> parts = entries(entered.context, item);
        if (const Entry* set = find(parts, "@set"); set != nullptr && parts.size() == 1 && document().kind(set->value) == Kind::array)
          return members.push_back(list(place(entered.context, at.key), set->value));
      }
      if (document().kind(item) != Kind::array) return values(at, item, one);
      if (term == nullptr || !term->list) unsupported(item, "an array in a @list, where {\"@list\": [...]} is meant,");
      members.push_back(list(at, item));
    };
    if (document().kind(value) == Kind::array) {
      for (const Id item : Children(document(), value)) item_of(item);
    } else {
      values(at, value, one);
    }
    return list_of(members);
  }

  TermId list_of(const std::vector<TermId>& members) {
    const TermId nil = graph().intern(vocab::rdf_::nil);
    TermId head = nil;
    for (std::size_t i = members.size(); i-- > 0;) {
      const TermId cell = fresh_blank();
      emit(cell, graph().intern(vocab::rdf_::first), members[i]);
      emit(cell, graph().intern(vocab::rdf_::rest), head);
      head = cell;
    }
    return head;
  }

  /// Any JSON as a literal, in its canonical form (JSON-LD-API 1.1, 8.2.2).
  TermId json_literal(Id value) {
    const std::string text = json::canonical(document(), value);
    return graph().intern(literal(text, json_datatype));
  }

  /// JSON-LD-API 1.1, 5.3.
  std::optional<TermId> scalar(const Context& context, std::string_view key, Id value) {
    const Definition* term = context->find(key);
    const auto type = term != nullptr ? term->type : Definition::Type::absent;
    if (type == Definition::Type::json) return json_literal(value);
    if (document().kind(value) != Kind::string)
      return native(value, type == Definition::Type::datatype ? std::string_view(term->datatype) : std::string_view());
    return text_value(context, key, value, document().text(value));
  }

  /// A string, at its place or as the name of a member there.
  std::optional<TermId> text_value(const Context& context, std::string_view key, Id value, std::string_view text) {
    const Definition* term = context->find(key);
    const auto type = term != nullptr ? term->type : Definition::Type::absent;
    if (type == Definition::Type::id || type == Definition::Type::vocab) {
      const std::optional<std::string> name = expand_iri(*context, text, type == Definition::Type::vocab, true, value);
      return name ? std::optional(node_of(value, *name)) : std::nullopt;
    }
    if (type == Definition::Type::datatype) return typed(value, text, term->datatype);
    const std::string& language = term != nullptr && term->language ? *term->language : context->language;
    const bool has_no_type = type == Definition::Type::absent || type == Definition::Type::none;
    if (has_no_type && !language.empty()) return graph().intern(tagged_literal(text, language));
    return graph().intern(literal(text));
  }

  TermId typed(Id at, std::string_view text, std::string_view datatype) {
    if (datatype == vocab::rdf_::langString.text) refuse(at, std::string(no_language));
    return graph().intern(literal(text, Iri(datatype)));
  }

  /// true, false or a number (JSON-LD-API 1.1, 8.2.2).
  TermId native(Id value, std::string_view datatype) {
    const Kind kind = document().kind(value);
    const auto made = [&](std::string_view text, Iri otherwise) { return typed(value, text, datatype.empty() ? otherwise.text : datatype); };
    if (kind != Kind::number) return made(kind == Kind::true_ ? "true" : "false", vocab::xsd::boolean);
    const std::string_view digits = document().text(value) == "-0" ? "0" : document().text(value);  // JSON-LD has no negative zero
    const bool wants_double = datatype == vocab::xsd::double_.text;
    const bool is_integer = digits.find_first_not_of("-0123456789") == std::string_view::npos;
    const std::size_t length = digits.size() - (digits.front() == '-' ? 1 : 0);
    if (is_integer && !wants_double && length <= 21) return made(digits, vocab::xsd::integer);  // below 10^21
    const double number = lexical::parse_double(digits).value_or(0);
    if (lexical::is_rounded_away(digits, number)) refuse(value, "a number beyond xsd:double");
    if (wants_double || std::fabs(number) >= 1e21 || number != std::trunc(number)) return made(exact_double(number), vocab::xsd::double_);
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, number == 0 ? 0.0 : number, std::chars_format::fixed, 0).ptr;
    return made(std::string_view(buffer, static_cast<std::size_t>(end - buffer)), vocab::xsd::integer);
  }

  std::optional<TermId> value_object(const Object& object, const std::vector<Entry>& members) {
    const Entry *value = nullptr, *type = nullptr, *language = nullptr;
    Id direction = Document::none;
    for (const Entry& e : members) {
      if (e.name == "@value") value = &e;
      else if (e.name == "@type") type = &e;
      else if (e.name == "@language") language = &e;
      else if (e.name == "@direction") check_direction(direction = e.value);
      else if (e.name != "@index") refuse(e.value, shortened(e.name) + " has no meaning beside @value");
    }
    if (type != nullptr && document().kind(type->value) == Kind::null) type = nullptr;
    if (language != nullptr && document().kind(language->value) == Kind::null) language = nullptr;
    if (type != nullptr && language != nullptr) refuse(language->value, "@language has no meaning beside @type");
    if (type != nullptr && direction != Document::none) refuse(direction, "@direction has no meaning beside @type");
    std::string datatype;
    if (type != nullptr) {
      const std::optional<std::string> name = expand_iri(*object.of_types, string_at(type->value, "a datatype"), true, true, type->value);
      if (name && *name == "@json") return json_literal(value->value);
      if (!name || !iri::is_absolute(*name)) refuse(type->value, "expected an IRI as datatype");
      if (name->size() > max_iri) refuse(type->value, "IRI of more than " + std::to_string(max_iri) + " bytes", Errc::limit_exceeded);
      datatype = *name;
    }
    const std::string tag = language != nullptr ? language_at(language->value) : std::string();
    switch (document().kind(value->value)) {
      case Kind::null: return std::nullopt;
      case Kind::object:
      case Kind::array: refuse(value->value, "expected a string, number, true, false or null as @value");
      case Kind::string: {
        const std::string_view text = document().text(value->value);
        if (!tag.empty()) return graph().intern(tagged_literal(text, tag));
        return datatype.empty() ? graph().intern(literal(text)) : typed(value->value, text, datatype);
      }
      default:
        if (!tag.empty()) refuse(value->value, "expected a string beside @language");
        return native(value->value, datatype);
    }
  }

  /// A scoped context after it was processed, with the active context, which stays for its address.
  struct Scope {
    Context active, made;
  };
  static constexpr std::string_view named_graph = "a named graph, where one graph is read,";

  const ReadOptions& options_;
  const bool reads_dataset_;
  std::shared_ptr<const std::string> initial_base_;
  const Source self_;
  const Source* source_ = &self_;
  Target default_;
  Target* target_ = &default_;
  std::vector<std::pair<std::string, std::unique_ptr<Target>>> named_;  // graphs
  std::map<std::string, std::size_t, std::less<>> by_name_;
  Context own_;
  std::map<std::tuple<const Layer*, const Source*, Id, bool>, Scope> scopes_;
  std::size_t terms_ = 0, triples_ = 0, bytes_ = 0, expanded_ = 0, references_ = 0;
};

}  // namespace

/// A context with the place of what is in it.
struct RegisteredContexts {
  struct One {
    Document document;
    Source source;
  };
  std::map<std::string, std::shared_ptr<const One>, std::less<>> by_iri;
};

namespace {

const Source* Reader::registered(const std::string& name) {
  if (options_.contexts == nullptr || !options_.contexts->kept()) return nullptr;
  const auto& all = options_.contexts->kept()->by_iri;
  const auto found = all.find(name);
  return found == all.end() ? nullptr : &found->second->source;
}

Result<Dataset> read_any(std::string_view text, const ReadOptions& options, bool reads_dataset) {
  constexpr std::size_t values_per_triple = 16;
  const std::size_t most = options.max_triples > 0x0FFFFFFF ? 0xFFFFFFF0 : values_per_triple * options.max_triples + 1000;
  const Result<Document> document = Document::parse(text, {most, max_depth, true});
  if (!document) return unexpected(document.error());
  try {
    return Reader(*document, options, reads_dataset).read();
  } catch (const Refused& refused) { return unexpected(refused.error); }
}

}  // namespace

Result<void> Contexts::add(std::string_view iri, std::string_view text) {
  const auto named = [&](Errc code, const std::string& sentence) { return unexpected(code, "the context <" + shortened(iri) + ">: " + sentence); };
  if (!iri::is_absolute(iri) || iri.size() > max_iri) return named(Errc::expected_iri, "expected an absolute IRI as its name");
  if (text.size() > max_bytes) return named(Errc::limit_exceeded, "more than " + std::to_string(max_bytes) + " bytes");
  Result<Document> document = Document::parse(text, {max_bytes, max_depth});
  if (!document) return named(document.error().code, document.error().message);
  const Kind root = document->kind(document->root());
  const Id context = root == Kind::object ? document->member(document->root(), "@context") : Document::none;
  if (context == Document::none) return named(Errc::expected_rdf, "expected an object with the member @context");
  if (const Kind kind = document->kind(context); kind != Kind::object && kind != Kind::array && kind != Kind::string)
    return named(Errc::expected_rdf, "at \"/@context\": expected an object, an IRI or an array of these");
  auto one = std::make_shared<RegisteredContexts::One>(RegisteredContexts::One{*std::move(document), {}});
  one->source = {&one->document, std::string(iri), true};
  auto next = kept_ ? std::make_shared<RegisteredContexts>(*kept_) : std::make_shared<RegisteredContexts>();
  next->by_iri.insert_or_assign(std::string(iri), std::move(one));
  if (next->by_iri.size() > max_contexts) return named(Errc::limit_exceeded, "more than " + std::to_string(max_contexts) + " contexts");
  kept_ = std::move(next);
  return {};
}

Result<Graph> read_json_ld(std::string_view text, const ReadOptions& options) {
  Result<Dataset> read = read_any(text, options, false);
  if (!read) return unexpected(read.error());
  return std::move(read->default_graph);
}

Result<Dataset> read_json_ld_dataset(std::string_view text, const ReadOptions& options) { return read_any(text, options, true); }

}  // namespace v0
}  // namespace lrt::rdf
