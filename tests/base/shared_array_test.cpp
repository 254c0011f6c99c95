// SPDX-License-Identifier: Apache-2.0
#include "src/base/shared_array.hpp"

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"

namespace {
using Array = lrt::detail::SharedArray<std::uint32_t, 2>;  // blocks of 4, 256 to a branch

std::vector<std::uint32_t> all(const Array& array) {
  std::vector<std::uint32_t> values;
  for (std::uint32_t i = 0; i < array.size(); ++i) values.push_back(array[i]);
  return values;
}
}  // namespace

TEST_CASE("copies of a shared array keep their content", "[base]") {
  std::mt19937 random(7);
  std::vector<std::pair<Array, std::vector<std::uint32_t>>> versions;
  versions.emplace_back();
  for (int i = 0; i < 400; ++i) {
    const auto& from = versions[random() % versions.size()];
    std::pair<Array, std::vector<std::uint32_t>> next(from.first, from.second);
    for (auto n = random() % 40; n > 0; --n) {
      const auto value = static_cast<std::uint32_t>(random());
      if (next.second.empty() || random() % 2) {
        next.first.push_back(value);
        next.second.push_back(value);
      } else {
        const auto at = static_cast<std::uint32_t>(random() % next.second.size());
        next.first.edit(at) = value;
        next.second[at] = value;
      }
    }
    versions.emplace_back(next);
  }
  for (const auto& [array, expected] : versions) REQUIRE(all(array) == expected);
  for (int i = 0; i < 400; ++i) {
    const auto &a = versions[random() % versions.size()], &b = versions[random() % versions.size()];
    std::vector<bool> visited(std::max(a.second.size(), b.second.size()));
    Array::for_each_difference(a.first, b.first, [&](std::uint32_t from, std::uint32_t end) {
      REQUIRE(end <= visited.size());
      for (; from < end; ++from) visited[from] = true;
    });
    for (std::size_t at = 0; at < visited.size(); ++at) {
      const bool differs = at >= a.second.size() || at >= b.second.size() || a.second[at] != b.second[at];
      REQUIRE((!differs || visited[at]));
    }
  }
}
