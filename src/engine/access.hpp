// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>

#include "src/base/function_ref.hpp"
#include "src/engine/bases.hpp"
#include "src/engine/callback_rules.hpp"
#include "src/engine/context.hpp"
#include "src/engine/cors.hpp"
#include "src/engine/responses.hpp"
#include "src/engine/subscription_requests.hpp"

namespace lrt::engine {

/// The caller of a request: the one with which its header section was judged (http::Request::judged), else the result of `find`, which gets the request
/// without its body. Calls user code; an exception is an error.
Result<Caller> caller_of(const http::Request& request, FunctionRef<Caller(const http::Request&)> find);
/// A caller for http::Request::judged. All callers with all rights share one object.
/// @param rights_revision  Caller::rights_revision is not greater
std::shared_ptr<const Caller> judged_caller(const Caller& caller, std::uint64_t rights_revision = std::numeric_limits<std::uint64_t>::max());

/// Decides whether a caller may send a request: first by its header section, then, when the resource is known, by the rights at the resource. Each
/// function returns the response that refuses the request; nullopt: it may be sent.
class AccessControl {
 public:
  AccessControl(const EngineOptions& options, const Bases& bases, const Cors& cors, const Responses& responses, const CallbackRules& callback_rules,
                const SubscriptionRequests& subscription_requests)
      : options_(options),
        bases_(bases),
        cors_(cors),
        responses_(responses),
        callback_rules_(callback_rules),
        subscription_requests_(subscription_requests) {}

  /// Refuses a login for reasons other than credentials: a page of another origin, or too many failed logins.
  /// @pre the request is a login, so there are sessions
  std::optional<http::Response> refused_login(const Context& context, const Caller& caller) const;
  /// What no resource allows: the client sends too much, a foreign page has sent this, it is a notification, the credentials do not suffice.
  std::optional<http::Response> denied(const Context& context, const Result<Caller>& caller) const;
  /// A resource that the caller may not see is reported as missing. A caller without any rights gets the same response for all paths. Sets
  /// `context.rights`, and `context.resource` to nullptr if the caller may not see it.
  std::optional<http::Response> refused_right(Context& context, const Caller& caller) const;

 private:
  http::Response too_many_requests(const Context& context, const Caller& caller) const;
  http::Response unauthenticated(const Context& context, const Caller& caller) const;
  http::Response forbidden(const Context& context) const;
  bool may(const Context& context) const;
  bool is_from_foreign_page(const Context& context) const;
  bool is_of_own_origin(const Context& context) const;
  bool may_use_cookie(const Context& context) const;

  const EngineOptions& options_;
  const Bases& bases_;
  const Cors& cors_;
  const Responses& responses_;
  const CallbackRules& callback_rules_;
  const SubscriptionRequests& subscription_requests_;
};

}  // namespace lrt::engine
