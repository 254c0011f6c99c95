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

/// Who has logged in: sessions of browsers, and tickets of scripts. Both stand for a bearer token, which whoever finds the caller judges anew at each request,
/// so that they end with it.
///
/// The cookie is named after the port in Host, because browsers send a cookie to all ports of a host: so robots on one machine do not end each other's
/// sessions. Over https it has the prefix `__Host-` (RFC 6265bis 4.1.3), with which no other host can set it.
///
/// @par Threads  any
class Sessions {
 public:
  /// The parameter of a target's query that has a ticket.
  static constexpr std::string_view ticket_parameter = "ticket";

  explicit Sessions(const SessionOptions& options);

  /// Begins a session for a token, and ends that of the request's cookie.
  /// @param secure  the browser came over https
  /// @return  value of Set-Cookie; nullopt: there are too many sessions
  std::optional<std::string> begin(const http::Request& request, std::string_view owner, std::string_view token, bool secure, TimePoint now);
  /// The token of the session that the cookie of a request names. Without a cookie no lock is taken.
  std::optional<std::string> token_of(const http::Request& request, TimePoint now) const;
  /// Ends the session that the cookie of a request names.
  /// @return  value of Set-Cookie that removes the cookie; nullopt: there is none
  std::optional<std::string> end(const http::Request& request);

  /// A ticket for a token; nullopt: there are too many.
  std::optional<std::string> make_ticket(std::string_view owner, std::string_view token, TimePoint now);
  /// The token of a ticket, which ends.
  std::optional<std::string> take_ticket(std::string_view ticket, TimePoint now);
  std::chrono::seconds ticket_life() const noexcept { return ticket_life_; }

  FailedLogins& failed_logins() noexcept { return failed_logins_; }

 private:
  const std::chrono::seconds ticket_life_;
  SealedTokens sessions_, tickets_;
  FailedLogins failed_logins_;
};

}  // namespace lrt::security
