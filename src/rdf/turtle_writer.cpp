#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/codecs.hpp"
#include "src/rdf/n_triples.hpp"

// Turtle and N-Triples are written here and not by Raptor: this is the way from the control loop to the wire, its bytes are
// what ETags are made of, and Raptor 2.0.15 writes invalid Turtle at the edges (tests/rdf/turtle_writer_test.cpp).

namespace lrt::rdf {
namespace {

constexpr int max_nesting = 24;  // deeper blank nodes and lists get a label and a block of their own

constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
constexpr bool is_name_byte(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_';
}

/// The part of PN_LOCAL that needs no escapes and that every reader agrees on.
bool is_local_name(std::string_view name) noexcept {
  if (name.empty()) return true;
  if (!is_name_byte(name.front()) || name.back() == '.') return false;
  for (const char c : name) {
    if (!is_name_byte(c) && c != '-' && c != '.') return false;
  }
  return true;
}

/// PN_PREFIX in ASCII, or the empty prefix.
bool is_prefix(std::string_view name) noexcept {
  return is_local_name(name) && (name.empty() || (!is_digit(name.front()) && name.front() != '_'));
}

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

/// One usable line of the caller's prefix table.
struct Prefix {
  std::string_view name, iri;
  std::uint64_t tail;  // the last eight bytes of `iri`: compared first, because most namespaces begin alike
  bool used = false;
};

std::uint64_t eight_bytes(const char* at) noexcept {
  std::uint64_t word;
  std::memcpy(&word, at, 8);
  return word;
}

std::vector<Prefix> usable(const Prefixes& prefixes) {
  const bool known_good = &prefixes == &default_prefixes();
  std::vector<Prefix> table;
  table.reserve(prefixes.size());
  for (const auto& [name, iri] : prefixes) {
    if (iri.size() < 8) continue;
    if (!known_good) {
      const auto same = [&name = name](const Prefix& other) { return other.name == name; };
      if (!is_prefix(name) || !iri::is_absolute(iri) || std::any_of(table.begin(), table.end(), same)) continue;
    }
    table.push_back({name, iri, eight_bytes(iri.data() + iri.size() - 8)});
  }
  return table;
}

class TurtleWriter {
 public:
  TurtleWriter(const Graph& graph, const Prefixes& prefixes)
      : graph_(graph),
        prefixes_(usable(prefixes)),
        type_(graph.find(vocab::rdf::type)),
        first_(graph.find(vocab::rdf::first)),
        rest_(graph.find(vocab::rdf::rest)),
        nil_(graph.find(vocab::rdf::nil)),
        nodes_(graph.term_count()) {}

  Result<std::string> write() {
    out_.reserve(128 + 96 * graph_.size());
    find_nested();
    for (const Triple& t : graph_.triples()) {
      if (!node(t.subject).nested) block(t.subject);
      while (!postponed_.empty()) {  // what was too deep; each block may postpone more
        const TermId next = postponed_.back();
        postponed_.pop_back();
        block(next);
      }
    }
    if (fault_) return unwritable(graph_.term(*fault_), fault_of(graph_.term(*fault_)));
    return document();
  }

 private:
  enum class ListState : std::uint8_t { unknown, yes, no };
  struct Node {
    std::uint32_t uses = 0;                 // as object
    std::uint32_t parent = 0;               // subject of the last use
    std::uint32_t at = 0, length = 0;       // where out_ has the term already, as an IRI
    std::uint32_t rank = 0, ranked_by = 0;  // of a predicate among those of a subject
    std::uint32_t label = 0;                // of a renamed blank node, from 1
    bool subject = false, nested = false, done = false, seen = false;
    ListState list = ListState::unknown;
  };

  static std::uint32_t number(TermId id) noexcept { return static_cast<std::uint32_t>(id); }
  Node& node(TermId id) noexcept { return nodes_[number(id)]; }

