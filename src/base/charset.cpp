// SPDX-License-Identifier: Apache-2.0
#include "src/base/charset.hpp"

#include <algorithm>
#include <cstddef>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"

namespace lrt::charset {

Result<std::string_view> to_utf8(std::string_view text, std::string_view name, std::string& storage) {
  const auto is = [name](std::string_view a, std::string_view b) { return detail::iequals_ascii(name, a) || detail::iequals_ascii(name, b); };
  if (is("utf-8", "utf8")) return text;
  const bool ascii = is("us-ascii", "ascii");
  if (!ascii && !is("iso-8859-1", "latin1"))
    return unexpected(Errc::unsupported_syntax, "charset: expected one of " + std::string(names) + ", found \"" + std::string(name) + "\"");

  const auto first = std::find_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
  if (first == text.end()) return text;
  const auto at = static_cast<std::size_t>(first - text.begin());
  if (ascii) {
    Error error{Errc::expected_value, "byte " + std::to_string(at) + ": expected a character of us-ascii, found a byte above 0x7F"};
    error.offset = at;
    return unexpected(std::move(error));
  }
  storage.assign(text, 0, at);
  storage.reserve(text.size() + text.size() / 8);
  for (const char c : text.substr(at)) utf8::append(storage, static_cast<unsigned char>(c));  // its 256 characters are the first of Unicode
  return std::string_view(storage);
}

}  // namespace lrt::charset
