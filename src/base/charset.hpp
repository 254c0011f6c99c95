// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

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

}  // namespace lrt::charset
