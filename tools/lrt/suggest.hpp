// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lrt::tool {

/// The candidate that was probably meant: equal but for the case of letters, or with at most two letters added, left out, changed or swapped.
/// Empty: none, or several are as near.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean \"get\"?", or nothing.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace lrt::tool
