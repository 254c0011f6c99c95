// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

/// The character encodings of texts that lrt reads. Private to the library.
namespace lrt::charset {

/// The encodings that to_utf8() accepts, for messages.
inline constexpr std::string_view names = "utf-8, us-ascii, iso-8859-1";

/// A text in UTF-8. The case of the name does not matter. Besides the preferred names of IANA these are accepted: "utf8", "ascii" and "latin1".
/// "windows-1252" is not: it differs from iso-8859-1 in 27 bytes that are letters and quotes to one reader and control characters to the other.
/// @param name     the value of a parameter `charset`
/// @param storage  holds the result if that is not `text` itself
/// @return         `text`, or a view of `storage`; well-formedness of utf-8 is not checked
/// @par Errors     unsupported_syntax: an encoding that is not supported; expected_value: a byte that us-ascii does not have, with its offset
Result<std::string_view> to_utf8(std::string_view text, std::string_view name, std::string& storage);

/// The Content-Type of a body: of `text/*` with characters beyond ASCII in UTF-8 it says so, because many readers take ISO-8859-1 otherwise
/// (RFC 2616 3.7.1, which they still follow), and the registration of text/turtle requires it. Other media types fix their encoding.
/// @return  the media type, maybe with "; charset=utf-8"; a parameter `charset` that it has stays
LRT_INTERNAL_API std::string content_type(std::string_view media_type, std::string_view body);

}  // namespace lrt::charset
