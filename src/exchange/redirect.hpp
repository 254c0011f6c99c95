// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/http/message.hpp>

#include "src/http/url.hpp"

namespace lrt::exchange {

/// What is sent next.
struct Redirect {
  std::string method;
  std::string url;  ///< without a fragment
  http::Url parts;
  bool leaves_origin;  ///< credentials must be left out, also those of requests that follow
};

/// Where a response sends its client (RFC 9110 15.4), for all that lrt sends: 301, 302, 303, 307 and 308 of GET and HEAD; 303 of another method, by GET;
/// 307 and 308 of another method within its origin, because a server must not command another one through its client.
/// @param url    of the request
/// @return       nullopt: it is no redirect, or one that is not followed: the response is the result
/// @par Errors   expected_iri: Location; refused: a command would leave its origin
LRT_INTERNAL_API Result<std::optional<Redirect>> redirect_of(int status, const http::Fields& fields, std::string_view method, const std::string& url);

}  // namespace lrt::exchange