  /// Marks the blank nodes that can stand inside the only triple that mentions them: those that are not on a cycle.
  void find_nested() {
    bool blanks = false;
    for (const Triple& t : graph_.triples()) {
      node(t.subject).subject = true;
      Node& object = node(t.object);
      ++object.uses;
      object.parent = number(t.subject);
    }
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].uses == 1 && graph_.term(TermId{i}).is_blank()) nodes_[i].nested = blanks = true;
    }
    if (!blanks) return;
    // Each nested node has one parent: walk up from every node not seen; a walk that meets itself has found a cycle.
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      std::uint32_t at = i;
      while (nodes_[at].nested && !nodes_[at].seen) {
        nodes_[at].seen = true;
        nodes_[at].label = i + 1;  // the walk's mark, cleared below
        at = nodes_[at].parent;
      }
      if (!nodes_[at].nested || nodes_[at].label != i + 1) continue;
      for (std::uint32_t on = at; nodes_[on].nested; on = nodes_[on].parent) nodes_[on].nested = false;
    }
    for (Node& n : nodes_) n.label = 0;
  }

  /// True if the cell heads a list that nothing else refers to and that says nothing else. Judges all its cells at once.
  bool is_list(TermId head) {
    if (!first_ || !rest_ || !nil_) return false;
    std::vector<TermId>& cells = cells_;
    cells.clear();
    ListState verdict = ListState::no;
    for (TermId cell = head;;) {
      if (nil_ && cell == *nil_) {
        verdict = ListState::yes;
        break;
      }
      const Node& n = node(cell);
      if (!n.nested) break;
      if (n.list != ListState::unknown) {
        verdict = n.list;
        break;
      }
      cells.push_back(cell);
      std::size_t triples = 0;
      std::optional<TermId> member, next;
      for (const Triple& t : graph_.match(cell, std::nullopt, std::nullopt)) {
        if (++triples > 2) break;
        if (t.predicate == *first_) member = t.object;
        if (t.predicate == *rest_) next = t.object;
      }
      if (triples != 2 || !member || !next) break;
      cell = *next;
    }
    for (const TermId cell : cells) node(cell).list = verdict;
    return node(head).list == ListState::yes;
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

  /// All that is said of a subject. `own_line`: the first predicate begins a line, as inside brackets.
  void predicates(TermId subject, int depth, bool own_line) {
    const std::size_t base = keys_.size();
    std::uint32_t ranks = 1;  // 0 is rdf:type
    bool sorted = true;
    const std::uint32_t stamp = number(subject) + 1;
    for (const Triple& t : graph_.match(subject, std::nullopt, std::nullopt)) {
      Node& predicate = node(t.predicate);
      if (predicate.ranked_by != stamp) {
        predicate.ranked_by = stamp;
        predicate.rank = type_ && t.predicate == *type_ ? 0 : ranks++;
      }
      const auto at = static_cast<std::uint64_t>(&t - graph_.triples().data());
      const std::uint64_t key = (static_cast<std::uint64_t>(predicate.rank) << 32) | at;
      sorted = sorted && (keys_.size() == base || keys_.back() < key);
      keys_.push_back(key);
    }
    if (!sorted) std::sort(keys_.begin() + static_cast<std::ptrdiff_t>(base), keys_.end());
    const std::size_t end = keys_.size();
    std::uint64_t current = ~std::uint64_t{0};
    for (std::size_t i = base; i < end; ++i) {
      const Triple t = graph_.triples()[keys_[i] & 0xFFFFFFFF];
      const std::uint64_t rank = keys_[i] >> 32;
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
    Node& n = node(id);
    if (n.length != 0) {
      const std::size_t size = out_.size();
      out_.resize(size + n.length);
      std::memcpy(&out_[size], &out_[n.at], n.length);
      return;
    }
    if (!iri::is_absolute(text)) fault_ = id;
    const std::size_t at = out_.size();
    if (!shortened(text)) {
      out_.push_back('<');
      out_.append(text);
      out_.push_back('>');
    }
    n.at = static_cast<std::uint32_t>(at);
    n.length = static_cast<std::uint32_t>(out_.size() - at);
  }

  /// Writes prefix and local name with the longest namespace that fits.
  bool shortened(std::string_view text) {
    Prefix* best = nullptr;
    for (Prefix& prefix : prefixes_) {
      const std::size_t size = prefix.iri.size();
      if (size > text.size() || eight_bytes(text.data() + size - 8) != prefix.tail) continue;
      if (best != nullptr && best->iri.size() >= size) continue;
      if (std::memcmp(text.data(), prefix.iri.data(), size) == 0 && is_local_name(text.substr(size))) best = &prefix;
    }
    if (best == nullptr) return false;
    best->used = true;
    out_.append(best->name);
    out_.push_back(':');
    out_.append(text.substr(best->iri.size()));
    return true;
  }

  void literal_of(TermId id, const TermView& view) {
    if (is_bare(view.text, view.datatype)) {
      out_.append(view.text);
      return;
    }
    append_quoted(out_, view.text);
    if (!fault_of({TermKind::literal, view.text, "x:", view.language}).empty()) fault_ = id;
    if (!view.language.empty()) {
      out_.push_back('@');
      out_.append(view.language);
    } else if (view.datatype != vocab::xsd::string.text) {
      out_.append("^^");
      const auto datatype = graph_.find(iri(view.datatype));
      iri_of(*datatype, view.datatype);
    }
  }

  void label(TermId id, std::string_view text) {
    out_.append("_:");
    if (is_plain_label(text)) {
      out_.append(text);
      return;
    }
    Node& n = node(id);
    while (n.label == 0) {
      if (!graph_.find(blank("b" + std::to_string(labels_)))) n.label = labels_ + 1;
      ++labels_;
    }
    out_.push_back('b');
    out_.append(std::to_string(n.label - 1));
  }

  std::string document() {
    std::size_t size = out_.size() + 1;
    for (const Prefix& prefix : prefixes_) {
      if (prefix.used) size += prefix.name.size() + prefix.iri.size() + 16;
    }
    std::string text;
    text.reserve(size);
    for (const Prefix& prefix : prefixes_) {
      if (!prefix.used) continue;
      text.append("@prefix ");
      text.append(prefix.name);
      text.append(": <");
      text.append(prefix.iri);
      text.append("> .\n");
    }
    if (!text.empty()) text.push_back('\n');
    text.append(out_);
    return text;
  }

  const Graph& graph_;
  std::vector<Prefix> prefixes_;
  const std::optional<TermId> type_, first_, rest_, nil_;
  std::vector<Node> nodes_;
  std::vector<std::uint64_t> keys_;  // a stack: rank and index of the triples of the subjects being written
  std::vector<TermId> cells_, postponed_;
  std::string out_;
  std::optional<TermId> fault_;
  std::uint32_t labels_ = 0;
};

}  // namespace

Unexpected unwritable(const TermView& term, std::string_view why) {
  return unexpected(Errc::unsupported_syntax, "cannot write " + to_string(term) + ": " + std::string(why));
}

Result<std::string> write_turtle(const Graph& graph, const Prefixes& prefixes) { return TurtleWriter(graph, prefixes).write(); }

Result<std::string> write_n_triples(const Graph& graph) {
  std::string out;
  out.reserve(160 * graph.size());
  std::vector<std::uint32_t> names(graph.term_count(), 0);  // of blank nodes whose label N-Triples cannot carry
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
    const char* after = " ";
    for (const TermId id : {t.subject, t.predicate, t.object}) {
      if (const std::string_view fault = append(id); !fault.empty()) return unwritable(graph.term(id), fault);
      out += after;
    }
    out += ".\n";
  }
  return out;
}

}  // namespace lrt::rdf
