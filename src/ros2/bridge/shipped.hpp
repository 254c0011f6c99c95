// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace lrt::ros2 {

/// The shipped table as a text, see shipped.cpp. mapping.cpp reads it.
extern const std::string_view shipped_table;

}  // namespace lrt::ros2
