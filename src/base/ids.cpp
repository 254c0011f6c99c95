#include <lrt/base/ids.hpp>

#include <cstdint>
#include <cstring>
#include <random>

#if defined(__linux__)
#include <sys/random.h>

#include <cerrno>
#endif

namespace lrt {
namespace {

/// Read for every id: a buffer of entropy would be copied by fork(), and the child would produce the ids of its parent.
void fill_random(unsigned char (&bytes)[16]) {
  std::size_t filled = 0;
#if defined(__linux__)
  while (filled < sizeof bytes) {
    const ssize_t got = ::getrandom(bytes + filled, sizeof bytes - filled, 0);
    if (got > 0) filled += static_cast<std::size_t>(got);
    else if (errno != EINTR) break;
  }
#endif
  if (filled == sizeof bytes) return;
  std::random_device device;
  for (std::size_t i = 0; i < sizeof bytes; i += 4) {
    const std::uint32_t word = device();
    std::memcpy(bytes + i, &word, 4);
  }
}

}  // namespace

std::string RandomIds::next() {
  unsigned char bytes[16];
  fill_random(bytes);
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
