#pragma once

#include <map>
#include <memory>
#include <string>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/options.hpp>

#include "src/security/authentication.hpp"

namespace lrt {

/// Finds out who sends a request, and which rights that gives, as lrt::Security says.
///
/// @par Threads  any
class Callers {
 public:
  /// nullptr: the options restrict nobody.
  /// @par Errors  those of Tokens::load; invalid_option
  static Result<std::shared_ptr<Callers>> create(const Security& security, LogCallback log, const Clock& clock);

  /// Calls user code.
  engine::Caller of(const http::Request& request);

 private:
  Callers(const Security& security, const Clock& clock);
  std::shared_ptr<const security::Principal> principal_of(const http::Request& request, bool& refused);
  security::Rights rights_of(const security::Principal& principal) const;
  static std::string challenge_for(const http::Request& request, bool refused);

  const Clock& clock_;
  const bool authenticates_;  ///< false: the authorizer alone decides
  const std::map<std::string, std::shared_ptr<const security::Principal>> certificates_;
  const security::Authenticate authenticate_;
  const security::Roles roles_;
  const security::Rights anyone_;
  const engine::Authorizer authorize_;
  std::unique_ptr<security::TokenFile> tokens_;
};

}  // namespace lrt
