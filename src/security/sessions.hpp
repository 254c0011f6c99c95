// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/clock.hpp>
#include <lrt/http/message.hpp>
#include <lrt/security.hpp>

#include "src/security/failed_logins.hpp"
#include "src/security/sealed_tokens.hpp"

namespace lrt::security {
inline namespace v0 {

/// The active logins: sessions of browsers, and tickets of scripts. Both stand for a bearer token. The token is checked again at each request,
/// so that they end with the token.
///
/// The cookie is named after the server: the public base, or the port in Host and the path that it is mounted at. Browsers send a cookie to all ports and
/// paths of a host, so robots of one host would end each other's sessions. Over https it has the prefix `__Host-` (RFC 6265bis 4.1.3), with which no other host can set it.
///
/// @par Threads  any
class Sessions {
 public:
  /// The parameter of a target's query that has a ticket.
  static constexpr std::string_view ticket_parameter = "ticket";

  /// @param public_base  Listen::public_base
  Sessions(const SessionOptions& options, std::string_view public_base);

  /// Begins a session for a token, and ends that of the request's cookie.
  /// @param secure  the browser came over https
  /// @return  value of Set-Cookie; nullopt: there are too many sessions
  std::optional<std::string> begin(const http::Request& request, std::string_view owner, std::string_view token, bool secure, TimePoint now);
  /// The token of the session that the cookie of a request names. Without a cookie no lock is taken.
  std::optional<std::string> token_of(const http::Request& request, TimePoint now) const;
  /// Ends the session that the cookie of a request names.
  /// @return  value of Set-Cookie that removes the cookie; nullopt: there is none
  std::optional<std::string> end(const http::Request& request);

  /// Ends all sessions and tickets of an owner.
  void end_all_of(std::string_view owner);

  /// A ticket for a token; nullopt: there are too many.
  std::optional<std::string> make_ticket(std::string_view owner, std::string_view token, TimePoint now);
  /// The token of a ticket, which ends.
  std::optional<std::string> take_ticket(std::string_view ticket, TimePoint now);
  std::chrono::seconds ticket_life() const noexcept { return ticket_life_; }

  FailedLogins& failed_logins() noexcept { return failed_logins_; }

 private:
  struct Cookie {
    std::string name;
    std::string_view value;
    bool secure;
  };
  std::string cookie_name(const http::Request& request, bool secure) const;
  std::optional<Cookie> cookie_of(const http::Request& request) const;

  const std::string server_;  ///< in names of cookies; empty: by each request
  const std::chrono::seconds ticket_life_;
  SealedTokens sessions_, tickets_;
  FailedLogins failed_logins_;
};

}  // namespace v0
}  // namespace lrt::security
