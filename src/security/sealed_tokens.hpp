// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "src/security/digest.hpp"

namespace lrt::security {

/// Secrets that stand for a token for some time. Of a secret only its digest is kept, and the token is sealed with the secret, so that memory shows
/// neither.
///
/// @par Threads  any
class SealedTokens {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  struct Bounds {
    std::chrono::seconds life;
    std::size_t max;            ///< of all
    std::size_t max_per_owner;  ///< one more removes the owner's oldest
  };
  explicit SealedTokens(const Bounds& bounds) : bounds_(bounds) {}

  /// A new secret for a token; nullopt: there are too many of other owners.
  /// @param purpose  the secret is valid with the same text only
  std::optional<std::string> add(std::string_view owner, std::string_view purpose, std::string_view token, Instant now);
  /// The token of a secret; nullopt: it is unknown or expired.
  std::optional<std::string> find(std::string_view secret, std::string_view purpose, Instant now) const;
  /// The same, and removes the secret.
  std::optional<std::string> take(std::string_view secret, std::string_view purpose, Instant now);
  void remove(std::string_view secret, std::string_view purpose);
  void remove_all_of(std::string_view owner);

 private:
  struct Entry {
    std::string owner, sealed;
    Instant ends;
  };
  static Digest key_of(std::string_view secret, std::string_view purpose);
  bool make_space(std::string_view owner, Instant now);

  const Bounds bounds_;
  mutable std::mutex mutex_;         ///< guards entries_
  std::map<Digest, Entry> entries_;  ///< by the digest of secret and purpose
};

}  // namespace lrt::security
