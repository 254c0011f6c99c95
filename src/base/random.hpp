// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

namespace lrt {

/// Fills memory with random bytes of the operating system. They are read at each call: a buffer of them would be copied by fork(), and the child would
/// have the bytes of its parent.
void fill_random(unsigned char* bytes, std::size_t count);

/// Random bytes in lower-case hex, two digits each.
std::string random_hex(std::size_t bytes);

}  // namespace lrt
