// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace lrt::shacl {

// The patterns of derived shapes. Messages describe them in words.
inline constexpr std::string_view day_time_pattern = "^[^YM]*(T.*)?$";          ///< a duration without years and months
inline constexpr std::string_view finite_pattern = "^[^NI]*$";                  ///< a number that is not NaN, INF or -INF
inline constexpr std::string_view zone_pattern = "(Z|[+-][0-9]{2}:[0-9]{2})$";  ///< a time with its zone

}  // namespace lrt::shacl
