// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/graph.hpp>

#include <algorithm>
#include <string>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/hash.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace vocab = lrt::vocab;

namespace {

const TermView s = lrt::rdf::iri("http://e/s"), p = lrt::rdf::iri("http://e/p"), q = lrt::rdf::iri("http://e/q"), o = lrt::rdf::iri("http://e/o");

std::size_t count(const Graph::Matches& matches) {
  std::size_t n = 0;
  for (auto it = matches.begin(); it != matches.end(); ++it) ++n;
  return n;
}

}  // namespace

TEST_CASE("a graph is a set of triples that keeps their order", "[rdf]") {
  Graph g;
  CHECK(g.empty());
  CHECK(g.match(std::nullopt, std::nullopt, std::nullopt).empty());
  CHECK(g.add(s, p, o));
  CHECK(g.add(s, q, literal("1")));
  CHECK_FALSE(g.add(s, p, o));
  REQUIRE(g.size() == 2);
  CHECK(g.term(g.triples()[0].object) == o);
  CHECK(g.term(g.triples()[1].object) == literal("1"));
  CHECK(g.contains(s, p, o));
  CHECK_FALSE(g.contains(s, q, o));
  CHECK_FALSE(g.contains(o, p, s));
  CHECK_FALSE(g.contains(s, p, lrt::rdf::iri("http://e/unknown")));
}

TEST_CASE("terms that differ in one part only are different", "[rdf]") {
  Graph g;
  const TermView terms[] = {lrt::rdf::iri("a:"),           blank("a:"), literal("a:"), literal("a:", vocab::xsd::anyURI), tagged_literal("a:", "en"),
                            tagged_literal("a:", "en-gb"), literal("")};
  for (const TermView& t : terms) g.intern(t);
  for (const TermView& a : terms) {
    const auto id = g.find(a);
    REQUIRE(id);
    CHECK(g.term(*id) == a);
  }
}

TEST_CASE("language tags become lower case", "[rdf]") {
  Graph g;
  const TermId id = g.intern(tagged_literal("colour", "en-GB"));
  CHECK(g.term(id).language == "en-gb");
  CHECK(g.intern(tagged_literal("colour", "EN-gb")) == id);
  CHECK(g.find(tagged_literal("colour", "en-gb")) == id);
}

TEST_CASE("a literal made without a datatype is an xsd:string", "[rdf]") {
  Graph g;
  CHECK(g.intern({TermKind::literal, "a"}) == g.intern(literal("a")));
}

TEST_CASE("match finds the same triples by every combination of bound terms", "[rdf]") {
  Graph g;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 5; ++k) {
        g.add(lrt::rdf::iri("s:" + std::to_string(i)), lrt::rdf::iri("p:" + std::to_string(j)), literal(std::to_string(k)));
      }
    }
  }
  const auto subject = g.find(lrt::rdf::iri("s:2")), predicate = g.find(lrt::rdf::iri("p:1")), object = g.find(literal("4"));
  REQUIRE((subject && predicate && object));
  const auto any = std::nullopt;
  CHECK(count(g.match(any, any, any)) == 60);
  CHECK(count(g.match(subject, any, any)) == 15);
  CHECK(count(g.match(any, predicate, any)) == 20);
  CHECK(count(g.match(any, any, object)) == 12);
  CHECK(count(g.match(subject, predicate, any)) == 5);
  CHECK(count(g.match(subject, any, object)) == 3);
  CHECK(count(g.match(any, predicate, object)) == 4);
  CHECK(count(g.match(subject, predicate, object)) == 1);
  CHECK(count(g.match(predicate, predicate, any)) == 0);
  std::string order;
  for (const Triple& t : g.match(subject, predicate, any)) order += g.term(t.object).text;
  CHECK(order == "01234");
  const TermView unknown = lrt::rdf::iri("x:");
  CHECK(g.match(&unknown, nullptr, nullptr).empty());
}

TEST_CASE("object, objects and subjects keep the order of addition", "[rdf]") {
  Graph g;
  CHECK_FALSE(g.object(s, p));
  g.add(s, p, literal("2"));
  g.add(s, p, literal("1"));
  g.add(o, p, literal("1"));
  CHECK(g.object(s, p) == literal("2"));
  REQUIRE(g.objects(s, p).size() == 2);
  CHECK(g.objects(s, p)[1] == literal("1"));
  REQUIRE(g.subjects(p, literal("1")).size() == 2);
  CHECK(g.subjects(p, literal("1"))[0] == s);
}

