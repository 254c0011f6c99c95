// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "src/base/ascii.hpp"

namespace lrt::engine {
inline namespace v0 {

// The blank nodes of the user's Turtle stand in several documents, so they get names: `<arm#_b0>` (RDF 1.1 Concepts 3.5, SPEC 3.19). Rights treat them
// as blank nodes: they belong to the triples that lead to them.

inline constexpr std::string_view named_blank_fragment = "#_b";

inline std::string named_blank(std::string_view document, std::size_t number) {
  return std::string(document).append(named_blank_fragment).append(std::to_string(number));
}

inline bool is_named_blank(std::string_view iri) noexcept {
  const std::size_t at = iri.find(named_blank_fragment);
  if (at == std::string_view::npos) return false;
  const std::string_view number = iri.substr(at + named_blank_fragment.size());
  for (const char c : number)
    if (!detail::is_digit(c)) return false;
  return !number.empty();
}

}  // namespace v0
}  // namespace lrt::engine
