// SPDX-License-Identifier: Apache-2.0
#include "src/query/parser.hpp"

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "src/base/thread.hpp"
#include "tests/query/algebra_text.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sanitizer.hpp"

namespace {

using lrt::Errc;
using lrt::Error;
using lrt::Result;
using lrt::query::ParseOptions;
using lrt::query::Query;
using lrt::test::AlgebraText;

const std::string prologue = "PREFIX : <http://e/> PREFIX xsd: <http://www.w3.org/2001/XMLSchema#> ";

Result<std::shared_ptr<const Query>> parse(const std::string& text) {
  ParseOptions options;
  options.base = "http://base.example/folder/query";
  return lrt::query::parse(text, options);
}
std::shared_ptr<const Query> query(const std::string& text) {
  auto parsed = parse(prologue + text);
  INFO(text);
  INFO((parsed ? "" : parsed.error().message));
  REQUIRE(parsed);
  return *parsed;
}
/// The pattern of a WHERE clause.
std::string where(const std::string& group) {
  const auto q = query("SELECT * " + group);
  return AlgebraText(*q).pattern(*q->where);
}
/// A whole SELECT.
std::string select(const std::string& text) {
  const auto q = query(text);
  return AlgebraText(*q).query(*q);
}
std::string filter(const std::string& expression) {
  const auto q = query("SELECT * { FILTER(" + expression + ") }");
  return AlgebraText(*q).expression(q->where->condition.value());
}
/// The triples that a path means between ?x and ?y.
std::string path(const std::string& text) { return where("{ ?x " + text + " ?y }"); }

Error refusal(const std::string& text) {
  const auto parsed = parse(text);
  INFO(text);
  REQUIRE_FALSE(parsed);
  return parsed.error();
}
bool refused(const std::string& text) { return refusal(prologue + text).code == Errc::expected_rdf; }

std::string repeated(const std::string& text, std::size_t n) {
  std::string result;
  for (std::size_t i = 0; i < n; ++i) result += text;
  return result;
}

}  // namespace

// --- prologue and terms

TEST_CASE("IRIs resolve against the base and prefixes, and both can be declared again", "[query]") {
  CHECK(where("{ <a> <#f> <../b?c> }") == "[<http://base.example/folder/a> <http://base.example/folder/query#f> <http://base.example/b?c>]");
  const auto q = parse("BASE <http://one.example/x/> PREFIX p: <y#> BASE <z/> PREFIX q: <> PREFIX p: <http://e/> SELECT * { <> p:a\\~b q:c }");
  REQUIRE(q);
  CHECK(AlgebraText(**q).pattern(*(*q)->where) == "[<http://one.example/x/z/> :a~b <http://one.example/x/z/c>]");
  CHECK((*q)->base == "http://one.example/x/z/");
  REQUIRE((*q)->prefixes.size() == 2);
  CHECK((*q)->prefixes[0] == std::pair<std::string, std::string>("p", "http://e/"));
  CHECK((*q)->prefixes[1] == std::pair<std::string, std::string>("q", "http://one.example/x/z/"));
  CHECK(refusal("SELECT * { ?x a u:c }").message == "line 1, column 17: undeclared prefix \"u:\"");
  CHECK_FALSE(lrt::query::parse("SELECT * { <a> <b> <c> }", {}));
  ParseOptions relative;
  relative.base = "folder/";
  CHECK(lrt::query::parse("ASK {}", relative).error().code == Errc::expected_iri);
}

TEST_CASE("codepoint escapes stand for characters, but not for space or what ends a string, an IRI or a group", "[query]") {
  CHECK(where("{ ?\\u0061b <http://e/\\u0063> \"\\U0001F46A\\u0022\\\\u0041\" }") == "[?ab :c \"\xF0\x9F\x91\xAA\"\\u0041\"]");
  CHECK(where("{ :\\u0070\\U000000e9 \\u0061 :c }") == "[:p\xC3\xA9 rdf:type :c]");
  CHECK(where("{ \\u003Fx \\u003Ap :q\\u003Ar\\u002Es\\u002C 1\\u002E5\\u003B a :c \\u002E }") ==
        "[?x :p :q:r.s. ?x :p \"1.5\"^^xsd:decimal. ?x rdf:type :c]");
  CHECK(where("{ ?x :p 'a\\u003Ab\\u0027\\u0023', <http\\u003A//e/c>, :d # \\u002E\n }") == "[?x :p \"a:b'#\". ?x :p :c. ?x :p :d]");
  CHECK(refused("SELECT * { ?x :p :q\\u0025zz }"));
  CHECK(refused("SELECT * { ?x :p \\u003Curn:a\\u003E }"));
  CHECK(refused("SELECT * { ?x\\u0020:p ?y }"));
  CHECK(refused("SELECT * { ?x :p \\u0022text\\u0022 }"));
  CHECK(refused("SELECT * { ?x :p '\\uD800' }"));
  const Error error = refusal("# \\u0041\\u0042\nSELECT ?\\u0061 \\u0062 {}");
  CHECK(error.line == 2);
  CHECK(error.column == 16);
  CHECK(error.offset == 30u);
}

