// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

/// Reading and writing the few messages that the graph itself needs. Their layouts are fixed; all others are of MessageType.
namespace lrt::ros2 {

/// Reads a payload of XCDR1. After the first fault all reads give 0 or "", and ok() is false.
class CdrReader {
 public:
  explicit CdrReader(std::string_view payload) noexcept : bytes_(payload) {
    ok_ = payload.size() >= 4 && payload[0] == 0 && (payload[1] == 0 || payload[1] == 1);
    little_ = ok_ && payload[1] == 1;
    at_ = 4;
  }
  bool ok() const noexcept { return ok_; }
  std::size_t left() const noexcept { return ok_ ? bytes_.size() - at_ : 0; }

  std::uint8_t u8() noexcept { return static_cast<std::uint8_t>(number(1)); }
  bool boolean() noexcept { return u8() != 0; }
  std::uint32_t u32() noexcept { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() noexcept { return number(8); }
  std::int32_t i32() noexcept { return static_cast<std::int32_t>(u32()); }
  std::int64_t i64() noexcept { return static_cast<std::int64_t>(u64()); }
  double f64() noexcept {
    const std::uint64_t bits = u64();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  std::string_view bytes(std::size_t count) noexcept {
    if (!ok_ || count > bytes_.size() - at_) return fail();
    const std::string_view found = bytes_.substr(at_, count);
    at_ += count;
    return found;
  }
  std::string_view text() noexcept {
    const std::uint32_t length = u32();
    if (length == 0) return {};  // some middlewares write an empty text so
    const std::string_view found = bytes(length);
    return found.empty() || found.back() != '\0' ? fail() : found.substr(0, found.size() - 1);
  }
  /// The length of a sequence whose members take at least `least` bytes each.
  std::size_t count(std::size_t least) noexcept {
    const std::uint32_t members = u32();
    if (!ok_ || members > left() / least) {
      fail();
      return 0;
    }
    return members;
  }

 private:
  std::string_view fail() noexcept {
    ok_ = false;
    return {};
  }
  std::uint64_t number(std::size_t size) noexcept {
    const std::size_t begin = 4 + (at_ - 4 + size - 1) / size * size;
    if (!ok_ || begin > bytes_.size() || bytes_.size() - begin < size) {
      fail();
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value |= std::uint64_t{static_cast<unsigned char>(bytes_[begin + i])} << (little_ ? 8 * i : 8 * (size - 1 - i));
    at_ = begin + size;
    return value;
  }

  std::string_view bytes_;
  std::size_t at_ = 4;
  bool ok_ = false, little_ = true;
};

/// Writes a payload of XCDR1, little-endian.
class CdrWriter {
 public:
  CdrWriter() : bytes_("\0\1\0\0", 4) {}
  CdrWriter& u8(std::uint8_t value) { return number(value, 1); }
  CdrWriter& boolean(bool value) { return u8(value ? 1 : 0); }
  CdrWriter& u32(std::uint32_t value) { return number(value, 4); }
  CdrWriter& u64(std::uint64_t value) { return number(value, 8); }
  CdrWriter& i64(std::int64_t value) { return u64(static_cast<std::uint64_t>(value)); }
  CdrWriter& f64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    return u64(bits);
  }
  CdrWriter& bytes(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  CdrWriter& text(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size() + 1)).bytes(value);
    bytes_ += '\0';
    return *this;
  }
  const std::string& payload() const noexcept { return bytes_; }

 private:
  CdrWriter& number(std::uint64_t value, std::size_t size) {
    bytes_.append((size - (bytes_.size() - 4) % size) % size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes_ += static_cast<char>(static_cast<unsigned char>(value >> (8 * i)));
    return *this;
  }
  std::string bytes_;
};

}  // namespace lrt::ros2