TEST_CASE("terms of a graph can be added to the same graph while it grows", "[rdf]") {
  Graph g;
  g.add(s, p, tagged_literal("some text that is longer than a short string", "en"));
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const auto known = [&] { return g.term(g.triples()[0].object); };  // its views end with each change
    const std::string fresh = "http://e/fresh" + std::to_string(i);
    g.add(lrt::rdf::iri(fresh), p, known());
    g.add(lrt::rdf::iri(fresh), q, tagged_literal(g.term(g.triples()[i].subject).text, known().language));  // new, of old parts
    g.add(lrt::rdf::iri(fresh), lrt::rdf::iri(fresh + "/p"), literal(g.term(g.triples()[i].subject).text));
  }
  CHECK(g.size() == 9001);
  CHECK(g.contains(lrt::rdf::iri("http://e/fresh2999"), p, tagged_literal("some text that is longer than a short string", "en")));
  CHECK(g.contains(lrt::rdf::iri("http://e/fresh0"), q, tagged_literal("http://e/s", "en")));
}

TEST_CASE("merging identifies blank nodes with equal labels and skips existing triples", "[rdf]") {
  Graph a, b;
  a.add(s, p, blank("x"));
  b.add(s, p, blank("x"));
  b.add(blank("x"), q, literal("1", vocab::xsd::integer));
  a.merge(b);
  CHECK(a.size() == 2);
  a.merge(a);
  CHECK(a.size() == 2);
  Graph copy = a;
  copy.add(s, q, o);
  CHECK(a.size() == 2);
  CHECK(copy.contains(blank("x"), q, literal("1", vocab::xsd::integer)));
}

TEST_CASE("a new blank node has a unique label", "[rdf]") {
  Graph g;
  g.intern(blank("b0"));
  g.intern(blank("b2"));
  const TermId first = g.fresh_blank(), second = g.fresh_blank();
  CHECK(g.term(first).text == "b1");
  CHECK(g.term(second).text == "b3");
}

TEST_CASE("new blank nodes step over labels that were given, and both are found", "[rdf]") {
  Graph g;
  const TermId two = g.intern(blank("2")), b1 = g.intern(blank("b1")), b02 = g.intern(blank("b02"));
  std::vector<TermId> fresh;
  for (const char* label : {"b0", "b2", "b3"}) {
    fresh.push_back(g.fresh_blank());
    CHECK(g.term(fresh.back()) == blank(label));
  }
  const Graph copy = g;
  for (const Graph* of : {&static_cast<const Graph&>(g), &copy}) {
    CHECK(of->find(blank("b0")) == fresh[0]);
    CHECK(of->find(blank("b1")) == b1);
    CHECK(of->find(blank("b2")) == fresh[1]);
    CHECK(of->find(blank("b02")) == b02);
    CHECK(of->find(blank("2")) == two);
    for (const char* label : {"", "b", "b4", "b00", "b-1", "b0 ", "c0", "b99999999999999999999"}) CHECK_FALSE(of->find(blank(label)));
    CHECK_FALSE(of->find(lrt::rdf::iri("b0")));
    CHECK_FALSE(of->find(literal("b0")));
  }
  CHECK(g.intern(blank("b3")) == fresh[2]);
  CHECK(g.intern(blank("b5")) != g.fresh_blank());
  CHECK(g.term(g.fresh_blank()) == blank("b6"));
  CHECK(g.term_count() == 9);
}

TEST_CASE("triples whose terms all have many triples are added once and found", "[rdf]") {
  constexpr std::size_t side = 24;
  std::vector<TermId> nodes;
  Graph g;
  for (std::size_t i = 0; i < side; ++i) nodes.push_back(g.intern(lrt::rdf::iri("http://e/" + std::to_string(i))));
  const auto left_out = [](std::size_t s, std::size_t p, std::size_t o) { return (s + 2 * p + 3 * o) % 7 == 0; };
  std::size_t added = 0;
  for (int round = 0; round < 2; ++round) {
    std::size_t again = 0;
    for (std::size_t s = 0; s < side; ++s)
      for (std::size_t p = 0; p < side; ++p)
        for (std::size_t o = 0; o < side; ++o)
          if (!left_out(s, p, o)) (g.add(nodes[s], nodes[p], nodes[o]) ? added : again) += 1;
    CHECK(again == (round == 0 ? 0 : added));
  }
  CHECK(g.size() == added);
  std::size_t wrong = 0;
  for (std::size_t s = 0; s < side; ++s)
    for (std::size_t p = 0; p < side; ++p)
      for (std::size_t o = 0; o < side; ++o) wrong += g.contains(nodes[s], nodes[p], nodes[o]) == left_out(s, p, o);
  CHECK(wrong == 0);
}

