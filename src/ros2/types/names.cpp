// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/types/names.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "src/base/ascii.hpp"

namespace lrt::ros2 {

namespace {

bool is_identifier(std::string_view s) noexcept {
  if (s.empty() || !(detail::is_alpha(s[0]) || s[0] == '_')) return false;
  for (char c : s)
    if (!detail::is_alpha(c) && !detail::is_digit(c) && c != '_') return false;
  return true;
}

/// Splits "a/b/c" into exactly three identifiers.
bool split_type(std::string_view type, std::string_view separator, std::array<std::string_view, 3>& parts) noexcept {
  const std::size_t first = type.find(separator);
  if (first == std::string_view::npos) return false;
  const std::size_t second = type.find(separator, first + separator.size());
  if (second == std::string_view::npos) return false;
  parts = {type.substr(0, first), type.substr(first + separator.size(), second - first - separator.size()), type.substr(second + separator.size())};
  if (type.size() > 255) return false;
  for (std::string_view p : parts)
    if (!is_identifier(p)) return false;
  return parts[1] == "msg" || parts[1] == "srv" || parts[1] == "action";
}

}  // namespace

bool is_full_name(std::string_view name) noexcept {
  if (name.size() < 2 || name.size() > 255 || name[0] != '/') return false;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t end = std::min(name.find('/', at + 1), name.size());
    if (!is_identifier(name.substr(at + 1, end - at - 1))) return false;
    at = end;
  }
  return true;
}

bool is_type_name(std::string_view type) noexcept {
  std::array<std::string_view, 3> parts;
  return split_type(type, "/", parts);
}

std::string dds_type_of(std::string_view ros_type) {
  std::array<std::string_view, 3> parts;
  if (!split_type(ros_type, "/", parts)) return {};
  return std::string(parts[0]).append("::").append(parts[1]).append("::dds_::").append(parts[2]).append("_");
}

std::string ros_type_of(std::string_view dds_type) {
  constexpr std::string_view middle = "::dds_::";
  const std::size_t at = dds_type.find(middle);
  if (at == std::string_view::npos || dds_type.back() != '_') return {};
  const std::string_view name = dds_type.substr(at + middle.size(), dds_type.size() - at - middle.size() - 1);
  const std::string_view folder = dds_type.substr(0, at);
  const std::size_t colons = folder.find("::");
  if (colons == std::string_view::npos) return {};
  std::string made(folder.substr(0, colons));
  made.append("/").append(folder.substr(colons + 2)).append("/").append(name);
  return is_type_name(made) ? made : std::string();
}

std::string record_name_of(std::string_view ros_type) {
  std::array<std::string_view, 3> parts;
  if (!split_type(ros_type, "/", parts)) return {};
  return std::string(parts[0]).append(".").append(parts[2]);
}

bool fits(std::string_view pattern, std::string_view name) noexcept {
  constexpr std::size_t none = std::string_view::npos;
  // The last '*' and the last '**' that were met, and how much of the name each has taken so far.
  std::size_t p = 0, n = 0, star = none, star_n = 0, stars = none, stars_n = 0;
  for (;;) {
    if (p < pattern.size() && pattern[p] == '*') {
      if (p + 1 < pattern.size() && pattern[p + 1] == '*') {
        p += 2;
        stars = p, stars_n = n, star = none;
      } else {
        p += 1;
        star = p, star_n = n;
      }
      continue;
    }
    if (p == pattern.size() && n == name.size()) return true;
    if (p < pattern.size() && n < name.size() && pattern[p] == name[n]) {
      ++p, ++n;
      continue;
    }
    if (star != none && star_n < name.size() && name[star_n] != '/' && name[star_n] != ':') {
      p = star, n = ++star_n;
      continue;
    }
    if (stars != none && stars_n < name.size()) {
      p = stars, n = ++stars_n, star = none;
      continue;
    }
    return false;
  }
}

}  // namespace lrt::ros2
