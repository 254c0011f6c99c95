// SPDX-License-Identifier: Apache-2.0
#include "src/http/form.hpp"

#include "tests/support/catch.hpp"

using lrt::http::parse_form;
using lrt::http::Plus;
using lrt::http::query_parameter;

TEST_CASE("a query parameter is decoded, and the first well-formed one counts", "[http][SPEC 3.6]") {
  CHECK(query_parameter("/arm?a=1&b=2", "b") == "2");
  CHECK(query_parameter("/arm?b=%zz&b=2", "b") == "2");
  CHECK(query_parameter("/arm?b=x%20y", "b") == "x y");
  CHECK(query_parameter("/arm?b=", "b") == "");
  CHECK_FALSE(query_parameter("/arm?bb=1&b", "b"));
  CHECK_FALSE(query_parameter("/arm", "b"));
  CHECK_FALSE(query_parameter("/arm?", "b"));
}

TEST_CASE("a plus of a query is itself, or a space where a standard says so", "[http]") {
  CHECK(query_parameter("/arm?accept=image/svg+xml", "accept") == "image/svg+xml");
  CHECK(query_parameter("/sparql?query=ASK+%2B", "query", Plus::space) == "ASK +");
}

TEST_CASE("a form has names and values in order, and is refused if one cannot be decoded", "[http]") {
  const auto form = parse_form("a=1&&b=x+y%21&a");
  REQUIRE(form);
  CHECK(*form == std::vector<std::pair<std::string, std::string>>{{"a", "1"}, {"b", "x y!"}, {"a", ""}});
  CHECK_FALSE(parse_form("a=%"));
  CHECK_FALSE(parse_form("a=%FF"));
}
