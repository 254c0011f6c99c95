// SPDX-License-Identifier: Apache-2.0
#include "src/page/term_page.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/page/html.hpp"

namespace lrt::page {

namespace {

using rdf::TermView;

constexpr Iri owl_class{"http://www.w3.org/2002/07/owl#Class"}, object_property{"http://www.w3.org/2002/07/owl#ObjectProperty"},
    datatype_property{"http://www.w3.org/2002/07/owl#DatatypeProperty"}, inverse_of{"http://www.w3.org/2002/07/owl#inverseOf"},
    subproperty_of{"http://www.w3.org/2000/01/rdf-schema#subPropertyOf"};

enum class Kind : std::uint8_t { class_, property, value };
constexpr std::array<std::string_view, 3> headings = {"Classes", "Properties", "Values"};

struct Term {
  std::string_view iri;
  std::string name;    ///< as it is shown: with a prefix if there is one
  std::string anchor;  ///< unique in the page
  Kind kind = Kind::value;
};

class Writer {
 public:
  explicit Writer(const engine::TermList& list) : graph_(list.graph), prefixes_(list.prefixes) {
    const TermView ontology(vocab::owl::Ontology);
    for (const rdf::Triple& t : graph_.triples())
      if (list_.empty() && graph_.term(t.predicate) == TermView(vocab::rdf_::type) && graph_.term(t.object) == ontology)
        list_ = graph_.term(t.subject).text;
    for (const rdf::Triple& t : graph_.triples()) {
      const TermView subject = graph_.term(t.subject);
      if (!subject.is_iri() || graph_.term(t.predicate) != TermView(vocab::rdfs::label)) continue;
      Term& term = terms_[subject.text];
      term.iri = subject.text;
      term.name = name_of(subject.text);
      term.anchor = own_name(subject.text).value_or(term.name);
      const auto is = [&](Iri of) { return graph_.contains(subject, TermView(vocab::rdf_::type), TermView(of)); };
      term.kind = is(vocab::rdfs::Class) || is(owl_class) ? Kind::class_ : is(vocab::rdf_::Property) ? Kind::property : Kind::value;
    }
  }

  TermPage page(const std::vector<std::string_view>& types) && {
    const TermView list = rdf::iri(list_);
    const std::string title = text_of(list, vocab::dcterms::title);
    html_ = "<h1>" + html_text(title) + "</h1>\n";
    if (const std::string comment = text_of(list, vocab::rdfs::comment); !comment.empty()) html_ += "<p>" + html_text(comment) + "</p>\n";
    html_ += "<p>The same as RDF:";
    const char* separator = " ";
    for (const std::string_view type : types) {
      if (type.find(';') != std::string_view::npos) continue;  // a profile of one of the others
      html_ += separator + ("<a rel=\"alternate\" href=\"?accept=" + html_text(percent_encoded(type, "/+")) + "\">") + html_text(type) + "</a>";
      separator = ", ";
    }
    html_ += "</p>\n";
    write_vocabularies();
    return {title, std::move(html_)};
  }

 private:
  std::string text_of(const TermView& subject, Iri predicate) const {
    const std::optional<TermView> found = graph_.object(subject, TermView(predicate));
    return found && found->is_literal() ? std::string(found->text) : std::string();
  }

  /// The name of a term of this list below its IRI.
  std::optional<std::string> own_name(std::string_view iri) const {
    if (iri.size() <= list_.size() || iri.substr(0, list_.size()) != list_) return std::nullopt;
    std::string_view rest = iri.substr(list_.size());
    if (rest.front() == '#' || rest.front() == '/') rest.remove_prefix(1);
    return rest.empty() ? std::nullopt : std::optional<std::string>(rest);
  }

  std::string name_of(std::string_view iri) const {
    const std::pair<std::string, std::string>* longest = nullptr;
    for (const auto& prefix : prefixes_) {
      const std::string& space = prefix.second;
      if (iri.size() > space.size() && iri.substr(0, space.size()) == space && (!longest || space.size() > longest->second.size())) longest = &prefix;
    }
    if (longest) return longest->first + ":" + std::string(iri.substr(longest->second.size()));
    return own_name(iri).value_or(std::string(iri));
  }

  std::string link(std::string_view iri) const {
    const auto here = terms_.find(iri);
    const bool is_web = iri.substr(0, 7) == "http://" || iri.substr(0, 8) == "https://";
    if (here == terms_.end() && !is_web) return html_text(iri);
    const std::string target = here != terms_.end() ? "#" + here->second.anchor : std::string(iri);
    return "<a href=\"" + html_text(target) + "\">" + html_text(name_of(iri)) + "</a>";
  }

