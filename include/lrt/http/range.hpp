// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// What a Range field requests of a representation (RFC 9110 14.1.2, 14.2).
struct ByteRange {
  enum class Kind : unsigned char {
    whole,  ///< no byte range, a malformed one, or several: the field is ignored
    part,
    unsatisfiable,  ///< 416
  };
  Kind kind = Kind::whole;
  std::size_t first = 0;   ///< of a part
  std::size_t length = 0;  ///< of a part, at least 1
};

/// Reads `bytes=first-last`, `bytes=first-` and `bytes=-suffix` against a representation of `size` bytes.
LRT_API ByteRange parse_range(std::string_view field, std::size_t size) noexcept;

}  // namespace v0
}  // namespace lrt::http
