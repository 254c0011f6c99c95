// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/session.hpp"

#include <optional>
#include <string>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/problem.hpp>

#include "src/engine/context.hpp"
#include "src/engine/responses.hpp"
#include "src/security/authentication.hpp"

namespace lrt::engine {
inline namespace v0 {
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

std::string about(const Caller& caller) {
  std::string roles;
  for (const std::string& role : caller.principal->roles) roles += (roles.empty() ? "" : ",") + http::json_string(role);
  return "{\"name\":" + http::json_string(caller.principal->name) + ",\"roles\":[" + roles +
         "],\"session\":" + (caller.by_cookie ? "true" : "false") + "}";
}

}  // namespace

const Variants& CallerResource::variants() const {
  static const Immortal<Variants> none;
  return *none;
}

http::Response SessionResource::respond(const Context& context, const Caller& caller, const Responses& responses) {
  const std::string_view method = context.request().method;
  if (method == "POST") return begin(context, caller, responses);
  if (method == "DELETE") return with_cookie(sessions_.end(context.request()));
  return json(200, about(caller));
}

http::Response SessionResource::begin(const Context& context, const Caller& caller, const Responses& responses) {
  const http::Request& request = context.request();
  const security::Credentials credentials = security::credentials_of(request);
  if (credentials.secret.empty()) return needs_token(context, responses);
  const bool secure = request.find("Origin").value_or(std::string_view()).substr(0, 6) == "https:";
  const auto cookie = sessions_.begin(request, caller.principal->name, credentials.secret, secure, context.now);
  return cookie ? with_cookie(cookie) : full(context, responses);
}

http::Response TicketResource::respond(const Context& context, const Caller& caller, const Responses& responses) {
  const std::string life = "\"expires_in\":" + std::to_string(sessions_.ticket_life().count());
  if (context.request().method != "POST") return json(200, "{" + life + "}");
  const security::Credentials credentials = security::credentials_of(context.request());
  if (credentials.secret.empty()) return needs_token(context, responses);
  const auto ticket = sessions_.make_ticket(caller.principal->name, credentials.secret, context.now);
  if (!ticket) return full(context, responses);
  return json(200, "{\"ticket\":" + http::json_string(*ticket) + "," + life + "}");
}

}  // namespace v0
}  // namespace lrt::engine
