// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::utf8 {

/// Validates a text.
/// @return  offset of the first byte that is not part of well-formed UTF-8 (RFC 3629: no surrogates, no overlong forms,
///          at most U+10FFFF); nullopt: the text is well-formed
/// @par Threads  Any.
/// @par Time     Linear in the text. Does not allocate.
LRT_INTERNAL_API std::optional<std::size_t> find_invalid(std::string_view text) noexcept;

/// Whether the text ends with an incomplete character. @pre the text is well-formed up to that character
/// @par Threads  Any.
/// @par Time     Constant. Does not allocate.
LRT_INTERNAL_API bool ends_within_character(std::string_view text) noexcept;

/// The beginning of a text, of at most `limit` bytes. It does not end within a character. Of bytes that are not well-formed, it may be shorter.
/// @par Threads  Any.
/// @par Time     Constant if the text is well-formed. Does not allocate.
LRT_INTERNAL_API std::string_view prefix(std::string_view text, std::size_t limit) noexcept;

/// The encoded U+FEFF. At the beginning of a text it says that the text is UTF-8 (RFC 3629 6), as some editors and shells write it.
inline constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

/// The text without one byte order mark at its beginning.
/// @par Threads  Any.
/// @par Time     Constant. Does not allocate.
constexpr std::string_view without_mark(std::string_view text) noexcept {
  return text.substr(0, byte_order_mark.size()) == byte_order_mark ? text.substr(byte_order_mark.size()) : text;
}

/// What is wrong with a text that is not well-formed, for a message: that which Windows PowerShell writes with `>` is UTF-16.
constexpr const char* fault_of(std::string_view text) noexcept {
  const std::string_view begin = text.substr(0, 2);
  return begin == "\xFF\xFE" || begin == "\xFE\xFF" ? "expected UTF-8, found UTF-16" : "invalid UTF-8";
}

/// Appends one code point. @pre it is a scalar value
/// @par Threads  Any.
/// @par Time     Constant, but for an allocation of `out`.
LRT_INTERNAL_API void append(std::string& out, char32_t code_point);

/// Reads the code point at `offset` and advances past it. @pre the text is well-formed and offset < size
/// @par Threads  Any.
/// @par Time     Constant. Does not allocate.
LRT_INTERNAL_API char32_t decode(std::string_view text, std::size_t& offset) noexcept;

}  // namespace lrt::utf8
