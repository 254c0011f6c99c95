// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/shared_graph.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/rdf/difference.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace vocab = lrt::vocab;

namespace {

using Model = std::set<std::string>;

Graph shared() {
  Graph graph;
  SharedGraph::of(graph);
  return graph;
}

std::string line(const Graph& g, const Triple& t) {
  return to_string(g.term(t.subject)) + " " + to_string(g.term(t.predicate)) + " " + to_string(g.term(t.object));
}

Model lines(const Graph& g, const std::vector<Triple>& triples) {
  Model all;
  for (const Triple& t : triples) all.insert(line(g, t));
  return all;
}

std::vector<std::string> in_order(const Graph& g, const Graph::Matches& matches) {
  std::vector<std::string> all;
  for (const Triple& t : matches) all.push_back(line(g, t));
  return all;
}

Term subject(std::uint_fast32_t n) { return n % 5 == 0 ? Term(blank("n" + std::to_string(n))) : Term(iri("http://e/s" + std::to_string(n))); }
Term predicate(std::uint_fast32_t n) { return Term(iri("http://e/p" + std::to_string(n))); }
Term object(std::uint_fast32_t n) {
  switch (n % 4) {
    case 0: return Term(iri("http://e/s" + std::to_string(n)));
    case 1: return Term(literal(std::to_string(n), vocab::xsd::integer));
    case 2: return Term(tagged_literal("text " + std::to_string(n), "en-gb"));
    default: return Term(literal(std::string(n % 97 == 3 ? 5'000 : n % 40, 'x') + std::to_string(n)));
  }
}

/// What a graph must be, and that all ways to look at it agree.
void check(const Graph& g, const Model& model, std::mt19937& random) {
  REQUIRE(g.size() == model.size());
  REQUIRE(lines(g, g.triples()) == model);
  REQUIRE(in_order(g, g.match(std::nullopt, std::nullopt, std::nullopt)).size() == model.size());
  for (int i = 0; i < 5; ++i) {
    const Term s = subject(random() % 40), p = predicate(random() % 6), o = object(random() % 200);
    const auto by_filter = [&](const TermView* ws, const TermView* wp, const TermView* wo) {
      std::vector<std::string> all;
      for (const Triple& t : g.triples())
        if ((!ws || g.term(t.subject) == *ws) && (!wp || g.term(t.predicate) == *wp) && (!wo || g.term(t.object) == *wo)) all.push_back(line(g, t));
      return all;
    };
    const TermView sv = s.view(), pv = p.view(), ov = o.view();
    for (int bound = 0; bound < 8; ++bound) {
      const TermView *ws = bound & 1 ? &sv : nullptr, *wp = bound & 2 ? &pv : nullptr, *wo = bound & 4 ? &ov : nullptr;
      REQUIRE(in_order(g, g.match(ws, wp, wo)) == by_filter(ws, wp, wo));
    }
  }
}

bool remove(Graph& g, const TermView& s, const TermView& p, const TermView& o) {
  const auto is = g.find(s), ip = g.find(p), io = g.find(o);
  return is && ip && io && SharedGraph::in(g)->remove({*is, *ip, *io});
}

}  // namespace

TEST_CASE("a shared graph is a set of triples under random changes, and its copies keep their moment", "[rdf][shared]") {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937 random(seed);
    const unsigned objects = seed % 2 == 0 ? 20 : 200;  // few: triples are found by the table
    Graph graph = shared();
    Model model;
    std::vector<std::pair<Graph, Model>> past;
    for (int step = 0; step < 3'000; ++step) {
      const Term s = subject(random() % 40), p = predicate(random() % 6), o = object(random() % objects);
      Graph one;
      one.add(s, p, o);
      const std::string text = line(one, one.triples()[0]);
      if (random() % 3 != 0) REQUIRE(graph.add(s, p, o) == model.insert(text).second);
      else REQUIRE(remove(graph, s, p, o) == (model.erase(text) == 1));
      if (random() % 150 == 0) past.emplace_back(graph, model);
      if (random() % 400 == 0 && !past.empty()) {  // an old moment is continued: a fork
        std::tie(graph, model) = past[random() % past.size()];
      }
      if (random() % 100 == 0) check(graph, model, random);
    }
    check(graph, model, random);
    for (const auto& [old, had] : past) {
      check(old, had, random);
      const auto change = shared_difference(old, graph);
      REQUIRE(change);
      Model removed, added;
      std::set_difference(had.begin(), had.end(), model.begin(), model.end(), std::inserter(removed, removed.end()));
      std::set_difference(model.begin(), model.end(), had.begin(), had.end(), std::inserter(added, added.end()));
      REQUIRE(lines(old, change->removed) == removed);
      REQUIRE(lines(graph, change->added) == added);
    }
  }
}

TEST_CASE("a graph that takes the shared form, or is copied into it, goes on as a set of triples", "[rdf][shared]") {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const unsigned objects = seed % 2 == 0 ? 20 : 200;  // few: triples are found by the table
    const bool is_copied = seed % 4 >= 2;
    Graph graph;
    Model model;
    const auto change = [&](bool adds) {
      Term s = subject(random() % 40);
      const Term p = predicate(random() % 6), o = object(random() % objects);
      if (is_copied && s.view().is_blank()) s = Term(iri("http://e/s1"));  // blank nodes would get other labels
      Graph one;
      one.add(s, p, o);
      const std::string text = line(one, one.triples()[0]);
      if (adds) REQUIRE(graph.add(s, p, o) == model.insert(text).second);
      else REQUIRE(remove(graph, s, p, o) == (model.erase(text) == 1));
    };
    for (int i = 0; i < 2'500; ++i) change(true);
    (void)graph.intern(iri("http://e/unused"));
    const std::string turtle = write(graph, Syntax::turtle).value();
    if (is_copied) {
      graph = SharedGraph::with_new_blanks(graph);
    } else {
      SharedGraph::of(graph);
    }
    CHECK(write(graph, Syntax::turtle).value() == turtle);
    check(graph, model, random);
    const Graph before = graph;
    const Model had = model;
    for (int i = 0; i < 3'000; ++i) {
      change(random() % 2 == 0);
      if (i % 300 == 0) check(graph, model, random);
    }
    check(graph, model, random);
    check(before, had, random);
    REQUIRE(shared_difference(before, graph));
  }
}

TEST_CASE("a copy with new blank nodes shares none, and what no triple has counts as unused", "[rdf][shared]") {
  Graph graph;
  const auto p = iri("http://e/p");
  graph.add(blank("b1"), p, blank("x"));  // b1 is a label that fresh_blank() makes, too
  for (int i = 0; i < 5'000; ++i) graph.add(graph.fresh_blank(), graph.intern(p), graph.intern(literal(std::to_string(i), vocab::xsd::integer)));
  Graph copy = SharedGraph::with_new_blanks(graph);
  CHECK(copy.size() == 5'001);
  CHECK_FALSE(SharedGraph::has_much_unused(copy));
  std::set<std::string> labels;
  for (const Triple& t : copy.triples()) labels.insert(std::string(copy.term(t.subject).text));
  CHECK(labels.size() == 5'001);
  CHECK_FALSE(copy.find(blank("x")));
  const auto first = copy.triples()[0];
  CHECK(copy.match(first.object, std::nullopt, std::nullopt).empty());
  CHECK(labels.count(std::string(copy.term(copy.fresh_blank()).text)) == 0);
  CHECK_FALSE(copy.add(copy.triples()[7].subject, copy.triples()[7].predicate, copy.triples()[7].object));

  (void)graph.intern(literal(std::string(1'000'000, 'x')));
  copy = SharedGraph::with_new_blanks(graph);
  CHECK(SharedGraph::has_much_unused(copy));
  SharedGraph::compact(copy);
  CHECK_FALSE(SharedGraph::has_much_unused(copy));
  CHECK(copy.size() == 5'001);
}

TEST_CASE("versions that have gone different ways differ in literals without text, too", "[rdf][shared]") {
  const TermView s = iri("http://e/s"), p = iri("http://e/p");
  Graph graph = shared();
  graph.add(s, p, literal("1", vocab::xsd::integer));
  graph.add(s, p, literal("one"));
  Graph other = graph;
  graph.add(s, p, literal(""));
  other.add(s, p, literal("", vocab::xsd::integer));
  const auto change = shared_difference(graph, other);
  REQUIRE(change);
  REQUIRE(change->removed.size() == 1);
  REQUIRE(change->added.size() == 1);
  CHECK(graph.term(change->removed[0].object) == literal(""));
  CHECK(other.term(change->added[0].object) == literal("", vocab::xsd::integer));
}

TEST_CASE("a graph that becomes shared is the same JSON-LD", "[rdf][shared][json_ld]") {
  Graph graph;
  for (unsigned n = 0; n < 900; ++n) graph.add(subject(n / 3), predicate(n % 7), object(n));
  const auto cell = graph.fresh_blank();
  graph.add(cell, graph.intern(vocab::rdf_::type), cell);
  const Graph plain = graph;
  SharedGraph::of(graph);
  CHECK(write(graph, Syntax::json_ld).value() == write(plain, Syntax::json_ld).value());
}

TEST_CASE("a graph that becomes shared is the same, and one that shrinks is written anew", "[rdf][shared]") {
  Graph graph;
  for (unsigned n = 0; n < 9'000; ++n) graph.add(subject(n / 3), predicate(n % 7), object(n));
  const auto cell = graph.fresh_blank();
  graph.add(cell, graph.intern(vocab::rdf_::type), cell);
  const Graph plain = graph;
  SharedGraph::of(graph);
  const Graph::Matches all = graph.match(std::nullopt, std::nullopt, std::nullopt);
  CHECK(in_order(graph, all) == in_order(plain, plain.match(std::nullopt, std::nullopt, std::nullopt)));
  CHECK(write(graph, Syntax::turtle).value() == write(plain, Syntax::turtle).value());
  CHECK_FALSE(graph.find(graph.term(graph.fresh_blank())) == cell);
  CHECK(difference(plain, graph).empty());
  CHECK_FALSE(shared_difference(plain, graph));

  const Graph before = graph;
  std::vector<Triple> most(graph.triples().begin(), graph.triples().begin() + 3'000);
  for (const Triple& t : most) CHECK(SharedGraph::in(graph)->remove(t));
  const std::vector<std::string> rest = in_order(graph, graph.match(std::nullopt, std::nullopt, std::nullopt));
  CHECK(shared_difference(before, graph)->removed.size() == 3'000);
  SharedGraph::compact(graph);
  REQUIRE(SharedGraph::in(graph));
  CHECK(SharedGraph::in(graph)->place_limit() == 6'001);
  CHECK(in_order(graph, graph.match(std::nullopt, std::nullopt, std::nullopt)) == rest);
  CHECK_FALSE(shared_difference(before, graph));
  CHECK(difference(before, graph).removed.size() == 3'000);
  most.assign(graph.triples().begin(), graph.triples().begin() + 5'000);
  for (const Triple& t : most) CHECK(SharedGraph::in(graph)->remove(t));
  SharedGraph::compact(graph);
  CHECK_FALSE(SharedGraph::in(graph));
  CHECK(in_order(graph, graph.match(std::nullopt, std::nullopt, std::nullopt)) == std::vector<std::string>(rest.begin() + 5'000, rest.end()));
  CHECK(before.size() == 9'001);
}

TEST_CASE("texts of changes that were given up are used again", "[rdf][shared]") {
  SharedText text;
  const auto add = [](SharedText& to, char c) { return to.add(1'000, [c](char* at) { std::fill_n(at, 1'000, c); }); };
  const SharedText::Place first = add(text, 'a');
  SharedText present(text);
  const SharedText::Place kept = add(present, 'b');
  for (int i = 0; i < 200; ++i) {
    SharedText given_up(present);
    add(given_up, 'c');
  }
  {
    SharedText next(present), beside(present);  // two copies add at the same place
    const SharedText::Place in_next = add(next, 'd'), in_beside = add(beside, 'e');
    CHECK(in_next.block == kept.block);
    CHECK(in_beside.block != kept.block);
    CHECK(*next.at(in_next) == 'd');
    CHECK(*beside.at(in_beside) == 'e');
    CHECK(*next.at(kept) == 'b');
    CHECK(*next.at(first) == 'a');
  }
}

TEST_CASE("readers in other threads see whole versions of a graph while it is changed", "[rdf][shared]") {
  std::mutex mutex;
  Graph start = shared();
  for (unsigned n = 0; n < 600; ++n) start.add(subject(n), predicate(n % 7), object(n));
  auto current = std::make_shared<const Graph>(start);  // each version has one triple "x count N" and N triples "x has ..."
  const auto now = [&] {
    const std::lock_guard lock(mutex);
    return current;
  };
  const TermView x = iri("http://e/x"), count = iri("http://e/count"), has = iri("http://e/has");
  std::atomic<bool> done{false};
  std::atomic<int> faults{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < 3; ++r)
    readers.emplace_back([&] {
      for (bool last = false; !last;) {
        last = done;
        const std::shared_ptr<const Graph> seen = now();
        const auto number = seen->object(x, count);
        const std::size_t expected = number ? std::stoul(std::string(number->text)) : 0;
        if (seen->objects(x, has).size() != expected) ++faults;
        if (seen->triples().size() != seen->size()) ++faults;
        for (const Triple& t : seen->match(&x, nullptr, nullptr)) (void)seen->term(t.object);
      }
    });
  for (unsigned n = 1; n <= 300; ++n) {
    Graph next = *now();
    if (n > 1) REQUIRE(remove(next, x, count, literal(std::to_string(n - 1), vocab::xsd::integer)));
    next.add(x, count, literal(std::to_string(n), vocab::xsd::integer));
    next.add(x, has, literal("thing " + std::to_string(n)));
    auto made = std::make_shared<const Graph>(std::move(next));
    const std::lock_guard lock(mutex);
    current.swap(made);
  }
  done = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(faults == 0);
  CHECK(now()->objects(x, has).size() == 300);
}