  void write_vocabularies() {
    std::map<std::string, std::vector<const Term*>> by_vocabulary;
    for (const auto& [iri, term] : terms_) {
      const std::optional<TermView> of = graph_.object(rdf::iri(iri), TermView(vocab::rdfs::isDefinedBy));
      by_vocabulary[of && of->text != list_ ? std::string(of->text) : std::string()].push_back(&term);  // its own are the first
    }
    for (auto& [vocabulary, terms] : by_vocabulary) {
      std::sort(terms.begin(), terms.end(), [](const Term* a, const Term* b) {
        const std::string x = lrt::detail::lower(a->name), y = lrt::detail::lower(b->name);
        return std::make_pair(a->kind, x == y ? a->name : x) < std::make_pair(b->kind, x == y ? b->name : y);
      });
      const std::string_view first = terms.front()->iri;
      html_ += "<section>\n<h2>" + html_text(first.substr(0, name_start(first))) + "</h2>\n";
      write_contents(terms);
      html_ += "<div class=\"cards wide\">\n";
      for (const Term* term : terms) write(*term);
      html_ += "</div>\n</section>\n";
    }
  }

  /// Where the name of a term begins in its IRI.
  std::size_t name_start(std::string_view iri) const {
    if (const std::optional<std::string> own = own_name(iri)) return iri.size() - own->size();
    return iri.find_last_of("#/") + 1;
  }

  void write_contents(const std::vector<const Term*>& terms) {
    for (std::size_t kind = 0; kind < headings.size(); ++kind) {
      bool is_first = true;
      for (const Term* term : terms) {
        if (static_cast<std::size_t>(term->kind) != kind) continue;
        html_ += is_first ? "<p>" + std::string(headings[kind]) + ": " : std::string(", ");
        html_ += link(term->iri);
        is_first = false;
      }
      if (!is_first) html_ += "</p>\n";
    }
  }

  /// What a predicate is called; empty: it is not shown among the facts.
  std::string caption_of(const TermView& predicate) const {
    static constexpr std::array<std::pair<Iri, std::string_view>, 12> captions = {{{vocab::rdf_::type, ""},
                                                                                   {vocab::rdfs::label, ""},
                                                                                   {vocab::rdfs::comment, ""},
                                                                                   {vocab::rdfs::isDefinedBy, ""},
                                                                                   {vocab::rdfs::subClassOf, "Subclass of"},
                                                                                   {subproperty_of, "Subproperty of"},
                                                                                   {vocab::rdfs::domain, "Domain"},
                                                                                   {vocab::rdfs::range, "Range"},
                                                                                   {inverse_of, "Inverse of"},
                                                                                   {vocab::rdfs::seeAlso, "See also"},
                                                                                   {vocab::vom::unit, "Unit"},
                                                                                   {vocab::qudt::hasUnit, "Unit"}}};
    for (const auto& [iri, caption] : captions)
      if (predicate == TermView(iri)) return std::string(caption);
    return name_of(predicate.text);
  }

  std::string types_of(const TermView& term) const {
    std::string html;
    for (const TermView& type : graph_.objects(term, TermView(vocab::rdf_::type))) {
      if (type == TermView(owl_class) || type == TermView(vocab::rdfs::Resource)) continue;
      const std::string shown = type == TermView(vocab::rdfs::Class)      ? "class"
                                : type == TermView(vocab::rdf_::Property) ? "property"
                                : type == TermView(object_property)       ? "to a resource"
                                : type == TermView(datatype_property)     ? "to a literal"
                                                                          : link(type.text);
      html += " <span class=\"chip\">" + shown + "</span>";
    }
    return html;
  }

  void write(const Term& term) {
    const TermView subject = rdf::iri(term.iri);
    const std::string anchor = html_text(term.anchor), label = text_of(subject, vocab::rdfs::label);
    html_ += "<article class=\"card\" id=\"" + anchor + "\">\n<h3><a href=\"#" + anchor + "\">" + html_text(term.name) + "</a></h3>\n";
    html_ += "<p>" + html_text(label) + types_of(subject) + "</p>\n";
    if (const std::string comment = text_of(subject, vocab::rdfs::comment); !comment.empty()) html_ += "<p>" + html_text(comment) + "</p>\n";
    std::vector<std::pair<std::string, std::string>> facts = {{"IRI", "<code>" + html_text(term.iri) + "</code>"}};
    for (const rdf::Triple& t : graph_.match(&subject, nullptr, nullptr)) {
      const TermView object = graph_.term(t.object);
      const std::string caption = caption_of(graph_.term(t.predicate));
      if (caption.empty() || object.is_blank()) continue;
      const std::string value = object.is_iri() ? link(object.text) : html_text(object.text);
      const auto same = std::find_if(facts.begin(), facts.end(), [&](const auto& fact) { return fact.first == caption; });
      if (same == facts.end()) facts.emplace_back(caption, value);
      else same->second += ", " + value;
    }
    html_ += "<dl class=\"facts\">\n";
    for (const auto& [caption, value] : facts) html_ += "<dt>" + html_text(caption) + "</dt><dd>" + value + "</dd>\n";
    html_ += "</dl>\n</article>\n";
  }

  const rdf::Graph& graph_;
  const std::vector<std::pair<std::string, std::string>>& prefixes_;
  std::string_view list_;  ///< IRI of the ontology
  std::map<std::string_view, Term> terms_;
  std::string html_;
};

}  // namespace

TermPage term_page(const engine::TermList& list) { return Writer(list).page(list.types); }

}  // namespace lrt::page
