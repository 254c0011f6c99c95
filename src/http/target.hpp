// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::http {

/// The parts of a request target (RFC 9112 3.2), as views of the parsed text:
///
///     origin-form   = absolute-path [ "?" query ]
///     absolute-form = ( "http" / "https" ) "://" authority [ absolute-path ] [ "?" query ]
///     asterisk-form = "*"
///
/// The authority-form belongs to CONNECT, which is refused.
struct Target {
  std::string_view authority;  ///< host and port of an absolute-form; empty for the other forms
  std::string_view path;       ///< "/...", percent-encoded as received; "/" if there is none; "*" for the asterisk-form
  std::string_view query;      ///< without '?'
  bool absolute = false;       ///< the target is an absolute-form
  bool secure = false;         ///< absolute-form with https
};
/// Parses a request target. Does not allocate.
/// @return  nullopt: the target has another form, or an authority that parse_host() refuses
/// @par Threads  Any.
/// @par Time     Linear in the text.
LRT_INTERNAL_API std::optional<Target> split_target(std::string_view target) noexcept;

/// Host and port of a Host field (RFC 9110 7.2) or of an authority (RFC 3986 3.2.2, 3.2.3):
///
///     Host = ( IPv4address / IPv6 literal in brackets / reg-name without ',' ) [ ":" *DIGIT ]
struct HostPort {
  std::string_view host;              ///< `[::1]:80` gives `[::1]`
  std::optional<std::uint16_t> port;  ///< nullopt: none
};
/// Parses host and port. Does not allocate.
/// @return  nullopt: userinfo, a comma, an empty host, an ill-formed IPv6 address, or a port above 65535
/// @par Threads  Any.
/// @par Time     Linear in the text.
std::optional<HostPort> parse_host(std::string_view authority) noexcept;

}  // namespace lrt::http
