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
      authenticates_(!security.token_file.empty() || !security.certificates.empty() || security.authenticate),
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
  if (security.token_file.empty()) return callers;
  auto tokens = security::TokenFile::open(security.token_file, std::move(log));
  if (!tokens) return Unexpected{std::move(tokens).error()};
  callers->tokens_ = *std::move(tokens);
  return callers;
}

engine::Caller Callers::of(const http::Request& request) {
  engine::Caller caller;
  if (authenticates_) {
    bool refused = false;
    caller.principal = principal_of(request, refused);
    caller.rights = caller.principal ? rights_of(*caller.principal) : anyone_;
    if (!caller.principal) caller.challenge = challenge_for(request, refused);
    if (refused) caller.access = engine::Access::unauthenticated;
    else if (caller.rights.empty()) caller.access = caller.principal ? engine::Access::forbidden : engine::Access::unauthenticated;
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
    auto principal = tokens_->tokens(now)->find(credentials.secret, now.utc);
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

security::Rights Callers::rights_of(const security::Principal& principal) const {
  security::Rights rights;
  for (const std::string& role : principal.roles)
    if (const auto found = roles_.find(role); found != roles_.end()) rights = rights | found->second;
  return rights;
}

/// RFC 6750 3, RFC 7617 2
std::string Callers::challenge_for(const http::Request& request, bool refused) {
  std::string challenge = refused ? "Bearer realm=\"lrt\", error=\"invalid_token\"" : "Bearer realm=\"lrt\"";
  if (request.secure) challenge += ", Basic realm=\"lrt\", charset=\"UTF-8\"";
  return challenge;
}

}  // namespace lrt
