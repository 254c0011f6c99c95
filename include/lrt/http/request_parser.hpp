// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

namespace lrt::http {
inline namespace v0 {

/// Why a request is refused. The transport responds with it and closes the connection: what two parsers could read differently is not
/// repaired (RFC 9112 2.2, 3.2, 6.3).
struct Refusal {
  int status;
  std::string reason;  ///< what was found and where; no byte of the client's outside visible ASCII
};

/// How the body of a request is framed, and whether its connection stays open.
struct Framing {
  bool chunked = false;
  std::uint64_t length = 0;       ///< of a body that is not chunked
  bool expects_continue = false;  ///< RFC 9110 10.1.1: the request is HTTP/1.1 and has content
  bool keep_alive = true;         ///< RFC 9112 9.3
};

/// The version by which a request is served: 10 for "HTTP/1.0"; 11 for "HTTP/1.1" and each later minor version, because the highest known
/// one is used for those (RFC 9110 6.2). nullopt: another major version, or no HTTP-version (RFC 9112 2.3).
LRT_API std::optional<int> spoken_version(std::string_view http_version) noexcept;

/// Parses the header section of a request, from the request line to the empty line, and checks it with check_request().
///
///     header         = request-line *( field-line CRLF ) CRLF
///     request-line   = method SP request-target SP HTTP-version CRLF     RFC 9112 3
///     method         = 1*tchar without lower-case letters                RFC 9110 9.1
///     request-target = 1*( any character of RFC 3986 but '#' )           RFC 9112 3.2
///     HTTP-version   = "HTTP/1." DIGIT                                   RFC 9112 2.3; see spoken_version(); another: 505
///     field-line     = field-name ":" OWS field-value OWS                RFC 9112 5, 5.1
///     field-name     = 1*tchar                                           RFC 9110 5.1
///     field-value    = *( HTAB / SP / VCHAR / obs-text )                 RFC 9110 5.5; no obs-fold (RFC 9112 5.2)
///
/// Where the RFCs allow a lenient parser to go on (bare CR or LF, other white space), this one refuses. It allocates nothing but what
/// request.fields and a refusal need.
///
/// @param request  request.secure is set before. Method, target, version and fields become views of `header`, the fields in order, those
///                 that frame the body among them, without white space around their values. After a refusal their content is unspecified.
/// @par Implements  R0.1, RFC 9112 2.2, 3, 5, 6
LRT_API std::optional<Refusal> parse_request_header(std::string_view header, Request& request, Framing& framing);

/// The same for bytes that begin with a header section and may go on behind it, in one pass.
/// @return  its size; nullopt: it is incomplete, or parse_request_header() would refuse it
LRT_API std::optional<std::size_t> parse_leading_header(std::string_view bytes, Request& request, Framing& framing);

/// Checks what the parts of a parsed request mean: exactly one well-formed Host (HTTP/1.0 may lack it), target form against method,
/// Content-Length and Transfer-Encoding (501 for an unknown coding, alone or before a final chunked), Expect (417), Connection. CONNECT
/// and TRACE are refused (501), and so is an absolute-form whose scheme is not that of the connection (421). For requests that another
/// HTTP server has parsed; the fields that frame the body are still among the request's. Percent escapes of the target are not checked.
/// @par Implements  R0.1, RFC 9112 3.2, 6.1, 6.3, RFC 9110 7.2, 7.4, 8.6, 10.1.1
LRT_API std::optional<Refusal> check_request(const Request& request, Framing& framing);

}  // namespace v0
}  // namespace lrt::http
