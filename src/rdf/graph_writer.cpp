// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/graph_writer.hpp"

#include <algorithm>
#include <cstring>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::rdf {
namespace {

using lrt::detail::is_digit;
constexpr bool is_name_byte(char c) noexcept { return lrt::detail::is_alpha(c) || is_digit(c) || c == '_'; }

/// PN_PREFIX in ASCII, or the empty prefix.
bool is_prefix(std::string_view name) noexcept { return is_local_name(name) && (name.empty() || (!is_digit(name.front()) && name.front() != '_')); }

std::uint64_t eight_bytes(const char* at) noexcept {
  std::uint64_t word;
  std::memcpy(&word, at, 8);
  return word;
}

}  // namespace

bool is_local_name(std::string_view name) noexcept {
  if (name.empty()) return true;
  if (!is_name_byte(name.front()) || name.back() == '.') return false;
  for (const char c : name) {
    if (!is_name_byte(c) && c != '-' && c != '.') return false;
  }
  return true;
}

PrefixTable::PrefixTable(const Prefixes& prefixes) {
  table_.reserve(prefixes.size());
  for (const auto& [name, iri] : prefixes)
    if (iri.size() >= 8) table_.push_back({name, iri, eight_bytes(iri.data() + iri.size() - 8), std::nullopt});
}

bool PrefixTable::is_usable(Prefix& prefix) noexcept {
  if (!prefix.usable) {
    bool usable = is_prefix(prefix.name) && iri::is_absolute(prefix.iri);
    for (Prefix* before = table_.data(); usable && before != &prefix; ++before) usable = before->name != prefix.name || !is_usable(*before);
    prefix.usable = usable;
  }
  return *prefix.usable;
}

PrefixTable::Prefix* PrefixTable::best_for(std::string_view iri) noexcept {
  Prefix* best = nullptr;
  for (Prefix& prefix : table_) {
    const std::size_t size = prefix.iri.size();
    if (size > iri.size() || eight_bytes(iri.data() + size - 8) != prefix.tail) continue;
    if (best != nullptr && best->iri.size() >= size) continue;
    if (std::memcmp(iri.data(), prefix.iri.data(), size) == 0 && is_local_name(iri.substr(size)) && is_usable(prefix)) best = &prefix;
  }
  return best;
}

PrefixTable::Prefix* PrefixTable::find(std::string_view name) noexcept {
  for (Prefix& prefix : table_)
    if (prefix.name == name && is_usable(prefix)) return &prefix;
  return nullptr;
}

GraphWriter::GraphWriter(const Graph& graph)
    : graph_(graph),
      type_(graph.find(vocab::rdf_::type)),
      first_(graph.find(vocab::rdf_::first)),
      rest_(graph.find(vocab::rdf_::rest)),
      nil_(graph.find(vocab::rdf_::nil)),
      nodes_(graph.term_count()) {}

void GraphWriter::find_nested() {
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
  // Each nested node has one parent. Follow the parents from every node; a walk that meets itself has found a cycle.
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    std::uint32_t at = i;
    while (nodes_[at].nested && !nodes_[at].seen) {
      nodes_[at].seen = true;
      nodes_[at].label = i + 1;  // marks the walk; cleared below
      at = nodes_[at].parent;
    }
    if (!nodes_[at].nested || nodes_[at].label != i + 1) continue;
    for (std::uint32_t on = at; nodes_[on].nested; on = nodes_[on].parent) nodes_[on].nested = false;
  }
  for (Node& n : nodes_) n.label = 0;
}

bool GraphWriter::is_list(TermId head) {
  if (!first_ || !rest_ || !nil_) return false;
  std::vector<TermId>& cells = cells_;
  cells.clear();
  ListState verdict = ListState::no;
  for (TermId cell = head;;) {
    if (cell == *nil_) {
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

void GraphWriter::push_triples(TermId subject) {
  const std::size_t base = keys_.size();
  std::uint32_t ranks = 1;  // 0 is rdf:type
  bool sorted = true;
  const std::uint32_t stamp = number(subject) + 1;
  const Graph::Matches matches = graph_.match(subject, std::nullopt, std::nullopt);
  for (auto match = matches.begin(); match != matches.end(); ++match) {
    const Triple& t = *match;
    Node& predicate = node(t.predicate);
    if (predicate.ranked_by != stamp) {
      predicate.ranked_by = stamp;
      predicate.rank = type_ && t.predicate == *type_ ? 0 : ranks++;
    }
    const std::uint64_t key = (static_cast<std::uint64_t>(predicate.rank) << 32) | match.place();
    sorted = sorted && (keys_.size() == base || keys_.back() < key);
    keys_.push_back(key);
  }
  if (!sorted) std::sort(keys_.begin() + static_cast<std::ptrdiff_t>(base), keys_.end());
}

bool GraphWriter::repeat(Text text) {
  if (text.length == 0) return false;
  const std::size_t size = out_.size();
  out_.resize(size + text.length);
  std::memcpy(&out_[size], &out_[text.at], text.length);
  return true;
}

void GraphWriter::label(TermId id, std::string_view text) {
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

}  // namespace lrt::rdf
