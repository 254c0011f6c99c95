// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <string>

#include <lrt/base/iri.hpp>

#include "src/rdf/limits.hpp"
#include "src/rdf/turtle_parser.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lrt::Errc;

namespace {

std::string repeated(std::size_t n, const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < n; ++i) out += text;
  return out;
}

ReadOptions limits(std::size_t triples = 10'000, std::size_t bytes = 64 * 1024 * 1024) {
  ReadOptions options;
  options.base = "http://h/a/b";
  options.max_triples = triples;
  options.max_bytes = bytes;
  return options;
}

/// The error of a document beyond a limit: it has a place.
lrt::Error beyond(const std::string& text, Syntax syntax = Syntax::turtle, const ReadOptions& options = limits()) {
  const auto graph = read(text, syntax, options);
  INFO(text.substr(0, 200));
  if (graph) FAIL("accepted " << graph->size() << " triples");
  CHECK(graph.error().code == Errc::limit_exceeded);
  CHECK(graph.error().line > 0);
  CHECK(graph.error().message.substr(0, 5) == "line ");
  CHECK(graph.error().message.size() < 200);
  return graph.error();
}

Graph accepted(const std::string& text, Syntax syntax = Syntax::turtle, const ReadOptions& options = limits()) {
  auto graph = read(text, syntax, options);
  INFO(text.substr(0, 200));
  if (!graph) FAIL(graph.error().message);
  return *graph;
}

