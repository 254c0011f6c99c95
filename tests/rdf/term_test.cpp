// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/term.hpp>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace vocab = lrt::vocab;

TEST_CASE("a plain literal has the datatype xsd:string and a tagged one rdf:langString", "[rdf]") {
  CHECK(literal("a").datatype == vocab::xsd::string.text);
  CHECK(tagged_literal("a", "en").datatype == vocab::rdf_::langString.text);
  CHECK(literal("a") != tagged_literal("a", "en"));
  CHECK(literal("a") == literal("a", vocab::xsd::string));
  CHECK(literal("1", vocab::xsd::integer) != literal("1", vocab::xsd::decimal));
}

TEST_CASE("a Term owns the text of a view", "[rdf]") {
  std::string text = "http://example.org/";
  const Term term(TermView(TermKind::iri, text));
  text = "changed";
  CHECK(term.view() == lrt::rdf::iri("http://example.org/"));
}

TEST_CASE("a term in a message is N-Triples", "[rdf]") {
  CHECK(to_string(lrt::rdf::iri("http://e/")) == "<http://e/>");
  CHECK(to_string(blank("b")) == "_:b");
  CHECK(to_string(literal("a\"\\\n\x01")) == "\"a\\\"\\\\\\n\\u0001\"");
  CHECK(to_string(tagged_literal("a", "en-gb")) == "\"a\"@en-gb");
  CHECK(to_string(literal("1", vocab::xsd::byte_)) == "\"1\"^^<http://www.w3.org/2001/XMLSchema#byte>");
}
