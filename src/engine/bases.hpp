// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>

#include "src/http/target.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {
inline namespace v0 {

/// The base IRIs of representations and the hosts that requests may name (SPEC 3.7).
class Bases {
 public:
  /// @param public_base    the only base of requests, "https://robot.example/cell7", without a slash at the end; empty: each request's Host
  ///                       decides
  /// @param allowed_hosts  as Security::allowed_hosts
  /// @param max_forwarded  as RequestRules::max_forwarded_bases
  Bases(std::string public_base, std::vector<std::string> allowed_hosts, std::size_t max_forwarded = RequestRules().max_forwarded_bases);

  /// Whether the public base and the allowed hosts are well-formed.
  /// @par Errors  invalid_option
  Result<void> check() const;

  /// Sets the listening address and forgets all known bases.
  /// @param name  the host name that has given the numeric address; empty: none
  void listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name = {}, Upgrades upgrades = {});

  /// The base of a request.
  /// @par Errors  refused: the host is not one of this server's (421)
  Result<std::size_t> of(const http::Request& request, const http::Target& target);
  /// The number of a base IRI without a slash at the end.
  /// @param served  requests may name it; false for a base that only a restored subscription has
  std::size_t intern(std::string base, bool served);
  /// The number of the base of a saved subscription. One that names a forwarded port counts among those; if there is no room, it is the listening
  /// address.
  std::size_t restore(std::string base);
  const std::string& operator[](std::size_t number) const { return bases_[number]; }
  /// Keeps the number of a forwarded base for as long as the result or a copy of it exists; nullptr for all other bases, which nothing replaces.
  std::shared_ptr<const void> hold(std::size_t number) const;
  /// The numbers that stand for another base since the last call. What was made for them must be forgotten.
  std::vector<std::size_t> take_replaced();
  /// The kinds of Upgrade that a request of this base can have.
  Upgrades upgrades(std::string_view base) const;
  /// Scheme, host and port of a base.
  std::string_view origin(std::size_t number) const;
  /// Whether a field Origin (RFC 6454 7) names this server: the origin of the request's base or, with a public base, of the name in Host.
  bool is_own_origin(std::string_view origin, std::size_t base, const http::Request& request) const;
  /// The path of the public base, "/cell7"; empty: it has none, or there is no public base. A proxy may keep it in targets.
  std::string_view public_path() const noexcept { return public_path_; }

  /// The path of an IRI below one of the bases, percent-encoded as it stands; nullopt: it is not below one, or has a query or fragment.
  std::optional<std::string> path_of(std::string_view iri) const;
  /// Whether a callback to this URL would reach this server itself.
  bool is_this_server(const subscription::CallbackUrl& url) const;

 private:
  /// A base with a name of this machine and a port that is not the server's: somebody forwards that port (`ssh -L`).
  struct Forwarded {
    std::size_t number;
    std::uint64_t last_use;
    bool is_guest;                      ///< of a host's own HTTP server
    std::shared_ptr<const void> token;  ///< each hold() has a copy
  };

  /// A request names this machine, and a port that neither the server nor its proxy has.
  bool is_forwarded(std::string_view authority, const http::Request& request) const;
  std::size_t intern_forwarded(std::string base, bool is_guest);
  /// A request may name this authority: one of the listening port, or one of the public base, or of a host's own server.
  bool is_served(std::string_view authority, const http::Request& request) const;
  bool accepts(const std::string& host) const;
  /// Whether the authority is a name of a proxy.
  bool accepts_from_proxy(std::string_view authority) const;
  /// A name of this machine, or an allowed host.
  bool is_known_name(std::string_view host) const;
  /// A path of the public base's without its own path; nullopt: it is not below it.
  std::optional<std::string_view> below_public_path(std::string_view path) const;

  const std::string public_base_;
  const std::vector<std::string> allowed_;
  const std::size_t max_forwarded_;
  bool public_secure_ = false;
  std::string public_path_;
  std::vector<std::string> bases_;         ///< [0]: the public base, or that of the listening address
  std::vector<bool> served_;               ///< of the same index
  std::vector<std::string> hosts_;         ///< accepted ones, in lower case, with the port unless it is the scheme's
  std::vector<std::string> public_hosts_;  ///< the public base's and allowed ones, with the port unless it is that of its scheme
  std::uint16_t port_ = 0;
  Upgrades upgrades_;                       ///< of the transport
  std::vector<Forwarded> forwarded_;        ///< at most max_forwarded_
  std::vector<std::size_t> replaced_;       ///< for take_replaced()
  std::uint64_t uses_ = 0;                  ///< of forwarded bases
  std::vector<std::uint16_t> guest_ports_;  ///< of hosts' own HTTP servers that have handed requests over
};

}  // namespace v0
}  // namespace lrt::engine
