// SPDX-License-Identifier: Apache-2.0
#include "src/base/crc32c.hpp"

#include <array>
#include <cstddef>

namespace lrt {
namespace {

constexpr std::size_t width = 8;  // bytes at a time
using Tables = std::array<std::array<std::uint32_t, 256>, width>;

/// The n-th table: of a byte that n bytes follow.
constexpr Tables make_tables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t sum = byte;
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0x82F63B78U : 0U);
    tables[0][byte] = sum;
  }
  for (std::size_t n = 1; n < width; ++n)
    for (std::size_t byte = 0; byte < 256; ++byte) tables[n][byte] = (tables[n - 1][byte] >> 8U) ^ tables[0][tables[n - 1][byte] & 0xFFU];
  return tables;
}
constexpr Tables tables = make_tables();

}  // namespace

std::uint32_t crc32c(std::string_view bytes, std::uint32_t before) noexcept {
  std::uint32_t sum = ~before;
  const auto at = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])); };
  for (; bytes.size() >= width; bytes.remove_prefix(width)) {
    sum ^= at(0) | at(1) << 8U | at(2) << 16U | at(3) << 24U;
    sum = tables[7][sum & 0xFFU] ^ tables[6][(sum >> 8U) & 0xFFU] ^ tables[5][(sum >> 16U) & 0xFFU] ^ tables[4][sum >> 24U] ^ tables[3][at(4)] ^
          tables[2][at(5)] ^ tables[1][at(6)] ^ tables[0][at(7)];
  }
  for (const char c : bytes) sum = (sum >> 8U) ^ tables[0][(sum ^ static_cast<unsigned char>(c)) & 0xFFU];
  return ~sum;
}

}  // namespace lrt
