// SPDX-License-Identifier: Apache-2.0
#include "src/query/decimal.hpp"

#include <algorithm>

namespace lrt::query {
namespace {

constexpr int places_of_quotient = 18;

}  // namespace

std::optional<Decimal> Decimal::parse(std::string_view text) {
  Decimal d;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    d.negative_ = text.front() == '-';
    text.remove_prefix(1);
  }
  const std::size_t point = std::min(text.find('.'), text.size());
  std::string_view whole = text.substr(0, point), fraction = point < text.size() ? text.substr(point + 1) : std::string_view();
  if (whole.empty() && fraction.empty()) return std::nullopt;
  while (!whole.empty() && whole.front() == '0') whole.remove_prefix(1);
  while (!fraction.empty() && fraction.back() == '0') fraction.remove_suffix(1);
  if (whole.size() + fraction.size() > max_digits) return std::nullopt;
  for (std::size_t i = fraction.size() + whole.size(); i-- > 0;) {
    const char c = i < whole.size() ? whole[i] : fraction[i - whole.size()];
    if (c < '0' || c > '9') return std::nullopt;
    d.digits_[static_cast<std::size_t>(d.size_++)] = static_cast<std::uint8_t>(c - '0');
  }
  d.scale_ = static_cast<int>(fraction.size());
  d.trim();
  return d;
}

std::string Decimal::text() const {
  if (is_zero()) return "0";
  std::string out = negative_ ? "-" : "";
  for (int place = std::max(size_ - scale_ - 1, 0); place >= -scale_; --place) {
    if (place == -1) out += '.';
    out += static_cast<char>('0' + digit(place));
  }
  return out;
}

/// Removes leading zeros, and zeros at the end of the fraction.
void Decimal::trim() noexcept {
  while (size_ > 0 && digits_[static_cast<std::size_t>(size_ - 1)] == 0) --size_;
  int zeros = 0;
  while (zeros < scale_ && zeros < size_ && digits_[static_cast<std::size_t>(zeros)] == 0) ++zeros;
  if (zeros > 0) std::copy(digits_.begin() + zeros, digits_.begin() + size_, digits_.begin());
  size_ -= zeros;
  scale_ -= zeros;
  if (size_ == 0) negative_ = false, scale_ = 0;
}

int Decimal::compare_magnitudes(const Decimal& a, const Decimal& b) noexcept {
  for (int place = std::max(a.size_ - a.scale_, b.size_ - b.scale_) - 1; place >= -std::max(a.scale_, b.scale_); --place) {
    if (a.digit(place) != b.digit(place)) return a.digit(place) < b.digit(place) ? -1 : 1;
  }
  return 0;
}

std::optional<Decimal> add(const Decimal& a, const Decimal& b) {
  const int scale = std::max(a.scale_, b.scale_), top = std::max(a.size_ - a.scale_, b.size_ - b.scale_);
  if (scale + top + 1 > Decimal::max_digits) return std::nullopt;
  Decimal sum;
  sum.scale_ = scale;
  const bool same = a.negative_ == b.negative_;
  const bool swapped = !same && Decimal::compare_magnitudes(a, b) < 0;
  const Decimal &high = swapped ? b : a, &low = swapped ? a : b;
  sum.negative_ = high.negative_;
  int carry = 0;
  for (int place = -scale; place <= top; ++place) {
    int digit = high.digit(place) + (same ? low.digit(place) : -low.digit(place)) + carry;
    carry = digit > 9 ? 1 : digit < 0 ? -1 : 0;
    digit -= carry * 10;
    sum.digits_[static_cast<std::size_t>(sum.size_++)] = static_cast<std::uint8_t>(digit);
  }
  sum.trim();
  return sum;
}

std::optional<Decimal> multiply(const Decimal& a, const Decimal& b) {
  Decimal product;
  if (a.is_zero() || b.is_zero()) return product;
  std::array<std::uint32_t, 2 * Decimal::max_digits> digits{};
  for (int i = 0; i < a.size_; ++i) {
    for (int j = 0; j < b.size_; ++j)
      digits[static_cast<std::size_t>(i) + static_cast<std::size_t>(j)] +=
          static_cast<std::uint32_t>(a.digits_[static_cast<std::size_t>(i)]) * b.digits_[static_cast<std::size_t>(j)];
  }
  int size = a.size_ + b.size_;
  std::uint32_t carry = 0;
  for (int i = 0; i < size; ++i) {
    std::uint32_t& digit = digits[static_cast<std::size_t>(i)];
    digit += carry;
    carry = digit / 10;
    digit %= 10;
  }
  while (size > 0 && digits[static_cast<std::size_t>(size - 1)] == 0) --size;
  int scale = a.scale_ + b.scale_, zeros = 0;
  while (zeros < scale && digits[static_cast<std::size_t>(zeros)] == 0) ++zeros;
  scale -= zeros;
  if (size - zeros > Decimal::max_digits) return std::nullopt;
  for (int i = zeros; i < size; ++i)
    product.digits_[static_cast<std::size_t>(product.size_++)] = static_cast<std::uint8_t>(digits[static_cast<std::size_t>(i)]);
  product.scale_ = scale;
  product.negative_ = a.negative_ != b.negative_;
  product.trim();
  return product;
}

