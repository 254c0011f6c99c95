// SPDX-License-Identifier: Apache-2.0
#include "src/query/letter_case.hpp"

#include <string>
#include <utility>

#include "src/base/utf8.hpp"
#include "tests/support/catch.hpp"

using lrt::query::to_case;

TEST_CASE("the case of a text is that of Unicode, also where one letter becomes several", "[query]") {
  const std::pair<const char*, const char*> upper[] = {
      {"", ""},     {"straße", "STRASSE"},       {"ẞ", "ẞ"},       {"ﬁn", "FIN"}, {"ﬃ", "FFI"},   {"ŉ", "ʼN"},
      {"ǰ", "J̌"},   {"ΐ", "\u0399\u0308\u0301"}, {"և", "ԵՒ"},      {"ᾳ", "ΑΙ"},   {"ᾼ", "ΑΙ"},    {"ς", "Σ"},
      {"ı", "I"},   {"i\u0307", "I\u0307"},      {"ÿ", "Ÿ"},       {"µ", "Μ"},    {"ǆ ǅ", "Ǆ Ǆ"}, {"ä ж 1\n", "Ä Ж 1\n"},
      {"ꭰ", "Ꭰ"}, {"𐐨 🤖", "𐐀 🤖"},  {"日本", "日本"},
  };
  for (const auto& [text, wanted] : upper) CHECK(to_case(text, true) == wanted);
  const std::pair<const char*, const char*> lower[] = {
      {"", ""},
      {"STRASSE", "strasse"},
      {"ẞ", "ß"},
      {"İ", "i̇"},
      {"ÄΩЖ A", "äωж a"},
      {"Σ", "σ"},
      {"ΑΣ", "ας"},
      {"ΑΣΑ", "ασα"},
      {"ΣΑΣ ΣΑΣ", "σας σας"},
      {"ΑΣ.", "ας."},
      {"Α'Σ", "α'ς"},
      {"ΑΣ'Α", "ασ'α"},
      {"Α1Σ", "α1σ"},
      {"Α ΣΣ", "α σς"},
      {"Á́Σ́", "á́ς́"},
      {"Ǆ ǅ", "ǆ ǆ"},
      {"K Å", "k å"},
      {"ᾼ", "ᾳ"},
      {"Ꭰ", "ꭰ"},
      {"𐐀 🤖", "𐐨 🤖"},
  };
  for (const auto& [text, wanted] : lower) CHECK(to_case(text, false) == wanted);
}

TEST_CASE("no character grows by more than was counted for it", "[query]") {
  for (const bool is_upper : {true, false})
    for (char32_t c = 0; c < 0x30000; ++c) {
      if (c >= 0xD800 && c < 0xE000) continue;
      std::string text;
      lrt::utf8::append(text, c);
      if (to_case(text, is_upper).size() > lrt::query::max_case_growth * text.size()) FAIL("U+" << std::hex << static_cast<unsigned>(c));
    }
}
