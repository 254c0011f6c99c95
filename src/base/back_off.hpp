// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace lrt {

/// The pause before the next attempt after a number of failures in succession: `first`, twice, four times `first`, and so on, at most `longest`.
/// @param chance  in [0, 1): the pause is multiplied by 0.5 + chance, so that many that lost the same peer do not return at the same time
inline std::chrono::microseconds back_off(unsigned failures, std::chrono::milliseconds first, std::chrono::milliseconds longest,
                                          double chance) noexcept {
  std::chrono::milliseconds pause = first;
  for (unsigned i = 1; i < failures && pause < longest; ++i) pause *= 2;
  const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(std::min(pause, longest));
  return std::chrono::microseconds(static_cast<std::chrono::microseconds::rep>(static_cast<double>(whole.count()) * (0.5 + chance)));
}

}  // namespace lrt
