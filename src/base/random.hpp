// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <lrt/base/abi.hpp>

namespace lrt {

/// Fills memory with random bytes of the operating system. They are read at each call: a buffer of them would be copied by fork(), and the child would
/// have the bytes of its parent.
LRT_INTERNAL_API void fill_random(unsigned char* bytes, std::size_t count);

/// Random bytes in lower-case hex, two digits each.
LRT_INTERNAL_API std::string random_hex(std::size_t bytes);

/// A random number in [0, 1).
LRT_INTERNAL_API double random_fraction();

}  // namespace lrt
