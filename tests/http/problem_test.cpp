// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/problem.hpp>

#include <string_view>

#include <lrt/http/message.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("a problem is RFC 9457 JSON", "[http][R0.6]") {
  CHECK(http::to_json({404, "no resource \"/x\""}) == R"({"type":"about:blank","title":"Not Found","status":404,"detail":"no resource \"/x\""})");
  CHECK(http::to_json({500, ""}) == R"({"type":"about:blank","title":"Internal Server Error","status":500})");
}

TEST_CASE("any bytes become a JSON string", "[http]") {
  CHECK(http::json_string("") == "\"\"");
  CHECK(http::json_string("a\"\\\n\r\t\x01\x1F/\xC3\xB6") == "\"a\\\"\\\\\\n\\r\\t\\u0001\\u001F/\xC3\xB6\"");
  CHECK(http::json_string(std::string_view("\0", 1)) == "\"\\u0000\"");
  CHECK(http::json_string("a\xFF\xC3") == "\"a\xEF\xBF\xBD\xEF\xBF\xBD\"");
}

TEST_CASE("a response that becomes a problem has its status, its document and the fields for browsers", "[http][R0.6]") {
  http::Response response;
  response.fields.add("Retry-After", "1");
  http::set_problem(response, {503, "the robot is busy", "[]"});
  CHECK(response.status == 503);
  CHECK(response.content() == R"({"type":"about:blank","title":"Service Unavailable","status":503,"detail":"the robot is busy","errors":[]})");
  CHECK(response.fields.joined("Content-Type") == "application/problem+json");
  CHECK(response.fields.joined("X-Content-Type-Options") == "nosniff");
  CHECK(response.fields.joined("Cross-Origin-Resource-Policy") == "same-origin");
  CHECK(response.fields.joined("Retry-After") == "1");
  CHECK(response.fields.list().size() == 4);
  CHECK_FALSE(response.close);
}

TEST_CASE("a response with a body that becomes a problem has one Content-Type", "[http][R0.6]") {
  http::Response response;
  response.fields.add("content-type", "text/turtle");
  response.set_body("<#a> <#b> <#c> .");
  http::set_problem(response, {599, "a text\r\nX: \"1\" \xFF"});
  CHECK(response.fields.joined("Content-Type") == "application/problem+json");
  CHECK(response.content() == "{\"type\":\"about:blank\",\"title\":\"\",\"status\":599,\"detail\":\"a text\\r\\nX: \\\"1\\\" \xEF\xBF\xBD\"}");
  http::set_problem(response, {500, {}});
  CHECK(response.fields.list().size() == 3);
  CHECK(response.content() == R"({"type":"about:blank","title":"Internal Server Error","status":500})");
}