TEST_CASE("every form of literal is read", "[query]") {
  CHECK(
      where("{ ?x :p 1, -2, +3, 1.5, -.5, 1e3, 1.E-3, true, FALSE, 'a', \"b\", '''c'd''', \"\"\"e\"\n\"\"\" }") ==
      "[?x :p \"1\"^^xsd:integer. ?x :p \"-2\"^^xsd:integer. ?x :p \"+3\"^^xsd:integer. ?x :p \"1.5\"^^xsd:decimal. ?x :p \"-.5\"^^xsd:decimal. "
      "?x :p \"1e3\"^^xsd:double. ?x :p \"1.E-3\"^^xsd:double. ?x :p \"true\"^^xsd:boolean. ?x :p \"false\"^^xsd:boolean. ?x :p \"a\". ?x :p \"b\". "
      "?x :p \"c'd\". ?x :p \"e\"\n\"]");
  CHECK(where("{ ?x :p 'a'@EN-gb, 'b' ^^ xsd:date, 'c'^^:d, '\\t\\\"' }") ==
        "[?x :p \"a\"@en-gb. ?x :p \"b\"^^xsd:date. ?x :p \"c\"^^:d. ?x :p \"\t\"\"]");
  CHECK(where("{ ?x :p 1.:a :q 2 }") == "[?x :p \"1\"^^xsd:integer. :a :q \"2\"^^xsd:integer]");
  CHECK(query("SELECT * { 1 :p 1, '1', '1'@en }")->constants.size() == 4);
  CHECK(refused("SELECT * { ?x :p - 1 }"));
  CHECK(refused("SELECT * { ?x :p 'a\n' }"));
  CHECK(refused("SELECT * { ?x :p 'a'^^'b' }"));
  const std::string lang_string = "<http://www.w3.org/1999/02/22-rdf-syntax-ns#langString>";
  CHECK(refusal("SELECT * {\n ?x <p:> 'a'^^" + lang_string + " }").message ==
        "line 2, column 15: expected a language tag with a literal of rdf:langString");
  CHECK(refused("CONSTRUCT { <a:> <b:> 'a'^^" + lang_string + " } WHERE {}"));
  CHECK(refused("PREFIX rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> ASK { FILTER(?x = 'a'^^rdf:langString) }"));
}

TEST_CASE("property lists, collections and blank nodes become triples with hidden variables", "[query]") {
  CHECK(where("{ ?x :p 1, 2; :q ?z;; a :C; . }") == "[?x :p \"1\"^^xsd:integer. ?x :p \"2\"^^xsd:integer. ?x :q ?z. ?x rdf:type :C]");
  CHECK(where("{ [] :p _:a . _:a :q [ :r 'x' ] }") == "[_0 :p _1. _2 :r \"x\". _1 :q _2]");
  CHECK(where("{ [ :p 'x' ] }") == "[_0 :p \"x\"]");
  CHECK(where("{ (?a 'b') :p () }") == "[_0 rdf:first ?a. _0 rdf:rest _2. _2 rdf:first \"b\". _2 rdf:rest rdf:nil. _0 :p rdf:nil]");
  CHECK(where("{ ( ( 'a' ) ) }") == "[_1 rdf:first \"a\". _1 rdf:rest rdf:nil. _0 rdf:first _1. _0 rdf:rest rdf:nil]");
  CHECK(query("SELECT * { [] :p _:a }")->columns.empty());
  CHECK(refused("SELECT * { () }"));
  CHECK(refused("SELECT * { [] }"));
  CHECK(refused("SELECT * { ?x :p ?y ?z }"));
  CHECK(refused("SELECT * { ?x :p ?y . . }"));
}

TEST_CASE("a blank node label belongs to one basic graph pattern", "[query]") {
  CHECK(where("{ _:a :p 'x' FILTER(true) _:a :q 'y' }") == "(filter \"true\"^^xsd:boolean [_0 :p \"x\". _0 :q \"y\"])");
  CHECK(where("{ _:a :p 'x' FILTER EXISTS { _:b :p 'y' } _:a :q 'y' }") == "(filter (exists [_1 :p \"y\"]) [_0 :p \"x\". _0 :q \"y\"])");
  CHECK(refusal("SELECT * { _:a <p> 'x' OPTIONAL { _:a <p> 'y' } }").message ==
        "line 1, column 35: the blank node label _:a is in two basic graph patterns");
  CHECK(refused("SELECT * { _:a :p 'x' BIND(1 AS ?x) _:a :p 'y' }"));
  CHECK(refused("SELECT * { { _:a :p 'x' } UNION { _:a :p 'y' } }"));
  CHECK(refused("SELECT * { _:a :p 'x' FILTER EXISTS { _:a :p 'y' } }"));
}

// --- paths

