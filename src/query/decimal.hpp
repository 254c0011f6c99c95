// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lrt::query {

/// An exact decimal of at most 100 digits: xsd:decimal, and integers beyond int64. A result that needs more digits is an error, which
/// XPath allows (XPath and XQuery Functions 3.1, 4.2). A quotient has at least 18 digits after the point and is not rounded up.
class Decimal {
 public:
  static constexpr int max_digits = 100;

  /// [+-]?digits with an optional point. nullopt: not such a text, or too many digits.
  static std::optional<Decimal> parse(std::string_view text);
  /// Without an exponent, without zeros that say nothing, integers without a point.
  std::string text() const;
  bool is_zero() const noexcept { return size_ == 0; }

  friend std::optional<Decimal> add(const Decimal& a, const Decimal& b);
  friend std::optional<Decimal> subtract(const Decimal& a, Decimal b) {
    b.negative_ = !b.negative_ && !b.is_zero();
    return add(a, b);
  }
  friend std::optional<Decimal> multiply(const Decimal& a, const Decimal& b);
  /// nullopt also for a division by zero.
  friend std::optional<Decimal> divide(const Decimal& a, const Decimal& b);

  Decimal absolute() const noexcept {
    Decimal d = *this;
    d.negative_ = false;
    return d;
  }
  enum class Rounding : std::uint8_t { floor, ceiling, half_up, to_zero };
  /// To an integer. half_up: halves go up, as ROUND says.
  std::optional<Decimal> rounded(Rounding rounding) const;

 private:
  void trim() noexcept;
  std::uint8_t digit(int place) const noexcept {  // of 10^place
    const int at = place + scale_;
    return at < 0 || at >= size_ ? std::uint8_t{0} : digits_[static_cast<std::size_t>(at)];
  }
  static int compare_magnitudes(const Decimal& a, const Decimal& b) noexcept;

  bool negative_ = false;
  int size_ = 0, scale_ = 0;                     // digits, and how many of them are behind the point
  std::array<std::uint8_t, max_digits> digits_;  // the lowest first
};

}  // namespace lrt::query