/// Long division, digit by digit.
std::optional<Decimal> divide(const Decimal& a, const Decimal& b) {
  if (b.is_zero()) return std::nullopt;
  Decimal quotient;
  if (a.is_zero()) return quotient;
  // Divides the digits of a by those of b, with `places` digits of the quotient after the point.
  const int places = std::max(places_of_quotient, a.scale_ - b.scale_);
  const int zeros = places - a.scale_ + b.scale_;
  if (a.size_ + zeros > 2 * Decimal::max_digits) return std::nullopt;
  std::array<std::uint8_t, Decimal::max_digits + 1> rest{};  // the lowest first
  int rest_size = 0;
  std::array<std::uint8_t, 2 * Decimal::max_digits> out{};
  int out_size = 0;
  for (int i = a.size_ - 1; i >= -zeros; --i) {
    // rest = rest * 10 + the next digit; it is less than 10 * b
    std::copy_backward(rest.begin(), rest.begin() + rest_size, rest.begin() + rest_size + 1);
    rest[0] = i >= 0 ? a.digits_[static_cast<std::size_t>(i)] : std::uint8_t{0};
    ++rest_size;
    while (rest_size > 0 && rest[static_cast<std::size_t>(rest_size - 1)] == 0) --rest_size;
    std::uint8_t digit = 0;
    for (;;) {
      bool less = rest_size < b.size_;
      if (rest_size == b.size_) {
        for (int k = rest_size - 1; k >= 0; --k) {
          const std::uint8_t x = rest[static_cast<std::size_t>(k)], y = b.digits_[static_cast<std::size_t>(k)];
          if (x != y) {
            less = x < y;
            break;
          }
        }
      }
      if (less) break;
      int borrow = 0;
      for (int k = 0; k < rest_size; ++k) {
        int d = rest[static_cast<std::size_t>(k)] - (k < b.size_ ? b.digits_[static_cast<std::size_t>(k)] : 0) - borrow;
        borrow = d < 0 ? 1 : 0;
        rest[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(d + borrow * 10);
      }
      while (rest_size > 0 && rest[static_cast<std::size_t>(rest_size - 1)] == 0) --rest_size;
      ++digit;
    }
    if (digit != 0 || out_size != 0) out[static_cast<std::size_t>(out_size++)] = digit;  // the highest first
  }
  int scale = places;
  while (scale > 0 && out_size > 0 && out[static_cast<std::size_t>(out_size - 1)] == 0) --out_size, --scale;
  if (out_size > Decimal::max_digits) return std::nullopt;
  for (int i = out_size; i-- > 0;) quotient.digits_[static_cast<std::size_t>(quotient.size_++)] = out[static_cast<std::size_t>(i)];
  quotient.scale_ = scale;
  if (quotient.scale_ > Decimal::max_digits) return std::nullopt;
  quotient.negative_ = a.negative_ != b.negative_;
  quotient.trim();
  return quotient;
}

std::optional<Decimal> Decimal::rounded(Rounding rounding) const {
  if (scale_ == 0) return *this;
  Decimal whole = *this;
  const int cut = std::min(scale_, size_);
  std::copy(whole.digits_.begin() + cut, whole.digits_.begin() + whole.size_, whole.digits_.begin());
  whole.size_ -= cut;
  whole.scale_ = 0;
  whole.trim();
  // The fraction is not 0, as trim() has removed its zeros.
  const std::uint8_t tenth = digit(-1);
  bool half = tenth == 5;
  for (int place = -2; half && place >= -scale_; --place) half = digit(place) == 0;
  bool away = false;  // from zero
  switch (rounding) {
    case Rounding::floor: away = negative_; break;
    case Rounding::ceiling: away = !negative_; break;
    case Rounding::half_up: away = tenth > 5 || (tenth == 5 && (!negative_ || !half)); break;
    case Rounding::to_zero: break;
  }
  if (!away) return whole;
  Decimal one;
  one.size_ = 1;
  one.digits_[0] = 1;
  one.negative_ = negative_;
  return add(whole, one);
}

}  // namespace lrt::query
