// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/media_type.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("a media type is lower-cased, its parameter values are unquoted and kept", "[base]") {
  const auto result = MediaType::parse("Text/Turtle ; Charset=\"UTF-8\";x=\"a\\\"b;,\" ;; v=1.0;");
  REQUIRE(result);
  CHECK(result->essence() == "text/turtle");
  CHECK(result->parameter("charset") == "UTF-8");
  CHECK(result->parameter("CHARSET") == "UTF-8");
  CHECK(result->parameter("x") == "a\"b;,");
  CHECK(result->parameter("v") == "1.0");
  CHECK(result->parameter("none").empty());
  CHECK(result->parameters.size() == 3);
  CHECK(MediaType::parse("application/ld+json")->essence() == "application/ld+json");
  CHECK(MediaType::parse("a/b;x=\"\"")->parameter("x").empty());
}

TEST_CASE("an invalid media type is refused with the offset of the first invalid byte", "[base]") {
  struct Case {
    const char* text;
    std::size_t offset;
  };
  for (const auto& [text, offset] :
       {Case{"", 0}, Case{"text", 4}, Case{"text/", 5}, Case{"/turtle", 0}, Case{"text /turtle", 4}, Case{"text/turtle x", 12},
        Case{"text/turtle;x", 13}, Case{"text/turtle;x=", 14}, Case{"text/turtle;x =1", 13}, Case{"text/turtle;x=\"a", 14},
        Case{"text/turtle;x=\"\x01\"", 14}, Case{"text/turtle, a/b", 11}, Case{"text/turtle;=1", 12}, Case{"te\xC3\xB6/a", 2}}) {
    CAPTURE(text);
    const auto result = MediaType::parse(text);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Errc::expected_media_type);
    CHECK(result.error().offset == offset);
  }
}
