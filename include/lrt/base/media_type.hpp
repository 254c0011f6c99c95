// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt {
inline namespace v0 {

/// A media type with parameters (RFC 9110 8.3.1): `type "/" subtype *( OWS ";" OWS [ name "=" ( token / quoted-string )
/// ] )`. Type, subtype and parameter names are lower-cased; values are unquoted.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct LRT_API MediaType {
  std::string type;                                             ///< "text"
  std::string subtype;                                          ///< "turtle"
  std::vector<std::pair<std::string, std::string>> parameters;  ///< names and values, in order

  /// Parses a media type.
  /// @par Errors  expected_media_type, with the offset of the first invalid byte
  static Result<MediaType> parse(std::string_view text);

  /// "text/turtle", without parameters.
  std::string essence() const { return type + "/" + subtype; }
  /// The media type with its parameters. Values are quoted where the grammar requires it. parse() of the result returns
  /// an equal MediaType.
  std::string to_string() const;
  /// The value of the first parameter of that name; empty: there is none. The view is valid until the parameters are
  /// changed.
  std::string_view parameter(std::string_view name) const noexcept;
};

}  // namespace v0
}  // namespace lrt
