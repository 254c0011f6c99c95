// SPDX-License-Identifier: Apache-2.0
#include "src/query/dataset.hpp"

#include <lrt/rdf/vocab.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "tests/support/catch.hpp"

namespace {

using lrt::query::Dataset;
using lrt::query::GraphSet;
using lrt::query::nothing;
using lrt::query::NumberedTriple;
using lrt::query::Scope;
using lrt::query::TermNumber;
using lrt::rdf::Graph;
using lrt::rdf::TermView;

using Text = std::tuple<std::string, std::string, std::string>;

TermView ex(const std::string& name) { return lrt::rdf::iri(name); }

std::multiset<Text> texts(const Dataset& data, Dataset::Matches matches) {
  std::multiset<Text> found;
  while (const NumberedTriple* t = matches.next()) {
    found.emplace(to_string(data.term(t->subject)), to_string(data.term(t->predicate)), to_string(data.term(t->object)));
  }
  return found;
}

std::multiset<Text> everything(const Dataset& data, const Scope& scope) { return texts(data, data.match(nothing, nothing, nothing, scope)); }

Graph graph_of(const std::vector<std::array<std::string, 3>>& triples) {
  Graph graph;
  for (const auto& t : triples) graph.add(ex(t[0]), ex(t[1]), ex(t[2]));
  return graph;
}

Scope one(const Dataset& data, const std::string& name) { return Scope::one(data.graph_named(data.find(ex(name)))); }

}  // namespace

TEST_CASE("the default graph has a triple of several graphs once", "[query]") {
  Dataset data;
  data.put("u:g1", graph_of({{"u:a", "u:p", "u:b"}, {"u:a", "u:p", "u:c"}}));
  data.put("u:g2", graph_of({{"u:a", "u:p", "u:b"}}));
  CHECK(data.triple_count() == 2);
  CHECK(everything(data, Scope::all()).size() == 2);
  CHECK(everything(data, one(data, "u:g1")).size() == 2);
  CHECK(everything(data, one(data, "u:g2")).size() == 1);
  data.remove("u:g1");
  CHECK(data.triple_count() == 1);
  CHECK(everything(data, Scope::all()).size() == 1);
  CHECK(data.find(ex("u:c")) == nothing);
  CHECK(data.find(ex("u:g1")) == nothing);
  data.remove("u:g2");
  data.remove("u:g2");
  CHECK(data.triple_count() == 0);
  CHECK(data.graph_count() == 0);
}

TEST_CASE("blank nodes of two graphs are two nodes, and keep their numbers when a graph is replaced", "[query]") {
  Graph graph;
  graph.add(lrt::rdf::blank("x"), ex("u:p"), lrt::rdf::literal("1"));
  Dataset data;
  data.put("u:g1", graph);
  data.put("u:g2", graph);
  CHECK(data.triple_count() == 2);
  const TermNumber before = data.match(nothing, nothing, nothing, one(data, "u:g1")).next()->subject;
  graph.add(lrt::rdf::blank("x"), ex("u:p"), lrt::rdf::literal("2"));
  data.put("u:g1", graph);
  auto matches = data.match(nothing, nothing, nothing, one(data, "u:g1"));
  while (const NumberedTriple* t = matches.next()) CHECK(t->subject == before);
  CHECK(data.triple_count() == 3);
}

TEST_CASE("an empty graph is known by its name", "[query]") {
  Dataset data;
  data.put("u:g", Graph{});
  CHECK(data.graph_count() == 1);
  CHECK(data.graph_named(data.find(ex("u:g"))) != nothing);
  data.put("u:g", graph_of({{"u:g", "u:g", "u:g"}}));
  data.put("u:g", Graph{});
  CHECK(data.graph_named(data.find(ex("u:g"))) != nothing);
  CHECK(everything(data, Scope::all()).empty());
}

TEST_CASE("the values of literals are read with them", "[query]") {
  Graph graph;
  const auto add = [&](const char* text, lrt::Iri datatype) { graph.add(ex("u:a"), ex("u:p"), lrt::rdf::literal(text, datatype)); };
  add("7", lrt::vocab::xsd::int_);
  add("99999999999999999999", lrt::vocab::xsd::integer);
  add("0.5", lrt::vocab::xsd::decimal);
  add("x", lrt::vocab::xsd::integer);
  add("true", lrt::vocab::xsd::boolean);
  Dataset data;
  data.put("u:g", graph);
  const auto value = [&](const char* text, lrt::Iri datatype) { return data.value(data.find(lrt::rdf::literal(text, datatype))); };
  CHECK(value("7", lrt::vocab::xsd::int_).integer == 7);
  CHECK_FALSE(value("99999999999999999999", lrt::vocab::xsd::integer).fits);
  CHECK(value("0.5", lrt::vocab::xsd::decimal).real == 0.5);
  CHECK(value("x", lrt::vocab::xsd::integer).type == lrt::query::Type::other);
  CHECK(value("true", lrt::vocab::xsd::boolean).truth);
  CHECK(data.value(data.find(ex("u:a"))).type == lrt::query::Type::iri);
}

