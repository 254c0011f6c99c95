// SPDX-License-Identifier: Apache-2.0
#include "src/server/callers.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "src/engine/context.hpp"
#include "src/engine/receivers/event_stream.hpp"
#include "src/http/form.hpp"
#include "src/http/websocket.hpp"

namespace lrt {
namespace {

std::map<std::string, std::shared_ptr<const security::Principal>> shared(const std::map<std::string, security::Principal>& certificates) {
  std::map<std::string, std::shared_ptr<const security::Principal>> all;
  for (const auto& [subject, principal] : certificates) {
    auto known = std::make_shared<security::Principal>(principal);
    known->known_by = security::KnownBy::certificate;
    all.emplace(subject, std::move(known));
  }
  return all;
}

}  // namespace

Callers::Callers(const Security& security, std::shared_ptr<security::Sessions> sessions, const Clock& clock)
    : clock_(clock),
      authenticates_(!security.token_file.empty() || !security.certificates.empty() || security.authenticate || !security.rules.empty() ||
                     !security.policy_file.empty()),
      certificates_(shared(security.certificates)),
      authenticate_(security.authenticate),
      roles_(security.roles),
      anyone_(security.anyone),
      authorize_(security.authorize),
      sessions_(std::move(sessions)) {}

Result<std::shared_ptr<Callers>> Callers::create(const Security& security, std::shared_ptr<security::Sessions> sessions, const LogCallback& log,
                                                 const Clock& clock) {
  std::shared_ptr<Callers> callers(new Callers(security, std::move(sessions), clock));
  if (!callers->authenticates_ && !callers->authorize_) return std::shared_ptr<Callers>();
  if (!security.certificates.empty() && (!security.tls || security.tls->client_ca_file.empty()))
    return unexpected(Errc::invalid_option,
                      "security.certificates: clients cannot present a certificate without security.tls and its client_ca_file");
  const auto is_between = [](std::chrono::seconds value, std::chrono::seconds least, std::chrono::seconds most) {
    return value >= least && value <= most;
  };
  if (const auto life = security.sessions.life; !is_between(life, std::chrono::seconds(0), std::chrono::hours(24 * 365)))
    return unexpected(Errc::invalid_option, "security.sessions.life: expected 0 s to 365 days, found " + std::to_string(life.count()) + " s");
  if (const auto life = security.sessions.ticket_life; !is_between(life, std::chrono::seconds(1), std::chrono::hours(1)))
    return unexpected(Errc::invalid_option, "security.sessions.ticket_life: expected 1 s to 1 h, found " + std::to_string(life.count()) + " s");
  if (!security.token_file.empty()) {
    auto tokens = security::open_tokens(security.token_file, log);
    if (!tokens) return Unexpected{std::move(tokens).error()};
    callers->tokens_ = *std::move(tokens);
  }
  if (!security.policy_file.empty()) {
    auto policy = security::open_policy(security.policy_file, security.rules, log);
    if (!policy) return Unexpected{std::move(policy).error()};
    callers->policy_file_ = *std::move(policy);
  } else if (!security.rules.empty()) {
    auto policy = security::Policy::create(security.rules);
    if (!policy) return Unexpected{std::move(policy).error()};
    callers->policy_ = *std::move(policy);
  }
  return callers;
}

engine::Caller Callers::of(const http::Request& request) {
  engine::Caller caller;
  if (authenticates_) {
    const TimePoint now = clock_.now();
    Found found = find(request, now);
    caller.principal = std::move(found.principal);
    caller.by_cookie = found.by_cookie;
    caller.view = view_of(caller.principal, now);
    if (!caller.principal) caller.challenge = challenge_for(request, found.refused);
    // A user who has lost all rights may log in with another token.
    if (found.refused) caller.access = engine::Access::unauthenticated;
    else if (caller.view->anywhere().empty())
      caller.access = caller.principal && !found.by_cookie ? engine::Access::forbidden : engine::Access::unauthenticated;
  }
  if (authorize_ && caller.access == engine::Access::granted) caller.access = authorize_(request);
  return caller;
}

/// Unknown credentials are refused, also where clients without credentials have rights.
Callers::Found Callers::find(const http::Request& request, TimePoint now) {
  using Scheme = security::Credentials::Scheme;
  const security::Credentials credentials = security::credentials_of(request);
  const bool may_be_token = credentials.scheme == Scheme::bearer || (credentials.scheme == Scheme::basic && request.secure);
  if (may_be_token && tokens_) {
    auto principal = tokens_->content(now)->find(credentials.secret, now.utc);
    if (principal && (credentials.scheme == Scheme::bearer || principal->name == credentials.user)) return {std::move(principal)};
  }
  if (credentials.scheme == Scheme::none) {
    if (auto found = find_by_session(request, now)) return *std::move(found);
    if (!request.client_certificate.empty()) {
      const auto found = certificates_.find(std::string(request.client_certificate));
      if (found != certificates_.end()) return {found->second};
    }
  }
  return authenticate(request, credentials.scheme != Scheme::none, now);
}

/// By the function of the host.
Callers::Found Callers::authenticate(const http::Request& request, bool refused, TimePoint now) {
  std::optional<security::Principal> principal = authenticate_ ? authenticate_(request) : std::nullopt;
  if (!principal) return {nullptr, refused};
  principal->known_by = security::KnownBy::function;
  if (principal->expires && *principal->expires <= now.utc) return {nullptr, true};
  if (!keep_end(*principal)) return {nullptr, true};
  return {std::make_shared<const security::Principal>(*std::move(principal))};
}

/// False: there are too many, until one of them ends.
bool Callers::keep_end(const security::Principal& principal) {
  constexpr std::size_t max_ends = 10'000;
  if (!principal.expires) return true;
  const std::lock_guard lock(mutex_);
  if (ends_.size() >= max_ends && ends_.count(principal.name) == 0) return false;
  auto& end = ends_[principal.name];
  end = std::max(end, *principal.expires);
  return true;
}

/// It was authenticated for a time, and none of its name was for a longer one.
bool Callers::has_ended(const security::Principal& principal, TimePoint now) const {
  if (!principal.expires || *principal.expires > now.utc) return false;
  const std::lock_guard lock(mutex_);
  const auto found = ends_.find(principal.name);
  return found == ends_.end() || found->second <= now.utc;
}

/// By a ticket or a cookie; nullopt: the request has neither, or an expired cookie.
std::optional<Callers::Found> Callers::find_by_session(const http::Request& request, TimePoint now) {
  if (!sessions_) return std::nullopt;
  if (const auto ticket = http::query_parameter(request.target, security::Sessions::ticket_parameter)) {
    const bool watches =
        request.method == "GET" && ((request.can_upgrade && http::requests_upgrade(request, "websocket")) || engine::names_event_stream(request));
    const auto token = watches ? sessions_->take_ticket(*ticket, now) : std::nullopt;
    return token ? find_by_token(request, *token, now) : Found{nullptr, true};
  }
  const auto token = sessions_->token_of(request, now);
  if (!token) return std::nullopt;
  Found found = find_by_token(request, *token, now);
  found.by_cookie = true;
  if (found.principal) return found;
  (void)sessions_->end(request);
  return std::nullopt;
}

/// Equivalent to a request with that token.
Callers::Found Callers::find_by_token(const http::Request& request, const std::string& token, TimePoint now) {
  const std::string value = "Bearer " + token;
  http::Request with_token = request;
  with_token.fields.push_back({"Authorization", value});
  return find(with_token, now);
}

/// Callers with the same rights share a view, and therefore representations.
Callers::ViewPtr Callers::view_of(const PrincipalPtr& principal, TimePoint now) {
  constexpr std::size_t max_views = 10'000;  // a user function may create a principal for each request
  const std::shared_ptr<security::Policy> policy = policy_file_ ? policy_file_->content(now) : policy_;
  const std::lock_guard lock(mutex_);
  if (policy != views_are_of_ || views_.size() > max_views) {
    views_.clear();
    views_are_of_ = policy;
  }
  auto& [owner, view] = views_[principal.get()];
  if (!view) {
    owner = principal;  // so that its address is not reused
    view = make_view(principal.get());
  }
  return view;
}

Callers::ViewPtr Callers::make_view(const security::Principal* principal) {
  if (views_are_of_) return views_are_of_->view(principal);
  security::Rights rights = principal ? security::Rights() : anyone_;
  if (principal)
    for (const std::string& role : principal->roles)
      if (const auto found = roles_.find(role); found != roles_.end()) rights = rights | found->second;
  std::weak_ptr<const security::View>& known = by_rights_[rights.bits()];
  ViewPtr view = known.lock();
  if (!view) known = view = std::make_shared<const security::View>(rights);
  return view;
}

std::optional<engine::Caller> Callers::renew(const security::Principal* owner) {
  engine::Caller caller;
  if (!authenticates_) return caller;
  const TimePoint now = clock_.now();
  if (owner) {
    using security::KnownBy;
    const auto may_be = [&](KnownBy known_by) { return !caller.principal && (owner->known_by == known_by || owner->known_by == KnownBy::host); };
    if (tokens_ && may_be(KnownBy::token)) caller.principal = tokens_->content(now)->find_name(owner->name, now.utc);
    for (const auto& [subject, principal] : certificates_)
      if (may_be(KnownBy::certificate) && principal->name == owner->name) caller.principal = principal;
    if (authenticate_ && may_be(KnownBy::function) && !has_ended(*owner, now) && keep_end(*owner))
      caller.principal = std::make_shared<const security::Principal>(*owner);
    if (!caller.principal) return std::nullopt;
  }
  caller.view = view_of(caller.principal, now);
  return caller;
}

std::optional<std::string> Callers::rules_around(std::string_view path) const {
  const auto policy = policy_file_ ? policy_file_->content(clock_.now()) : policy_;
  return policy ? policy->around(path) : std::string();
}

bool Callers::have_changed(TimePoint now) {
  const auto tokens = tokens_ ? tokens_->content(now) : nullptr;
  const auto policy = policy_file_ ? policy_file_->content(now) : policy_;
  const std::lock_guard lock(mutex_);
  next_look_ = now.steady + security::look_pause;
  const auto expiry = tokens ? tokens->next_expiry(seen_at_) : std::nullopt;
  bool changed = tokens != seen_tokens_ || policy != seen_policy_ || (expiry && *expiry <= now.utc);
  for (auto end = ends_.begin(); end != ends_.end();) {
    if (end->second > now.utc) ++end;
    else changed = true, end = ends_.erase(end);
  }
  seen_tokens_ = tokens;
  seen_policy_ = policy;
  seen_at_ = now.utc;
  return changed;
}

std::optional<std::chrono::steady_clock::time_point> Callers::next_look() const {
  const std::lock_guard lock(mutex_);
  if (!tokens_ && !policy_file_ && ends_.empty()) return std::nullopt;
  return next_look_;
}

/// RFC 6750 3, RFC 7617 2. A browser that is offered Basic shows a dialog of its own in place of the page where a user logs in.
std::string Callers::challenge_for(const http::Request& request, bool refused) const {
  std::string challenge = refused ? "Bearer realm=\"lrt\", error=\"invalid_token\"" : "Bearer realm=\"lrt\"";
  const bool logs_in = sessions_ && request.find("Sec-Fetch-Mode");
  if (request.secure && !logs_in) challenge += ", Basic realm=\"lrt\", charset=\"UTF-8\"";
  return challenge;
}

}  // namespace lrt
