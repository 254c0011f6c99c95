// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// Picks among the media types on offer by an Accept field (RFC 9110 12.5.1): the highest q-value wins, the more specific range
/// decides a type's q, among equals the earlier offer wins. A range with parameters matches only offers that have them;
/// charset=utf-8 is taken as true of every offer, and profiles of http://www.w3.org/ns/json-ld# of application/ld+json. A malformed member is skipped; a field that is absent, empty or has no
/// well-formed member accepts everything. nullopt: none is acceptable. Does not allocate.
/// @param accept  the joined Accept fields, or nullopt
/// @par Implements  R1.2
LRT_API std::optional<std::size_t> negotiate(std::optional<std::string_view> accept, const std::vector<std::string_view>& offers);

}  // namespace v0
}  // namespace lrt::http
