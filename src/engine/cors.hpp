// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>

namespace lrt::engine {

/// Header fields that limit what browsers do with responses. Pages of Security::read_origins may read. Pages of Security::allowed_origins may
/// also send commands. The fields are those of the CORS protocol (WHATWG Fetch 3.3). Credentials of the browser (cookies, client
/// certificates) are never allowed; a page that has a token sends it as Authorization. Other pages cannot embed a response
/// (Cross-Origin-Resource-Policy, Fetch 3.7). If a browser opens a response as a document, no script in it runs.
class Cors {
 public:
  explicit Cors(const EngineOptions& options) : options_(options) {}

  /// Whether the origins are well-formed.
  /// @par Errors  invalid_option
  Result<void> check() const;

  bool may_command(std::string_view origin) const;
  /// Also the origins that may send commands: they need entity tags, and the responses to their commands.
  bool may_read(std::string_view origin) const;

  /// The response to a preflight request of an allowed origin; nullopt: the request is not one. It does not depend on the resource, but for
  /// the endpoint of queries, because a preflight request has no credentials: an authorizer must not be called for it, and it must not reveal
  /// which resources exist.
  /// @param posts_query  POST of the resource is a query, which an origin that may read may send, too
  std::optional<http::Response> preflight(const http::Request& request, bool posts_query = false) const;
  /// Adds the header fields for browsers and caches. A response that has X-Content-Type-Options already has them.
  void add_fields(const http::Request& request, http::Response& response) const;

 private:
  void protect(const http::Request& request, http::Response& response) const;
  /// Some responses have the origin of the request in them.
  bool depends_on_origin() const;

  const EngineOptions& options_;
};

}  // namespace lrt::engine