TEST_CASE("paths that triples can say become triples", "[query]") {
  CHECK(path(":a") == "[?x :a ?y]");
  CHECK(path("a") == "[?x rdf:type ?y]");
  CHECK(path("((:a))") == "[?x :a ?y]");
  CHECK(path("^:a") == "[?y :a ?x]");
  CHECK(path("^(^:a)") == "[?x :a ?y]");
  CHECK(path(":a/^:b/:c") == "[?x :a _2. _3 :b _2. _3 :c ?y]");
  CHECK(path("^(:a/(:b/:c))") == "[_2 :c ?x. _3 :b _2. ?y :a _3]");
  CHECK(where("{ ?x :a/:b 'p', 'q' }") == "[?x :a _1. _1 :b \"p\". ?x :a _2. _2 :b \"q\"]");
  CHECK(where("{ ?x ^:a ?y, ?z }") == "[?y :a ?x. ?z :a ?x]");
}

TEST_CASE("other paths keep their form, with inverses at the links", "[query]") {
  CHECK(path(":a|:b/:c|^:d") == "[?x (:a|(:b/:c)|^:d) ?y]");
  CHECK(path(":a*") == "[?x :a* ?y]");
  CHECK(path(":a?/:b+") == "[?x :a? _2. _2 :b+ ?y]");
  CHECK(path("^:a*") == "[?x ^:a* ?y]");
  CHECK(path("^(:a/^(:b/:c)/^:d)*") == "[?x (:d/:b/:c/^:a)* ?y]");
  CHECK(path("^(:a|:b/:c)+") == "[?x (^:a|(^:c/^:b))+ ?y]");
  CHECK(path("((:a?)*)+") == "[?x :a?*+ ?y]");
  CHECK(path("(:a|(:b|:c))*") == "[?x (:a|:b|:c)* ?y]");
  CHECK(path("!:a") == "[?x !(:a) ?y]");
  CHECK(path("!(:a|^:b|a)") == "[?x !(:a|rdf:type|^:b) ?y]");
  CHECK(path("^!(:a|^:b)") == "[?x !(:b|^:a) ?y]");
  CHECK(path("!()") == "[?x !() ?y]");
  CHECK(path("!^a") == "[?x !(^rdf:type) ?y]");
  CHECK(refused("SELECT * { ?x :a** ?y }"));
  CHECK(refused("SELECT * { ?x ^^:a ?y }"));
  CHECK(refused("SELECT * { ?x !(:a/:b) ?y }"));
  CHECK(refused("SELECT * { ?x :a| ?y }"));
  CHECK(refused("SELECT * { ?x :a/?v ?y }"));
  const auto shared = query("SELECT * { ?x :a* ?y, ?z }");
  CHECK(shared->where->triples[0].path == shared->where->triples[1].path);
}

// --- groups

TEST_CASE("a group is the join of its parts without empty patterns", "[query]") {
  CHECK(where("{}") == "[]");
  CHECK(where("{ { { } } }") == "[]");
  CHECK(where("{ ?a :p ?b . ?b :p ?c { ?c :p ?d } {} ?d :p ?e }") == "(join [?a :p ?b. ?b :p ?c] [?c :p ?d] [?d :p ?e])");
  CHECK(where("{ { ?a :p ?b { ?b :p ?c } } ?c :p ?d }") == "(join [?a :p ?b] [?b :p ?c] [?c :p ?d])");
  CHECK(where("{ {} UNION { ?a :p 'x' } UNION { ?a :q 'x' } }") == "(union [] [?a :p \"x\"] [?a :q \"x\"])");
  CHECK(where("{ GRAPH ?g {} GRAPH :g { ?a :p ?b } }") == "(join (graph ?g []) (graph :g [?a :p ?b]))");
  CHECK(where("{ ?a :p ?b MINUS { ?b :q 'x' } }") == "(minus [?a :p ?b] [?b :q \"x\"])");
  CHECK(where("{ MINUS { ?b :q 'x' } }") == "(minus [] [?b :q \"x\"])");
  CHECK(where("{ ?a :p ?b BIND(?b + 1 AS ?c) ?c :q 'x' }") == "(join (extend ?c (+ ?b \"1\"^^xsd:integer) [?a :p ?b]) [?c :q \"x\"])");
  CHECK(where("{ VALUES ?a { 1 UNDEF :x } VALUES (?b ?c) { (1 'two') (UNDEF 3) } VALUES () { () } }") ==
        "(join (values ?a (\"1\"^^xsd:integer) (UNDEF) (:x)) (values ?b ?c (\"1\"^^xsd:integer \"two\") (UNDEF \"3\"^^xsd:integer)) (values ()))");
}

