// SPDX-License-Identifier: Apache-2.0
#include "src/security/sessions.hpp"

#include <algorithm>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/http/target.hpp"

namespace lrt::security {
namespace {

constexpr std::string_view attributes = "; Path=/; HttpOnly; SameSite=Strict";
/// Tickets are valid for any path that they are sent to.
constexpr std::string_view any_purpose;

/// A digest of a text, for the name of a cookie.
std::string word_of(std::string_view text) {
  static constexpr char digits[] = "0123456789abcdef";
  const Digest digest = digest_of(text);
  std::string word;
  for (std::size_t i = 0; i < 6; ++i) {
    word += digits[digest[i] >> 4];
    word += digits[digest[i] & 0x0FU];
  }
  return word;
}

/// The value of a cookie (RFC 6265 4.2); nullopt: no cookie or several cookies have that name.
std::optional<std::string_view> value_of(std::string_view cookies, std::string_view name) {
  std::optional<std::string_view> value;
  while (!cookies.empty()) {
    const std::string_view one = cookies.substr(0, cookies.find(';'));
    cookies.remove_prefix(std::min(cookies.size(), one.size() + 1));
    const std::size_t equals = one.find('=');
    if (equals == std::string_view::npos || detail::trim(one.substr(0, equals)) != name) continue;
    if (value) return std::nullopt;
    value = detail::trim(one.substr(equals + 1));
  }
  return value;
}

/// A session is bound to the name of the cookie and the host where it began, so that a cookie for another host is not valid.
std::string purpose_of(const http::Request& request, std::string_view name) {
  std::string purpose(name);
  purpose += ' ';
  for (const char c : request.find("Host").value_or(std::string_view())) purpose += detail::lower(c);
  return purpose;
}

}  // namespace

Sessions::Sessions(const SessionOptions& options, std::string_view public_base)
    : server_(public_base.empty() ? std::string() : word_of(public_base)),
      ticket_life_(options.ticket_life),
      sessions_({options.life, options.max_sessions, options.max_sessions_per_principal}),
      tickets_({options.ticket_life, options.max_tickets, options.max_tickets_per_principal}),
      failed_logins_(options.max_failed_logins) {}

std::string Sessions::cookie_name(const http::Request& request, bool secure) const {
  std::string name = secure ? "__Host-lrt-session" : "lrt-session";
  if (!server_.empty()) return name + "-" + server_;
  const auto host = http::parse_host(request.find("Host").value_or(std::string_view()));
  if (host && host->port) name += "-" + std::to_string(*host->port);
  if (!request.mount.empty()) name += "-" + word_of(request.mount);
  return name;
}

/// The cookie of a session. The https cookie has priority; over TLS it is the only one.
std::optional<Sessions::Cookie> Sessions::cookie_of(const http::Request& request) const {
  const auto field = request.find("Cookie");
  if (!field || request.count("Cookie") != 1) return std::nullopt;
  for (const bool secure : {true, false}) {
    if (!secure && request.secure) continue;
    std::string name = cookie_name(request, secure);
    if (const auto value = value_of(*field, name)) return Cookie{std::move(name), *value, secure};
  }
  return std::nullopt;
}

std::optional<std::string> Sessions::begin(const http::Request& request, std::string_view owner, std::string_view token, bool secure, TimePoint now) {
  (void)end(request);
  const std::string name = cookie_name(request, secure);
  const std::optional<std::string> secret = sessions_.add(owner, purpose_of(request, name), token, now.steady);
  if (!secret) return std::nullopt;
  return (name + "=" + *secret).append(attributes).append(secure ? "; Secure" : "");
}

std::optional<std::string> Sessions::token_of(const http::Request& request, TimePoint now) const {
  const std::optional<Cookie> cookie = cookie_of(request);
  return cookie ? sessions_.find(cookie->value, purpose_of(request, cookie->name), now.steady) : std::nullopt;
}

std::optional<std::string> Sessions::end(const http::Request& request) {
  const std::optional<Cookie> cookie = cookie_of(request);
  if (!cookie) return std::nullopt;
  sessions_.remove(cookie->value, purpose_of(request, cookie->name));
  return (cookie->name + "=; Max-Age=0").append(attributes).append(cookie->secure ? "; Secure" : "");
}

void Sessions::end_all_of(std::string_view owner) {
  sessions_.remove_all_of(owner);
  tickets_.remove_all_of(owner);
}

std::optional<std::string> Sessions::make_ticket(std::string_view owner, std::string_view token, TimePoint now) {
  return tickets_.add(owner, any_purpose, token, now.steady);
}

std::optional<std::string> Sessions::take_ticket(std::string_view ticket, TimePoint now) { return tickets_.take(ticket, any_purpose, now.steady); }

}  // namespace lrt::security
