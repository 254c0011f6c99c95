// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "src/base/ascii.hpp"

/// What the parsers of requests and responses have in common.
namespace lrt::http::framing {

/// Calls `visit(element)` for each element of a comma-separated list without quoted strings, until it returns false.
template <class Visit>
bool for_each_element(std::string_view list, Visit visit) {
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    const std::string_view element = detail::trim(list.substr(0, comma));
    if (!element.empty() && !visit(element)) return false;
    list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
  }
  return true;
}

inline bool is_token(std::string_view text) noexcept { return !text.empty() && detail::token_end(text, 0) == text.size(); }

/// 1*19DIGIT, which always fits 64 bits; nullopt for anything else.
inline std::optional<std::uint64_t> parse_length(std::string_view text) noexcept {
  if (text.empty() || text.size() > 19) return std::nullopt;
  std::uint64_t result = 0;
  for (const char c : text) {
    if (!detail::is_digit(c)) return std::nullopt;
    result = result * 10 + static_cast<unsigned>(c - '0');
  }
  return result;
}

}  // namespace lrt::http::framing
