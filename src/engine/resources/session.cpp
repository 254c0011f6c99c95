// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/session.hpp"

#include <optional>
#include <string>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/problem.hpp>

#include "src/engine/context.hpp"
#include "src/engine/parts.hpp"
#include "src/security/authentication.hpp"

namespace lrt::engine {
namespace {

http::Response json(int status, std::string text) {
  http::Response response;
  response.status = status;
  response.fields.add("Content-Type", "application/json");
  response.fields.add("Cache-Control", "private, no-store");
  response.set_body(std::move(text));
  return response;
}

http::Response with_cookie(const std::optional<std::string>& cookie) {
  http::Response response;
  response.status = 204;
  response.fields.add("Cache-Control", "private, no-store");
  if (cookie) response.fields.add("Set-Cookie", *cookie);
  return response;
}

http::Response needs_token(const Context& context, const Responses& responses) {
  return responses.problem(context, 400, "expected a token: Authorization: Bearer TOKEN");
}

http::Response full(const Context& context, const Responses& responses) {
  http::Response response = responses.problem(context, 503, "there are as many sessions or tickets as the server allows; try again later");
  responses.add_retry_after(response);
  return response;
}

std::string about(const security::Principal& principal, bool by_cookie) {
  std::string roles;
  for (const std::string& role : principal.roles) roles += (roles.empty() ? "" : ",") + http::json_string(role);
  return "{\"name\":" + http::json_string(principal.name) + ",\"roles\":[" + roles + "],\"session\":" + (by_cookie ? "true" : "false") + "}";
}

}  // namespace

const Variants& CallerResource::variants() const {
  static const Immortal<Variants> none;
  return *none;
}

std::optional<Outcome> SessionResource::get(Context& context, Parts&) { return json(200, about(*context.audience.principal, context.by_cookie)); }

Outcome SessionResource::post(Context& context, Parts& parts) {
  const http::Request& request = context.request();
  const security::Credentials credentials = security::credentials_of(request);
  if (credentials.secret.empty()) return needs_token(context, parts.responses);
  const bool secure = request.find("Origin").value_or(std::string_view()).substr(0, 6) == "https:";
  const auto cookie = sessions_.begin(request, context.audience.principal->name, credentials.secret, secure, context.now);
  return cookie ? with_cookie(cookie) : full(context, parts.responses);
}

Outcome SessionResource::remove(Context& context, Parts&) { return with_cookie(sessions_.end(context.request())); }

std::string TicketResource::lifetime() const { return "\"expires_in\":" + std::to_string(sessions_.ticket_life().count()); }

std::optional<Outcome> TicketResource::get(Context&, Parts&) { return json(200, "{" + lifetime() + "}"); }

Outcome TicketResource::post(Context& context, Parts& parts) {
  const security::Credentials credentials = security::credentials_of(context.request());
  if (credentials.secret.empty()) return needs_token(context, parts.responses);
  const auto ticket = sessions_.make_ticket(context.audience.principal->name, credentials.secret, context.now);
  if (!ticket) return full(context, parts.responses);
  return json(200, "{\"ticket\":" + http::json_string(*ticket) + "," + lifetime() + "}");
}

}  // namespace lrt::engine
