// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/graph.hpp>

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;

namespace {

const TermView p = lrt::rdf::iri("http://e/p"), q = lrt::rdf::iri("http://e/q"), s = lrt::rdf::iri("http://e/s");
std::string label(const char* prefix, int i) { return prefix + std::to_string(i); }

/// Rings of blank nodes, of the given lengths.
Graph rings(const char* prefix, std::initializer_list<int> lengths) {
  Graph g;
  int from = 0;
  for (const int n : lengths) {
    for (int i = 0; i < n; ++i) g.add(blank(label(prefix, from + i)), p, blank(label(prefix, from + (i + 1) % n)));
    from += n;
  }
  return g;
}

}  // namespace

TEST_CASE("graphs that differ in blank node labels and order only are isomorphic", "[rdf]") {
  Graph a, b;
  a.add(s, p, blank("x"));
  a.add(blank("x"), q, literal("1"));
  a.add(s, p, blank("y"));
  b.add(blank("x"), q, literal("1"));
  b.add(s, p, blank("k"));
  b.add(s, p, blank("x"));
  CHECK(isomorphic(a, b));
  CHECK(isomorphic(Graph(), Graph()));
}

TEST_CASE("a ground term, a count or a connection that differs makes graphs different", "[rdf]") {
  Graph a, b;
  a.add(s, p, literal("1"));
  CHECK_FALSE(isomorphic(a, b));
  b.add(s, p, literal("2"));
  CHECK_FALSE(isomorphic(a, b));
  Graph c, d;
  c.add(blank("x"), p, blank("x"));
  d.add(blank("x"), p, blank("y"));
  CHECK_FALSE(isomorphic(c, d));
  Graph e, f;
  e.add(s, p, blank("x"));
  f.add(s, q, blank("x"));
  CHECK_FALSE(isomorphic(e, f));
}

TEST_CASE("nodes with equal colours are distinguished by search", "[rdf]") {
  CHECK(isomorphic(rings("a", {3, 4}), rings("b", {4, 3})));
  CHECK_FALSE(isomorphic(rings("a", {3, 3}), rings("b", {6})));
  CHECK_FALSE(isomorphic(rings("a", {4, 4, 4}), rings("b", {3, 3, 6})));
}

TEST_CASE("a few hundred interchangeable blank nodes are compared in reasonable time", "[rdf]") {
  Graph a, b;
  for (int i = 0; i < 300; ++i) a.add(blank(label("a", i)), p, literal("same"));
  for (int i = 300; i-- > 0;) b.add(blank(label("z", i)), p, literal("same"));
  CHECK(isomorphic(a, b));
  b.add(blank("z7"), q, literal("more"));
  a.add(s, q, literal("more"));
  CHECK_FALSE(isomorphic(a, b));
}

TEST_CASE("blank nodes that are interned but in no triple do not count", "[rdf]") {
  Graph a, b;
  a.add(s, p, s);
  b.add(s, p, s);
  b.fresh_blank();
  CHECK(isomorphic(a, b));
}