TEST_CASE("filters count for their whole group, and in OPTIONAL for the left join", "[query]") {
  CHECK(where("{ FILTER(?a = ?b) ?a :p ?b { ?b :p ?c FILTER(bound(?c)) } FILTER(true) }") ==
        "(filter (&& (= ?a ?b) \"true\"^^xsd:boolean) (join [?a :p ?b] (filter (bound ?c) [?b :p ?c])))");
  CHECK(where("{ ?a :p ?b OPTIONAL { ?b :p ?c FILTER(?a = ?c) } }") == "(leftjoin (= ?a ?c) [?a :p ?b] [?b :p ?c])");
  CHECK(where("{ ?a :p ?b OPTIONAL { { ?b :p ?c FILTER(?a = ?c) } } }") == "(leftjoin [?a :p ?b] (filter (= ?a ?c) [?b :p ?c]))");
  CHECK(where("{ ?a :p ?b OPTIONAL { ?b :p ?c } OPTIONAL { ?b :q ?d } }") == "(leftjoin (leftjoin [?a :p ?b] [?b :p ?c]) [?b :q ?d])");
  CHECK(where("{ OPTIONAL { ?b :p ?c } ?a :p ?b }") == "(join (leftjoin [] [?b :p ?c]) [?a :p ?b])");
  CHECK(where("{ ?a :p ?b FILTER NOT EXISTS { ?b :p ?c FILTER(?c != ?a) } }") == "(filter (notexists (filter (!= ?c ?a) [?b :p ?c])) [?a :p ?b])");
  CHECK(where("{ ?a :p ?b FILTER xsd:boolean(?b) }") == "(filter (call xsd:boolean ?b) [?a :p ?b])");
  CHECK(refused("SELECT * { FILTER ?a }"));
  CHECK(refused("SELECT * { FILTER :f }"));
  CHECK(refused("SELECT * { FILTER true }"));
}

TEST_CASE("a SELECT in a group is a query of its own with the same variables", "[query]") {
  CHECK(select("SELECT * { ?a :p ?b { SELECT ?b (COUNT(*) AS ?n) { ?b :q ?a } GROUP BY ?b LIMIT 3 } }") ==
        "(select ?a ?b ?n (join [?a :p ?b] (select ?b ?n=(count) [?b :q ?a] group by ?b=?b limit 3)))");
  CHECK(select("SELECT * { { SELECT DISTINCT * { ?x :p ?y FILTER(?z) } VALUES ?x { 1 } } }") ==
        "(select ?x ?y (select distinct ?x ?y (filter ?z [?x :p ?y]) (values ?x (\"1\"^^xsd:integer))))");
  CHECK(select("SELECT * { SELECT * { ?x :p ?y } }") == "(select ?x ?y (select ?x ?y [?x :p ?y]))");
  CHECK(refused("SELECT * { SELECT * {} ?x :p ?y }"));
  CHECK(refused("SELECT * { { SELECT * FROM :g {} } }"));
  CHECK(refused("SELECT * { { ?x :p ?y SELECT * {} } }"));
}

// --- queries

TEST_CASE("SELECT * has the variables in scope in order of appearance", "[query]") {
  const auto q = query(
      "SELECT * { ?b :p ?a FILTER(?no1) OPTIONAL { ?c ?d [] } MINUS { ?no2 :p 1 } GRAPH ?e { ?a :p ?f } BIND(?no3 AS ?g) "
      "{ SELECT ?h { ?h :p ?no4 } } FILTER EXISTS { ?no5 :p 1 } VALUES ?i { 1 } } VALUES ?j { 1 }");
  std::string names;
  for (const auto& column : q->columns) names += q->variables.at(static_cast<std::size_t>(column.variable));
  CHECK(names == "bacdefghij");
}

TEST_CASE("AS names a variable that is not in scope", "[query]") {
  CHECK(select("SELECT ?x (?x + 1 AS ?y) (?y AS ?z) ?x { ?x :p 1 }") == "(select ?x ?y=(+ ?x \"1\"^^xsd:integer) ?z=?y [?x :p \"1\"^^xsd:integer])");
  CHECK(refusal("SELECT (1 AS ?x) { ?x a ?y }").message == "line 1, column 8: ?x is in the pattern already, and cannot be named by AS");
  CHECK(refused("SELECT (1 AS ?x) (2 AS ?x) {}"));
  CHECK(refused("SELECT ?x (2 AS ?x) {}"));
  CHECK(refused("SELECT (1 AS ?x) {} VALUES ?x { 1 }"));
  CHECK(refused("SELECT * { ?x :p ?y BIND(1 AS ?y) }"));
  CHECK(refused("SELECT * { OPTIONAL { ?x :p ?y } BIND(1 AS ?y) }"));
  CHECK(query("SELECT * { { ?x :p ?y } UNION { BIND(1 AS ?y) } MINUS { ?z :p 1 } FILTER(?z) BIND(2 AS ?z) }")->columns.size() == 3);
  CHECK(refused("SELECT ?y { ?x :p ?z } GROUP BY (?x AS ?z)"));
  CHECK(refused("SELECT (1 AS ?y) { ?x :p ?z } GROUP BY (?x AS ?y)"));
}

