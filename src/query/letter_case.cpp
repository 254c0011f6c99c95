// SPDX-License-Identifier: Apache-2.0
#include "src/query/letter_case.hpp"

#include <algorithm>
#include <iterator>

#include "src/base/utf8.hpp"
#include "src/query/letter_case_table.hpp"

namespace lrt::query {
namespace {

constexpr char32_t capital_sigma = 0x3A3, sigma = 0x3C3, final_sigma = 0x3C2;

/// The entry of the character in a sorted table of ranges, or nullptr.
template <class T, std::size_t n>
const T* range_of(const T (&table)[n], char32_t c) noexcept {
  const T* const found = std::lower_bound(table, table + n, c, [](const T& range, char32_t wanted) { return range.last < wanted; });
  return found != table + n && found->first <= c ? found : nullptr;
}

template <std::size_t n>
char32_t mapped(const letter_case::Run (&table)[n], char32_t c) noexcept {
  const letter_case::Run* const run = range_of(table, c);
  if (run == nullptr || (c - run->first) % static_cast<char32_t>(run->step) != 0) return c;
  return static_cast<char32_t>(static_cast<std::int32_t>(c) + run->distance);
}

template <std::size_t n>
bool append_several(const letter_case::Several (&table)[n], char32_t c, std::string& out) {
  const auto* const found = std::lower_bound(table, table + n, c, [](const auto& entry, char32_t wanted) { return entry.from < wanted; });
  if (found == table + n || found->from != c) return false;
  for (const char32_t to : found->to)
    if (to != 0) utf8::append(out, to);
  return true;
}

bool is_ignored(char32_t c) noexcept { return range_of(letter_case::ignored, c) != nullptr; }
bool is_cased(char32_t c) noexcept { return range_of(letter_case::cased, c) != nullptr; }

/// Whether a letter follows, maybe behind characters that are ignored. Each character is looked at once for the sigma before it only.
bool letter_follows(std::string_view text, std::size_t at) noexcept {
  while (at < text.size()) {
    const char32_t c = utf8::decode(text, at);
    if (!is_ignored(c)) return is_cased(c);
  }
  return false;
}

}  // namespace

std::string to_case(std::string_view text, bool upper) {
  std::string out;
  out.reserve(text.size());
  bool follows_letter = false;  // not counting what is ignored
  for (std::size_t at = 0; at < text.size();) {
    const char32_t c = utf8::decode(text, at);
    if (upper) {
      if (!append_several(letter_case::to_upper_several, c, out)) utf8::append(out, mapped(letter_case::to_upper, c));
      continue;
    }
    if (c == capital_sigma) utf8::append(out, follows_letter && !letter_follows(text, at) ? final_sigma : sigma);
    else if (!append_several(letter_case::to_lower_several, c, out)) utf8::append(out, mapped(letter_case::to_lower, c));
    if (!is_ignored(c)) follows_letter = is_cased(c);
  }
  return out;
}

}  // namespace lrt::query
