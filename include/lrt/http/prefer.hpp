// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// The preferences of a Prefer field that lrt knows (RFC 7240, LDP 7.2). Unknown and malformed ones are ignored, the first of a
/// repeated one counts.
struct Preferences {
  enum class Return : unsigned char { unsaid, minimal, representation };
  Return return_ = Return::unsaid;
  bool respond_async = false;
  std::optional<std::chrono::seconds> wait;  ///< at most 24 h
  std::vector<std::string> include, omit;    ///< IRIs of `return=representation; include="..."`
};
/// @param prefer  the joined Prefer fields
LRT_API Preferences parse_prefer(std::string_view prefer);

}  // namespace v0
}  // namespace lrt::http