TEST_CASE("groups and aggregates select what they have", "[query]") {
  CHECK(select("SELECT ?k (SUM(DISTINCT ?v) + 1 AS ?s) (?s + ?k AS ?t) { ?k :p ?v } GROUP BY ?k (?v AS ?w) STR(?k) HAVING (COUNT(?v) > 1) (?v = ?k) "
               "ORDER BY DESC(?s) ?v ASC(?k) LIMIT 10 OFFSET 5") ==
        "(select ?k ?s=(+ (sum distinct ?v) \"1\"^^xsd:integer) ?t=(+ ?s ?k) [?k :p ?v] group by ?k=?k by ?v=?w by (op" +
            std::to_string(static_cast<int>(lrt::query::Operator::str)) +
            " ?k) having (> (count ?v) \"1\"^^xsd:integer) having (= (sample ?v) ?k) desc ?s asc (sample ?v) asc ?k offset 5 limit 10)");
  CHECK(select("SELECT (GROUP_CONCAT(?v) AS ?a) (GROUP_CONCAT(DISTINCT ?v; SEPARATOR=', ') AS ?b) (COUNT(DISTINCT *) AS ?c) { ?k :p ?v }") ==
        "(select ?a=(concat' ' ?v) ?b=(concat', ' distinct ?v) ?c=(count distinct) [?k :p ?v] group)");
  CHECK_FALSE(query("SELECT ?k { ?k :p ?v } HAVING (?v > 1)")->grouped);
  CHECK(refusal("SELECT ?v (COUNT(*) AS ?n) { ?k a ?v }").message == "line 1, column 8: ?v is neither in GROUP BY nor in an aggregate");
  CHECK(refused("SELECT ?v { ?k :p ?v } GROUP BY ?k"));
  CHECK(refused("SELECT (STR(?v) AS ?s) { ?k :p ?v } GROUP BY STR(?v)"));
  CHECK(refused("SELECT ?v { ?k :p ?v } HAVING (COUNT(*) > 1)"));
  CHECK(refused("SELECT * { ?k :p ?v } GROUP BY ?k"));
  CHECK(refused("SELECT (SUM(COUNT(?v)) AS ?n) { ?k :p ?v }"));
  CHECK(refused("SELECT * { ?k :p ?v FILTER(COUNT(?v) > 1) }"));
  CHECK(refused("SELECT * { ?k :p ?v BIND(COUNT(?v) AS ?n) }"));
  CHECK(refused("SELECT ?k { ?k :p ?v } GROUP BY COUNT(?v)"));
  CHECK(refused("SELECT (EXISTS { ?k :p ?v FILTER(COUNT(?v) > 1) } AS ?n) {}"));
  CHECK(query("SELECT ?k { ?k :p ?v { SELECT (COUNT(*) AS ?n) {} } }")->grouped == false);
}

TEST_CASE("limits, offsets and values stand behind the pattern", "[query]") {
  CHECK(select("SELECT REDUCED ?x WHERE { } OFFSET 2 LIMIT 0 VALUES (?x ?y) { (1 UNDEF) }") ==
        "(select reduced ?x [] offset 2 limit 0 (values ?x ?y (\"1\"^^xsd:integer UNDEF)))");
  CHECK(query("SELECT ?x {} LIMIT 99999999999999999999999")->limit == 0xFFFFFFFFFFFFFFFFu);
  CHECK(refused("SELECT ?x {} LIMIT 1 LIMIT 2"));
  CHECK(refused("SELECT ?x {} LIMIT -1"));
  CHECK(refused("SELECT ?x {} LIMIT 1.0"));
  CHECK(refused("SELECT ?x {} ORDER BY"));
  CHECK(refused("SELECT ?x {} VALUES ?x { _:a }"));
  CHECK(refused("SELECT ?x {} VALUES ?x { ?y }"));
  CHECK(refused("SELECT ?x {} VALUES (?x ?x) { (1 1) }"));
  CHECK(refusal("SELECT ?x {}\nVALUES (?x ?y) { (1 2)\n (1) }").message == "line 3, column 2: found a row of 1 values, expected 2");
}

TEST_CASE("CONSTRUCT has a template with blank nodes of its own", "[query]") {
  auto q = query("CONSTRUCT { ?x :p _:a . _:a :q [ :r ('l') ] . [] ?x _:a } FROM :g WHERE { ?x :p _:a } ORDER BY ?x LIMIT 1");
  CHECK(q->form == Query::Form::construct);
  CHECK(AlgebraText(*q).triples(q->template_triples) == "[?x :p _1. _3 rdf:first \"l\". _3 rdf:rest rdf:nil. _2 :r _3. _1 :q _2. _4 ?x _1]");
  CHECK(q->template_blanks.size() == 4);
  CHECK(AlgebraText(*q).pattern(*q->where) == "[?x :p _5]");
  CHECK(q->from == std::vector<std::string>{"http://e/g"});
  CHECK(q->limit == 1u);
  CHECK(query("CONSTRUCT { } { }")->template_triples.empty());

  q = query("CONSTRUCT FROM NAMED :h WHERE { ?x :p _:a . _:a :q [] } LIMIT 2");
  CHECK(AlgebraText(*q).pattern(*q->where) == "[?x :p _1. _1 :q _2]");
  CHECK(AlgebraText(*q).triples(q->template_triples) == "[?x :p _3. _3 :q _4]");
  CHECK(q->template_blanks.size() == 2);
  CHECK(q->from_named == std::vector<std::string>{"http://e/h"});
  CHECK(refused("CONSTRUCT WHERE { ?x :p ?y FILTER(?x) }"));
  CHECK(refused("CONSTRUCT WHERE { ?x :p/:q ?y }"));
  CHECK(refused("CONSTRUCT { ?x :p/:q ?y } { }"));
  CHECK(refused("CONSTRUCT { ?x :p ?y } "));
}

