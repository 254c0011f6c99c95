// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include <lrt/base/language.hpp>

namespace lrt::http {

/// The part of a representation that a Range field requests (RFC 9110 14.1.2, 14.2).
struct ByteRange {
  /// How the request is answered.
  enum class Kind : unsigned char {
    whole,          ///< 200: the field has no byte range, a malformed one, or several, and is ignored
    part,           ///< 206
    unsatisfiable,  ///< 416
  };
  Kind kind = Kind::whole;  ///< how the request is answered
  std::size_t first = 0;    ///< offset of a part, in bytes
  std::size_t length = 0;   ///< size of a part, at least 1 byte
};

/// Parses `bytes=first-last`, `bytes=first-` or `bytes=-suffix` for a representation of `size` bytes. Does not
/// allocate.
/// @par Threads  Any.
/// @par Time     Linear in the field.
/// @par Implements  RFC 9110 14.1.1, 14.1.2, 14.2
ByteRange parse_range(std::string_view field, std::size_t size) noexcept;

}  // namespace lrt::http