TEST_CASE("a list is read only if it is well-formed and finite", "[rdf]") {
  Graph g;
  const TermId nil = g.intern(vocab::rdf_::nil);
  REQUIRE(g.list(nil));
  CHECK(g.list(nil)->empty());
  g.add(blank("1"), vocab::rdf_::first, literal("a"));
  g.add(blank("1"), vocab::rdf_::rest, blank("2"));
  g.add(blank("2"), vocab::rdf_::first, literal("b"));
  const TermId head = *g.find(blank("1"));
  CHECK_FALSE(g.list(head));
  g.add(blank("2"), vocab::rdf_::rest, vocab::rdf_::nil);
  REQUIRE(g.list(head));
  REQUIRE(g.list(head)->size() == 2);
  CHECK(g.term(g.list(head)->at(1)) == literal("b"));
  SECTION("two members in a cell") { g.add(blank("2"), vocab::rdf_::first, literal("c")); }
  SECTION("two ways on") { g.add(blank("1"), vocab::rdf_::rest, vocab::rdf_::nil); }
  SECTION("a cycle") {
    Graph cycle;
    cycle.add(blank("1"), vocab::rdf_::first, literal("a"));
    cycle.add(blank("1"), vocab::rdf_::rest, blank("1"));
    cycle.intern(vocab::rdf_::nil);
    CHECK_FALSE(cycle.list(*cycle.find(blank("1"))));
    return;
  }
  CHECK_FALSE(g.list(head));
}

TEST_CASE("a hundred thousand triples are found again", "[rdf]") {
  Graph g;
  for (int i = 0; i < 100'000; ++i) {
    g.add(lrt::rdf::iri("http://e/" + std::to_string(i / 10)), lrt::rdf::iri("http://p/" + std::to_string(i % 10)), literal(std::to_string(i)));
  }
  REQUIRE(g.size() == 100'000);
  CHECK(g.object(lrt::rdf::iri("http://e/9999"), lrt::rdf::iri("http://p/9")) == literal("99999"));
  CHECK(g.subjects(lrt::rdf::iri("http://p/3"), literal("50003")).size() == 1);
}

TEST_CASE("no client can choose triples that are in one place of the hash table", "[rdf]") {
  // The triples whose hashes without a seed end in zeros.
  constexpr std::uint64_t slots = 1 << 12;
  std::vector<std::size_t> found(slots);
  std::size_t chosen = 0;
  for (std::uint32_t s = 0; s < 2'000; ++s) {
    for (std::uint32_t o = 2; o < 2'000; ++o) {
      const std::uint64_t unseeded = fold_multiply((static_cast<std::uint64_t>(s) << 32 | 1) ^ 0xA0761D6478BD642Fu, o ^ 0xE7037ED1A0B428DBu);
      if (unseeded % slots != 0) continue;
      ++chosen;
      ++found[hash_triple(s, 1, o) % slots];
    }
  }
  REQUIRE(chosen > 500);
  CHECK(*std::max_element(found.begin(), found.end()) < 20);
  CHECK(hash_seeds().first != 0);
  CHECK(hash_seeds().first != hash_seeds().second);
}

TEST_CASE("a list that was added is read with its members in order, also with repeated ones", "[rdf]") {
  Graph g;
  const TermId one = g.intern(literal("1")), two = g.intern(literal("2"));
  const std::vector<TermId> none, members = {one, two, one, one};
  CHECK(g.term(g.add_list(none)) == TermView(vocab::rdf_::nil));
  CHECK(g.empty());
  const TermId head = g.add_list(members);
  CHECK(g.list(head) == members);
  CHECK(g.size() == 2 * members.size());
  CHECK(g.term(head).is_blank());
  const TermId outer = g.add_list({head, g.add_list(none)});  // a list of lists
  REQUIRE(g.list(outer));
  CHECK(g.list(g.list(outer)->front()) == members);
  CHECK(g.list(g.list(outer)->back()) == none);
  CHECK(g.list(g.add_list(members)) == members);  // a second list with the same members has cells of its own
  CHECK(g.size() == 4 * members.size() + 4);
}

TEST_CASE("the first cells of a list are the nodes that are given, and the list ends with its last member", "[rdf]") {
  Graph g;
  const TermId one = g.intern(literal("1")), two = g.intern(literal("2"));
  const std::vector<TermId> cells = {g.intern(lrt::rdf::iri("http://e/1")), g.intern(lrt::rdf::iri("http://e/2")),
                                     g.intern(lrt::rdf::iri("http://e/3"))};
  SECTION("fewer than members") {
    const std::vector<TermId> members = {one, two, one, two, one};
    CHECK(g.add_list(members, cells) == cells[0]);
    CHECK(g.list(cells[0]) == members);
    CHECK(g.list(cells[2]) == std::vector<TermId>{one, two, one});
    CHECK(g.size() == 10);
  }
  SECTION("as many as members") {
    CHECK(g.add_list({one, two, one}, cells) == cells[0]);
    CHECK(g.list(cells[0]) == std::vector<TermId>{one, two, one});
  }
  SECTION("more than members") {
    CHECK(g.add_list({one, two}, cells) == cells[0]);
    CHECK(g.list(cells[0]) == std::vector<TermId>{one, two});
    CHECK(g.size() == 4);
  }
  SECTION("without a member") {
    CHECK(g.term(g.add_list({}, cells)) == TermView(vocab::rdf_::nil));
    CHECK(g.empty());
  }
}
