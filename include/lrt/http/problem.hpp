// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// Problem details (RFC 9457). `type` is about:blank, `title` the reason phrase.
struct Problem {
  int status = 500;
  std::string detail;       ///< what was found and where
  std::string errors = {};  ///< the extension member `errors` as JSON (RFC 9457 3.2); empty: none
};

/// application/problem+json
LRT_API std::string to_json(const Problem& problem);

struct Response;
/// Makes a problem the status and body of a response that no engine has made, with the fields that browsers must see in each response:
/// Content-Type, X-Content-Type-Options, Cross-Origin-Resource-Policy.
LRT_API void set_problem(Response& response, const Problem& problem);

/// Text as a JSON string with its quotes; bytes that are not UTF-8 become U+FFFD.
LRT_API std::string json_string(std::string_view text);

}  // namespace v0
}  // namespace lrt::http
