// SPDX-License-Identifier: Apache-2.0
#include "src/http/url.hpp"

#include <optional>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/http/host.hpp"
#include "src/http/target.hpp"

namespace lrt::http {

using lrt::detail::is;

Result<Url> parse_url(std::string_view url, std::size_t longest) {
  const auto refuse = [](std::string what, std::optional<std::size_t> offset = std::nullopt) {
    return unexpected(Error{Errc::expected_iri, std::move(what), offset});
  };
  if (url.size() > longest) return refuse("expected a URL of at most " + std::to_string(longest) + " bytes, found " + std::to_string(url.size()));
  for (std::size_t at = 0; at < url.size(); ++at) {
    if (url[at] == '#') return refuse("expected no fragment", at);
    const bool escape = url[at] == '%';
    if (!is(url[at], lrt::detail::uri) ||
        (escape && (url.size() - at < 3 || !is(url[at + 1], lrt::detail::hex) || !is(url[at + 2], lrt::detail::hex)))) {
      return refuse("found a byte that is not allowed in a URL, at byte " + std::to_string(at), at);
    }
  }
  const std::optional<Target> parts = split_target(url);
  if (!parts || !parts->absolute) return refuse("expected an absolute http or https URL with a host and without userinfo");
  const std::optional<HostPort> authority = parse_host(parts->authority);
  if (!authority) return refuse("expected a host, optionally with a port");  // split_target() has checked it

  Url result;
  result.secure = parts->secure;
  result.host = lrt::detail::lower(authority->host);
  if (!literal_address(result.host) && !is_host_name(result.host)) {
    return refuse("expected a host name or an address, found \"" + result.host + "\"");
  }
  const std::uint16_t usual = result.secure ? 443 : 80;
  result.port = usual;
  if (const std::string_view rest = parts->authority.substr(authority->host.size()); !rest.empty()) {
    const std::optional<std::uint16_t> port = parse_port(rest.substr(1));
    if (!port) return refuse("expected a port from 1 to 65535, without leading zeros, after the colon");
    result.port = *port;
  }
  result.authority = result.host;
  if (result.port != usual) result.authority += ":" + std::to_string(result.port);
  result.target = parts->path;
  // A URL with an empty query differs from one without a query. split_target() does not distinguish them.
  if (const std::size_t mark = url.find('?'); mark != std::string_view::npos) result.target += url.substr(mark);
  return result;
}

}  // namespace lrt::http