TEST_CASE("DESCRIBE and ASK are read", "[query]") {
  auto q = query("DESCRIBE ?x :y <z>");
  REQUIRE(q->described.size() == 3);
  CHECK(AlgebraText(*q).node(q->described[0]) == "?x");
  CHECK(AlgebraText(*q).node(q->described[2]) == "<http://base.example/folder/z>");
  REQUIRE(q->where);
  CHECK(AlgebraText(*q).pattern(*q->where) == "[]");
  q = query("DESCRIBE * FROM :g { ?x :p ?y } LIMIT 1");
  CHECK(q->form == Query::Form::describe);
  CHECK(q->described.size() == 2);
  q = query("ASK FROM NAMED :g { ?x :p ?y }");
  CHECK(q->form == Query::Form::ask);
  CHECK(AlgebraText(*q).pattern(*q->where) == "[?x :p ?y]");
  CHECK(refused("DESCRIBE { }"));
}

// --- expressions

TEST_CASE("operators bind as the grammar says", "[query]") {
  CHECK(filter("?a || ?b && ?c = ?d + ?e * ?f") == "(|| ?a (&& ?b (= ?c (+ ?d (* ?e ?f)))))");
  CHECK(filter("(?a || ?b) && !?c = -?d") == "(&& (|| ?a ?b) (= (! ?c) (neg ?d)))");
  CHECK(filter("?a - ?b - ?c + ?d + ?e / ?f / ?g * ?h") == "(+ (- ?a ?b ?c) ?d (* (/ ?e ?f ?g) ?h))");
  CHECK(filter("?a - (?b - ?c)") == "(- ?a (- ?b ?c))");
  CHECK(filter("?a || ?b || ?c && ?d && ?e") == "(|| ?a ?b (&& ?c ?d ?e))");
  CHECK(filter("?a -1 +2") == "(+ (- ?a \"1\"^^xsd:integer) \"2\"^^xsd:integer)");
  CHECK(filter("?a * -1 = - 1") == "(= (* ?a \"-1\"^^xsd:integer) (neg \"1\"^^xsd:integer))");
  CHECK(filter("?a IN (1, ?b) && ?c + 1 NOT IN ()") == "(&& (in ?a \"1\"^^xsd:integer ?b) (notin (+ ?c \"1\"^^xsd:integer)))");
  CHECK(filter("?a<?b || ?a>= ?b") == "(|| (< ?a ?b) (>= ?a ?b))");
  CHECK(filter(":f(DISTINCT ?a, ?b) != :g()") == "(!= (call :f distinct ?a ?b) (call :g))");
  CHECK(filter("if(bound(?a), :x, EXISTS { ?a :p ?b })") == "(if (bound ?a) :x (exists [?a :p ?b]))");
  CHECK(refused("SELECT * { FILTER(?a = ?b = ?c) }"));
  CHECK(refused("SELECT * { FILTER(?a IN (1) = ?c) }"));
  CHECK(refused("SELECT * { FILTER(!!?a) }"));
  CHECK(refused("SELECT * { FILTER(?a +) }"));
  CHECK(refused("SELECT * { FILTER(bound(1)) }"));
  CHECK(refused("SELECT * { FILTER(?a NOT 1) }"));
}

TEST_CASE("built-in calls take as many arguments as they have", "[query]") {
  for (const char* call : {"str(?x)",
                           "LANG(?x)",
                           "langMatches(?x, '*')",
                           "datatype(?x)",
                           "iri(?x)",
                           "uri(?x)",
                           "bnode()",
                           "bnode(?x)",
                           "rand()",
                           "abs(?x)",
                           "ceil(?x)",
                           "floor(?x)",
                           "round(?x)",
                           "concat()",
                           "concat(?x, ?x, ?x)",
                           "strlen(?x)",
                           "substr(?x, 1)",
                           "substr(?x, 1, 2)",
                           "replace(?x, 'a', 'b')",
                           "replace(?x, 'a', 'b', 'i')",
                           "regex(?x, 'a')",
                           "regex(?x, 'a', 'i')",
                           "ucase(?x)",
                           "lcase(?x)",
                           "encode_for_uri(?x)",
                           "contains(?x, 'a')",
                           "strstarts(?x, 'a')",
                           "strends(?x, 'a')",
                           "strbefore(?x, 'a')",
                           "strafter(?x, 'a')",
                           "year(?x)",
                           "month(?x)",
                           "day(?x)",
                           "hours(?x)",
                           "minutes(?x)",
                           "seconds(?x)",
                           "timezone(?x)",
                           "tz(?x)",
                           "now()",
                           "uuid()",
                           "struuid()",
                           "md5(?x)",
                           "sha1(?x)",
                           "sha256(?x)",
                           "sha384(?x)",
                           "sha512(?x)",
                           "coalesce()",
                           "coalesce(?x, 1)",
                           "strlang(?x, 'en')",
                           "strdt(?x, xsd:date)",
                           "sameTerm(?x, ?x)",
                           "isIRI(?x)",
                           "isURI(?x)",
                           "isBlank(?x)",
                           "isLiteral(?x)",
                           "isNumeric(?x)"}) {
    INFO(call);
    CHECK(query("ASK { FILTER(" + std::string(call) + ") FILTER " + call + " }"));
  }
  CHECK(refusal("ASK { FILTER substr(?x) }").message == "line 1, column 14: SUBSTR takes 2 or 3 arguments, found 1");
  CHECK(refused("ASK { FILTER now(1) }"));
  CHECK(refused("ASK { FILTER strlen() }"));
  CHECK(refused("ASK { FILTER unknown(?x) }"));
}

