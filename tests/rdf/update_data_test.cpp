// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/update_data.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lrt::Errc;

namespace {

/// The triples of an update of one operation, as N-Triples.
std::string triples(const std::string& text) {
  const auto updates = read_data_updates(text, {});
  INFO(text);
  if (!updates) FAIL(updates.error().message);
  REQUIRE(updates->size() == 1);
  return *write(updates->front().graph, Syntax::n_triples);
}

lrt::Error refusal(const std::string& text) {
  const auto updates = read_data_updates(text, {});
  INFO(text);
  if (updates) FAIL("accepted");
  CHECK(updates.error().code == Errc::expected_rdf);
  return updates.error();
}

}  // namespace

TEST_CASE("a literal of an update may have its tag or type after white space or a comment", "[rdf]") {
  for (const char* literal : {"\"x\"@en", "\"x\" @en", "'x'\t@en", "\"\"\"x\"\"\"\n@en", "'x' # the language:\n @en"})
    CHECK(triples(std::string("INSERT DATA { <a:> <b:> ") + literal + " }") == "<a:> <b:> \"x\"@en .\n");
  for (const char* literal : {"\"x\"^^<c:>", "\"x\" ^^<c:>", "\"x\"^^ <c:>", "'x'\n^^\t<c:>"})
    CHECK(triples(std::string("DELETE DATA { <a:> <b:> ") + literal + " . }") == "<a:> <b:> \"x\"^^<c:> .\n");
  CHECK(refusal("INSERT DATA { @prefix a: <a:> . a:a a:b a:c }").column == 15);
  refusal("INSERT DATA { <a:> <b:> <c:> @en }");
  refusal("INSERT DATA { <a:> <b:> 'x' . @en }");
}

TEST_CASE("a literal of rdf:langString without a language is refused in an update, with its place", "[rdf]") {
  for (const char* operation : {"INSERT", "DELETE"}) {
    const std::string prefix = "PREFIX rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#>\n", text = std::string(operation) + " DATA {\n <a:> <b:> ";
    CHECK(triples(prefix + text + "'x'@en }") == "<a:> <b:> \"x\"@en .\n");
    const lrt::Error error = refusal(prefix + text + "'x'^^rdf:langString }");
    CHECK(error.line == 3);
    CHECK(error.column == 17);
  }
}

TEST_CASE("an update may begin with a byte order mark", "[rdf]") {
  const std::string mark = "\xEF\xBB\xBF";
  CHECK(triples(mark + "INSERT DATA { <a:> <b:> 'c' }") == "<a:> <b:> \"c\" .\n");
  CHECK(triples(mark + "PREFIX : <a:> INSERT DATA { : <b:> 'c' }") == "<a:> <b:> \"c\" .\n");
  CHECK(triples(mark + "# a comment\nDELETE DATA { <a:> <b:> 'c' }") == "<a:> <b:> \"c\" .\n");
  const lrt::Error error = refusal(mark + "INSERT DATA { <a:> ! }");
  CHECK(error.column == 20);
  CHECK(error.offset == 22u);
  refusal(" " + mark + "INSERT DATA { <a:> <b:> 'c' }");
}
