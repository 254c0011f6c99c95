// SPDX-License-Identifier: Apache-2.0
#include "src/http/range.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include <lrt/http/message.hpp>

namespace lrt::http {
namespace {

/// Digits as a number, the largest one when they are too many; nullopt if they are no digits.
std::optional<std::size_t> number(std::string_view digits) noexcept {
  constexpr std::size_t most = std::numeric_limits<std::size_t>::max();
  if (digits.empty()) return std::nullopt;
  std::size_t value = 0;
  for (const char c : digits) {
    if (c < '0' || c > '9') return std::nullopt;
    value = value > (most - 9) / 10 ? most : value * 10 + static_cast<std::size_t>(c - '0');
  }
  return value;
}

}  // namespace

ByteRange parse_range(std::string_view field, std::size_t size) noexcept {
  constexpr std::string_view unit = "bytes=";
  if (field.size() < unit.size() || !iequals(field.substr(0, unit.size()), unit)) return {};
  field.remove_prefix(unit.size());
  const std::size_t dash = field.find('-');
  if (dash == std::string_view::npos) return {};
  const std::string_view from = field.substr(0, dash), to = field.substr(dash + 1);
  if (from.empty()) {
    const auto suffix = number(to);
    if (!suffix) return {};
    if (*suffix == 0 || size == 0) return {ByteRange::Kind::unsatisfiable};
    const std::size_t length = std::min(*suffix, size);
    return {ByteRange::Kind::part, size - length, length};
  }
  const auto first = number(from);
  const auto last = to.empty() ? std::optional<std::size_t>(std::numeric_limits<std::size_t>::max()) : number(to);
  if (!first || !last || *last < *first) return {};
  if (*first >= size) return {ByteRange::Kind::unsatisfiable};
  return {ByteRange::Kind::part, *first, std::min(*last, size - 1) - *first + 1};
}

}  // namespace lrt::http
