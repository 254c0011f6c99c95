#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/options.hpp>

#include "src/security/authentication.hpp"
#include "src/security/sessions.hpp"

namespace lrt {

/// Finds out who sends a request, and which rights that gives, as lrt::Security says.
///
/// @par Threads  any
class Callers {
 public:
  /// nullptr: the options restrict nobody.
  /// @par Errors  those of Tokens::load; invalid_option
  static Result<std::shared_ptr<Callers>> create(const Security& security, std::shared_ptr<security::Sessions> sessions, LogCallback log,
                                                 const Clock& clock);

  /// Calls user code.
  engine::Caller of(const http::Request& request);

 private:
  /// What the credentials of a request have shown.
  struct Found {
    std::shared_ptr<const security::Principal> principal{};  ///< nullptr: nobody
    bool refused = false;    ///< there are credentials, which nobody has
    bool by_cookie = false;  ///< engine::Caller::by_cookie
  };

  Callers(const Security& security, std::shared_ptr<security::Sessions> sessions, const Clock& clock);
  Found find(const http::Request& request);
  std::optional<Found> find_by_session(const http::Request& request);
  Found find_by_token(const http::Request& request, const std::string& token);
  security::Rights rights_of(const security::Principal& principal) const;
  std::string challenge_for(const http::Request& request, bool refused) const;

  const Clock& clock_;
  const bool authenticates_;  ///< false: the authorizer alone decides
  const std::map<std::string, std::shared_ptr<const security::Principal>> certificates_;
  const security::Authenticate authenticate_;
  const security::Roles roles_;
  const security::Rights anyone_;
  const engine::Authorizer authorize_;
  const std::shared_ptr<security::Sessions> sessions_;  ///< nullptr: there are none
  std::unique_ptr<security::TokenFile> tokens_;
};

}  // namespace lrt
