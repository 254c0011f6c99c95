// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/exactly_one.hpp"

#include <algorithm>
#include <cstddef>

namespace lrt::rdf {
namespace {

constexpr std::size_t max_shown = 20;

std::string joined(const std::vector<std::string>& names, const char* last) {
  if (names.empty()) return "none";
  std::string text = names.front();
  const std::size_t shown = std::min(names.size(), max_shown);
  for (std::size_t i = 1; i < shown; ++i) text += (i + 1 == names.size() ? last : ", ") + names[i];
  return text + (shown < names.size() ? ", ... (cut)" : "");
}

}  // namespace

std::string exactly_one_of(const std::vector<std::string>& names, const std::vector<std::string>& found) {
  return "expected exactly one of " + joined(names, ", ") + "; found " + joined(found, " and ");
}

}  // namespace lrt::rdf
