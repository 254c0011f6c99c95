// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/iri.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

struct Resolution {
  const char *reference, *expected;
};

// RFC 3986 5.4.1 and 5.4.2, against http://a/b/c/d;p?q
const Resolution rfc3986[] = {
    {"g:h", "g:h"},
    {"g", "http://a/b/c/g"},
    {"./g", "http://a/b/c/g"},
    {"g/", "http://a/b/c/g/"},
    {"/g", "http://a/g"},
    {"//g", "http://g"},
    {"?y", "http://a/b/c/d;p?y"},
    {"g?y", "http://a/b/c/g?y"},
    {"#s", "http://a/b/c/d;p?q#s"},
    {"g#s", "http://a/b/c/g#s"},
    {"g?y#s", "http://a/b/c/g?y#s"},
    {";x", "http://a/b/c/;x"},
    {"g;x", "http://a/b/c/g;x"},
    {"g;x?y#s", "http://a/b/c/g;x?y#s"},
    {"", "http://a/b/c/d;p?q"},
    {".", "http://a/b/c/"},
    {"./", "http://a/b/c/"},
    {"..", "http://a/b/"},
    {"../", "http://a/b/"},
    {"../g", "http://a/b/g"},
    {"../..", "http://a/"},
    {"../../", "http://a/"},
    {"../../g", "http://a/g"},
    {"../../../g", "http://a/g"},
    {"../../../../g", "http://a/g"},
    {"/./g", "http://a/g"},
    {"/../g", "http://a/g"},
    {"g.", "http://a/b/c/g."},
    {".g", "http://a/b/c/.g"},
    {"g..", "http://a/b/c/g.."},
    {"..g", "http://a/b/c/..g"},
    {"./../g", "http://a/b/g"},
    {"./g/.", "http://a/b/c/g/"},
    {"g/./h", "http://a/b/c/g/h"},
    {"g/../h", "http://a/b/c/h"},
    {"g;x=1/./y", "http://a/b/c/g;x=1/y"},
    {"g;x=1/../y", "http://a/b/c/y"},
    {"g?y/./x", "http://a/b/c/g?y/./x"},
    {"g?y/../x", "http://a/b/c/g?y/../x"},
    {"g#s/./x", "http://a/b/c/g#s/./x"},
    {"g#s/../x", "http://a/b/c/g#s/../x"},
    {"http:g", "http:g"},  // strict
};

}  // namespace

TEST_CASE("references resolve as in the examples of RFC 3986 5.4", "[base]") {
  for (const auto& [reference, expected] : rfc3986) {
    CAPTURE(reference);
    const auto result = iri::resolve("http://a/b/c/d;p?q", reference);
    REQUIRE(result);
    CHECK(*result == expected);
  }
}

TEST_CASE("references resolve against bases of other shapes", "[base]") {
  struct Case {
    const char *base, *reference, *expected;
  };
  const Case cases[] = {
      {"http://robot.example", "baxter", "http://robot.example/baxter"},
      {"http://robot.example?x", "", "http://robot.example?x"},
      {"http://robot.example/a/../b", "", "http://robot.example/a/../b"},
      {"http://robot.example/a#frag", "", "http://robot.example/a"},
      {"http://robot.example/a#frag", "#other", "http://robot.example/a#other"},
      {"http://robot.example/a", "?", "http://robot.example/a?"},
      {"http://robot.example/a/", "..//b", "http://robot.example//b"},
      {"urn:uuid:1", "#x", "urn:uuid:1#x"},
      {"mailto:a", "b", "mailto:b"},
      {"x:a/b", "../../c", "x:/c"},
      {"x:/a", ".//c", "x:/.//c"},  // not x://c, whose c would be an authority
      {"http://r/",
       "gr\xC3\xB6\xC3\x9F"
       "e",
       "http://r/gr\xC3\xB6\xC3\x9F"
       "e"},
  };
  for (const auto& [base, reference, expected] : cases) {
    CAPTURE(base, reference);
    const auto result = iri::resolve(base, reference);
    REQUIRE(result);
    CHECK(*result == expected);
    CHECK(iri::is_absolute(*result));
  }
}

