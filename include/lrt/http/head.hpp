#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <lrt/http/message.hpp>

namespace lrt::http {

/// Why a head is refused. The transport answers it and closes the connection (RFC 9112 2.2, 3.2, 6.3: what two parsers could read
/// differently is not repaired).
struct Refusal {
  int status;
  std::string reason;  ///< says what was found and where
};

/// Looks at the bytes of a head, request line to empty line, before any parser does: bare CR or LF, NUL and other controls,
/// obs-fold, white space before a colon or around the request line's parts, a lower-case or non-token method, a target with
/// bytes that no RFC 3986 URI has (controls, space, non-ASCII, <>"{}|^`\) or with '#', a version other than HTTP/1.0 and HTTP/1.1 (505).
/// White space around a value is left to whoever parses the fields. Does not allocate unless it refuses.
/// @par Implements  R0.1, RFC 9112 2.2, 3, 5.1, 5.2
std::optional<Refusal> check_raw_head(std::string_view head);

/// Takes apart a head that check_raw_head() passed, with no opinion about it: method, target, version and fields of `request` become views
/// of `head`, the fields in order and without white space around their values. Its framing fields are still among them.
void split_head(std::string_view head, Request& request);

/// Looks at a parsed head: exactly one well-formed Host (HTTP/1.0 may lack it), target form against method, Content-Length and
/// Transfer-Encoding (501 for an unknown coding, alone or before a final chunked), Expect (417), Connection. CONNECT and TRACE are
/// refused (501), and so is an absolute-form whose scheme is not that of the connection (421). To be asked before the fields that
/// frame the body are taken out of the request, with request.secure set. Percent escapes of the target are not judged here.
/// @par Implements  R0.1, RFC 9112 3.2, 6.1, 6.3, RFC 9110 7.2, 7.4, 8.6, 10.1.1
std::optional<Refusal> check_head(const Request& request);

/// How the body of a request that passed check_head() is framed.
struct Framing {
  bool chunked = false;
  std::uint64_t length = 0;       ///< of a body that is not chunked
  bool expects_continue = false;  ///< RFC 9110 10.1.1: the request is HTTP/1.1 and has content
  bool keep_alive = true;         ///< RFC 9112 9.3
};
Framing framing(const Request& request) noexcept;

/// A request target taken apart (RFC 9112 3.2).
struct Target {
  std::string_view authority;  ///< of an absolute-form, else empty
  std::string_view path;       ///< "/..." still percent-encoded, "/" if there is none; "*" for the asterisk-form
  std::string_view query;      ///< without '?'
  bool absolute = false;
  bool secure = false;         ///< absolute-form with https
};
/// nullopt for anything that is none of origin-form, absolute-form with http(s), and asterisk-form.
std::optional<Target> split_target(std::string_view target) noexcept;

/// Host and port of a Host field or authority. `[::1]:80` gives `[::1]`. nullopt for userinfo, a comma, an empty host, an
/// ill-formed IPv6 address, or a port above 65535.
struct HostPort {
  std::string_view host;
  std::optional<std::uint16_t> port;
};
std::optional<HostPort> parse_host(std::string_view authority) noexcept;

}  // namespace lrt::http
