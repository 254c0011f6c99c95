// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lrt/rdf/lexical.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The digits of a number that is an integer but is not written as one: "5.0", "5e0", "50e-1". They have no "+", no leading zeros and no negative
/// zero. A number of xsd:double or xsd:float has the value of that datatype, every other one is exact; in all of them a fraction counts that rounding
/// would remove. nullopt: the text is no number, or has a fraction, or more than 20 digits, which no C++ type can hold.
///
/// @par Time  Linear in the text, whatever its exponent is.
std::optional<std::string> whole_number(std::string_view text, lexical::Datatype datatype = lexical::Datatype::decimal);

}  // namespace v0
}  // namespace lrt::rdf
