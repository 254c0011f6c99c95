#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/http/target.hpp>
#include <lrt/http/message.hpp>
#include <lrt/subscription/allowed_hosts.hpp>

namespace lrt::engine {

/// The base IRIs of representations and the hosts that requests may name (SPEC 3.7).
class Bases {
 public:
  /// @param public_base    the only base of requests, "https://robot.example/arm"; empty: each request's Host decides
  /// @param allowed_hosts  as Security::allowed_hosts
  Bases(std::string public_base, std::vector<std::string> allowed_hosts);

  /// Where the server listens. All bases that were known are forgotten.
  void listens_on(std::string_view address, std::uint16_t port, bool secure);

  /// The base of a request.
  /// @par Errors  refused: the host is not one of this server's (421)
  Result<std::size_t> of(const http::Request& request, const http::Target& target);
  /// The number of a base IRI without a slash at the end.
  /// @param served  requests may name it; false for a base that only a restored subscription has
  std::size_t intern(std::string base, bool served);
  const std::string& operator[](std::size_t number) const { return bases_[number]; }
  /// Scheme, host and port of a base.
  std::string_view origin(std::size_t number) const;

  /// The path of an IRI below one of the bases, percent-encoded as it stands; nullopt: it is not below one, or has a query or fragment.
  std::optional<std::string> path_of(std::string_view iri) const;
  /// A callback to this URL would come back to this server.
  bool is_this_server(const subscription::CallbackUrl& url) const;

 private:
  bool accepts(const std::string& host) const;
  /// A name of this machine, or an allowed host.
  bool is_known_name(std::string_view host) const;

  const std::string public_base_;
  const std::vector<std::string> allowed_;
  std::vector<std::string> bases_;  ///< [0]: the public base, or that of the listening address
  std::vector<bool> served_;        ///< of the same index
  std::vector<std::string> hosts_;  ///< accepted ones, in lower case, with the port unless it is the scheme's
  std::uint16_t port_ = 0;
  std::vector<std::uint16_t> guest_ports_;  ///< of hosts' own HTTP servers that have handed requests over
};

}  // namespace lrt::engine
