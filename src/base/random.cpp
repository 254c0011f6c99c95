#include "src/base/random.hpp"

#include <cstring>
#include <random>

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

}  // namespace lrt
