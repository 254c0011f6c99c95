// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/language.hpp>

namespace lrt::http {

/// Chooses one of the offered media types by an Accept field (RFC 9110 12.5.1).
///
/// - The offer with the highest q-value wins. Among equal ones a type that the field names precedes one that only a range
///   includes ("application/json, text/plain, */*" of axios), "type/*" precedes "*/*", and then the earlier offer wins.
/// - The most specific range that matches an offer determines its q-value.
/// - A range with parameters matches only offers that have these parameters. Two are ignored: charset=utf-8, and of
///   application/ld+json profiles below http://www.w3.org/ns/json-ld#.
/// - A malformed member of the field is skipped. A field that is absent, empty or without a well-formed member accepts
///   everything.
///
/// Does not allocate.
///
/// @param accept  the joined Accept fields; nullopt: there is none
/// @param offers  media types that the server can send, the preferred one first
/// @return        index of an offer; nullopt: none is acceptable (406)
/// @par Threads  Any.
/// @par Time     Linear in the product of field and offers.
/// @par Implements  R1.2
std::optional<std::size_t> negotiate(std::optional<std::string_view> accept, const std::vector<std::string_view>& offers);

/// The language ranges of an Accept-Language field in lower case, that with the highest q-value first (RFC 9110 12.5.4). Among equal ones the
/// earlier is first. "*", ranges with q=0 and malformed members are left out; at most 32 are returned.
/// @param field  the joined fields
/// @par Threads  Any.
std::vector<std::string> accepted_languages(std::string_view field);

}  // namespace lrt::http
