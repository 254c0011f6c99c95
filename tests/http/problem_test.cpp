// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/problem.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("a problem is RFC 9457 JSON", "[http][R0.6]") {
  CHECK(http::to_json({404, "no resource \"/x\""}) == R"({"type":"about:blank","title":"Not Found","status":404,"detail":"no resource \"/x\""})");
  CHECK(http::to_json({500, ""}) == R"({"type":"about:blank","title":"Internal Server Error","status":500})");
}

TEST_CASE("any bytes become a JSON string", "[http]") {
  CHECK(http::json_string("") == "\"\"");
  CHECK(http::json_string("a\"\\\n\r\t\x01\x1F/\xC3\xB6") == "\"a\\\"\\\\\\n\\r\\t\\u0001\\u001f/\xC3\xB6\"");
  CHECK(http::json_string(std::string_view("\0", 1)) == "\"\\u0000\"");
  CHECK(http::json_string("a\xFF\xC3") == "\"a\xEF\xBF\xBD\xEF\xBF\xBD\"");
}
