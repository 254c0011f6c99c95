// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace lrt::transport {

/// The time until `due`, rounded up, so that a wait does not end just before it.
inline std::chrono::milliseconds until(std::chrono::steady_clock::time_point due, std::chrono::steady_clock::time_point now) {
  return due <= now ? std::chrono::milliseconds(0) : std::chrono::ceil<std::chrono::milliseconds>(due - now);
}

}  // namespace lrt::transport
