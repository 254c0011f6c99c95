// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "src/base/base64.hpp"

namespace lrt::rdf {

/// The bytes of xsd:base64Binary, which may have spaces within. nullopt: it is no base64, or its last digit has bits that no byte has.
inline std::optional<std::string> bytes_of(std::string_view text) {
  std::string out;
  unsigned group = 0, digits = 0, padding = 0;
  for (const char c : text) {
    if (c == ' ' || c == '\t' || c == '\r' || c == '\n') continue;
    if (c == '=') {
      ++padding;
      continue;
    }
    const int digit = lrt::detail::base64_digit(c);
    if (digit < 0 || padding > 0) return std::nullopt;
    group = group << 6 | static_cast<unsigned>(digit);
    if (++digits % 4 != 0) continue;
    for (const unsigned shift : {16U, 8U, 0U}) out += static_cast<char>(group >> shift & 0xFFU);
    group = 0;
  }
  const unsigned rest = digits % 4;
  if (rest == 1 || padding != (4 - rest) % 4 || (rest == 0 && padding != 0)) return std::nullopt;
  if (rest == 2) {
    if ((group & 0xFU) != 0) return std::nullopt;
    out += static_cast<char>(group >> 4 & 0xFFU);
  } else if (rest == 3) {
    if ((group & 0x3U) != 0) return std::nullopt;
    for (const unsigned shift : {10U, 2U}) out += static_cast<char>(group >> shift & 0xFFU);
  }
  return out;
}

/// How many characters so many bytes take.
constexpr std::size_t base64_length(std::size_t bytes) noexcept {
  constexpr std::size_t many = std::numeric_limits<std::size_t>::max() / 8;
  return ((bytes < many ? bytes : many) + 2) / 3 * 4;
}

}  // namespace lrt::rdf
