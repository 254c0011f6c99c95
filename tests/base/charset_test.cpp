// SPDX-License-Identifier: Apache-2.0
#include "src/base/charset.hpp"

#include <string>

#include "tests/support/catch.hpp"

using lrt::charset::to_utf8;

TEST_CASE("texts in ASCII, Latin-1 and UTF-8 become UTF-8", "[base][R0.6]") {
  std::string storage;
  const auto read = [&](std::string_view text, std::string_view name) { return std::string(to_utf8(text, name, storage).value()); };
  for (const char* name : {"utf-8", "UTF-8", "utf8", "us-ascii", "US-ASCII", "ascii", "iso-8859-1", "ISO-8859-1", "Latin1"}) {
    CAPTURE(name);
    CHECK(read("", name).empty());
    CHECK(read("43.6", name) == "43.6");
  }
  CHECK(read("gr\xFC\xDF", "ISO-8859-1") == "gr\xC3\xBC\xC3\x9F");
  CHECK(read("\x80\xFF", "latin1") == "\xC2\x80\xC3\xBF");
  CHECK(read("gr\xC3\xBC", "utf-8") == "gr\xC3\xBC");
  const std::string text = "as it is";
  CHECK(to_utf8(text, "iso-8859-1", storage)->data() == text.data());
}

TEST_CASE("a text beyond ASCII says its charset, and no other body does", "[base][R1.2]") {
  using lrt::charset::content_type;
  for (const std::string& wide : {std::string("\xC3\xB6"), "12345678" + std::string("\xC2\xB0"), "\xE2\x82\xAC" + std::string(1000, 'x'),
                                  std::string("1234567\xF0\x9F\xA4\x96")}) {
    CAPTURE(wide);
    CHECK(content_type("text/turtle", wide) == "text/turtle; charset=utf-8");
    CHECK(content_type("Text/CSV", wide) == "Text/CSV; charset=utf-8");
    CHECK(content_type("text/x;version=1", wide) == "text/x;version=1; charset=utf-8");
    CHECK(content_type("text/x; charset=iso-8859-1", wide) == "text/x; charset=iso-8859-1");
    CHECK(content_type("text/x;Charset=\"UTF-8\"", wide) == "text/x;Charset=\"UTF-8\"");
    for (const char* other : {"application/n-triples", "application/trig", "application/ld+json", "application/rdf+xml", "image/jpeg", "textual/x"})
      CHECK(content_type(other, wide) == other);
  }
  CHECK(content_type("text/turtle", "") == "text/turtle");
  CHECK(content_type("text/turtle", std::string(1000, '\x7F')) == "text/turtle");
  CHECK(content_type("text/x", "gr\xFC\xDF") == "text/x");  // another encoding, which only its owner knows
  CHECK(content_type("text/x", "1234567\xFF") == "text/x");
}

TEST_CASE("a byte that us-ascii does not have is an error with its offset", "[base][R0.6]") {
  std::string storage;
  const auto result = to_utf8("gr\xC3\xBC", "us-ascii", storage);
  REQUIRE_FALSE(result);
  CHECK(result.error().code == lrt::Errc::expected_value);
  CHECK(result.error().offset == std::size_t{2});
}

TEST_CASE("other encodings are named in the error, with those that are taken", "[base][R0.6]") {
  std::string storage;
  for (const char* name : {"utf-16", "windows-1252", "iso-8859-15", "utf-8x", "latin", ""}) {
    const auto result = to_utf8("1", name, storage);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == lrt::Errc::unsupported_syntax);
    CHECK(result.error().message == "charset: expected one of utf-8, us-ascii, iso-8859-1, found \"" + std::string(name) + "\"");
  }
}
