// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {
inline namespace v0 {

/// Problem details (RFC 9457 3.1). `title` is the reason phrase of the status.
struct Problem {
  int status = 500;         ///< status code of the response
  std::string detail;       ///< a sentence for people: what was found, where, and what was expected
  std::string errors = {};  ///< value of the extension member `errors`, as JSON (RFC 9457 3.2); empty: none
  std::string type = {};    ///< IRI of the problem type; empty: about:blank, the status says it all
};

/// A problem as a document of type application/problem+json.
/// @par Threads  Any.
/// @par Time     Linear in the text. Allocates.
LRT_API std::string to_json(const Problem& problem);

struct Response;
/// Sets status and body of a response that a transport makes without the engine, and the fields that each response to a
/// browser has: Content-Type, X-Content-Type-Options, Cross-Origin-Resource-Policy.
/// @par Threads  Any.
/// @par Time     Linear in the text. Allocates.
LRT_API void set_problem(Response& response, const Problem& problem);

/// A text as a JSON string with its quotes. Bytes that are not UTF-8 become U+FFFD.
/// @par Threads  Any.
/// @par Time     Linear in the text. Allocates.
LRT_API std::string json_string(std::string_view text);

}  // namespace v0
}  // namespace lrt::http