TEST_CASE("a dataset that changed at random has what its graphs have, by every index", "[query]") {
  std::mt19937 random(7);  // the same each time
  const auto below = [&](unsigned n) { return static_cast<unsigned>(random() % n); };
  const auto term = [&](char kind, unsigned n) { return std::string("u:") + kind + std::to_string(below(n)); };
  std::map<std::string, std::set<Text>> model;
  Dataset data;
  for (int round = 0; round < 400; ++round) {
    const std::string name = term('g', 12);
    if (below(5) == 0) {
      data.remove(name);
      model.erase(name);
    } else {
      Graph graph;
      std::set<Text>& expected = model[name];
      expected.clear();
      for (unsigned n = below(40); n > 0; --n) {
        const std::string s = term('n', 15), p = term('p', 4), o = term('n', 15);
        graph.add(ex(s), ex(p), ex(o));
        expected.emplace("<" + s + ">", "<" + p + ">", "<" + o + ">");
      }
      data.put(name, graph);
    }
    if (round % 20 != 19) continue;
    const Dataset copy = data;
    std::set<Text> all;
    for (const auto& [graph, triples] : model) {
      all.insert(triples.begin(), triples.end());
      CHECK(everything(copy, one(copy, graph)) == std::multiset<Text>(triples.begin(), triples.end()));
    }
    CHECK(everything(copy, Scope::all()) == std::multiset<Text>(all.begin(), all.end()));
    CHECK(copy.graph_count() == model.size());
    CHECK(copy.triple_count() == all.size());
    GraphSet some;
    std::set<Text> in_some;
    for (const auto& [graph, triples] : model) {
      if (below(3) == 0) some.insert(copy.graph_named(copy.find(ex(graph)))), in_some.insert(triples.begin(), triples.end());
    }
    CHECK(everything(copy, Scope::of(some)) == std::multiset<Text>(in_some.begin(), in_some.end()));
    std::set<Text> subjects, objects;
    for (const Text& t : all) subjects.insert({std::get<0>(t), "", ""}), objects.insert({std::get<2>(t), "", ""});
    CHECK(copy.spread().subjects == subjects.size());
    CHECK(copy.spread().objects == objects.size());
    for (unsigned look_up = 0; look_up < 64; ++look_up) {
      const std::string s = term('n', 15), p = term('p', 4), o = term('n', 15), g = model.empty() ? "" : model.begin()->first;
      const auto wanted = [&](unsigned bit, const std::string& text) { return (look_up & bit) != 0 ? copy.find(ex(text)) : nothing; };
      const auto is = [&](unsigned bit, const std::string& text, const std::string& found) {
        return (look_up & bit) == 0 || "<" + text + ">" == found;
      };
      const TermNumber terms[3] = {wanted(1, s), wanted(2, p), wanted(4, o)};
      if (((look_up & 1) && terms[0] == nothing) || ((look_up & 2) && terms[1] == nothing) || ((look_up & 4) && terms[2] == nothing)) continue;
      const auto expected = [&](const std::set<Text>& triples) {
        std::multiset<Text> chosen;
        for (const Text& t : triples) {
          if (is(1, s, std::get<0>(t)) && is(2, p, std::get<1>(t)) && is(4, o, std::get<2>(t))) chosen.insert(t);
        }
        return chosen;
      };
      const auto in_all = expected(all);
      CHECK(texts(copy, copy.match(terms[0], terms[1], terms[2], Scope::all())) == in_all);
      if ((look_up & 7) == 5) CHECK(copy.count(terms[0], terms[1], terms[2]) >= in_all.size());
      else CHECK(copy.count(terms[0], terms[1], terms[2]) == in_all.size());
      CHECK(texts(copy, copy.match(terms[0], terms[1], terms[2], Scope::of(some))) == expected(in_some));
      if (!g.empty()) CHECK(texts(copy, copy.match(terms[0], terms[1], terms[2], one(copy, g))) == expected(model[g]));
    }
  }
}

TEST_CASE("a dataset gives back what most of its triples used", "[query]") {
  Dataset data;
  const auto big = [](int offset) {
    Graph graph;
    for (int i = 0; i < 10'000; ++i)
      graph.add(ex("u:s" + std::to_string(i + offset)), ex("u:p"), lrt::rdf::literal(std::to_string(i) + std::string(20, 'x')));
    return graph;
  };
  data.put("u:keep", graph_of({{"u:a", "u:p", "u:b"}}));
  data.put("u:big", big(0));
  const std::size_t full = data.bytes();
  data.remove("u:big");
  CHECK(data.bytes() < full / 20);
  CHECK(everything(data, Scope::all()) == std::multiset<Text>{{"<u:a>", "<u:p>", "<u:b>"}});
  CHECK(everything(data, one(data, "u:keep")).size() == 1);
  for (int round = 0; round < 20; ++round) data.put("u:big", big(round * 10'000));
  CHECK(data.bytes() < full * 3);
  CHECK(data.triple_count() == 10'001);
}

TEST_CASE("a triple of many graphs is found in each of them", "[query]") {
  Dataset data;
  for (int i = 0; i < 300; ++i) data.put("u:g" + std::to_string(i), graph_of({{"u:a", "u:p", "u:b"}}));
  for (int i = 0; i < 300; i += 3) data.remove("u:g" + std::to_string(i));
  data.put("u:empty", Graph{});
  const NumberedTriple triple{data.find(ex("u:a")), data.find(ex("u:p")), data.find(ex("u:b"))};
  for (int i = 0; i < 300; ++i) {
    const auto graph = data.graph_named(data.find(ex("u:g" + std::to_string(i))));
    CHECK((graph == nothing) == (i % 3 == 0));
    if (graph != nothing) CHECK(data.contains(triple, Scope::one(graph)));
  }
  CHECK_FALSE(data.contains(triple, one(data, "u:empty")));
  auto matches = data.match(nothing, nothing, nothing, Scope::all());
  REQUIRE(matches.next());
  std::size_t graphs = 0;
  matches.graphs([&](auto) { ++graphs; });
  CHECK(graphs == 200);
  CHECK_FALSE(matches.next());
}
