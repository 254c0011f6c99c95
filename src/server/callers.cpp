#include "src/server/callers.hpp"

#include <optional>
#include <utility>

namespace lrt {
namespace {

std::map<std::string, std::shared_ptr<const security::Principal>> shared(const std::map<std::string, security::Principal>& certificates) {
  std::map<std::string, std::shared_ptr<const security::Principal>> all;
  for (const auto& [subject, principal] : certificates) all.emplace(subject, std::make_shared<const security::Principal>(principal));
  return all;
}

}  // namespace

Callers::Callers(const Security& security, const Clock& clock)
    : clock_(clock),
      authenticates_(!security.token_file.empty() || !security.certificates.empty() || security.authenticate || !security.rules.empty() ||
                     !security.policy_file.empty()),
      certificates_(shared(security.certificates)),
      authenticate_(security.authenticate),
      roles_(security.roles),
      anyone_(security.anyone),
      authorize_(security.authorize) {}

Result<std::shared_ptr<Callers>> Callers::create(const Security& security, LogCallback log, const Clock& clock) {
  std::shared_ptr<Callers> callers(new Callers(security, clock));
  if (!callers->authenticates_ && !callers->authorize_) return std::shared_ptr<Callers>();
  if (!security.certificates.empty() && (!security.tls || security.tls->client_ca_file.empty()))
    return unexpected(Errc::invalid_option, "security.certificates: no client can show a certificate without security.tls and its client_ca_file");
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
    bool refused = false;
    caller.principal = principal_of(request, refused);
    caller.view = view_of(caller.principal);
    if (!caller.principal) caller.challenge = challenge_for(request, refused);
    if (refused) caller.access = engine::Access::unauthenticated;
    else if (caller.view->anywhere().empty()) caller.access = caller.principal ? engine::Access::forbidden : engine::Access::unauthenticated;
  }
  if (authorize_ && caller.access == engine::Access::granted) caller.access = authorize_(request);
  return caller;
}

/// Credentials that nobody has are refused, also where clients without credentials may do something.
/// @param refused  set where that is so
std::shared_ptr<const security::Principal> Callers::principal_of(const http::Request& request, bool& refused) {
  using Scheme = security::Credentials::Scheme;
  const security::Credentials credentials = security::credentials_of(request);
  const bool may_be_token = credentials.scheme == Scheme::bearer || (credentials.scheme == Scheme::basic && request.secure);
  if (may_be_token && tokens_) {
    const TimePoint now = clock_.now();
    auto principal = tokens_->content(now)->find(credentials.secret, now.utc);
    if (principal && (credentials.scheme == Scheme::bearer || principal->name == credentials.user)) return principal;
  }
  if (credentials.scheme == Scheme::none && !request.client_certificate.empty()) {
    const auto found = certificates_.find(std::string(request.client_certificate));
    if (found != certificates_.end()) return found->second;
  }
  if (authenticate_)
    if (std::optional<security::Principal> principal = authenticate_(request)) return std::make_shared<const security::Principal>(*std::move(principal));
  refused = credentials.scheme != Scheme::none;
  return nullptr;
}

/// Those who may do the same share a view, and so representations.
Callers::ViewPtr Callers::view_of(const PrincipalPtr& principal) {
  constexpr std::size_t max_views = 10'000;  // a function of the user's may make a principal for each request
  const std::shared_ptr<security::Policy> policy = policy_file_ ? policy_file_->content(clock_.now()) : policy_;
  const std::lock_guard lock(mutex_);
  if (policy != views_are_of_ || views_.size() > max_views) {
    views_.clear();
    views_are_of_ = policy;
  }
  auto& [owner, view] = views_[principal.get()];
  if (!view) {
    owner = principal;  // so that nobody else gets its address
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
  if (owner) {
    const TimePoint now = clock_.now();
    if (tokens_) caller.principal = tokens_->content(now)->find_name(owner->name, now.utc);
    for (const auto& [subject, principal] : certificates_)
      if (!caller.principal && principal->name == owner->name) caller.principal = principal;
    if (!caller.principal && authenticate_) caller.principal = std::make_shared<const security::Principal>(*owner);
    if (!caller.principal) return std::nullopt;
  }
  caller.view = view_of(caller.principal);
  return caller;
}

bool Callers::have_changed(TimePoint now) {
  const auto tokens = tokens_ ? tokens_->content(now) : nullptr;
  const auto policy = policy_file_ ? policy_file_->content(now) : policy_;
  const std::lock_guard lock(mutex_);
  next_look_ = now.steady + security::look_pause;
  const auto expiry = tokens ? tokens->next_expiry(seen_at_) : std::nullopt;
  const bool changed = tokens != seen_tokens_ || policy != seen_policy_ || (expiry && *expiry <= now.utc);
  seen_tokens_ = tokens;
  seen_policy_ = policy;
  seen_at_ = now.utc;
  return changed;
}

std::optional<std::chrono::steady_clock::time_point> Callers::next_look() const {
  if (!tokens_ && !policy_file_) return std::nullopt;
  const std::lock_guard lock(mutex_);
  return next_look_;
}

/// RFC 6750 3, RFC 7617 2
std::string Callers::challenge_for(const http::Request& request, bool refused) {
  std::string challenge = refused ? "Bearer realm=\"lrt\", error=\"invalid_token\"" : "Bearer realm=\"lrt\"";
  if (request.secure) challenge += ", Basic realm=\"lrt\", charset=\"UTF-8\"";
  return challenge;
}

}  // namespace lrt
