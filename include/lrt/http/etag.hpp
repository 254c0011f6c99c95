// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// A strong entity tag with its quotes, computed from the media type and the bytes: it changes exactly when they do.
/// @par Implements  R0.11, RFC 9110 8.8.3
LRT_API std::string entity_tag(std::string_view media_type, std::string_view bytes);

enum class Match : unsigned char { yes, no, malformed };

/// Whether an If-Match or If-None-Match field value (joined) names `tag`, or is `*` (which every existing representation matches).
/// An empty list names no tag (RFC 9110 5.6.1.1, 13.1): an empty If-None-Match excludes nothing, and an empty If-Match is false, so that a
/// client whose tag is missing does not overwrite what it has not seen.
/// @param weak  compare weakly (If-None-Match, RFC 9110 13.1.2) or strongly (If-Match, 13.1.1)
LRT_API Match matches(std::string_view field, std::string_view tag, bool weak) noexcept;

}  // namespace v0
}  // namespace lrt::http
