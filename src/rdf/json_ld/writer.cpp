// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/rdf/codecs.hpp"
#include "src/base/quote.hpp"
#include "src/rdf/graph_writer.hpp"
#include "src/rdf/json_ld/context.hpp"
#include "src/rdf/n_triples.hpp"

// Compacted JSON-LD 1.1, written directly from the graph, as Turtle is: this code is on the path from the control loop to the wire.

namespace lrt::rdf {
inline namespace v0 {
namespace {

using json_ld::Coercion;
using json_ld::Term;

/// True if a reader that stores numbers as doubles (JSON-LD-API 1.1, 8.2.2) gets a literal of exactly this text and datatype from a JSON
/// number of this text: integers up to 2^53, and non-integer doubles from 10^-6 in canonical form with at most 16 digits.
bool is_number(std::string_view text, std::string_view datatype) {
  if (text.empty()) return false;
  const std::size_t sign = text.front() == '-' ? 1 : 0;
  if (datatype == vocab::xsd::integer.text) {
    if (text.size() > 17 || !lexical::is_integer(text) || text.front() == '+') return false;
    if (text[sign] == '0') return text == "0";
    const auto value = lexical::parse_int64(text);
    return value && *value >= -9007199254740991 && *value <= 9007199254740991;
  }
  if (datatype != vocab::xsd::double_.text) return false;
  const std::size_t e = text.find('E');
  if (e == std::string_view::npos || text.size() > 26) return false;
  const auto value = lexical::parse_double(text);
  if (!value || json_ld::canonical_double(*value) != text) return false;
  const std::size_t decimals = e - sign - 2;
  const auto exponent = lexical::parse_int64(text.substr(e + 1));
  if (!exponent || *exponent < -6) return false;  // "1e-7": jsonld.js reads a number that JavaScript writes without a point as an integer
  return *exponent < static_cast<std::int64_t>(decimals) && !(decimals == 1 && text[e - 1] == '0' && *exponent >= 0);
}

class JsonLdWriter : GraphWriter {
 public:
  JsonLdWriter(const Graph& graph, const Prefixes& prefixes, std::string_view context)
      : GraphWriter(graph), prefixes_(json_ld::usable_prefixes(prefixes)), context_(context), used_(json_ld::term_count(), false) {}

  /// The conditions under which the graph must be written once more, by another writer.
  struct Conditions {
    bool several = false;                   // more than one top-level node
    std::vector<std::string> not_prefixes;  // prefixes with the name of a scheme of an IRI in the graph
  };
  Result<std::string> write(Conditions& conditions, bool& again) {
    for (const std::string& name : conditions.not_prefixes) {
      prefixes_.remove_if([&](std::string_view prefix) { return prefix == name; });
      context_ = {};
    }
    out_.reserve(256 + 96 * graph_.size());
    find_nested();
    if (!conditions.several) conditions.several = has_several();
    depth_ = conditions.several ? 2 : 1;
    for (const Triple& t : graph_.triples()) {
      if (!node(t.subject).nested) block(t.subject, conditions.several);
      while (!postponed_.empty()) {
        const TermId next = postponed_.back();
        postponed_.pop_back();
        if (!conditions.several) again = conditions.several = true;
        block(next, conditions.several);
      }
    }
    if (fault_) return unwritable(graph_.term(*fault_), fault_sentence_);
    if (!schemes_.empty()) {
      again = true;
      for (const std::string_view name : schemes_) conditions.not_prefixes.emplace_back(name);
    }
    return document(conditions.several);
  }

 private:
  bool has_several() {
    std::optional<TermId> only;
    for (const Triple& t : graph_.triples()) {
      if (node(t.subject).nested) continue;
      if (only && *only != t.subject) return true;
      only = t.subject;
    }
    return !only;  // no node: an empty @graph
  }

  void indent(int depth) {
    out_.push_back('\n');
    out_.append(static_cast<std::size_t>(depth) * 2, ' ');
  }

  void fault(TermId id, std::string_view sentence) {
    if (fault_) return;
    fault_ = id;
    fault_sentence_ = sentence;
  }

  void block(TermId subject, bool several) {
    if (node(subject).done) return;
    node(subject).done = true;
    const TermView view = graph_.term(subject);
    if (several) {
      if (!out_.empty()) out_.push_back(',');
      indent(depth_);
      out_.push_back('{');
    }
    const int depth = several ? depth_ + 1 : depth_;
    bool first = true;
    if (view.is_literal()) fault(subject, "expected a subject that is not a literal");
    if (!view.is_blank() || node(subject).uses != 0) {
      member(depth, first, "id");
      quoted_name(subject, view);
    }
    predicates(subject, depth, first);
    if (several) {
      indent(depth_);
      out_.push_back('}');
    }
  }

  void member(int depth, bool& first, std::string_view name) {
    if (!first) out_.push_back(',');
    first = false;
    indent(depth);
    out_.push_back('"');
    out_.append(name);
    out_.append("\": ");
  }

  /// All triples of a subject, as members of its object.
  void predicates(TermId subject, int depth, bool first) {
    const std::size_t base = keys_.size();
    push_triples(subject);
    const std::size_t end = keys_.size();
    for (std::size_t i = base; i < end;) {
      std::size_t next = i + 1;
      while (next < end && rank_of(keys_[next]) == rank_of(keys_[i])) ++next;
      if (rank_of(keys_[i]) == 0) {
        types(i, next, depth, first);
      } else {
        values(i, next, depth, first);
      }
      i = next;
    }
    keys_.resize(base);
  }

  /// @type, for types that are IRIs. Other types are written as ordinary values.
  void types(std::size_t from, std::size_t to, int depth, bool& first) {
    std::size_t iris = 0;
    for (std::size_t i = from; i < to; ++i) iris += graph_.term(triple_of(keys_[i]).object).is_iri();
    if (iris != 0) {
      member(depth, first, "type");
      if (iris > 1) out_.push_back('[');
      std::size_t written = 0;
      for (std::size_t i = from; i < to; ++i) {
        const TermId type = triple_of(keys_[i]).object;
        if (!graph_.term(type).is_iri()) continue;
        if (written++ != 0) out_.append(", ");
        quoted_word(type, graph_.term(type).text);
      }
      if (iris > 1) out_.push_back(']');
    }
    if (iris == to - from) return;
    const auto is_iri = [&](std::uint64_t key) { return graph_.term(triple_of(key).object).is_iri(); };
    const auto begin = keys_.begin();
    const auto others = std::stable_partition(begin + static_cast<std::ptrdiff_t>(from), begin + static_cast<std::ptrdiff_t>(to), is_iri);
    values(static_cast<std::size_t>(others - keys_.begin()), to, depth, first);
  }

  void values(std::size_t from, std::size_t to, int depth, bool& first) {
    const TermId predicate = triple_of(keys_[from]).predicate;
    const TermView view = graph_.term(predicate);
    if (!view.is_iri()) fault(predicate, "expected a predicate that is an IRI");
    if (!first) out_.push_back(',');
    first = false;
    indent(depth);
    quoted_word(predicate, view.text);
    out_.append(": ");
    const Term* term = json_ld::term_of(view.text);
    if (term != nullptr && !json_ld::is_usable(*term, prefixes_)) term = nullptr;
    if (to - from == 1) return object(triple_of(keys_[from]).object, term, depth);
    out_.push_back('[');
    for (std::size_t i = from; i < to; ++i) {
      if (i != from) out_.push_back(',');
      indent(depth + 1);
      object(triple_of(keys_[i]).object, term, depth + 1);
    }
    indent(depth);
    out_.push_back(']');
  }

  void object(TermId id, const Term* term, int depth) {
    const TermView view = graph_.term(id);
    if (view.is_literal()) return literal_of(id, view, term);
    if (nil_ && id == *nil_) {
      out_.append("{\"@list\": []}");
    } else if (view.is_blank() && node(id).nested && node(id).subject) {
      nested(id, view, term, depth);
    } else {
      reference(id, view, term);
    }
  }

  void reference(TermId id, const TermView& view, const Term* term) {
    const bool is_coerced = term != nullptr && (term->coercion == Coercion::id || term->coercion == Coercion::vocab);
    if (!is_coerced) out_.append("{\"id\": ");
    if (is_coerced && term->coercion == Coercion::vocab && view.is_iri()) quoted_word(id, view.text);
    else quoted_name(id, view);
    if (!is_coerced) out_.push_back('}');
  }

  void nested(TermId id, const TermView& view, const Term* term, int depth) {
    if (depth >= depth_ + max_nesting) {
      postponed_.push_back(id);
      return reference(id, view, term);
    }
    node(id).done = true;
    if (!is_list(id)) {
      out_.push_back('{');
      predicates(id, depth + 1, true);
      indent(depth);
      out_.push_back('}');
      return;
    }
    out_.append("{\"@list\": [");
    for (TermId cell = id; cell != *nil_;) {
      if (cell != id) out_.append(", ");
      object(*graph_.object(cell, *first_), term, depth + 1);
      cell = *graph_.object(cell, *rest_);
    }
    out_.append("]}");
  }

  void literal_of(TermId id, const TermView& view, const Term* term) {
    const std::string_view datatype = view.datatype == vocab::rdf_::langString.text ? view.datatype : "x:";  // others are checked as IRIs
    if (const std::string_view why = fault_of({TermKind::literal, view.text, datatype, view.language}); !why.empty()) fault(id, why);
    if (!view.language.empty()) {
      out_.append("{\"@language\": ");
      append_quoted(out_, view.language);
      out_.append(", \"@value\": ");
      append_quoted(out_, view.text);
      out_.push_back('}');
      return;
    }
    const bool is_typed = term != nullptr && term->coercion == Coercion::datatype;
    const bool is_string = view.datatype == vocab::xsd::string.text;
    if (is_typed ? view.datatype == term->datatype.text : is_string && (term == nullptr || term->coercion == Coercion::none)) {
      append_quoted(out_, view.text);
      return;
    }
    const bool is_boolean = view.datatype == vocab::xsd::boolean.text && (view.text == "true" || view.text == "false");
    if (!is_typed && (is_boolean || is_number(view.text, view.datatype))) {
      out_.append(view.text);
      return;
    }
    out_.push_back('{');
    if (!is_string) {
      out_.append("\"@type\": ");
      quoted_word(*graph_.find(iri(view.datatype)), view.datatype);
      out_.append(", ");
    }
    out_.append("\"@value\": ");
    append_quoted(out_, view.text);
    out_.push_back('}');
  }

  /// An IRI in a position where terms are allowed: a key, a type or a datatype.
  void quoted_word(TermId id, std::string_view text) {
    if (repeat(node(id).name)) return;
    const std::size_t at = out_.size();
    const Term* term = json_ld::term_of(text);
    if (term != nullptr && json_ld::is_usable(*term, prefixes_)) {
      used_[json_ld::index_of(*term)] = true;
      out_.push_back('"');
      out_.append(term->name);
      out_.push_back('"');
    } else {
      quoted_iri(id, text);
    }
    node(id).name = since(at);
  }

  /// The value of @id for a node.
  void quoted_name(TermId id, const TermView& view) {
    if (repeat(node(id).iri)) return;
    const std::size_t at = out_.size();
    if (view.is_blank()) {
      out_.push_back('"');
      label(id, view.text);
      out_.push_back('"');
    } else {
      quoted_iri(id, view.text);
    }
    node(id).iri = since(at);
  }

  void quoted_iri(TermId id, std::string_view text) {
    if (!iri::is_absolute(text)) return fault(id, "expected an absolute IRI");
    if (PrefixTable::Prefix* prefix = prefixes_.best_for(text)) {
      prefix->used = true;
      out_.push_back('"');
      out_.append(prefix->name);
      out_.push_back(':');
      out_.append(text.substr(prefix->iri.size()));
      out_.push_back('"');
      return;
    }
    // An IRI "ros:thing" whose scheme is the name of a prefix would be read with that prefix.
    const std::size_t colon = text.find(':');
    if (text.substr(colon + 1, 2) != "//" && prefixes_.find(text.substr(0, colon)) != nullptr) schemes_.push_back(text.substr(0, colon));
    append_quoted(out_, text);
  }

  std::string document(bool several) {
    std::string text = "{\n  \"@context\": ";
    if (context_.empty()) {
      const std::string context = json_ld::members(prefixes_, &used_, 4);
      text.reserve(text.size() + context.size() + out_.size() + 32);
      text.append("{").append(context).append("\n  },");
    } else {
      text.reserve(text.size() + context_.size() + out_.size() + 32);
      append_quoted(text, context_);
      text.push_back(',');
    }
    if (several) text.append("\n  \"@graph\": [");
    text.append(out_);
    text.append(!several ? "\n}\n" : out_.empty() ? "]\n}\n" : "\n  ]\n}\n");
    return text;
  }

  PrefixTable prefixes_;
  std::string_view context_;
  std::vector<bool> used_;                 // terms, by index
  std::vector<std::string_view> schemes_;  // schemes of IRIs with the name of a prefix
  std::string_view fault_sentence_;
  int depth_ = 1;  // of the members of the only node, or of the nodes in @graph
};

}  // namespace

bool has_json_ld() noexcept { return true; }

Result<std::string> write_json_ld(const Graph& graph, const Prefixes& prefixes, std::string_view context) {
  JsonLdWriter::Conditions conditions;
  while (true) {
    bool again = false;
    Result<std::string> written = JsonLdWriter(graph, prefixes, context).write(conditions, again);
    if (!written || !again) return written;
  }
}

std::string json_ld_context(const Prefixes& prefixes) {
  PrefixTable table = json_ld::usable_prefixes(prefixes);
  return "{\n  \"@context\": {" + json_ld::members(table, nullptr, 4) + "\n  }\n}\n";
}

}  // namespace v0
}  // namespace lrt::rdf
