#pragma once

#include <cstddef>

namespace lrt {

/// Fills memory with random bytes of the operating system. They are read at each call: a buffer of them would be copied by fork(), and the child would
/// have the bytes of its parent.
void fill_random(unsigned char* bytes, std::size_t count);

}  // namespace lrt
