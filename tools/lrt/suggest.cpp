// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/suggest.hpp"

#include <algorithm>
#include <cctype>

#include "tools/lrt/terminal.hpp"

namespace lrt::tool {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// Letters that are added, left out, changed or swapped (optimal string alignment).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> rows(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) rows[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) rows[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = rows[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      rows[i][j] = std::min({rows[i - 1][j] + 1, rows[i][j - 1] + 1, changed});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) rows[i][j] = std::min(rows[i][j], rows[i - 2][j - 2] + 1);
    }
  return rows[a.size()][b.size()];
}

}  // namespace

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr std::size_t longest = 100, most = 5'000;
  if (word.empty() || word.size() > longest || candidates.size() > most) return {};
  const std::string wanted = lower(word);
  // One letter for each three: of two-letter words only the case may differ.
  std::size_t best = std::min<std::size_t>(wanted.size() / 3, 2) + 1;
  std::string found;
  for (const std::string& candidate : candidates) {
    if (candidate == found || candidate.size() > longest) continue;
    const std::size_t d = distance(wanted, lower(candidate));
    if (d > best || (d == best && found.empty() && d > std::min<std::size_t>(wanted.size() / 3, 2))) continue;
    found = d == best ? std::string() : candidate;
    best = d;
  }
  return found;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string name = nearest(word, candidates);
  return name.empty() ? name : "; did you mean \"" + printable(name) + "\"?";
}

}  // namespace lrt::tool
