// SPDX-License-Identifier: Apache-2.0
#include "src/engine/callback_rules.hpp"

#include <algorithm>

#include <lrt/base/ids.hpp>

#include "src/engine/resources/subscription.hpp"

namespace lrt::engine {

CallbackRules::CallbackRules(const EngineOptions& options, const Bases& bases, const Responses& responses)
    : options_(options),
      bases_(bases),
      responses_(responses),
      allowed_(subscription::AllowedHosts::parse(options.callbacks.allow)),
      instance_(RandomIds().next()) {}

Result<void> CallbackRules::check_options() const {
  if (!allowed_) return Unexpected{allowed_.error()};
  if (options_.callbacks.attempts == 0) return unexpected(Errc::invalid_option, "callbacks.attempts: expected at least 1");
  if (options_.callbacks.secret.size() > max_secret)
    return unexpected(Errc::invalid_option, "callbacks.secret: expected at most " + std::to_string(max_secret) + " bytes");
  return {};
}

bool CallbackRules::may_call(const subscription::CallbackUrl& url) const {
  return allowed_ && allowed_->names(url.host, url.port) && !bases_.is_this_server(url);
}

std::optional<http::Response> CallbackRules::refused_receiver(const Context& context, const std::string& url) const {
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  if (!parsed) return responses_.problem(context, 400, parsed.error().message);
  if (bases_.is_this_server(*parsed))
    return responses_.denied(context, http::Denial::receiver, 403, "callback URL: " + parsed->authority + " is this server itself");
  if (may_call(*parsed)) return std::nullopt;
  return responses_.denied(context, http::Denial::receiver, 403, "callback URL: this server may not call " + parsed->authority);
}

bool CallbackRules::must_confirm(const std::string& url) const {
  using subscription::Confirmation;
  const Confirmation which = options_.callbacks.confirmation;
  if (which != Confirmation::not_loopback) return which == Confirmation::all;
  const Result<subscription::CallbackUrl> parsed = subscription::parse_callback_url(url);
  return !parsed || !loopback_->names(parsed->host, parsed->port);
}

bool CallbackRules::is_refused_notification(const http::Request& request) const {
  const auto field = request.find(notification_field);
  if (!field) return false;
  constexpr std::string_view parameter = "; base=\"";
  const std::size_t at = field->find(parameter);
  if (request.count(notification_field) != 1 || at == std::string_view::npos || field->back() != '"' || field->substr(0, at) == instance_)
    return true;
  std::string_view sender = field->substr(at + parameter.size());
  sender.remove_suffix(1);
  const auto& senders = options_.notification_senders;
  return std::none_of(senders.begin(), senders.end(), [&](const std::string& allowed) { return allowed == "*" || allowed == sender; });
}

}  // namespace lrt::engine
