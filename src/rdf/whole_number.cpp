// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/whole_number.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace lrt::rdf {
inline namespace v0 {
namespace {

constexpr std::size_t max_digits = 20;  // of 2^64 - 1

std::optional<std::string> digits_of(std::optional<double> value) {
  if (!value || !std::isfinite(*value) || std::trunc(*value) != *value || std::fabs(*value) >= 1e20) return std::nullopt;
  char text[max_digits + 2];
  const auto end = std::to_chars(text, text + sizeof text, *value == 0 ? 0.0 : *value, std::chars_format::fixed, 0).ptr;
  return std::string(text, end);
}

/// @pre  lexical::is_double()
std::optional<std::string> exact_digits(std::string_view text) {
  const bool is_negative = text.front() == '-';
  if (is_negative || text.front() == '+') text.remove_prefix(1);
  const std::size_t e = text.find_first_of("eE");
  const std::string_view mantissa = text.substr(0, e);
  const std::size_t first = mantissa.find_first_of("123456789");
  if (first == std::string_view::npos) return mantissa.find('0') == std::string_view::npos ? std::nullopt : std::optional<std::string>("0");
  const std::size_t last = mantissa.find_last_of("123456789");
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  // How many digits stand before the point, from the first that is not 0.
  auto whole = point > first ? static_cast<std::int64_t>(point - first) : -static_cast<std::int64_t>(first - point - 1);
  if (e != std::string_view::npos) {
    constexpr std::int64_t far = std::int64_t{1} << 60;
    const auto exponent = lexical::parse_int64(text.substr(e + 1));
    if (!exponent || *exponent > far || *exponent < -far) return std::nullopt;
    whole += *exponent;
  }
  const bool has_point_between = point > first && point < last;
  const std::size_t digits = last - first + (has_point_between ? 0 : 1);
  if (whole < static_cast<std::int64_t>(digits) || whole > static_cast<std::int64_t>(max_digits)) return std::nullopt;
  std::string result = is_negative ? "-" : "";
  for (const char c : mantissa.substr(first, last - first + 1))
    if (c != '.') result += c;
  return result.append(static_cast<std::size_t>(whole) - digits, '0');
}

}  // namespace

std::optional<std::string> whole_number(std::string_view text, lexical::Datatype datatype) {
  if (!lexical::is_double(text)) return std::nullopt;
  std::optional<std::string> digits = exact_digits(text);  // without it the nearest double might be whole only because it is rounded
  if (digits && datatype == lexical::Datatype::double_) return digits_of(lexical::parse_double(text));
  if (digits && datatype == lexical::Datatype::float_) return digits_of(lexical::parse_float(text));
  return digits;
}

}  // namespace v0
}  // namespace lrt::rdf
