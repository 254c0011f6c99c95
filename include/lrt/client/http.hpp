// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

namespace lrt::client {
inline namespace v0 {

/// A request for Client::send().
struct Request {
  std::string method = "GET";
  std::string url;                                            ///< absolute http or https URL; a fragment is not sent
  std::vector<std::pair<std::string, std::string>> fields{};  ///< Content-Type, Accept, If-Match, ...
  std::string body{};
};

/// A complete response.
struct LRT_API Response {
  int status = 0;
  http::Fields fields{};
  std::string body{};
  std::string url{};  ///< of what has responded: the request's, or after redirects another

  bool ok() const noexcept { return status >= 200 && status < 300; }
  /// Content-Type without parameters, in lower case; empty: there is none.
  std::string media_type() const;
  /// Why the server refused: `detail`, else `title`, of problem details (RFC 9457), messages of a SHACL report, or the first line of a text; at
  /// most 500 bytes. Else the status and its phrase.
  std::string reason() const;
};

/// A link of a response (RFC 8288), resolved against its URL.
struct Link {
  std::string target, relation, type;
};
/// The links of all Link fields, of at most `max` links. What is ill-formed is left out.
/// @param base  URL of the response
LRT_API std::vector<Link> links(const http::Fields& fields, std::string_view base, std::size_t max = 10'000);

}  // namespace v0
}  // namespace lrt::client