// --- errors and limits

TEST_CASE("an error says what was found and expected, and where", "[query]") {
  const Error error = refusal("SELECT ?x\nWHERE { ?x <p> }");
  CHECK(error.message == "line 2, column 16: expected a term or a variable, found \"}\"");
  CHECK(error.code == Errc::expected_rdf);
  CHECK(error.line == 2);
  CHECK(error.column == 16);
  CHECK(error.offset == 25u);
  CHECK(refusal("").message == "line 1, column 1: expected SELECT, CONSTRUCT, DESCRIBE or ASK, found the end of the text");
  CHECK(refusal("ASK {} more").message == "line 1, column 8: expected the end of the query, found \"more\"");
  CHECK(refusal("ASK { ?x ~ ?y }").message == "line 1, column 10: expected a token of SPARQL, found \"~\"");
  CHECK(refusal("ASK { ?x <p> 'a }").message == "line 1, column 15: unterminated string");
  for (const char* text : {"ASK {}", " ASK {}", "\r\nASK {}", "# a comment\nASK {}", "BASE <a:> ASK {}"})
    CHECK(lrt::query::parse(std::string("\xEF\xBB\xBF") + text, {}));
  CHECK(refusal("\xEF\xBB\xBF\xEF\xBB\xBF ASK {}").column == 1);
  CHECK(refusal("\xEF\xBB\xBF"
                "ASK { ?x ~ ?y }")
            .message == "line 1, column 10: expected a token of SPARQL, found \"~\"");
  CHECK(refusal("ASK { \xFF }").message == "line 1, column 7: invalid UTF-8");
  CHECK(refusal("ASK { ?x <p> 1 . # \xC3\xA9 comment\n ?y }").message == "line 2, column 5: expected a predicate, found \"}\"");
}

TEST_CASE("SERVICE and updates are refused by name", "[query]") {
  CHECK(refusal("SELECT * { SERVICE <s> { } }").code == Errc::unsupported_syntax);
  CHECK(refusal("SELECT * { SERVICE SILENT <s> { } }").message ==
        "line 1, column 12: SERVICE is not supported: this endpoint does not query other endpoints");
  for (const char* update : {"INSERT DATA { }", "DELETE WHERE { }", "load <x>", "CLEAR ALL", "CREATE GRAPH <x>", "DROP ALL", "COPY <a> TO <b>",
                             "MOVE <a> TO <b>", "ADD <a> TO <b>", "WITH <g> DELETE { } WHERE { }"}) {
    INFO(update);
    CHECK(refusal(prologue + update).code == Errc::unsupported_syntax);
  }
  CHECK(refusal("\n INSERT DATA { }").message == "line 2, column 2: INSERT is not supported: this endpoint is read-only");
}

TEST_CASE("each limit of a query is an option", "[query]") {
  const auto code = [](const std::string& text, const ParseOptions& options) {
    const auto parsed = lrt::query::parse(text, options);
    return parsed ? std::string("read") : std::string(lrt::to_string(parsed.error().code));
  };
  ParseOptions options;
  options.max_bytes = 6;
  CHECK(code("ASK {}", options) == "read");
  CHECK(code("ASK {} ", options) == "limit_exceeded");
  options = {};
  options.max_triples = 3;
  CHECK(code("ASK { ?x <u:p>/<u:q> 1; a ?y }", options) == "read");
  CHECK(code("ASK { ?x <u:p>/<u:q> 1, 2 }", options) == "limit_exceeded");
  CHECK(code("SELECT * { ?x ?y ?z }", options) == "read");
  CHECK(code("SELECT * { { SELECT * { ?x ?y 1 } } }", options) == "limit_exceeded");
  options = {};
  options.max_term_bytes = 20;
  CHECK(code("ASK { ?x <u:p> '12345678901234567' }", options) == "read");
  CHECK(code("ASK { ?x <u:p> '123456789012345678' }", options) == "limit_exceeded");
  CHECK(code("PREFIX u: <u:123456> ASK { ?x u:p u:q }", options) == "limit_exceeded");
  options = {};
  options.max_depth = 3;
  CHECK(code("ASK { { { } } }", options) == "read");
  CHECK(code("ASK { { { { } } } }", options) == "limit_exceeded");
  CHECK(code("ASK { FILTER((1)) }", options) == "read");
  CHECK(code("ASK { FILTER(((1))) }", options) == "limit_exceeded");
  CHECK(code("ASK { " + repeated("OPTIONAL { ?x ?y ?z } ", 11) + "}", options) == "read");
  CHECK(code("ASK { " + repeated("OPTIONAL { ?x ?y ?z } ", 12) + "}", options) == "limit_exceeded");
}

