// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <lrt/base/abi.hpp>

namespace lrt::rdf::lexical {
inline namespace v0 {

/// XML Schema rounds to the nearest number of a binary type; beyond the largest it gives INF, and below half of the smallest 0. As the value of a
/// term, in a query or a shape, that is right. A value that a client writes to a robot may be rounded to the next double, but must not become
/// infinite, nor 0. @{

/// Whether a number that is finite and not 0 in its text became infinite or 0. @pre value is that of parse_double() or parse_float()
LRT_INTERNAL_API bool is_rounded_away(std::string_view text, double value) noexcept;
/// parse_double(). nullopt also if the number is rounded away.
LRT_INTERNAL_API std::optional<double> representable_double(std::string_view text) noexcept;
/// parse_float(). nullopt also if the number is rounded away.
LRT_INTERNAL_API std::optional<float> representable_float(std::string_view text) noexcept;
/// @}

}  // namespace v0
}  // namespace lrt::rdf::lexical
