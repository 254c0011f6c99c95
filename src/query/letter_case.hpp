// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace lrt::query {

/// No character has more than this number of bytes in its other case, for each byte of its own.
inline constexpr std::size_t max_case_growth = 3;

/// The text in upper or lower case: Unicode's full mapping, independent of a language (Unicode Standard 3.13, toUppercase and toLowercase). So
/// "ß" becomes "SS", and a capital sigma at the end of a word "ς". @pre well-formed UTF-8
std::string to_case(std::string_view text, bool upper);

}  // namespace lrt::query
