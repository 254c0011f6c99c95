// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/language.hpp>

namespace lrt::http {

/// Computes a strong entity tag with its quotes, from the media type and the bytes. The tag is a 128-bit hash
/// (MurmurHash3, not cryptographic): equal input gives an equal tag, and different input a different one, but for
/// collisions.
/// @par Threads  Any.
/// @par Time     Linear in the bytes.
/// @par Implements  R0.11, RFC 9110 8.8.3
std::string entity_tag(std::string_view media_type, std::string_view bytes);

/// The result of matches().
enum class Match : unsigned char {
  yes,        ///< the field names the tag
  no,         ///< the field is well-formed and does not name the tag
  malformed,  ///< the field is not valid
};

/// Whether the joined value of If-Match or If-None-Match names `tag`. `*` matches every tag. An empty list names no tag
/// (RFC 9110 5.6.1.1, 13.1): an empty If-None-Match excludes nothing, and an empty If-Match fails, so a client without
/// a tag cannot overwrite a representation that it has not read. Does not allocate.
///
/// @param tag   the present entity tag, with its quotes
/// @param weak  true: weak comparison, for If-None-Match (RFC 9110 13.1.2); false: strong comparison, for If-Match
///              (13.1.1)
/// @par Threads  Any.
/// @par Time     Linear in the field.
/// @par Implements  R0.11, RFC 9110 8.8.3.2
Match matches(std::string_view field, std::string_view tag, bool weak) noexcept;

}  // namespace lrt::http
