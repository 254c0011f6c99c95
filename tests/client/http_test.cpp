// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/http.hpp>

#include "tests/support/catch.hpp"

namespace lrt {
namespace {

using client::Link;
using client::Response;

std::vector<Link> links_of(std::string_view field) {
  http::Fields fields;
  fields.add("Link", field);
  return client::links(fields, "http://robot.example/arm/joint");
}

TEST_CASE("links are resolved, one for each relation", "[client][R0.9]") {
  const auto found = links_of(R"(<axis>; rel="related", </>; rel="up index" ; type="text/turtle",<http://other.example/x,y>;rel=related)");
  REQUIRE(found.size() == 4);
  CHECK(found[0].target == "http://robot.example/arm/axis");
  CHECK(found[0].relation == "related");
  CHECK(found[1].target == "http://robot.example/");
  CHECK(found[1].relation == "up");
  CHECK(found[1].type == "text/turtle");
  CHECK(found[2].relation == "index");
  CHECK(found[3].target == "http://other.example/x,y");
}

TEST_CASE("ill-formed links are left out, and those after them are read", "[client][R1.6]") {
  for (const char* bad : {"axis; rel=related", "<a b>; rel=related", "<axis; rel=related", "<axis>; rel=\"related", "<axis>", "<axis>; =; rel=x",
                          "<x>; rel=related; anchor=\"/other\""}) {
    INFO(bad);
    const auto alone = links_of(bad);
    CHECK(alone.empty());
  }
  const auto found = links_of("nonsense, <axis>; rel=related");
  REQUIRE(found.size() == 1);
  CHECK(found[0].target == "http://robot.example/arm/axis");
}

TEST_CASE("the reason of a refusal is one line of the server's own words", "[client]") {
  Response response;
  response.status = 422;
  response.fields.add("Content-Type", "application/problem+json; charset=utf-8");
  response.body = R"({"type":"about:blank","title":"Unprocessable Content","detail":"expected a number, found \"abc\""})";
  CHECK(response.reason() == "expected a number, found \"abc\"");
  response.body = R"({"title":"Unprocessable Content"})";
  CHECK(response.reason() == "Unprocessable Content");
  response.body = "{";
  CHECK(response.reason() == "422 Unprocessable Content");
  response.fields.set("Content-Type", "text/plain");
  response.body = "no\x1b[31m\nnext line";
  CHECK(response.reason() == "no [31m");
  response.fields.set("Content-Type", "text/turtle");
  response.body = "[] a sh:ValidationReport ; sh:result [ sh:resultMessage \"expected at most 360\" ] .";
  CHECK(response.reason() == "expected at most 360");
}

}  // namespace
}  // namespace lrt
