// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/ids.hpp>

#include "src/base/random.hpp"

namespace lrt {

std::string RandomIds::next() {
  unsigned char bytes[16];
  fill_random(bytes, sizeof bytes);
  bytes[6] = static_cast<unsigned char>((bytes[6] & 0x0FU) | 0x40U);  // version 4
  bytes[8] = static_cast<unsigned char>((bytes[8] & 0x3FU) | 0x80U);  // variant 10
  static constexpr char digits[] = "0123456789abcdef";
  std::string result;
  result.reserve(36);
  for (std::size_t i = 0; i < sizeof bytes; ++i) {
    if (i == 4 || i == 6 || i == 8 || i == 10) result += '-';
    result += digits[bytes[i] >> 4];
    result += digits[bytes[i] & 0x0FU];
  }
  return result;
}

}  // namespace lrt