TEST_CASE("resolve refuses an invalid IRI and gives the offset", "[base]") {
  CHECK(iri::resolve("/no/scheme", "x").error().code == Errc::expected_iri);
  CHECK(iri::resolve("http://a/ b", "x").error().offset == std::size_t{9});
  const auto result = iri::resolve("http://a/", "x<y");
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::expected_iri);
  CHECK(result.error().offset == std::size_t{1});
  CHECK(result.error().message == "the text is not an IRI reference: found '<' at byte 1");
  CHECK(iri::resolve("http://a/", "1a:b").error().offset == std::size_t{2});
}

TEST_CASE("split finds the five parts and distinguishes absent from empty parts", "[base]") {
  const iri::Parts parts = iri::split("http://u@h:1/p/q?a?b#c#");
  CHECK(parts.scheme == "http");
  CHECK(parts.authority == "u@h:1");
  CHECK(parts.path == "/p/q");
  CHECK(parts.query == "a?b");
  CHECK(parts.fragment == "c#");
  const iri::Parts bare = iri::split("x");
  CHECK_FALSE((bare.has_scheme || bare.has_authority || bare.has_query || bare.has_fragment));
  CHECK(bare.path == "x");
  const iri::Parts empties = iri::split("//?#");
  CHECK((empties.has_authority && empties.has_query && empties.has_fragment && !empties.has_scheme));
  CHECK_FALSE(iri::split("/a:b").has_scheme);
  CHECK_FALSE(iri::split("?a:b").has_scheme);
  CHECK_FALSE(iri::split(":b").has_scheme);
}

TEST_CASE("an absolute IRI has a scheme and allowed characters only", "[base]") {
  for (const char* good : {"http://a", "a:", "urn:uuid:1", "x+y-z.1:%41", "http://[::1]:80/", "http://r/gr\xC3\xB6", "http://r/\xF0\x9F\xA4\x96",
                           "http://example.org/\xEF\xBF\xBD"}) {
    CAPTURE(good);
    CHECK(iri::is_absolute(good));
  }
  for (const char* bad : {"",
                          "a",
                          "/a",
                          "//a",
                          "1a:b",
                          "-a:b",
                          ":a",
                          "a b:c",
                          "http://a b",
                          "http://a\tb",
                          "http://a\x7F",
                          "http://<",
                          "http://>",
                          "http://\"",
                          "http://{",
                          "http://}",
                          "http://|",
                          "http://^",
                          "http://`",
                          "http://\\",
                          "http://%",
                          "http://%4",
                          "http://%4g",
                          "http://\xC3",
                          "http://\xC0\x80",
                          "http://\xED\xA0\x80",
                          "http://\xC2\x80",
                          "http://\xEE\x80\x80",
                          "http://\xEF\xBF\xBE",
                          "http://\xEF\xB7\x90",
                          "http://\xF4\x90\x80\x80",
                          "http://\xF4\x8F\xBF\xBD"}) {
    CAPTURE(bad);
    CHECK_FALSE(iri::is_absolute(bad));
  }
  CHECK_FALSE(iri::is_absolute(std::string_view("a:\0", 3)));
}

TEST_CASE("a reference may be relative but its first segment has no colon", "[base]") {
  for (const char* good : {"", "a", "/a", "//a", "?x", "#x", "./a:b", "a/b:c", "a:b", "\xC3\xB6"}) {
    CAPTURE(good);
    CHECK(iri::is_reference(good));
  }
  for (const char* bad : {":a", "1a:b", "\xC3\xB6:b", "a b", "%", "a\n"}) {
    CAPTURE(bad);
    CHECK_FALSE(iri::is_reference(bad));
  }
}

TEST_CASE("encode_segment keeps unreserved characters, and decode restores all others", "[base]") {
  CHECK(iri::encode_segment("right_s1") == "right_s1");
  CHECK(iri::encode_segment("a/b c?#%") == "a%2Fb%20c%3F%23%25");
  CHECK(iri::encode_segment("!$&'()*+,;=:@-._~") == "!$&'()*+,;=:@-._~");
  CHECK(iri::encode_segment("\xC3\xB6") == "%C3%B6");
  std::string all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
  CHECK(*iri::decode(iri::encode_segment(all)) == all);
  CHECK(iri::is_reference("/" + iri::encode_segment(all)));
  CHECK(iri::decode("a%2").error().offset == std::size_t{1});
  CHECK(iri::decode("%zz").error().code == Errc::expected_iri);
  CHECK(*iri::decode("%2f%2F+") == "//+");
}
