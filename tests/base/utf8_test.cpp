// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/utf8.hpp>

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
