// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

namespace lrt::transport {

/// Capacity that a buffer of a connection may keep for the next exchange.
constexpr std::size_t kept_capacity = 8 * 1024;

/// Empties a buffer of a connection. A large one gives its memory back.
inline void release(std::string& buffer) {
  if (buffer.capacity() > kept_capacity) std::string().swap(buffer);
  else buffer.clear();
}

}  // namespace lrt::transport
