// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::http {

/// The parts of an http or https URL (RFC 9110 4.2).
struct Url {
  bool secure = false;      ///< the scheme is https
  std::string host;         ///< lower-case; IPv6 in brackets
  std::uint16_t port = 80;  ///< port of the URL, or else the default port of the scheme
  std::string authority;    ///< for the Host field: the host, and the port unless it is the scheme's default
  std::string target;       ///< path and query, at least "/"

  /// The origin (RFC 6454 6.2), "http://host:8080"; the port only if it is not the scheme's default.
  std::string origin() const { return (secure ? "https://" : "http://") + authority; }
};

/// Parses an absolute http or https URL.
/// @param longest  limit of the URL's size, in bytes
/// @par Errors   expected_iri: the URL is not absolute, not http(s), or longer than `longest`; it has userinfo, a
///               fragment, a byte that RFC 3986 does not allow, a host that is neither an address nor a host name
///               (percent escapes, empty labels), or an invalid port (0, empty, leading zeros)
/// @par Threads  Any.
/// @par Time     Linear in the text, of which at most `longest` bytes are read. Allocates.
/// @par Implements  RFC 3986 3, RFC 9110 4.2
LRT_INTERNAL_API Result<Url> parse_url(std::string_view url, std::size_t longest = 8 * 1024);

}  // namespace lrt::http
