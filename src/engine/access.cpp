// SPDX-License-Identifier: Apache-2.0
#include "src/engine/access.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/immortal.hpp>

#include "src/engine/host_calls.hpp"
#include "src/engine/receivers/event_stream.hpp"
#include "src/http/websocket.hpp"
#include "src/security/sessions.hpp"

namespace lrt::engine {

Result<Caller> caller_of(const http::Request& request, FunctionRef<Caller(const http::Request&)> find) {
  if (request.judged) return *static_cast<const Caller*>(request.judged.get());
  if (request.body.empty()) return guarded<Caller>([&]() -> Result<Caller> { return find(request); });
  http::Request header = request;  // whether the body came along with it makes no difference
  header.body = {};
  return guarded<Caller>([&]() -> Result<Caller> { return find(header); });
}

std::shared_ptr<const Caller> judged_caller(const Caller& caller, std::uint64_t rights_revision) {
  static const Immortal<Caller> unrestricted;
  if (!caller.view && !caller.principal && caller.client.empty()) return {std::shared_ptr<const Caller>(), &*unrestricted};
  auto judged = std::make_shared<Caller>(caller);
  judged->rights_revision = std::min(caller.rights_revision, rights_revision);
  return judged;
}

std::optional<http::Response> AccessControl::refused_login(const Context& context, const Caller& caller) const {
  const http::Request& request = context.request();
  if (!is_of_own_origin(context))
    return responses_.denied(context, http::Denial::origin, 403,
                             "only pages of this server may log in: the Origin field is missing or names another origin");
  security::FailedLogins& failed = options_.sessions->failed_logins();
  if (const auto pause = failed.pause(request.peer, context.now.steady)) {
    http::Response response = responses_.denied(
        context, http::Denial::rate, 429, "too many logins from this address have failed; try again in " + std::to_string(pause->count()) + " s");
    response.fields.set("Retry-After", std::to_string(pause->count()));
    return response;
  }
  if (!caller.principal) failed.add(request.peer, context.now.steady);
  return std::nullopt;
}

std::optional<http::Response> AccessControl::denied(const Context& context, const Result<Caller>& caller) const {
  const http::Request& request = context.request();
  if (caller && caller->access == Access::too_many_requests) return too_many_requests(context, *caller);
  if (is_from_foreign_page(context))
    return responses_.denied(
        context, http::Denial::origin, 403,
        "web pages of " + std::string(*request.find("Origin")) + " may not send this request: the origin is not in allowed_origins of this server");
  if (!context.is_safe() && callback_rules_.is_refused_notification(request))
    return responses_.denied(
        context, http::Denial::notification, 403,
        "this request is a notification about another resource. It was not executed, because its sender is not in notification_senders");
  if (!caller) {
    responses_.log(LogLevel::error, "the authorizer: " + caller.error().message);
    return responses_.problem(context, 500, "the authorizer failed");
  }
  if (caller->by_cookie && !may_use_cookie(context))
    return responses_.denied(context, http::Denial::origin, 403,
                             "a session cookie is accepted only from this server's own pages; other clients must send Authorization");
  if (caller->access == Access::unauthenticated) return unauthenticated(context, *caller);
  if (caller->access == Access::forbidden) return forbidden(context);
  return std::nullopt;
}

/// RFC 6585 4
http::Response AccessControl::too_many_requests(const Context& context, const Caller& caller) const {
  http::Response response = responses_.denied(context, http::Denial::rate, 429,
                                              "this client exceeds the rate limit per client; the Retry-After field states when to send again");
  response.fields.set("Retry-After", std::to_string(caller.retry_after.count()));
  return response;
}

http::Response AccessControl::unauthenticated(const Context& context, const Caller& caller) const {
  http::Response response =
      responses_.denied(context, http::Denial::credentials, 401, "credentials are required; the WWW-Authenticate field states which");
  response.fields.set("WWW-Authenticate", caller.challenge.empty() ? options_.challenge : caller.challenge);
  return response;
}

http::Response AccessControl::forbidden(const Context& context) const {
  return responses_.denied(context, http::Denial::right, 403, "these credentials do not allow " + std::string(context.request().method) + " here");
}

std::optional<http::Response> AccessControl::refused_right(Context& context, const Caller& caller) const {
  if (context.resource && context.resource->kind().is(Trait::about_caller))
    return caller.principal ? std::nullopt : std::optional(unauthenticated(context, caller));
  const Audience& audience = context.audience;
  if (!audience.is_restricted()) return std::nullopt;
  context.rights = context.resource ? audience.rights(*context.resource) : security::Rights();
  if (context.resource && may(context)) return std::nullopt;
  if (!context.rights.has(security::Right::read)) {
    const bool hides = std::exchange(context.resource, nullptr) != nullptr;
    if (audience.sees_something()) {
      http::Response response = responses_.no_resource(context);
      if (hides) response.denial = http::Denial::right;
      return response;
    }
  }
  return caller.principal ? forbidden(context) : unauthenticated(context, caller);
}

/// The rights at its resource are enough for the request.
bool AccessControl::may(const Context& context) const {
  const std::string_view method = context.request().method;
  if (!context.is_safe()) return context.rights.has(context.resource->kind().right_to_change);
  const bool reads = context.rights.has(security::Right::read), watches = context.rights.has(security::Right::subscribe);
  if (reads == watches) return reads;
  return method == "GET" && subscription_requests_.requested_protocol(context) ? watches : reads;
}

/// A page of another origin caused this request (RFC 6454 7), and is not allowed to.
bool AccessControl::is_from_foreign_page(const Context& context) const {
  const http::Request& request = context.request();
  const auto origin = request.find("Origin");
  if (!origin) return false;
  if (context.is_safe()) {
    const bool subscribes = (request.can_upgrade && http::requests_upgrade(request, "websocket")) || names_event_stream(request);
    if (!subscribes) return false;
  }
  if (is_of_own_origin(context)) return false;
  if (context.posts_query && request.method == "POST") return request.count("Origin") != 1 || !cors_.may_read(*origin);
  return !cors_.may_command(*origin);
}

/// A page of this server has sent this.
bool AccessControl::is_of_own_origin(const Context& context) const {
  const http::Request& request = context.request();
  return request.count("Origin") == 1 && bases_.is_own_origin(*request.find("Origin"), context.base, request);
}

/// A browser sends the cookie of a session with each request to this host, also for a page on another port. Therefore requests that change something and
/// subscriptions must come from a page of this server. Other requests may also come from a user who opens a page.
bool AccessControl::may_use_cookie(const Context& context) const {
  const http::Request& request = context.request();
  const auto site = request.find("Sec-Fetch-Site");  // Fetch Metadata; of trustworthy URLs only
  const bool is_same = site == "same-origin" && request.count("Sec-Fetch-Site") == 1;
  if (request.find("Origin") && !is_of_own_origin(context)) return false;
  if (!context.is_safe() || request.find("Upgrade") || names_event_stream(request)) return request.find("Origin") ? !site || is_same : is_same;
  if (!site || is_same || site == "none") return true;
  return request.find("Sec-Fetch-Mode") == "navigate" && request.find("Sec-Fetch-Dest") == "document";
}

}  // namespace lrt::engine
