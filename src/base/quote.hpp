// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>

namespace lrt {

/// Appends a text in quotation marks, with the escapes that JSON and N-Triples have in common. @pre the text is well-formed UTF-8
LRT_INTERNAL_API void append_quoted(std::string& out, std::string_view text);

/// The same as a JSON string (RFC 8259 7). A byte that is not UTF-8 becomes U+FFFD.
LRT_INTERNAL_API void append_json_string(std::string& out, std::string_view text);
LRT_INTERNAL_API std::string json_string(std::string_view text);

/// A JSON string in printable ASCII, for lines of a log: no byte of a client ends a line or controls a terminal. A byte that is not UTF-8 is written as
/// the character of its number.
void append_ascii_json_string(std::string& out, std::string_view text);

/// What a message shows of a text that lrt did not make: at most `longest` bytes, with " (cut)" if there are more. Control characters and bytes that
/// are not UTF-8 appear as numbers, "\x1b".
constexpr std::size_t longest_shown = 80;
LRT_INTERNAL_API std::string shortened(std::string_view text, std::size_t longest = longest_shown);
/// The same in quotation marks.
LRT_INTERNAL_API std::string quoted(std::string_view text, std::size_t longest = longest_shown);
/// The same in visible ASCII.
std::string quoted_ascii(std::string_view text, std::size_t longest = longest_shown);

/// A text as a quoted-string of HTTP (RFC 9110 5.6.4). @pre it has no control characters but tabs
LRT_INTERNAL_API std::string quoted_string(std::string_view text);

/// A text as a part of a URI: percent-encoded except for unreserved characters (RFC 3986 2.3) and those of `also`.
LRT_INTERNAL_API std::string percent_encoded(std::string_view text, std::string_view also = {});

}  // namespace lrt
