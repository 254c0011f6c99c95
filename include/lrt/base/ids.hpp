#pragma once

#include <string>

namespace lrt {

/// Where the last path segments of invocations, members and subscriptions come from.
/// @par Threads  One thread at a time.
class IdSource {
 public:
  virtual ~IdSource() = default;
  /// A new id of unreserved URI characters, never given before by this source.
  virtual std::string next() = 0;
};

/// Random UUIDs (RFC 9562 version 4) from the system's entropy: not to be guessed, not reused after a restart.
class RandomIds final : public IdSource {
 public:
  std::string next() override;
};

}  // namespace lrt
