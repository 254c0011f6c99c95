// SPDX-License-Identifier: Apache-2.0
#include "src/base/utf8.hpp"

#include <cstddef>
#include <string>
#include <string_view>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("well-formed UTF-8 has no invalid byte", "[base]") {
  CHECK_FALSE(utf8::find_invalid(""));
  CHECK_FALSE(utf8::find_invalid(std::string_view("a\0b", 3)));
  CHECK_FALSE(utf8::find_invalid("\xC2\x80 \xDF\xBF \xE0\xA0\x80 \xED\x9F\xBF \xEE\x80\x80 \xEF\xBF\xBF \xF0\x90\x80\x80 \xF4\x8F\xBF\xBF"));
}

TEST_CASE("the first byte of an ill-formed sequence is found", "[base]") {
  for (const char* bad : {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xC2", "\xC2\x41", "\xE0\x9F\xBF", "\xE0\xA0", "\xED\xA0\x80", "\xED\xBF\xBF",
                          "\xF0\x8F\xBF\xBF", "\xF0\x90\x80", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFE", "\xFF"}) {
    for (const std::string prefix : {"", "abc", "0123456789abcdef", "012345\xC3\xB6"}) {
      CAPTURE(prefix);
      CHECK(utf8::find_invalid(prefix + bad) == prefix.size());
      CHECK(utf8::find_invalid(prefix + bad + "12345678") == prefix.size());
    }
  }
}

TEST_CASE("one byte order mark at the beginning is no part of a text", "[base]") {
  const std::string mark = "\xEF\xBB\xBF";
  for (const std::string text : {"", "a", "\xEF\xBB", "\xC3\xB6", "\xEF\xBF\xBD"}) {
    CHECK(utf8::without_mark(text) == text);
    CHECK(utf8::without_mark(mark + text) == text);
    CHECK(utf8::without_mark(mark + mark + text) == mark + text);
    CHECK(utf8::without_mark("a" + mark + text) == "a" + mark + text);
  }
}

TEST_CASE("every scalar value survives append and decode", "[base]") {
  for (char32_t c = 0; c < 0x110000; ++c) {
    if (c >= 0xD800 && c < 0xE000) continue;
    std::string text;
    utf8::append(text, c);
    std::size_t offset = 0;
    if (utf8::find_invalid(text) || utf8::decode(text, offset) != c || offset != text.size()) {
      CAPTURE(static_cast<unsigned>(c));
      FAIL("changed");
    }
  }
}

TEST_CASE("a text ends within a character if bytes of that character are missing at its end", "[base]") {
  const std::string characters[] = {"a", "\x7F", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"};
  for (const std::string& character : characters)
    for (const std::string prefix : {"", "a", "12345678", "\xC3\xB6", "\xE2\x82\xAC", "\xF0\x9F\xA4\x96"})
      for (std::size_t size = 0; size <= character.size(); ++size) {
        CAPTURE(prefix, character, size);
        CHECK(utf8::ends_within_character(prefix + character.substr(0, size)) == (size > 0 && size < character.size()));
      }
  CHECK_FALSE(utf8::ends_within_character(std::string_view("\0", 1)));
}

TEST_CASE("of ill-formed bytes no byte before the text is read", "[base]") {
  const std::string bytes = "\xF0\xBF\xBF\xBF\xBF";
  for (std::size_t size = 0; size <= 3; ++size)  // a view of continuation bytes behind the first byte of a character
    CHECK_FALSE(utf8::ends_within_character(std::string_view(bytes).substr(1, size)));
  CHECK_FALSE(utf8::ends_within_character(bytes));
}

TEST_CASE("a prefix has the most characters that fit into the limit", "[base]") {
  const std::string characters[] = {"a", "\xC3\xB6", "\xE2\x82\xAC", "\xF0\x9F\xA4\x96"};
  for (const std::string& first : characters)
    for (const std::string& second : characters) {
      const std::string text = first + second;
      for (std::size_t limit = 0; limit <= text.size() + 1; ++limit) {
        CAPTURE(text, limit);
        const std::string expected = limit >= text.size() ? text : limit >= first.size() ? first : "";
        CHECK(utf8::prefix(text, limit) == expected);
      }
    }
  CHECK(utf8::prefix("", 0).empty());
  CHECK(utf8::prefix("\x80\x80\x80", 2).empty());
  CHECK(utf8::prefix("\xC3\xC3", 1) == "\xC3");
}
