// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/rdf/codecs.hpp"
#include "src/rdf/graph_writer.hpp"
#include "src/rdf/n_triples.hpp"

// Turtle and N-Triples are written by our own code: it is on the path from the control loop to the wire, ETags are hashes of its output, and
// Raptor 2.0.15 writes invalid Turtle in some cases (tests/rdf/turtle_writer_test.cpp).

namespace lrt::rdf {
inline namespace v0 {
namespace {

using lrt::detail::is_digit;

/// True if Turtle reads `text` without quotes as a literal of exactly this text and datatype (Turtle 2.5.2, 2.5.3).
bool is_bare(std::string_view text, std::string_view datatype) noexcept {
  if (datatype == vocab::xsd::boolean.text) return text == "true" || text == "false";
  const bool integer = datatype == vocab::xsd::integer.text, decimal = datatype == vocab::xsd::decimal.text;
  if (!integer && !decimal && datatype != vocab::xsd::double_.text) return false;
  std::size_t i = 0;
  const auto digits = [&] {
    const std::size_t from = i;
    while (i < text.size() && is_digit(text[i])) ++i;
    return i - from;
  };
  if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
  const std::size_t before = digits();
  if (integer) return before != 0 && i == text.size();
  std::size_t after = 0;
  const bool point = i < text.size() && text[i] == '.';
  if (point) {
    ++i;
    after = digits();
  }
  if (decimal) return after != 0 && i == text.size();
  if (before == 0 && after == 0) return false;
  if (i == text.size() || (text[i] != 'e' && text[i] != 'E')) return false;
  ++i;
  if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
  return digits() != 0 && i == text.size();
}

/// The IRI up to what a prefix of its document's fragments would leave, "http://robot/arm/limits#"; empty: it has no fragment, or none of a simple name.
std::string_view fragment_space(std::string_view iri) noexcept {
  const std::size_t last = iri.find_last_of("#/");
  if (last == std::string_view::npos || last + 1 == iri.size() || iri.substr(0, last + 1).find('#') == std::string_view::npos) return {};
  return is_local_name(iri.substr(last + 1)) ? iri.substr(0, last + 1) : std::string_view();
}

/// Prefixes for the fragments of the documents that a graph describes: the nodes inside of values and shapes. They are named in the order of use.
class FragmentPrefixes {
 public:
  /// @param taken  the names of others
  explicit FragmentPrefixes(PrefixTable& taken) : taken_(taken) {}

  void add(std::string_view space) {
    if (names_.size() < most && names_.find(space) == names_.end()) names_.emplace(space, std::nullopt);
  }
  bool empty() const noexcept { return names_.empty(); }
  /// The name of the prefix of a namespace, or nullptr.
  const std::string* find(std::string_view space) {
    const auto at = names_.find(space);
    if (at == names_.end()) return nullptr;
    if (!at->second) use(*at);
    return &*at->second;
  }
  template <class Visit>
  void for_each_used(Visit visit) const {
    for (const auto* one : used_) visit(*one->second, one->first);
  }

 private:
  static constexpr std::size_t most = 900;  // a reader may have a limit: ours is max_directives
  using Names = std::map<std::string, std::optional<std::string>, std::less<>>;

  void use(Names::value_type& one) {
    do {
      one.second = tried_ == 0 ? std::string() : "p" + std::to_string(tried_);
      ++tried_;
    } while (taken_.find(*one.second) != nullptr);
    used_.push_back(&one);
  }

  PrefixTable& taken_;
  Names names_;                                 ///< by namespace; without a name before the first use
  std::vector<const Names::value_type*> used_;  ///< in order
  std::size_t tried_ = 0;
};

class TurtleWriter : GraphWriter {
 public:
  TurtleWriter(const Graph& graph, PrefixTable& prefixes, FragmentPrefixes& fragments)
      : GraphWriter(graph), prefixes_(prefixes), fragments_(fragments) {}

  /// The triples alone. Marks the prefixes that they use.
  Result<std::string> write() {
    if (Result<void> written = write_blocks(); !written) return Unexpected{std::move(written).error()};
    return std::move(out_);
  }

  /// A document of this text, which begins with the prefixes that are used.
  static std::string document(const PrefixTable& prefixes, const FragmentPrefixes& fragments, std::string_view body) {
    std::string text;
    std::size_t size = body.size() + 1;
    const auto each = [&](auto visit) {
      for (const PrefixTable::Prefix& prefix : prefixes.all())
        if (prefix.used) visit(prefix.name, prefix.iri);
      fragments.for_each_used(visit);
    };
    each([&](std::string_view name, std::string_view iri) { size += name.size() + iri.size() + 16; });
    text.reserve(size);
    each([&](std::string_view name, std::string_view iri) { text.append("@prefix ").append(name).append(": <").append(iri).append("> .\n"); });
    if (!text.empty()) text.push_back('\n');
    text.append(body);
    return text;
  }

 private:
  Result<void> write_blocks() {
    out_.reserve(128 + 96 * graph_.size());
    find_nested();
    find_fragments();
    for (const Triple& t : graph_.triples()) {
      if (!node(t.subject).nested) block(t.subject);
      while (!postponed_.empty()) {  // nodes that were too deep; each block may postpone more
        const TermId next = postponed_.back();
        postponed_.pop_back();
        block(next);
      }
    }
    if (fault_) return unwritable(graph_.term(*fault_), fault_of(graph_.term(*fault_)));
    return {};
  }

  /// Fragments that are described here occur at least twice: as object and as subject.
  void find_fragments() {
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (!nodes_[i].subject || nodes_[i].uses == 0) continue;
      const TermView view = graph_.term(TermId{i});
      if (const std::string_view space = fragment_space(view.text); view.is_iri() && !space.empty()) fragments_.add(space);
    }
  }

  void indent(int depth) {
    out_.push_back('\n');
    out_.append(static_cast<std::size_t>(depth) * 4, ' ');
  }

  void block(TermId subject) {
    if (node(subject).done) return;
    node(subject).done = true;
    if (!out_.empty()) out_.push_back('\n');
    const TermView view = graph_.term(subject);
    if (view.is_blank()) {
      if (node(subject).uses == 0) {
        out_.append("[]");
      } else {
        label(subject, view.text);
      }
    } else {
      iri_of(subject, view.text);
    }
    predicates(subject, 1, false);
    out_.append(" .\n");
  }

  /// All triples of a subject. `own_line`: the first predicate starts a new line, as inside brackets.
  void predicates(TermId subject, int depth, bool own_line) {
    const std::size_t base = keys_.size();
    push_triples(subject);
    const std::size_t end = keys_.size();
    std::uint64_t current = ~std::uint64_t{0};
    for (std::size_t i = base; i < end; ++i) {
      const Triple t = triple_of(keys_[i]);
      const std::uint64_t rank = rank_of(keys_[i]);
      if (rank == current) {
        if (rank == 0) {
          out_.append(", ");
        } else {
          out_.push_back(',');
          indent(depth + 1);
        }
      } else {
        current = rank;
        if (i != base) out_.append(" ;");
        if (i != base || own_line) {
          indent(depth);
        } else {
          out_.push_back(' ');
        }
        if (rank == 0) {
          out_.append("a ");
        } else {
          iri_of(t.predicate, graph_.term(t.predicate).text);
          out_.push_back(' ');
        }
      }
      object(t.object, depth);
    }
    keys_.resize(base);
  }

  void object(TermId id, int depth) {
    const TermView view = graph_.term(id);
    switch (view.kind) {
      case TermKind::iri:
        if (nil_ && id == *nil_) {
          out_.append("()");
        } else {
          iri_of(id, view.text);
        }
        break;
      case TermKind::literal: literal_of(id, view); break;
      case TermKind::blank: blank_of(id, view, depth); break;
    }
  }

  void blank_of(TermId id, const TermView& view, int depth) {
    Node& n = node(id);
    if (!n.nested) return label(id, view.text);
    if (!n.subject) {
      out_.append("[]");
      return;
    }
    if (depth >= max_nesting) {
      postponed_.push_back(id);
      return label(id, view.text);
    }
    n.done = true;
    if (is_list(id)) {
      out_.push_back('(');
      for (TermId cell = id; cell != *nil_;) {
        out_.push_back(' ');
        object(*graph_.object(cell, *first_), depth + 1);
        cell = *graph_.object(cell, *rest_);
      }
      out_.append(" )");
      return;
    }
    out_.push_back('[');
    predicates(id, depth + 1, true);
    indent(depth);
    out_.push_back(']');
  }

  void iri_of(TermId id, std::string_view text) {
    if (repeat(node(id).iri)) return;
    if (!iri::is_absolute(text)) fault_ = id;
    const std::size_t at = out_.size();
    if (PrefixTable::Prefix* prefix = prefixes_.best_for(text)) {
      prefix->used = true;
      out_.append(prefix->name);
      out_.push_back(':');
      out_.append(text.substr(prefix->iri.size()));
    } else if (const std::string* name = fragment_prefix(text)) {
      out_.append(*name);
      out_.push_back(':');
      out_.append(text.substr(fragment_space(text).size()));
    } else {
      out_.push_back('<');
      out_.append(text);
      out_.push_back('>');
    }
    node(id).iri = since(at);
  }

  const std::string* fragment_prefix(std::string_view iri) {
    if (fragments_.empty()) return nullptr;
    const std::string_view space = fragment_space(iri);
    return space.empty() ? nullptr : fragments_.find(space);
  }

  void literal_of(TermId id, const TermView& view) {
    if (is_bare(view.text, view.datatype)) {
      out_.append(view.text);
      return;
    }
    append_quoted(out_, view.text);
    const std::string_view datatype = view.datatype == vocab::rdf_::langString.text ? view.datatype : "x:";  // others are checked as IRIs
    if (!fault_of({TermKind::literal, view.text, datatype, view.language}).empty()) fault_ = id;
    if (!view.language.empty()) {
      out_.push_back('@');
      out_.append(view.language);
    } else if (view.datatype != vocab::xsd::string.text) {
      out_.append("^^");
      const auto datatype_id = graph_.find(iri(view.datatype));
      iri_of(*datatype_id, view.datatype);
    }
  }

  PrefixTable& prefixes_;
  FragmentPrefixes& fragments_;
};

/// The graph with other labels of its blank nodes, which no graph of another number has.
Graph relabelled(const Graph& graph, std::size_t number) {
  const std::string prefix = "g" + std::to_string(number) + "_";
  Graph other;
  const auto copy = [&](TermId id) {
    const TermView term = graph.term(id);
    return other.intern(term.is_blank() ? blank(prefix + std::to_string(static_cast<std::uint32_t>(id))) : term);
  };
  for (const Triple& t : graph.triples()) {
    const TermId s = copy(t.subject), p = copy(t.predicate), o = copy(t.object);
    other.add(s, p, o);
  }
  return other;
}

}  // namespace

Unexpected unwritable(const TermView& term, std::string_view why) {
  return unexpected(Errc::unsupported_syntax, "cannot write " + to_string(term) + ": " + std::string(why));
}

Result<std::string> write_turtle(const Graph& graph, const Prefixes& prefixes) {
  PrefixTable used(prefixes);
  FragmentPrefixes fragments(used);
  Result<std::string> body = TurtleWriter(graph, used, fragments).write();
  if (!body) return body;
  return TurtleWriter::document(used, fragments, *body);
}

Result<std::string> write_trig(const Dataset& dataset, const Prefixes& prefixes) {
  PrefixTable used(prefixes);
  FragmentPrefixes fragments(used);
  std::string body;
  const auto append = [&](const Graph& graph, std::size_t number) -> Result<void> {
    const Graph own = relabelled(graph, number);
    Result<std::string> part = TurtleWriter(own, used, fragments).write();
    if (!part) return Unexpected{std::move(part).error()};
    body += *part;
    return {};
  };
  if (Result<void> written = append(dataset.default_graph, 0); !written) return Unexpected{std::move(written).error()};
  for (std::size_t i = 0; i < dataset.named.size(); ++i) {
    const auto& [name, graph] = dataset.named[i];
    if (!iri::is_absolute(name)) return unwritable(iri(name), "expected an absolute IRI");
    body.append(body.empty() ? "<" : "\n<").append(name).append("> {\n");
    if (Result<void> written = append(graph, i + 1); !written) return Unexpected{std::move(written).error()};
    body += "}\n";
  }
  return TurtleWriter::document(used, fragments, body);
}

namespace {

/// Appends a line for each triple.
/// @param graph_name  with a space after it, "<http://robot/arm> "; empty: the default graph
Result<void> append_lines(std::string& out, const Graph& graph, std::string_view graph_name) {
  std::vector<std::uint32_t> names(graph.term_count(), 0);  // new labels of blank nodes with labels that N-Triples does not allow
  std::uint32_t labels = 0;
  const auto append = [&](TermId id) {
    const TermView term = graph.term(id);
    if (!term.is_blank() || is_plain_label(term.text)) {
      append_n_triples(out, term);
      return fault_of(term);
    }
    std::uint32_t& name = names[static_cast<std::uint32_t>(id)];
    while (name == 0) {
      if (!graph.find(blank("b" + std::to_string(labels)))) name = labels + 1;
      ++labels;
    }
    out += "_:b" + std::to_string(name - 1);
    return std::string_view();
  };
  for (const Triple& t : graph.triples()) {
    for (const TermId id : {t.subject, t.predicate, t.object}) {
      if (const std::string_view fault = append(id); !fault.empty()) return unwritable(graph.term(id), fault);
      out += ' ';
    }
    out.append(graph_name).append(".\n");
  }
  return {};
}

}  // namespace

Result<std::string> write_n_triples(const Graph& graph) {
  std::string out;
  out.reserve(160 * graph.size());
  if (Result<void> written = append_lines(out, graph, {}); !written) return Unexpected{std::move(written).error()};
  return out;
}

Result<std::string> write_n_quads(const Dataset& dataset) {
  std::string out;
  out.reserve(400 * dataset.default_graph.size());
  Result<void> written = append_lines(out, relabelled(dataset.default_graph, 0), {});
  for (std::size_t i = 0; written && i < dataset.named.size(); ++i) {
    const auto& [name, graph] = dataset.named[i];
    if (!iri::is_absolute(name)) return unwritable(iri(name), "expected an absolute IRI");
    written = append_lines(out, relabelled(graph, i + 1), "<" + name + "> ");
  }
  if (!written) return Unexpected{std::move(written).error()};
  return out;
}

}  // namespace v0
}  // namespace lrt::rdf
