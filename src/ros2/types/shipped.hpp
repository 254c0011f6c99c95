// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace lrt::ros2 {

/// The definitions that lrt ships, without comments: each begins with a line "=== TYPE". Behind "=== as Humble has them" are
/// those that differ there.
std::string_view shipped_definitions() noexcept;

}  // namespace lrt::ros2
