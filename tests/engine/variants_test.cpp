// SPDX-License-Identifier: Apache-2.0
#include "src/engine/variants.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include <lrt/rdf/codec.hpp>

#include "src/model/spec.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::engine;

TEST_CASE("a variant is found by its media type and the other way round", "[engine][R1.2]") {
  for (const Variants* all : {&graph_variants(), &overview_variants(), &value_variants(), &context_variants()}) {
    REQUIRE(all->types.size() == all->variants.size());
    for (std::size_t i = 0; i < all->types.size(); ++i) {
      CHECK(all->find(all->types[i]) == all->variants[i]);
      CHECK(all->type_of(all->variants[i]) == all->types[i]);
    }
    CHECK_FALSE(all->find("no/type"));
  }
  CHECK(graph_variants().types.front() == "text/turtle");  // the first choice
  CHECK_FALSE(graph_variants().find("application/json"));
  CHECK(value_variants().find("application/json") == Variant(rdf::Plain::json));
  CHECK(overview_variants().find("application/json") == Variant::overview());
}

TEST_CASE("the page stands behind what lrt writes and before a user's encoders", "[engine][R1.2]") {
  model::PropertySpec spec;
  spec.representations.push_back({"image/jpeg", {}, {}, {}});
  spec.octets = true;
  const Variants all = variants_of(spec);
  const auto at = [&](std::string_view type) { return std::find(all.with_page.begin(), all.with_page.end(), type) - all.with_page.begin(); };
  CHECK(at("application/cbor") < at(page_type));
  CHECK(at(page_type) < at("application/octet-stream"));
  CHECK(at("application/octet-stream") < at("image/jpeg"));
  CHECK(all.find("image/jpeg") == Variant::encoded(0));
  CHECK(all.with_page.size() == all.types.size() + 1);
  CHECK(all.list().find("profile") == std::string::npos);
  CHECK(all.list().find("image/jpeg") != std::string::npos);
}

TEST_CASE("what is text can be an event; encodings and octets may be missing", "[engine][R0.17]") {
  CHECK(Variant().is_text());
  CHECK(Variant(rdf::Plain::json).is_text());
  CHECK(Variant::inlined_json_ld().is_rdf());
  CHECK(Variant::overview().is_text());
  CHECK_FALSE(Variant::overview().is_rdf());
  CHECK_FALSE(Variant(rdf::Plain::cbor).is_text());
  CHECK_FALSE(Variant(rdf::Plain::octets).is_text());
  CHECK_FALSE(Variant::encoded(0).is_text());
  CHECK(Variant::encoded(0).may_be_missing());
  CHECK(Variant(rdf::Plain::octets).may_be_missing());
  CHECK_FALSE(Variant().may_be_missing());
  CHECK(Variant::encoded(0) != Variant::encoded(1));
  CHECK(Variant::encoded(0) != Variant());
}

TEST_CASE("the IRI of a variant names its media type and page", "[engine][R0.9]") {
  CHECK(variant_iri("http://a/b", "text/turtle") == "http://a/b?accept=text/turtle");
  CHECK(variant_iri("http://a/b", "application/ld+json", 3) == "http://a/b?page=3&accept=application/ld+json");
  CHECK(variant_iri("http://a/b", "a/b;c=\"d e\"") == "http://a/b?accept=a/b%3Bc%3D%22d%20e%22");
  CHECK(content_type(Variant(rdf::Plain::text), "text/plain", "1") == "text/plain; charset=utf-8");
  CHECK(content_type(Variant(), "text/turtle", "<> <a:b> 1 .") == "text/turtle");
  CHECK(content_type(Variant(), "text/turtle", "<> <a:b> '\u00b0C' .") == "text/turtle; charset=utf-8");
}

TEST_CASE("JSON-LD with its context inside is offered by a build with JSON-LD", "[engine][R1.2]") {
  const bool has = rdf::syntax_of("application/ld+json").has_value();
  CHECK(graph_variants().find("application/ld+json;profile=\"https://w3id.org/lrt/ns#inlineContext\"").has_value() == has);
}
