// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/rdf/codecs.hpp"
#include "src/rdf/json_canonical.hpp"
#include "src/rdf/json_ld/context.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/limits.hpp"

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

struct Definition {
  std::optional<std::string> iri;  // or a keyword; nullopt: the term is ignored
  enum class Type : std::uint8_t { absent, none, id, vocab, json, datatype } type = Type::absent;
  std::string datatype;
  std::optional<std::string> language;  // "": none, also if there is a default
  bool list = false, language_map = false, index_map = false, id_map = false, type_map = false, reverse = false, prefix = false;
  std::string index;           // the property of the names in an index_map; "": they are no data
  Id scoped = Document::none;  // the context of the values, in the document
};

/// An active context: the changes of a local context and the context that it is based on. What contexts have in common is shared.
struct Layer {
  using Terms = std::map<std::string, Definition, std::less<>>;
  std::shared_ptr<const Layer> below;
  Terms before_own;                  // defined before the reference to lrt's own context, if there is one: its terms hide them
  std::shared_ptr<const Layer> own;  // lrt's own context
  Terms terms;
  std::shared_ptr<const std::string> base, vocab;
  std::string language;
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

class Reader {
 public:
  Reader(const Document& document, const ReadOptions& options)
      : document_(document), options_(options), initial_base_(options.base.empty() ? nullptr : shared(options.base)) {}

  Graph read() {
    auto start = std::make_shared<Layer>();
    start->base = initial_base_;
    const Id root = document_.root();
    const Kind kind = document_.kind(root);
    if (kind != Kind::object && kind != Kind::array) refuse(root, "expected an object or an array");
    if (kind == Kind::array) top(start, root);
    else document(start, root);
    return std::move(graph_);
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
      Id member;
      enum class State : std::uint8_t { open, begun, done } state = State::open;
    };
    std::map<std::string_view, Term> terms;
  };

  [[noreturn]] void refuse(Id at, const std::string& sentence, Errc code = Errc::expected_rdf) const {
    throw Refused{Error{code, "at \"" + document_.pointer(at) + "\": " + sentence}};
  }
  [[noreturn]] void unsupported(Id at, const std::string& what) const { refuse(at, what + " is not supported", Errc::unsupported_syntax); }

  std::string_view string_at(Id at, const char* what) const {
    if (document_.kind(at) != Kind::string) refuse(at, std::string("expected ") + what + " as a string");
    return document_.text(at);
  }

  // --- contexts

  Context with_context(const Context& active, Id object) {
    const Id local = document_.member(object, "@context");
    return local == Document::none ? active : with_local(active, local);
  }

  /// The context of a term's values. One is processed once for each active context.
  const Context& with_scope(const Context& active, const Definition* term) {
    if (term == nullptr || term->scoped == Document::none) return active;
    auto& [kept, made] = scopes_[{active.get(), term->scoped}];
    if (!made) {
      kept = active;
      made = with_local(active, term->scoped);
    }
    return made;
  }

  Context with_local(const Context& active, Id local) {
    auto layer = std::make_shared<Layer>();
    layer->below = active;
    layer->base = active->base;
    layer->vocab = active->vocab;
    layer->language = active->language;
    layer->height = active->height + 1;
    if (layer->height > max_contexts)
      refuse(local, "contexts in contexts, more than " + std::to_string(max_contexts) + " deep", Errc::limit_exceeded);
    if (document_.kind(local) != Kind::array) {
      add_context(*layer, local);
      return layer;
    }
    std::size_t count = 0;
    for (const Id item : Children(document_, local)) {
      if (++count > max_contexts) refuse(item, "more than " + std::to_string(max_contexts) + " contexts", Errc::limit_exceeded);
      add_context(*layer, item);
    }
    return layer;
  }

  void add_context(Layer& layer, Id local) {
    switch (document_.kind(local)) {
      case Kind::null:
        layer.below = nullptr;
        layer.before_own.clear();
        layer.own = nullptr;
        layer.terms.clear();
        layer.base = initial_base_;
        layer.vocab = nullptr;
        layer.language.clear();
        return;
      case Kind::string: return add_own(layer, local);
      case Kind::object: return add_definitions(layer, local);
      default: refuse(local, "expected a context: an object, an IRI or null");
    }
  }

  static std::shared_ptr<const std::string> shared(std::string_view text) { return std::make_shared<const std::string>(text); }

