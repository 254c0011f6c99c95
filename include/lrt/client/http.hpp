// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

namespace lrt::client {
inline namespace v0 {

/// A request for Client::send().
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Request {
  std::string method = "GET";                                 ///< case-sensitive
  std::string url;                                            ///< absolute http or https URL; a fragment is not sent
  std::vector<std::pair<std::string, std::string>> fields{};  ///< Content-Type, Accept, If-Match, ...
  std::string body{};                                         ///< empty: none
  /// How long a command (POST, PUT, PATCH, DELETE) is worth carrying out; 0: it does not expire, as a stop and the
  /// cancelling of an invocation. nullopt: Options::command_life.
  std::optional<std::chrono::milliseconds> life{};
};

/// A complete response.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct LRT_API Response {
  int status = 0;         ///< status code (RFC 9110 15)
  http::Fields fields{};  ///< header fields that have a value; without trailers, and without the codings and the length of a body that was decoded
  std::string body{};     ///< without the chunked coding, gzip and deflate
  std::string url{};      ///< URL of the resource that responded: of the request, or of the last redirect

  bool ok() const noexcept { return status >= 200 && status < 300; }  ///< whether the status is 2xx
  /// Content-Type without parameters, in lower case; empty: there is none.
  std::string media_type() const;
  /// The server's reason for a refusal: `detail`, else `title`, of problem details (RFC 9457), messages of a SHACL
  /// report, or the first line of a text; at most 500 bytes. Otherwise the status and its phrase.
  std::string reason() const;
};

/// A link of a response (RFC 8288), resolved against its URL.
struct Link {
  /// @{
  /// Absolute target, relation type, and media type (may be empty).
  std::string target, relation, type;
  /// @}
};
/// The links of all Link fields, at most `max`. Ill-formed links are left out.
/// @param fields  of the response
/// @param base    URL of the response
/// @param max     limit
/// @par Threads  Any.
/// @par Time     Allocates.
LRT_API std::vector<Link> links(const http::Fields& fields, std::string_view base, std::size_t max = 10'000);

}  // namespace v0
}  // namespace lrt::client
