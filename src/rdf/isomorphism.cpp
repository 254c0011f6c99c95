// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <vector>

#include <lrt/rdf/graph.hpp>

#include "src/rdf/hash.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

constexpr std::uint32_t no_number = 0xFFFFFFFF;
using Colour = std::uint64_t;
using Colours = std::vector<Colour>;

/// A triple. Ground terms have the same code in both graphs; blank nodes are numbered from 0 in each graph.
struct Edge {
  std::uint32_t code[3];   // of a ground term, or no_number
  std::uint32_t blank[3];  // of a blank node, or no_number
};

struct Side {
  std::vector<Edge> edges;     // those with a blank node
  std::vector<TermId> blanks;  // number to term
  std::size_t ground = 0;      // number of triples without a blank node
};

Colour mix(Colour a, Colour b) noexcept { return fold_multiply(a ^ 0xA0761D6478BD642Fu, b ^ 0xE7037ED1A0B428DBu); }

/// Colour refinement, followed by a search over the nodes that it does not distinguish.
class Matcher {
 public:
  Matcher(const Graph& a, const Graph& b) : a_(a), b_(b) {}

  bool run() {
    if (a_.size() != b_.size()) return false;
    std::vector<std::uint32_t> same(a_.term_count());
    for (std::uint32_t i = 0; i < same.size(); ++i) same[i] = i;
    std::vector<std::uint32_t> translated(b_.term_count(), no_number);
    for (std::uint32_t i = 0; i < translated.size(); ++i) {
      const TermView term = b_.term(TermId{i});
      if (term.is_blank()) continue;
      if (const auto id = a_.find(term)) translated[i] = static_cast<std::uint32_t>(*id);
    }
    if (!take(a_, same, side_a_, nullptr) || !take(b_, translated, side_b_, &a_)) return false;
    if (side_a_.ground != side_b_.ground || side_a_.blanks.size() != side_b_.blanks.size()) return false;
    return search(Colours(side_a_.blanks.size(), 1), Colours(side_b_.blanks.size(), 1));
  }

 private:
  /// Splits a graph into ground triples and triples with blank nodes. With `other`: that graph must have all the ground triples and terms.
  static bool take(const Graph& graph, const std::vector<std::uint32_t>& codes, Side& side, const Graph* other) {
    std::vector<std::uint32_t> numbers(graph.term_count(), no_number);
    for (const Triple& t : graph.triples()) {
      const TermId ids[3] = {t.subject, t.predicate, t.object};
      Edge edge{{no_number, no_number, no_number}, {no_number, no_number, no_number}};
      bool ground = true;
      for (int i = 0; i < 3; ++i) {
        const auto id = static_cast<std::uint32_t>(ids[i]);
        if (graph.term(ids[i]).is_blank()) {
          ground = false;
          if (numbers[id] == no_number) {
            numbers[id] = static_cast<std::uint32_t>(side.blanks.size());
            side.blanks.push_back(ids[i]);
          }
          edge.blank[i] = numbers[id];
        } else {
          if (codes[id] == no_number) return false;
          edge.code[i] = codes[id];
        }
      }
      if (!ground) {
        side.edges.push_back(edge);
        continue;
      }
      ++side.ground;
      if (other != nullptr && !other->contains(TermId{edge.code[0]}, TermId{edge.code[1]}, TermId{edge.code[2]})) return false;
    }
    return true;
  }

  /// One round: the colours of all neighbours are combined into a node's colour, independent of their order.
  static Colours refined(const Side& side, const Colours& colours) {
    Colours next = colours;
    for (const Edge& edge : side.edges) {
      Colour of[3];
      for (int i = 0; i < 3; ++i) of[i] = edge.blank[i] == no_number ? mix(edge.code[i], 7) : colours[edge.blank[i]];
      const Colour whole = mix(mix(of[0], of[1]), of[2]);
      for (int i = 0; i < 3; ++i) {
        if (edge.blank[i] != no_number) next[edge.blank[i]] += mix(whole, static_cast<Colour>(i) + 11);
      }
    }
    for (std::size_t i = 0; i < next.size(); ++i) next[i] = mix(next[i], colours[i]);
    return next;
  }

  static Colours sorted(Colours colours) {
    std::sort(colours.begin(), colours.end());
    return colours;
  }
  static std::size_t kinds(const Colours& sorted_colours) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < sorted_colours.size(); ++i) n += i == 0 || sorted_colours[i] != sorted_colours[i - 1];
    return n;
  }

  bool search(Colours a, Colours b) {
    Colours order = sorted(a);
    for (std::size_t before = 0, now = kinds(order); now != before && now != a.size();) {
      a = refined(side_a_, a);
      b = refined(side_b_, b);
      order = sorted(a);
      if (order != sorted(b)) return false;
      before = now;
      now = kinds(order);
    }
    if (order != sorted(b)) return false;

    // The smallest class of nodes with the same colour.
    Colour choice = 0;
    std::size_t smallest = no_number;
    for (std::size_t i = 0; i < order.size();) {
      std::size_t end = i;
      while (end < order.size() && order[end] == order[i]) ++end;
      if (end - i > 1 && end - i < smallest) {
        smallest = end - i;
        choice = order[i];
      }
      i = end;
    }
    if (smallest == no_number) return same(a, b);

    const auto chosen = static_cast<std::size_t>(std::find(a.begin(), a.end(), choice) - a.begin());
    const Colour mark = mix(choice, 0x51ED270B);
    a[chosen] = mark;
    for (std::size_t i = 0; i < b.size(); ++i) {
      if (b[i] != choice) continue;
      Colours trial = b;
      trial[i] = mark;
      if (search(a, std::move(trial))) return true;
    }
    return false;
  }

  /// Compares the triples. @pre every colour belongs to one node of each graph
  bool same(const Colours& a, const Colours& b) const {
    std::vector<std::pair<Colour, std::uint32_t>> nodes;
    for (std::uint32_t i = 0; i < b.size(); ++i) nodes.emplace_back(b[i], i);
    std::sort(nodes.begin(), nodes.end());
    for (const Edge& edge : side_a_.edges) {
      std::optional<TermId> ids[3];
      for (int i = 0; i < 3; ++i) {
        if (edge.blank[i] == no_number) {
          ids[i] = b_.find(a_.term(TermId{edge.code[i]}));
        } else {
          const auto at = std::lower_bound(nodes.begin(), nodes.end(), std::pair<Colour, std::uint32_t>(a[edge.blank[i]], 0));
          ids[i] = side_b_.blanks[at->second];
        }
        if (!ids[i]) return false;
      }
      if (!b_.contains(*ids[0], *ids[1], *ids[2])) return false;
    }
    return true;
  }

  const Graph& a_;
  const Graph& b_;
  Side side_a_, side_b_;
};

}  // namespace

bool isomorphic(const Graph& a, const Graph& b) { return Matcher(a, b).run(); }

}  // namespace v0
}  // namespace lrt::rdf
