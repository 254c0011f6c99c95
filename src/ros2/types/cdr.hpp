// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace lrt::ros2 {

/// Bytes before the content of a payload: what encoding it has, and options.
constexpr std::size_t encapsulation_bytes = 4;

/// Whether the content of a payload is plain CDR of XCDR1.
enum class Encapsulation : std::uint8_t { little_endian, big_endian, other };
inline Encapsulation encapsulation_of(std::string_view payload) noexcept {
  if (payload.size() < encapsulation_bytes || payload[0] != 0) return Encapsulation::other;
  return payload[1] == 0 ? Encapsulation::big_endian : payload[1] == 1 ? Encapsulation::little_endian : Encapsulation::other;
}

/// Unsigned integer of so many bytes.
template <std::size_t bytes>
struct UintOf;
template <>
struct UintOf<1> {
  using type = std::uint8_t;
};
template <>
struct UintOf<2> {
  using type = std::uint16_t;
};
template <>
struct UintOf<4> {
  using type = std::uint32_t;
};
template <>
struct UintOf<8> {
  using type = std::uint64_t;
};

/// Reads an integer at any address.
template <class T>
T load(const char* at, bool little) noexcept {
  T value = 0;
  if (little) {
    for (std::size_t i = sizeof(T); i-- > 0;) value = static_cast<T>(value << (sizeof(T) > 1 ? 8 : 0) | static_cast<unsigned char>(at[i]));
  } else {
    for (std::size_t i = 0; i < sizeof(T); ++i) value = static_cast<T>(value << (sizeof(T) > 1 ? 8 : 0) | static_cast<unsigned char>(at[i]));
  }
  return value;
}

/// Reads the content of a payload. Each function returns false if the content is too short, and then leaves it anywhere.
class Cursor {
 public:
  /// @pre encapsulation_of(payload) is not `other`
  Cursor(std::string_view payload, bool little) noexcept
      : begin_(payload.data() + encapsulation_bytes), at_(begin_), end_(payload.data() + payload.size()), little_(little) {}

  bool is_little() const noexcept { return little_; }
  std::size_t left() const noexcept { return static_cast<std::size_t>(end_ - at_); }
  const char* at() const noexcept { return at_; }

  /// @param width  1, 2, 4 or 8
  bool align(std::size_t width) noexcept {
    const std::size_t over = static_cast<std::size_t>(at_ - begin_) & (width - 1);
    return over == 0 || skip(width - over);
  }
  bool skip(std::size_t bytes) noexcept {
    if (bytes > left()) return false;
    at_ += bytes;
    return true;
  }
  template <class T>
  bool read(T& value) noexcept {
    if (!align(sizeof(T)) || sizeof(T) > left()) return false;
    value = load<T>(at_, little_);
    at_ += sizeof(T);
    return true;
  }
  /// The next bytes.
  bool take(std::size_t bytes, std::string_view& taken) noexcept {
    if (bytes > left()) return false;
    taken = {at_, bytes};
    at_ += bytes;
    return true;
  }

 private:
  const char* begin_;
  const char* at_;
  const char* end_;
  bool little_;
};

/// Writes a payload.
class Writer {
 public:
  explicit Writer(bool little) : out_(encapsulation_bytes, '\0'), little_(little) { out_[1] = little ? '\1' : '\0'; }

  void align(std::size_t width) {
    const std::size_t over = (out_.size() - encapsulation_bytes) & (width - 1);
    if (over != 0) out_.append(width - over, '\0');
  }
  template <class T>
  void write(T value) {
    align(sizeof(T));
    write_unaligned(value);
  }
  void bytes(std::string_view b) { out_.append(b); }
  void zeros(std::size_t n) { out_.append(n, '\0'); }
  std::size_t size() const noexcept { return out_.size(); }
  std::string take() { return std::move(out_); }

 private:
  template <class T>
  void write_unaligned(T value) {
    char b[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      b[little_ ? i : sizeof(T) - 1 - i] = static_cast<char>(static_cast<unsigned char>(value));
      if constexpr (sizeof(T) > 1) value = static_cast<T>(value >> 8U);
    }
    out_.append(b, sizeof(T));
  }
  std::string out_;
  bool little_;
};

/// @{
/// Between a float and the double that stands for it, bit for bit: conversions of the processor change NaN that signals.
inline double widened(std::uint32_t bits) noexcept {
  float f = 0;
  double d = 0;
  if ((bits & 0x7F800000U) != 0x7F800000U || (bits & 0x007FFFFFU) == 0) {
    std::memcpy(&f, &bits, sizeof f);
    return static_cast<double>(f);
  }
  const std::uint64_t wide =
      static_cast<std::uint64_t>(bits & 0x80000000U) << 32U | std::uint64_t{0x7FF} << 52U | static_cast<std::uint64_t>(bits & 0x007FFFFFU) << 29U;
  std::memcpy(&d, &wide, sizeof d);
  return d;
}
inline std::uint32_t narrowed(double d) noexcept {
  std::uint64_t wide = 0;
  std::memcpy(&wide, &d, sizeof d);
  const auto sign = static_cast<std::uint32_t>(wide >> 32U) & 0x80000000U;
  std::uint32_t bits = 0;
  if ((wide & 0x7FF0000000000000U) == 0x7FF0000000000000U && (wide & 0x000FFFFFFFFFFFFFU) != 0) {
    bits = static_cast<std::uint32_t>(wide >> 29U) & 0x007FFFFFU;
    return sign | 0x7F800000U | (bits != 0 ? bits : 0x00400000U);
  }
  const float f = static_cast<float>(d);
  std::memcpy(&bits, &f, sizeof bits);
  return bits;
}
/// @}

}  // namespace lrt::ros2
