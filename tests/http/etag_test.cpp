// SPDX-License-Identifier: Apache-2.0
#include "src/http/etag.hpp"

#include <set>

#include "tests/support/catch.hpp"

using namespace lrt;
using http::Match;

TEST_CASE("an entity tag is the same on every machine and in every run", "[http][R0.11]") {
  CHECK(http::entity_tag("text/turtle", "<a> <b> <c> .\n") == "\"05UAfhU5o9FvlOCJZV_TvD\"");
  CHECK(http::entity_tag("text/turtle", "<http://robot.example/baxter> <http://x> 1 .\n") == "\"8MlvCqgTATUQ-4TuMZp5YD\"");
  CHECK(http::entity_tag("", "") == "\"AAAAAAAAAAAAAAAAAAAAAA\"");
}

TEST_CASE("a tag changes with each byte, the length and the media type", "[http][R0.11]") {
  std::set<std::string> seen;
  std::size_t expected = 0;
  const auto add = [&](std::string_view type, std::string_view bytes) {
    ++expected;
    seen.insert(http::entity_tag(type, bytes));
  };
  std::string text = "<http://r/a> <http://r/b> 43.6 ; <http://r/c> 1 .";
  for (std::size_t n = 0; n <= text.size(); ++n) add("text/turtle", text.substr(0, n));
  for (std::size_t at = 0; at < text.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string changed = text;
      changed[at] = static_cast<char>(changed[at] ^ (1 << bit));
      add("text/turtle", changed);
    }
  }
  for (std::size_t zeros = 1; zeros < 40; ++zeros) add("text/turtle", std::string(zeros, '\0'));
  add("application/n-triples", text);
  add("text/turtl", "e" + text);
  add("text/turtle<", text.substr(1));
  add(text, "text/turtle");
  CHECK(seen.size() == expected);
}

TEST_CASE("a tag is strong, quoted and of etagc characters only", "[http][R0.11]") {
  for (int i = 0; i < 300; ++i) {
    const std::string tag = http::entity_tag("text/turtle", std::to_string(i));
    REQUIRE(tag.size() == 24);
    REQUIRE(http::matches(tag, tag, false) == Match::yes);
  }
}

TEST_CASE("If-Match and If-None-Match name tags as RFC 9110 13.1 says", "[http][R0.11]") {
  struct Case {
    std::string_view field, tag;
    Match weak, strong;
  };
  const Case cases[] = {
      {R"("a")", R"("a")", Match::yes, Match::yes},
      {R"("a")", R"("b")", Match::no, Match::no},
      {R"(W/"a")", R"("a")", Match::yes, Match::no},
      {R"("a")", R"(W/"a")", Match::yes, Match::no},
      {R"(W/"a")", R"(W/"a")", Match::yes, Match::no},
      {R"("x", "a")", R"("a")", Match::yes, Match::yes},
      {R"("x","a")", R"("a")", Match::yes, Match::yes},
      {R"(,, "x" ,	W/"y", "a",)", R"("a")", Match::yes, Match::yes},
      {R"("x, a")", R"("a")", Match::no, Match::no},  // a space within a tag: nothing has it
      {R"("x,a")", R"("a")", Match::no, Match::no},
      {R"("x\")", R"("a")", Match::no, Match::no},  // no escapes in a tag
      {R"("")", R"("")", Match::yes, Match::yes},
      {"*", R"("a")", Match::yes, Match::yes},
      {" * ", R"("a")", Match::yes, Match::yes},
      {"", R"("a")", Match::no, Match::no},
      {",", R"("a")", Match::no, Match::no},
      {"a", R"("a")", Match::malformed, Match::malformed},
      {R"("a)", R"("a")", Match::malformed, Match::malformed},
      {R"("a" "b")", R"("a")", Match::malformed, Match::malformed},
      {R"("a", *)", R"("a")", Match::malformed, Match::malformed},
      {R"("a", b)", R"("a")", Match::malformed, Match::malformed},
      {R"(w/"a")", R"("a")", Match::malformed, Match::malformed},  // case-sensitive
      {R"(W/ "a")", R"("a")", Match::malformed, Match::malformed},
  };
  for (const auto& [field, tag, weak, strong] : cases) {
    CAPTURE(field, tag);
    CHECK(http::matches(field, tag, true) == weak);
    CHECK(http::matches(field, tag, false) == strong);
  }
}
