// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "src/ros2/graph/guard.hpp"

/// Packets of RTPS, as a stranger makes them.
namespace lrt::test {

using ros2::Prefix;

inline Prefix prefix(std::uint8_t last) {
  Prefix bytes{};
  bytes[0] = 1;
  bytes[1] = 0x10;
  bytes[11] = last;
  return bytes;
}
inline std::string text(const Prefix& bytes) { return std::string(bytes.begin(), bytes.end()); }
inline std::string le16(unsigned value) { return {static_cast<char>(value & 0xff), static_cast<char>(value >> 8)}; }
inline std::string le32(std::uint32_t value) { return le16(value & 0xffff) + le16(value >> 16); }
inline std::string be32(std::uint32_t value) {
  const std::string little = le32(value);
  return {little.rbegin(), little.rend()};
}
inline std::string head(const Prefix& from) { return std::string("RTPS\2\1\1\20", 8) + text(from); }
inline std::string submessage(std::uint8_t id, std::uint8_t flags, const std::string& body) {
  return std::string{static_cast<char>(id), static_cast<char>(flags)} + le16(static_cast<unsigned>(body.size())) + body;
}
inline std::string parameter(unsigned pid, std::string value) {
  value.resize((value.size() + 3) / 4 * 4);
  return le16(pid) + le16(static_cast<unsigned>(value.size())) + value;
}
inline std::string end() { return le16(1) + le16(0); }
inline std::string name(const std::string& value) { return le32(static_cast<std::uint32_t>(value.size() + 1)) + value + '\0'; }
/// A DATA with a payload.
inline std::string data(std::uint32_t writer, std::uint32_t sequence, const std::string& payload) {
  return submessage(0x15, 5, le16(0) + le16(16) + be32(0) + be32(writer) + le32(0) + le32(sequence) + payload);
}

}  // namespace lrt::test
