// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/language.hpp>

namespace lrt::http {

/// The preferences of a Prefer field that lrt supports (RFC 7240, LDP 7.2). Unknown and malformed ones are ignored. If
/// one is repeated, the first counts.
struct Preferences {
  /// The preference `return`.
  enum class Return : unsigned char {
    unsaid,          ///< not stated
    minimal,         ///< return=minimal
    representation,  ///< return=representation
  };
  Return return_ = Return::unsaid;           ///< `return`
  bool respond_async = false;                ///< `respond-async`
  std::optional<std::chrono::seconds> wait;  ///< `wait`, at most 24 h
  /// @{
  /// IRIs of `return=representation; include="..."` and `omit="..."`.
  std::vector<std::string> include, omit;
  /// @}
};
/// Parses the joined Prefer fields of a request.
/// @param prefer  the joined Prefer fields
/// @par Threads  Any.
/// @par Time     Linear in the field. Allocates.
Preferences parse_prefer(std::string_view prefer);

}  // namespace lrt::http
