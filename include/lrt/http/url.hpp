// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::http {
inline namespace v0 {

/// The parts of an http or https URL (RFC 9110 4.2).
struct Url {
  bool secure = false;
  std::string host;         ///< lower-case; IPv6 in brackets
  std::uint16_t port = 80;  ///< the scheme's if the URL has none
  std::string authority;    ///< for the Host field: the host, and the port if it is not the scheme's
  std::string target;       ///< path and query, at least "/"

  /// "http://host:8080", the port only if it is not the scheme's: the origin of RFC 6454 6.2.
  std::string origin() const { return (secure ? "https://" : "http://") + authority; }
};

/// Parses a URL.
/// @par Errors  expected_iri: the URL is not absolute, not http(s), or longer than `longest` bytes; it has userinfo, a fragment, a byte that
///              RFC 3986 does not allow, a host that is neither an address nor a host name (percent escapes, empty labels), or an invalid
///              port (0, empty, leading zeros)
LRT_API Result<Url> parse_url(std::string_view url, std::size_t longest = 8 * 1024);

}  // namespace v0
}  // namespace lrt::http
