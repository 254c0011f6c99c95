// SPDX-License-Identifier: Apache-2.0
#include "src/query/dependencies.hpp"

#include <string>
#include <vector>

#include "src/query/parser.hpp"
#include "tests/support/catch.hpp"

namespace {

using lrt::query::Dependencies;
using Names = std::vector<std::string>;

Dependencies of(const std::string& text) {
  auto query = lrt::query::parse("PREFIX : <u:> " + text, {});
  if (!query) FAIL(text << ": " << query.error().message);
  return lrt::query::dependencies_of(**query);
}

}  // namespace

TEST_CASE("a query depends on the predicates of its patterns, paths and EXISTS", "[query]") {
  const Dependencies d =
      of("SELECT ?x { ?x :a [ :b ?y ] . ?x :c/:d* ?z OPTIONAL { ?x :e ?w } FILTER NOT EXISTS { ?x :f 1 } { SELECT ?x { ?x :g "
         "?h } } }");
  CHECK_FALSE(d.everything);
  CHECK(d.predicates == Names{"u:a", "u:b", "u:c", "u:d", "u:e", "u:f", "u:g"});
  CHECK(d.graphs.empty());
  CHECK_FALSE(d.uses_now_or_random);
}

TEST_CASE("a query depends on everything if a predicate may be any", "[query]") {
  CHECK(of("SELECT * { ?x ?p 1 }").everything);
  CHECK(of("SELECT * { :x !:p ?y }").everything);
  CHECK(of("DESCRIBE :x").everything);
  CHECK(of("SELECT * { ?x :p* ?y }").everything);
  CHECK_FALSE(of("SELECT * { ?x :p+ ?y }").everything);
  CHECK_FALSE(of("SELECT * { ?x :q ?z ; :p* ?y }").everything);
  CHECK_FALSE(of("SELECT * { :x :p* ?y }").everything);
  CHECK(of("SELECT ?g { GRAPH ?g {} }").everything);
  CHECK_FALSE(of("SELECT (1 AS ?one) {}").everything);
  CHECK(of("SELECT (1 AS ?one) {}").predicates.empty());
}

TEST_CASE("a query depends on the classes that it names, unless one may be any", "[query]") {
  CHECK(of("SELECT * { ?x a :B . ?y a :A ; :p 1 }").types == Names{"u:A", "u:B"});
  CHECK(of("SELECT * { ?x a :A FILTER NOT EXISTS { ?x a :B } }").types == Names{"u:A", "u:B"});
  CHECK(of("SELECT * { ?x a :A . ?y a ?type }").types.empty());
  CHECK(of("SELECT * { ?x a/:sub* :A . ?y a :B }").types.empty());
  CHECK(of("SELECT * { ?x (a|:p)+ ?z . ?y a :B }").types.empty());
  CHECK(of("SELECT * { ?x :p :A }").types.empty());
}

TEST_CASE("a query depends on the graphs that it names, unless a pattern is matched in any", "[query]") {
  CHECK(of("SELECT * { GRAPH :g { ?x :p ?y } GRAPH :h { ?x :q ?z } }").graphs == Names{"u:g", "u:h"});
  CHECK(of("SELECT * { GRAPH :g { ?x :p ?y } ?x :q ?z }").graphs.empty());
  CHECK(of("SELECT * { GRAPH ?g { ?x :p ?y } }").graphs.empty());
  CHECK(of("SELECT * FROM :a FROM NAMED :b { ?x :p ?y }").graphs == Names{"u:a"});
  CHECK(of("SELECT * FROM :a FROM NAMED :b { ?x :p ?y GRAPH ?g { ?y :q ?z } }").graphs == Names{"u:a", "u:b"});
  CHECK(of("SELECT * { GRAPH :g { ?x :p ?y FILTER EXISTS { ?y :q ?z } } }").graphs == Names{"u:g"});
}

TEST_CASE("a query says whether its answer changes by itself", "[query]") {
  CHECK(of("SELECT * { ?x :p ?t FILTER(?t < NOW()) }").uses_now_or_random);
  CHECK(of("SELECT (RAND() AS ?r) { ?x :p ?t }").uses_now_or_random);
  CHECK(of("SELECT ?x { ?x :p ?t } GROUP BY ?x HAVING (MAX(?t) > NOW())").uses_now_or_random);
  CHECK_FALSE(of("SELECT * { ?x :p ?t FILTER(YEAR(?t) = 2026) }").uses_now_or_random);
}