  static std::string_view without_query(std::string_view iri) noexcept { return iri.substr(0, iri.find_first_of("?#")); }

  void add_own(Layer& layer, Id local) {
    std::string name(document_.text(local));
    if (!options_.base.empty()) {
      if (Result<std::string> resolved = iri::resolve(options_.base, name)) name = *std::move(resolved);
    }
    const std::string_view plain = without_query(name);
    if (plain != json_ld_context_iri && (options_.context.empty() || plain != without_query(options_.context))) {
      const std::string_view ours = options_.context.empty() ? json_ld_context_iri : options_.context;
      refuse(local,
             "the context <" + shortened(name) + "> would have to be fetched, which is not supported: embed it in the document, or use <" +
                 std::string(ours) + ">",
             Errc::unsupported_syntax);
    }
    if (!own_) own_ = own_context(options_.context_prefixes != nullptr ? *options_.context_prefixes : default_prefixes());
    layer.add(own_);
  }

  void add_definitions(Layer& layer, Id local) {
    // Keywords first: terms may depend on them.
    for (const Id member : Children(document_, local)) {
      const std::string_view key = document_.key(member);
      const Kind kind = document_.kind(member);
      if (key == "@import" || key == "@propagate") unsupported(member, std::string(key));
      if (key == "@protected" && kind != Kind::false_) unsupported(member, "@protected");
      if (key == "@direction" && kind != Kind::null) unsupported(member, "@direction");
      if (key == "@version" && (kind != Kind::number || document_.text(member) != "1.1")) refuse(member, "expected 1.1 as @version");
      if (key == "@base") {
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
    for (const Id member : Children(document_, local)) {
      const std::string_view key = document_.key(member);
      if (key == "@vocab") {
        if (document_.kind(member) == Kind::null) {
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
        layer.language = document_.kind(member) == Kind::null ? std::string() : language_at(member);
      }
    }
    Local terms;
    for (const Id member : Children(document_, local)) {
      const std::string_view key = document_.key(member);
      if (key == "@base" || key == "@vocab" || key == "@language" || key == "@version" || key == "@protected" || key == "@direction") continue;
      if (++terms_ > max_terms) refuse(member, "more than " + std::to_string(max_terms) + " terms", Errc::limit_exceeded);
      terms.terms.emplace(key, Local::Term{member});
    }
    for (auto& [key, term] : terms.terms) define(layer, terms, term, 0);
  }

  std::string language_at(Id at) const {
    std::string tag(string_at(at, "a language tag"));
    if (!is_language_tag(tag)) refuse(at, "expected a language tag, found \"" + shortened(tag) + "\"");
    for (char& c : tag) c = lrt::detail::lower(c);
    return tag;
  }

  /// JSON-LD-API 1.1, 4.2.2.
  void define(Layer& layer, Local& local, Local::Term& one, std::size_t depth) {
    const Id member = one.member;
    const std::string_view term = document_.key(member);
    if (one.state == Local::Term::State::done) return;
    if (one.state == Local::Term::State::begun) refuse(member, "the term \"" + shortened(term) + "\" depends on itself");
    one.state = Local::Term::State::begun;
    if (depth > max_dependency) refuse(member, "terms that depend on each other, more than " + std::to_string(max_dependency), Errc::limit_exceeded);
    if (term.empty()) refuse(member, "expected a term, found nothing");
    if (is_keyword(term)) refuse(member, "the keyword " + std::string(term) + " cannot be defined");
    if (!looks_like_keyword(term)) {
      Definition made = definition(layer, local, one, depth);
      if (made.iri && made.iri->size() > max_iri) refuse(member, "IRI of more than " + std::to_string(max_iri) + " bytes", Errc::limit_exceeded);
      layer.terms.insert_or_assign(std::string(term), std::move(made));
    }
    one.state = Local::Term::State::done;
  }

  Definition definition(Layer& layer, Local& local, Local::Term& one, std::size_t depth) {
    const Id member = one.member;
    const std::string_view term = document_.key(member);
    Definition made;
    const Kind kind = document_.kind(member);
    if (kind == Kind::null) return made;
    if (kind != Kind::string && kind != Kind::object) refuse(member, "expected the definition of a term: an IRI, an object or null");
    const bool simple = kind == Kind::string;
    const auto part = [&](std::string_view name) { return simple ? Document::none : document_.member(member, name); };
    const auto expand = [&](Id at, std::string_view text) { return expand_iri(layer, text, true, false, at, &local, depth); };
    if (!simple) {
      for (const Id p : Children(document_, member)) {
        const std::string_view name = document_.key(p);
        if (name == "@protected" && document_.kind(p) != Kind::false_) unsupported(p, "@protected");
        if (name == "@direction" && document_.kind(p) != Kind::null) unsupported(p, "@direction");
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
    } else if (given != Document::none && document_.kind(given) == Kind::null) {
      return Definition();
    } else if (given != Document::none && document_.kind(given) == Kind::string && document_.text(given) != term) {
      const std::string_view text = document_.text(given);
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
    } else if (given != Document::none && document_.kind(given) != Kind::string) {
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

    if (const Id p = part("@container"); p != Document::none && document_.kind(p) != Kind::null) container(made, p);
    if (made.type_map && made.type == Definition::Type::absent) made.type = Definition::Type::id;
    if (made.type_map && made.type != Definition::Type::id && made.type != Definition::Type::vocab)
      refuse(member, "@type as a container excludes another @type than @id and @vocab");
    if (const Id p = part("@index"); p != Document::none) {
      if (!made.index_map) refuse(p, "expected @index as @container, too");
      const std::optional<std::string> index = expand(p, string_at(p, "an IRI"));
      if (!index || !iri::is_absolute(*index)) refuse(p, "expected an IRI as @index");
      made.index = std::string(document_.text(p));
    }
    if (const Id p = part("@context"); p != Document::none) made.scoped = p;
    if (const Id p = part("@language"); p != Document::none && made.type == Definition::Type::absent)
      made.language = document_.kind(p) == Kind::null ? std::string() : language_at(p);
    if (const Id p = part("@nest"); p != Document::none) {
      const std::string_view nest = string_at(p, "@nest or a term");
      if (is_keyword(nest) && nest != "@nest") refuse(p, "expected @nest or a term");
    }
    if (const Id p = part("@prefix"); p != Document::none) {
      const Kind flag = document_.kind(p);
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
      else if (name == "@graph") unsupported(item, std::string(name) + " as a container");
      else refuse(item, "expected @list, @set, @language, @index, @id or @type as @container, found \"" + shortened(name) + "\"");
    };
    if (document_.kind(at) == Kind::array) {
      for (const Id item : Children(document_, at)) one(item);
    } else {
      one(at);
    }
    if (made.list + made.language_map + made.index_map + made.id_map + made.type_map > 1 || (made.list && (set || made.reverse)) ||
        (made.reverse && (made.language_map || made.id_map || made.type_map)))
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
    return graph_.intern(iri(expanded));
  }

  TermId fresh_blank() { return graph_.intern(blank("b" + std::to_string(blanks_++))); }
  TermId blank_node(const std::string& label) {
    const auto known = labels_.find(label);
    return known != labels_.end() ? known->second : labels_.emplace(label, fresh_blank()).first->second;
  }

  // --- triples

  void emit(TermId subject, TermId predicate, TermId object) {
    if (++triples_ > options_.max_triples)
      throw Refused{Error{Errc::limit_exceeded, "more than " + std::to_string(options_.max_triples) + " triples"}};
    const auto size = [&](TermId id) {
      const TermView term = graph_.term(id);
      return term.is_blank() ? 0 : term.text.size() + (term.datatype != vocab::xsd::string.text ? term.datatype.size() : 0);
    };
    bytes_ += size(subject) + size(predicate) + size(object);
    if (bytes_ > options_.max_bytes)
      throw Refused{Error{Errc::limit_exceeded, "IRIs and literals of more than " + std::to_string(options_.max_bytes) + " bytes when written out"}};
    graph_.add(subject, predicate, object);
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
    for (const Id member : Children(document_, object)) {
      const std::string_view key = document_.key(member);
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

  /// A top-level object: a node or the default graph.
  void document(const Context& outer, Id object) {
    const Context context = with_context(outer, object);
    const std::vector<Entry> members = entries(context, object);
    const Entry* graph = find(members, "@graph");
    if (graph == nullptr) return top_object(context, members);
    if (members.size() > 1) unsupported(graph->value, "a named graph");
    top(context, graph->value);
  }

  void top(const Context& context, Id value) {
    if (document_.kind(value) == Kind::array) {
      for (const Id item : Children(document_, value)) top(context, item);
    } else if (document_.kind(value) == Kind::object) {
      const Context inner = with_context(context, value);
      top_object(inner, entries(inner, value));
    }  // a value without a subject and property is ignored
  }

  void top_object(const Context& context, const std::vector<Entry>& members) {
    if (const Entry* set = find(members, "@set")) return top(context, set->value);
    if (find(members, "@value") != nullptr || find(members, "@list") != nullptr) return;
    (void)node(context, members);
  }

  /// @param known  the node's name if it has no @id
  TermId node(const Context& context, const std::vector<Entry>& members, std::optional<TermId> known = std::nullopt) {
    std::optional<TermId> subject = known;
    if (const Entry* id = find(members, "@id")) {
      const std::optional<std::string> name = expand_iri(*context, string_at(id->value, "an IRI"), false, true, id->value);
      subject = name ? std::optional(node_of(id->value, *name)) : std::nullopt;
    }
    const TermId self = subject ? *subject : fresh_blank();
    properties(context, self, members);
    return self;
  }

  void properties(const Context& context, TermId self, const std::vector<Entry>& members) {
    for (const Entry& e : members) {
      if (e.name.front() == '@') keyword(context, self, e);
      else property(context, self, e);
    }
  }

  void keyword(const Context& context, TermId self, const Entry& e) {
    if (e.name == "@id") return;
    if (e.name == "@index") return void(string_at(e.value, "an index"));
    if (e.name == "@type") return types(context, self, e.value);
    if (e.name == "@graph") unsupported(e.value, "a named graph");
    if (e.name == "@reverse") return reverse(context, self, e.value);
    if (e.name == "@included") return included(context, e.value);
    if (e.name == "@nest") return nested(context, self, e.value);
    if (e.name == "@direction") unsupported(e.value, "@direction");
    refuse(e.value, e.name + " has no meaning in a node");
  }

  void types(const Context& context, TermId self, Id value) {
    if (document_.kind(value) == Kind::array) {
      for (const Id item : Children(document_, value)) types(context, self, item);
      return;
    }
    const std::string_view text = string_at(value, "a type");
    refuse_scope_of_type(context, text, value);
    const std::optional<std::string> type = expand_iri(*context, text, true, true, value);
    if (type) emit(self, graph_.intern(vocab::rdf_::type), node_of(value, *type));
  }

  void refuse_scope_of_type(const Context& context, std::string_view type, Id at) const {
    const Definition* term = context->find(type);
    if (term != nullptr && term->scoped != Document::none) unsupported(at, "a context of a type");
  }

  void included(const Context& context, Id value) {
    if (document_.kind(value) == Kind::array) {
      for (const Id item : Children(document_, value)) included(context, item);
      return;
    }
    if (document_.kind(value) != Kind::object) refuse(value, "expected nodes in @included");
    const Context inner = with_context(context, value);
    const std::vector<Entry> members = entries(inner, value);
    if (find(members, "@value") != nullptr || find(members, "@list") != nullptr || find(members, "@set") != nullptr)
      refuse(value, "expected nodes in @included");
    (void)node(inner, members);
  }

  void nested(const Context& context, TermId self, Id value) {
    if (document_.kind(value) == Kind::array) {
      for (const Id item : Children(document_, value)) nested(context, self, item);
      return;
    }
    if (document_.kind(value) != Kind::object) refuse(value, "expected an object in @nest");
    if (document_.member(value, "@context") != Document::none) refuse(value, "@context has no meaning in @nest");
    const std::vector<Entry> members = entries(context, value);
    if (find(members, "@value") != nullptr || find(members, "@id") != nullptr) refuse(value, "@value and @id have no meaning in @nest");
    properties(context, self, members);
  }

  void reverse(const Context& context, TermId self, Id value) {
    if (document_.kind(value) != Kind::object) refuse(value, "expected an object in @reverse");
    for (const Entry& e : entries(context, value)) {
      if (e.name.front() == '@') refuse(e.value, e.name + " has no meaning in @reverse");
      relate(context, self, e, e.term == nullptr || !e.term->reverse);
    }
  }

  void property(const Context& context, TermId self, const Entry& e) { relate(context, self, e, e.term != nullptr && e.term->reverse); }

  /// Adds a property of a node; for a reverse property, of its values.
  void relate(const Context& outer, TermId self, const Entry& e, bool reversed) {
    const Context context = with_scope(outer, e.term);
    const bool is_json = e.term != nullptr && e.term->type == Definition::Type::json;
    if (document_.kind(e.value) == Kind::null && !is_json) return;
    if (is_blank_node(e.name)) unsupported(e.value, "a blank node as predicate");
    const TermId predicate = node_of(e.value, e.name);
    const std::string_view key = document_.key(e.value);
    const auto one = [&](Id at, TermId object) {
      if (!reversed) return emit(self, predicate, object);
      if (graph_.term(object).is_literal()) refuse(at, "expected nodes as values of a reversed property");
      emit(object, predicate, self);
    };
    if (is_json) {  // before any container (JSON-LD-API 1.1, 5.1.2, 13.6)
      const TermId value = json_literal(e.value);
      return one(e.value, e.term->list && !reversed ? list_of({value}) : value);
    }
    if (e.term != nullptr && document_.kind(e.value) == Kind::object) {
      if (e.term->language_map) return language_map(context, e.value, one);
      if (e.term->id_map) return id_map(context, e.value, one);
      if (e.term->type_map || !e.term->index.empty()) return described_map(context, key, *e.term, e.value, one);
      if (e.term->index_map) {
        for (const Id item : Children(document_, e.value)) values(context, key, item, one);
        return;
      }
    }
    if (e.term != nullptr && e.term->list && !is_list_object(context, e.value)) {
      if (reversed) refuse(e.value, "a list cannot be reversed");
      return one(e.value, list(context, key, e.value));
    }
    values(context, key, e.value, one);
  }

  bool is_list_object(const Context& context, Id value) {
    if (document_.kind(value) != Kind::object) return false;
    return find(entries(with_context(context, value), value), "@list") != nullptr;
  }

  template <class F>
  void language_map(const Context& context, Id map, F& one) {
    for (const Id member : Children(document_, map)) {
      const std::optional<std::string> name = expand_iri(*context, document_.key(member), true, false, member);
      std::string tag;
      if (!name || *name != "@none") {
        tag = std::string(document_.key(member));
        if (!is_language_tag(tag)) refuse(member, "expected a language tag, found \"" + shortened(tag) + "\"");
        for (char& c : tag) c = lrt::detail::lower(c);
      }
      const auto text = [&](Id at) {
        if (document_.kind(at) == Kind::null) return;
        const std::string_view value = string_at(at, "a text");
        one(at, graph_.intern(tag.empty() ? literal(value) : tagged_literal(value, tag)));
      };
      if (document_.kind(member) == Kind::array) {
        for (const Id item : Children(document_, member)) text(item);
      } else {
        text(member);
      }
    }
  }

  /// A map from the names of nodes to what is said of them.
  template <class F>
  void id_map(const Context& context, Id map, F& one) {
    for (const Id member : Children(document_, map)) {
      const std::string_view text = document_.key(member);
      const std::optional<std::string> none = expand_iri(*context, text, true, false, member);
      const std::optional<std::string> name = none && *none == "@none" ? std::nullopt : expand_iri(*context, text, false, true, member);
      const std::optional<TermId> known = name ? std::optional(node_of(member, *name)) : std::nullopt;
      const auto item = [&](Id at) {
        if (document_.kind(at) == Kind::null) return;
        if (document_.kind(at) != Kind::object) refuse(at, "expected nodes in a map of @id");
        const Context inner = with_context(context, at);
        const std::vector<Entry> members = entries(inner, at);
        if (find(members, "@value") != nullptr || find(members, "@list") != nullptr || find(members, "@set") != nullptr)
          refuse(at, "expected nodes in a map of @id");
        one(at, node(inner, members, known));
      };
      if (document_.kind(member) == Kind::array) {
        for (const Id at : Children(document_, member)) item(at);
      } else {
        item(member);
      }
    }
  }

  /// A map from types, or values of another property, to nodes that have them.
  template <class F>
  void described_map(const Context& context, std::string_view key, const Definition& term, Id map, F& one) {
    for (const Id member : Children(document_, map)) {
      const std::string_view text = document_.key(member);
      const std::optional<std::string> name = expand_iri(*context, text, true, term.type_map, member);
      std::optional<TermId> predicate, value;
      if (name && *name != "@none" && term.type_map) {
        refuse_scope_of_type(context, text, member);
        predicate = graph_.intern(vocab::rdf_::type);
        value = node_of(member, *name);
      } else if (!term.type_map && !(name && *name == "@none")) {
        predicate = node_of(member, expand_iri(*context, term.index, true, false, member).value_or(std::string()));
        value = text_value(context, term.index, member, text);
      }
      const auto described = [&](Id at, TermId object) {
        if (graph_.term(object).is_literal()) refuse(at, "expected nodes in a map of " + std::string(term.type_map ? "@type" : term.index));
        if (value) emit(object, *predicate, *value);
        one(at, object);
      };
      values(context, key, member, described);
    }
  }

  /// Passes on the objects of a value. The definition of the property's `key` says how strings are read.
  template <class F>
  void values(const Context& context, std::string_view key, Id value, F& one) {
    switch (document_.kind(value)) {
      case Kind::null: return;
      case Kind::array:
        for (const Id item : Children(document_, value)) values(context, key, item, one);
        return;
      case Kind::object: return object(context, key, value, one);
      default:
        if (const std::optional<TermId> term = scalar(context, key, value)) one(value, *term);
    }
  }

  template <class F>
  void object(const Context& outer, std::string_view key, Id object, F& one) {
    const Context context = with_context(outer, object);
    const std::vector<Entry> members = entries(context, object);
    const Entry* container = find(members, "@list");
    if (container == nullptr) container = find(members, "@set");
    if (find(members, "@value") != nullptr) {
      if (const std::optional<TermId> term = value_object(context, members)) one(object, *term);
      return;
    }
    if (container == nullptr) return one(object, node(context, members));
    for (const Entry& e : members)
      if (&e != container && e.name != "@index") refuse(e.value, e.name + " has no meaning beside " + container->name);
    if (container->name == "@set") return values(context, key, container->value, one);
    one(object, list(context, key, container->value));
  }

  TermId list(const Context& context, std::string_view key, Id value) {
    std::vector<TermId> members;
    const Definition* term = context->find(key);
    const auto one = [&](Id, TermId member) { members.push_back(member); };
    const auto item_of = [&](Id item) {
      if (document_.kind(item) != Kind::array) return values(context, key, item, one);
      if (term == nullptr || !term->list) unsupported(item, "an array in a @list, where {\"@list\": [...]} is meant,");
      members.push_back(list(context, key, item));
    };
    if (document_.kind(value) == Kind::array) {
      for (const Id item : Children(document_, value)) item_of(item);
    } else {
      item_of(value);
    }
    return list_of(members);
  }

  TermId list_of(const std::vector<TermId>& members) {
    const TermId nil = graph_.intern(vocab::rdf_::nil);
    TermId head = nil;
    for (std::size_t i = members.size(); i-- > 0;) {
      const TermId cell = fresh_blank();
      emit(cell, graph_.intern(vocab::rdf_::first), members[i]);
      emit(cell, graph_.intern(vocab::rdf_::rest), head);
      head = cell;
    }
    return head;
  }

  /// Any JSON as a literal, in its canonical form (JSON-LD-API 1.1, 8.2.2).
  TermId json_literal(Id value) {
    const std::string text = json::canonical(document_, value);
    return graph_.intern(literal(text, json_datatype));
  }

  /// JSON-LD-API 1.1, 5.3.
  std::optional<TermId> scalar(const Context& context, std::string_view key, Id value) {
    const Definition* term = context->find(key);
    const auto type = term != nullptr ? term->type : Definition::Type::absent;
    if (document_.kind(value) != Kind::string)
      return native(value, type == Definition::Type::datatype ? std::string_view(term->datatype) : std::string_view());
    return text_value(context, key, value, document_.text(value));
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
    if (type == Definition::Type::absent && !language.empty()) return graph_.intern(tagged_literal(text, language));
    return graph_.intern(literal(text));
  }

  TermId typed(Id at, std::string_view text, std::string_view datatype) {
    if (datatype == vocab::rdf_::langString.text) refuse(at, std::string(no_language));
    return graph_.intern(literal(text, Iri(datatype)));
  }

  /// true, false or a number (JSON-LD-API 1.1, 8.2.2).
  TermId native(Id value, std::string_view datatype) {
    const Kind kind = document_.kind(value);
    const auto made = [&](std::string_view text, Iri otherwise) { return typed(value, text, datatype.empty() ? otherwise.text : datatype); };
    if (kind != Kind::number) return made(kind == Kind::true_ ? "true" : "false", vocab::xsd::boolean);
    const std::string_view digits = document_.text(value) == "-0" ? "0" : document_.text(value);  // JSON-LD has no negative zero
    const bool wants_double = datatype == vocab::xsd::double_.text;
    const bool is_integer = digits.find_first_not_of("-0123456789") == std::string_view::npos;
    const std::size_t length = digits.size() - (digits.front() == '-' ? 1 : 0);
    if (is_integer && !wants_double && length <= 21) return made(digits, vocab::xsd::integer);  // below 10^21
    const double number = lexical::parse_double(digits).value_or(0);
    if (!std::isfinite(number)) refuse(value, "a number beyond xsd:double");
    if (wants_double || std::fabs(number) >= 1e21 || number != std::trunc(number)) return made(exact_double(number), vocab::xsd::double_);
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, number == 0 ? 0.0 : number, std::chars_format::fixed, 0).ptr;
    return made(std::string_view(buffer, static_cast<std::size_t>(end - buffer)), vocab::xsd::integer);
  }

  std::optional<TermId> value_object(const Context& context, const std::vector<Entry>& members) {
    const Entry *value = nullptr, *type = nullptr, *language = nullptr;
    for (const Entry& e : members) {
      if (e.name == "@value") value = &e;
      else if (e.name == "@type") type = &e;
      else if (e.name == "@language") language = &e;
      else if (e.name == "@direction") unsupported(e.value, "@direction");
      else if (e.name != "@index") refuse(e.value, shortened(e.name) + " has no meaning beside @value");
    }
    if (type != nullptr && document_.kind(type->value) == Kind::null) type = nullptr;
    if (language != nullptr && document_.kind(language->value) == Kind::null) language = nullptr;
    if (type != nullptr && language != nullptr) refuse(language->value, "@language has no meaning beside @type");
    std::string datatype;
    if (type != nullptr) {
      const std::optional<std::string> name = expand_iri(*context, string_at(type->value, "a datatype"), true, true, type->value);
      if (name && *name == "@json") return json_literal(value->value);
      if (!name || !iri::is_absolute(*name)) refuse(type->value, "expected an IRI as datatype");
      if (name->size() > max_iri) refuse(type->value, "IRI of more than " + std::to_string(max_iri) + " bytes", Errc::limit_exceeded);
      datatype = *name;
    }
    const std::string tag = language != nullptr ? language_at(language->value) : std::string();
    switch (document_.kind(value->value)) {
      case Kind::null: return std::nullopt;
      case Kind::object:
      case Kind::array: refuse(value->value, "expected a string, number, true, false or null as @value");
      case Kind::string: {
        const std::string_view text = document_.text(value->value);
        if (!tag.empty()) return graph_.intern(tagged_literal(text, tag));
        return datatype.empty() ? graph_.intern(literal(text)) : typed(value->value, text, datatype);
      }
      default:
        if (!tag.empty()) refuse(value->value, "expected a string beside @language");
        return native(value->value, datatype);
    }
  }

  const Document& document_;
  const ReadOptions& options_;
  std::shared_ptr<const std::string> initial_base_;
  Graph graph_;
  Context own_;
  std::map<std::string, TermId, std::less<>> labels_;
  std::map<std::pair<const Layer*, Id>, std::pair<Context, Context>> scopes_;  // with the active context, which stays for its address
  std::size_t blanks_ = 0, terms_ = 0, triples_ = 0, bytes_ = 0, expanded_ = 0;
};

}  // namespace

Result<Graph> read_json_ld(std::string_view text, const ReadOptions& options) {
  constexpr std::size_t values_per_triple = 16;
  const std::size_t most = options.max_triples > 0x0FFFFFFF ? 0xFFFFFFF0 : values_per_triple * options.max_triples + 1000;
  const Result<Document> document = Document::parse(text, {most, max_depth, true});
  if (!document) return unexpected(document.error());
  try {
    return Reader(*document, options).read();
  } catch (const Refused& refused) { return unexpected(refused.error); }
}

}  // namespace v0
}  // namespace lrt::rdf
