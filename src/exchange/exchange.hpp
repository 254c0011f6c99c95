// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

#include "src/exchange/wire.hpp"

namespace lrt::exchange {

/// A request to another host. Views live for the call.
struct Request {
  std::string_view method;
  std::string_view target;            ///< sent as it is
  std::string_view authority;         ///< value of Host
  std::vector<http::Field> fields{};  ///< Host, Connection, Content-Length and Transfer-Encoding among them are left out
  std::string_view body{};
};

/// The status and header section of a response.
struct Header {
  int status = 0;
  http::Fields fields{};  ///< without Content-Encoding and Content-Length if the body is decoded
};

struct Limits {
  std::size_t max_header_bytes = 16 * 1024;
  std::optional<std::size_t> max_body_bytes{};  ///< nullopt: any number, for a stream that the Receiver judges
};

struct Outcome {
  Header header{};             ///< status 0: no complete response was received
  std::string error{};         ///< the reason, if the status is 0
  Errc code = Errc::io_error;  ///< the kind of the reason
  bool silent = false;         ///< the peer closed the connection before the first byte of a response
  bool keep = false;           ///< the connection can be used again
};

/// Callbacks for a response as it is received. Each returns false to end the exchange.
struct Receiver {
  std::function<bool(const Header& header)> header{};  ///< may be empty; called before the first byte of the body
  /// Gets the body without its content codings (ContentDecoder). Empty: the body is dropped as it is, and may have any coding.
  std::function<bool(std::string_view bytes)> body{};
};

/// Sends a request and reads the response (http::ResponseParser). Does not retry or follow redirects, and does not ask for a coding.
///
/// A request with a body and without Content-Type gets text/plain. A response is valid only if it is complete, within the limits and HTTP/1.x, and if
/// its length is stated once. If `limit.idle` is set, it is the longest wait for the next bytes, and `limit.until` bounds the request and the header
/// section only; otherwise it bounds all.
/// @par Threads  distinct wires: any
LRT_INTERNAL_API Outcome exchange(Wire& wire, const Request& request, const Limits& limits, WaitLimit limit, const Receiver& receiver = {});

}  // namespace lrt::exchange