TEST_CASE("a long query needs no deep stack, neither for parsing nor for destruction", "[query]") {
  struct Shape {
    std::string open, each, middle, close, end;  // `each` and `close` are repeated; % in `each` is the number of the repetition
    bool legal = true;
  };
  const std::vector<Shape> shapes = {
      {"ASK { FILTER(1", "+1", "", "", ") }"},
      {"ASK { FILTER(1", "+1-1", "", "", ") }"},
      {"ASK { FILTER(1", "*1/1", "", "", ") }"},
      {"ASK { FILTER(1", "||1", "", "", ") }"},
      {"ASK { FILTER(1", "||1&&1=1", "", "", ") }"},
      {"ASK { FILTER(", "!", "1", "", ") }", false},
      {"ASK { FILTER(", "- ", "1", "", ") }", false},
      {"ASK { FILTER(", "(", "1", ")", ") }"},
      {"ASK { FILTER(1", "=1*(2+3||4&&5", "", ")", ") }"},
      {"ASK { FILTER(", "if(1,2,", "1", ")", ") }"},
      {"ASK { FILTER(1 ", "in (1 ", "", ")", ") }"},
      {"ASK { FILTER(1 in (1", ",1", "", "", ")) }"},
      {"ASK { FILTER(", "<u:f>(", "1", ")", ") }"},
      {"ASK {", " FILTER EXISTS {", "", "}", "}"},
      {"ASK {", "FILTER(1)", "", "", "}"},
      {"ASK {", "{", "", "}", "}"},
      {"ASK {", "{}", "", "", "}"},
      {"ASK {", "{?x ?y 1}", "", "", "}"},
      {"ASK { {}", " UNION {}", "", "", "}"},
      {"ASK {", "{} UNION {", "", "}", "}"},
      {"ASK {", " OPTIONAL {}", "", "", "}"},
      {"ASK {", " OPTIONAL {", "", "}", "}"},
      {"ASK {", " MINUS {}", "", "", "}"},
      {"ASK {", " MINUS {", "", "}", "}"},
      {"ASK {", " GRAPH ?g {", "", "}", "}"},
      {"ASK {", "{SELECT * {", "", "}}", "}"},
      {"ASK {", "{SELECT (EXISTS {", "", "} AS ?x) {}}", "}"},
      {"ASK { ?x ", "<u:a>/", "", "", "<u:a> 1 }"},
      {"ASK { ?x ", "<u:a>|", "", "", "<u:a> 1 }"},
      {"ASK { ?x ", "(", "a", ")*", " 1 }"},
      {"ASK { ?x ", "^(a/(a|", "a", "))", " 1 }"},
      {"ASK { ?x !(a", "|a", "", "", ") 1 }"},
      {"ASK { ?x a ", "[a ", "1", "]", " }"},
      {"ASK { ?x a ", "(", "1", ")", " }"},
      {"ASK { ?x a (", "1 ", "", "", ") }"},
      {"ASK { ?x a 1", ",1", "", "", " }"},
      {"ASK { ?x a 1", ";a 1", "", "", " }"},
      {"ASK { ?x a 1", ".?x a 1", "", "", " }"},
      {"ASK { ?x a/a/a/a/a/a/a/a/a/a/a/a/a/a/a/a 1", ",1", "", "", " }"},
      {"ASK {} VALUES ?x {", "1 ", "", "", "}"},
      {"ASK {} GROUP BY ?y ", "?x ", "", "", ""},
      {"ASK {", "BIND(1 AS ?x%)", "", "", "}"},
  };
  std::vector<std::string> faults;
  std::size_t limited = 0;
  const auto parse_all = [&] {
    for (const Shape& shape : shapes) {
      const std::size_t many = (60 * 1024) / (shape.each.size() + shape.close.size()) - 20;
      for (const std::size_t n : {std::size_t{5}, std::size_t{20}, std::size_t{30}, std::size_t{31}, std::size_t{60}, std::size_t{61},
                                  std::size_t{62}, std::size_t{63}, std::size_t{250}, std::size_t{254}, std::size_t{255}, many}) {
        std::string text = shape.open;
        for (std::size_t i = 0; i < n; ++i) {
          const std::size_t number = shape.each.find('%');
          text += number == std::string::npos ? shape.each : shape.each.substr(0, number) + std::to_string(i) + shape.each.substr(number + 1);
        }
        text += shape.middle + repeated(shape.close, n) + shape.end;
        ParseOptions options;
        options.base = "http://base.example/";
        options.max_bytes = 100 * 1024;
        const auto parsed = lrt::query::parse(text, options);
        const bool is_limit = !parsed && parsed.error().code == Errc::limit_exceeded;
        limited += is_limit;
        if (shape.legal ? !parsed && (n == 5 || !is_limit) : parsed.has_value()) {
          faults.push_back(text.substr(0, 60) + (parsed ? " is read" : ": " + parsed.error().message));
        }
      }
    }
  };
  lrt::ThreadOptions options;
  options.stack_bytes = lrt::test::is_sanitized ? 4 * 1024 * 1024 : 256 * 1024;
  auto thread = lrt::start_thread("parser", options, parse_all);
  REQUIRE(thread);
  thread->join();
  CHECK(faults == std::vector<std::string>{});
  CHECK(limited > 30);
}
