// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/options.hpp>

#include "src/security/authentication.hpp"
#include "src/security/policy.hpp"
#include "src/security/sessions.hpp"

namespace lrt {

/// Determines the caller of a request and its rights, by the options lrt::Security.
///
/// @par Threads  any
class Callers {
 public:
  /// nullptr: the options do not restrict access.
  /// @par Errors  those of Tokens::load and security::load_rules; invalid_option
  static Result<std::shared_ptr<Callers>> create(const Security& security, std::shared_ptr<security::Sessions> sessions, const LogCallback& log,
                                                 const Clock& clock);

  /// Calls user code.
  engine::Caller of(const http::Request& request);
  /// The current rights of the owner of a subscription; nullopt: the principal no longer exists. nullptr: an anonymous caller.
  std::optional<engine::Caller> renew(const security::Principal* owner);
  /// security::Policy::around() of the present rules; empty: there are none.
  std::optional<std::string> rules_around(std::string_view path) const;
  /// Checks the files for changes. True: the result of renew() may differ from that of the previous call.
  bool have_changed(TimePoint now);
  /// When to call have_changed() again; nullopt: the rights cannot change.
  std::optional<std::chrono::steady_clock::time_point> next_look() const;

 private:
  using PrincipalPtr = std::shared_ptr<const security::Principal>;
  using ViewPtr = std::shared_ptr<const security::View>;
  /// The result of checking the credentials of a request.
  struct Found {
    PrincipalPtr principal{};  ///< nullptr: no principal
    bool refused = false;      ///< the credentials are unknown
    bool by_cookie = false;    ///< engine::Caller::by_cookie
  };

  Callers(const Security& security, std::shared_ptr<security::Sessions> sessions, const Clock& clock);
  Found find(const http::Request& request, TimePoint now);
  std::optional<Found> find_by_session(const http::Request& request, TimePoint now);
  Found authenticate(const http::Request& request, bool refused, TimePoint now);
  bool keep_end(const security::Principal& principal);
  bool has_ended(const security::Principal& principal, TimePoint now) const;
  Found find_by_token(const http::Request& request, const std::string& token, TimePoint now);
  ViewPtr view_of(const PrincipalPtr& principal, TimePoint now);
  ViewPtr make_view(const security::Principal* principal);
  std::string challenge_for(const http::Request& request, bool refused) const;

  const Clock& clock_;
  const bool authenticates_;  ///< false: the authorizer alone decides
  const std::map<std::string, PrincipalPtr> certificates_;
  const security::Authenticate authenticate_;
  const security::Roles roles_;
  const security::Rights anyone_;
  const engine::Authorizer authorize_;
  const std::shared_ptr<security::Sessions> sessions_;  ///< nullptr: there are none
  std::unique_ptr<security::TokenFile> tokens_;
  std::unique_ptr<security::PolicyFile> policy_file_;
  std::shared_ptr<security::Policy> policy_;  ///< of rules without a file; nullptr: none

  mutable std::mutex mutex_;  ///< guards the rest
  std::shared_ptr<security::Policy> views_are_of_;
  std::unordered_map<const security::Principal*, std::pair<PrincipalPtr, ViewPtr>> views_;
  std::map<std::uint8_t, std::weak_ptr<const security::View>> by_rights_;  ///< views without rules
  std::shared_ptr<const security::Tokens> seen_tokens_;
  std::shared_ptr<security::Policy> seen_policy_;
  std::chrono::system_clock::time_point seen_at_{};
  /// When principals of `authenticate_` end, by name; the latest that each came with.
  std::unordered_map<std::string, std::chrono::system_clock::time_point> ends_;
  std::chrono::steady_clock::time_point next_look_{};
};

}  // namespace lrt