bool says(const lrt::Error& error, const std::string& words) {
  INFO(error.message);
  return error.message.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("an IRI of more than 8 KiB is refused however it is written", "[rdf][limits]") {
  const std::string most(max_iri - 9, 'a');  // behind "http://x/"
  CHECK(accepted("<http://x/" + most + "> a <c>.").size() == 1);
  CHECK(says(beyond("\n<http://x/" + most + "a> a <c>."), "line 2, column 1: IRI of more than 8192 bytes"));
  CHECK(accepted("@prefix p: <http://x/>. p:" + most + " a <c>.").size() == 1);
  CHECK(says(beyond("@prefix p: <http://x/>. p:" + most + "a a <c>."), "line 1, column 25: IRI of more than 8192"));
  CHECK(accepted("@prefix p: <http://x/" + most.substr(1) + ">. p:\\- a <c>.", Syntax::turtle).size() == 1);
  beyond("@prefix p: <http://x/" + most.substr(1) + ">. p:ab a <c>.");
  beyond("@prefix p: <http://x/" + most + "ab>.");
  CHECK(accepted("BASE <http://x/" + most.substr(1) + "> <#> a <c>.").size() == 1);
  beyond("BASE <http://x/" + most.substr(1) + "> <#f> a <c>.");
  beyond("<http://x/" + repeated(max_iri, "\\u0061") + "> a <c>.");
  CHECK(accepted("<http://x/" + repeated(1365, "\\u0061") + "> a <c>.").size() == 1);
  beyond("<http://x/> <http://x/> \"\"^^<http://x/" + most + "a> .\n", Syntax::n_triples);
  beyond("<http://x/" + most + "a> <http://x/> _:b .\n", Syntax::n_triples);
}

TEST_CASE("a Turtle document has at most 1000 prefix and base directives", "[rdf][limits]") {
  for (const std::string directive : {"@prefix p: <x:>.\n", "PREFIX p: <x:>\n", "@base <a:/>.\n", "BASE <b/>\n"}) {
    if (directive != "BASE <b/>\n") accepted(repeated(max_directives, directive));
    CHECK(says(beyond(repeated(max_directives + 1, directive)), directive == "BASE <b/>\n" ? "more than" : "more than 1000 prefix"));
  }
}

TEST_CASE("triples are counted as they are written", "[rdf][limits]") {
  const std::string once = "<a:a> <a:b> <a:c> .\n";
  CHECK(accepted(repeated(10, once), Syntax::turtle, limits(10)).size() == 1);
  CHECK(says(beyond(repeated(11, once), Syntax::turtle, limits(10)), "line 11, column 13: more than 10 triples"));
  CHECK(says(beyond(repeated(11, once), Syntax::n_triples, limits(10)), "line 11, column 13: more than 10 triples"));
  const std::string list = "<a:a> <a:b> (1 () [ <a:b> 2 ] (3)).";  // 1 + 4 * 2 + 1 + 2
  CHECK(accepted(list, Syntax::turtle, limits(12)).size() == 12);
  beyond(list, Syntax::turtle, limits(11));
}

TEST_CASE("terms are counted as they are when written out, each time they occur", "[rdf][limits]") {
  const std::string head = "@prefix p: <http://x/" + std::string(991, 'a') + ">.\n";  // 1000 bytes, counted once itself
  CHECK(accepted(head + repeated(33, "p: p: p: .\n"), Syntax::turtle, limits(100, 100'000)).size() == 1);
  CHECK(says(beyond(head + repeated(34, "p: p: p: .\n"), Syntax::turtle, limits(100, 100'000)),
             "line 35, column 1: IRIs and literals of more than 100000 bytes"));
  beyond(head + repeated(100, "<a:a> <a:b> \"\"^^p: .\n"), Syntax::turtle, limits(100, 100'000));
  const std::string base = "BASE <http://x/" + std::string(990, 'a') + "/>\n";            // 999 bytes, counted once itself
  accepted(base + repeated(33, "<a> <> </> .\n"), Syntax::turtle, limits(100, 100'000));  // 1000 + 999 + 9 bytes
  beyond(base + repeated(33, "<a> <b> <c> .\n"), Syntax::turtle, limits(100, 99'000));
  const std::string slow_base = "BASE <urn:" + std::string(996, 'a') + ">\n";                  // 1000 bytes, parsed each time
  accepted(slow_base + repeated(2, "<#> <#> <#> .\n"), Syntax::turtle, limits(100, 103'006));  // 6 times 17001 bytes
  beyond(slow_base + repeated(2, "<#> <#> <#> .\n"), Syntax::turtle, limits(100, 103'005));
  accepted("BASE <urn:" + std::string(252, 'a') + "> <#> <#> <#> .", Syntax::turtle, limits(100, 256 + 3 * 257));
  accepted("<a:a> <a:b> \"" + std::string(94, 'x') + "\" .", Syntax::n_triples, limits(100, 100));
  beyond("<a:a> <a:b> \"" + std::string(95, 'x') + "\" .", Syntax::n_triples, limits(100, 100));
}

TEST_CASE("escapes and quotes of a string stand for their characters", "[rdf][limits]") {
  const auto object = [](const std::string& text, Syntax syntax = Syntax::turtle) {
    const Graph g = accepted("<a:a> <a:b> " + text + " .", syntax);
    for (std::uint32_t i = 0; i < g.term_count(); ++i) {
      if (g.term(TermId{i}).is_literal()) return std::string(g.term(TermId{i}).text);
    }
    return std::string("none");
  };
  CHECK(object(R"("a\u0022\u005C\u000A\u000D\u0009\u0008\u000C\u0027\u0001\u007F\u00E9\U0001F600z")") ==
        "a\"\\\n\r\t\b\f'\x01\x7F\xC3\xA9\xF0\x9F\x98\x80z");
  CHECK(object(R"('\u0027\u005C\u0022"')") == "'\\\"\"");
  CHECK(object(R"("\u005C\u0022\\\"\t" )", Syntax::n_triples) == "\\\"\\\"\t");
  CHECK(object("\"\"\"\"a\"\"b\\\"\n''' \\u0022\\\\\"\"\"") == "\"a\"\"b\"\n''' \"\\");
  CHECK(object("'''''a'\"\"\"'''") == "''a'\"\"\"");
  CHECK(object("\"\"\"\"\"\"") == "");
  CHECK(object("\"\\u0041\"@en") == "A");
  const Graph g = accepted("<a:a> <a:b> '1\\n', '\\n2', '3\\u0041' ; <a:\\u0041> <a:\\u0042> .");
  CHECK(g.size() == 4);
  for (const char* text : {"1\n", "\n2", "3A"}) CHECK(g.contains(lrt::rdf::iri("a:a"), lrt::rdf::iri("a:b"), literal(text)));
  CHECK(g.contains(lrt::rdf::iri("a:a"), lrt::rdf::iri("a:A"), lrt::rdf::iri("a:B")));
  CHECK(object("\"" + repeated(100'000, "\\u0041") + "\"") == std::string(100'000, 'A'));
}

TEST_CASE("relative IRIs are resolved as iri::resolve does", "[rdf]") {
  for (const std::string from : {"http://h", "http://h/", "http://h?q", "http://h#f", "http://h/a/b/c?q/r#f/g", "http://h/a/../b/./c",
                                 "http://h//a//b", "http://h/a/..", "http://h/..?/../x", "file:///a/b", "urn:a:b", "urn:a/b/c", "a:/b/c"}) {
    for (const std::string to :
         {"",    "x",      "x/",     ".",       "./",  "..",   "../",      "../..", "../../../x", "./x", "x/./y", "x/../y", "x/..",
          "x/.", "/",      "/x",     "/x/../y", "/..", "/../", "//",       "//x",   "//x/../y",   "?",   "?q",    "?../x",  "#",
          "#g",  "x?../y", "x#../y", "...",     ".x",  "..x",  "a//..//b", ".//x",  "..//x",      "/.",  "//h/.", "x:y",    "/a//../b"}) {
      INFO(from << " and " << to);
      const auto expected = lrt::iri::resolve(from, to);
      REQUIRE(expected);
      if (!lrt::iri::is_absolute(*expected)) continue;
      ReadOptions options;
      options.base = from;
      const auto graph = read("<" + to + "> a <a:a> .", Syntax::turtle, options);
      REQUIRE(graph);
      CHECK(graph->contains(lrt::rdf::iri(*expected), lrt::rdf::iri("http://www.w3.org/1999/02/22-rdf-syntax-ns#type"), lrt::rdf::iri("a:a")));
    }
  }
}
