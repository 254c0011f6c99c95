// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/subscription/allowed_hosts.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/context.hpp"
#include "src/engine/responses.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {

/// The name of a server in its notifications: `<id of the process>; base="<base IRI>"`. A server refuses notifications as commands: a robot
/// that executed them could be moved by any subscriber of another robot, and endlessly by its own notifications.
inline constexpr std::string_view notification_field = "Lrt-Notification-Of";

/// Which receivers web callbacks may reach, which of them confirm, and whose notifications this server executes.
class CallbackRules {
 public:
  CallbackRules(const EngineOptions& options, const Bases& bases, const Responses& responses);

  /// @par Errors  invalid_option: of the options of callbacks
  Result<void> check_options() const;
  /// Some receiver is allowed.
  bool allow_some() const { return allowed_ && !allowed_->empty(); }
  /// This server may post to the URL.
  bool may_call(const subscription::CallbackUrl& url) const;
  /// The response if a receiver is not allowed.
  std::optional<http::Response> refused_receiver(const Context& context, const std::string& url) const;
  /// The receiver gets nothing before it has confirmed the subscription.
  bool must_confirm(const std::string& url) const;

  /// The value of notification_field in the notifications of this server.
  std::string sender(std::size_t base) const { return instance_ + "; base=\"" + bases_[base] + '"'; }
  /// Whether a request is a notification from a sender that is not in the list of those whose notifications are executed.
  bool is_refused_notification(const http::Request& request) const;

 private:
  const EngineOptions& options_;
  const Bases& bases_;
  const Responses& responses_;
  const Result<subscription::AllowedHosts> allowed_;
  const Result<subscription::AllowedHosts> loopback_ = subscription::AllowedHosts::parse({"127.0.0.0/8", "::1"});
  const std::string instance_;
};

}  // namespace lrt::engine
