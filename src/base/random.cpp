// SPDX-License-Identifier: Apache-2.0
#include "src/base/random.hpp"

#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

#if defined(__linux__)
#include <sys/random.h>

#include <cerrno>
#endif

namespace lrt {

void fill_random(unsigned char* bytes, std::size_t count) {
  std::size_t filled = 0;
#if defined(__linux__)
  while (filled < count) {
    const ssize_t got = ::getrandom(bytes + filled, count - filled, 0);
    if (got > 0) filled += static_cast<std::size_t>(got);
    else if (errno != EINTR) break;
  }
#endif
  std::random_device device;
  for (; filled < count; ++filled) bytes[filled] = static_cast<unsigned char>(device());
}

std::string random_hex(std::size_t bytes) {
  static constexpr char digits[] = "0123456789abcdef";
  std::vector<unsigned char> random(bytes);
  fill_random(random.data(), random.size());
  std::string text;
  for (const unsigned char byte : random) text += {digits[byte >> 4], digits[byte & 0x0FU]};
  return text;
}

double random_fraction() {
  unsigned char bytes[4];
  fill_random(bytes, sizeof bytes);
  std::uint32_t number = 0;
  std::memcpy(&number, bytes, sizeof number);
  return number / 4294967296.0;
}

}  // namespace lrt
