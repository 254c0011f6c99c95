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

/// The reason why a request is refused. The transport sends the status and closes the connection. A request that two
/// parsers could read differently is refused and never repaired (RFC 9112 2.2, 3.2, 6.3).
struct Refusal {
  int status;          ///< 400 to 505
  std::string reason;  ///< what was found and where, in visible ASCII
};

/// How the body of a request is framed, and whether its connection stays open.
struct Framing {
  bool chunked = false;           ///< Transfer-Encoding: chunked
  std::uint64_t length = 0;       ///< size of a body that is not chunked, in bytes
  bool expects_continue = false;  ///< the client waits for 100 (Continue): the request is HTTP/1.1 and has content (RFC 9110 10.1.1)
  bool keep_alive = true;         ///< the connection stays open after the response (RFC 9112 9.3)
};

/// The HTTP version by which a request is served: 10 for "HTTP/1.0"; 11 for "HTTP/1.1" and each later minor version
/// (RFC 9110 6.2). nullopt: another major version, or text that is not an HTTP-version (RFC 9112 2.3).
/// @par Threads  Any.
/// @par Time     Constant.
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
/// Where the RFCs permit a lenient parser (bare CR or LF, other white space), this one refuses. It allocates only for
/// request.fields and for a refusal.
///
/// @param header   the bytes from the request line to the empty line; request.fields and the other views refer to them
/// @param request  the caller sets request.secure before. The function sets method, target, version and fields as views
///                 of `header`. The fields are in order, without white space around their values, and include those
///                 that frame the body. After a refusal their content is unspecified.
/// @param framing  is set
/// @return         nullopt: the request is accepted
/// @par Threads  Any.
/// @par Time     Linear in the header section.
/// @par Implements  R0.1, RFC 9112 2.2, 3, 5, 6
LRT_API std::optional<Refusal> parse_request_header(std::string_view header, Request& request, Framing& framing);

/// As parse_request_header(), for bytes that begin with a header section and may continue after it. One pass.
/// @return  size of the header section; nullopt: it is incomplete, or parse_request_header() would refuse it
/// @par Threads  Any.
/// @par Time     Linear in the header section, of which an incomplete one is read again by the next call.
LRT_API std::optional<std::size_t> parse_leading_header(std::string_view bytes, Request& request, Framing& framing);

/// Checks the meaning of a parsed request: exactly one well-formed Host (HTTP/1.0 may lack it), the form of the target
/// for the method, Content-Length and Transfer-Encoding (501 for an unknown coding, alone or before a final chunked),
/// Expect (417), Connection. CONNECT and TRACE are refused (501). An absolute-form whose scheme is not that of the
/// connection is refused (421). A transport uses it for requests that another HTTP server has parsed. `request.fields`
/// must include those that frame the body. Percent escapes of the target are not checked.
/// @return  nullopt: the request is accepted, and `framing` is set
/// @par Threads  Any.
/// @par Time     Linear in the fields. Allocates only for a refusal.
/// @par Implements  R0.1, RFC 9112 3.2, 6.1, 6.3, RFC 9110 7.2, 7.4, 8.6, 10.1.1
LRT_API std::optional<Refusal> check_request(const Request& request, Framing& framing);

}  // namespace v0
}  // namespace lrt::http
