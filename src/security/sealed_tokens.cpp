// SPDX-License-Identifier: Apache-2.0
#include "src/security/sealed_tokens.hpp"

#include <iterator>
#include <utility>

#include "src/security/sealing.hpp"

namespace lrt::security {

Digest SealedTokens::key_of(std::string_view secret, std::string_view purpose) {
  return digest_of(std::string("find ").append(secret).append(" ").append(purpose));
}

std::optional<std::string> SealedTokens::add(std::string_view owner, std::string_view purpose, std::string_view token, Instant now) {
  std::string secret = random_secret();
  Entry entry{std::string(owner), seal(secret, token), now + bounds_.life};
  const Digest key = key_of(secret, purpose);
  const std::lock_guard lock(mutex_);
  if (!make_space(owner, now)) return std::nullopt;
  entries_.emplace(key, std::move(entry));
  return secret;
}

/// Removes expired entries, and the oldest entry of an owner at the limit. All have the same lifetime, so the oldest expires first.
bool SealedTokens::make_space(std::string_view owner, Instant now) {
  std::size_t count = 0;
  auto oldest = entries_.end();
  for (auto at = entries_.begin(); at != entries_.end();) {
    if (at->second.ends <= now) {
      at = entries_.erase(at);
      continue;
    }
    if (at->second.owner == owner) {
      ++count;
      if (oldest == entries_.end() || at->second.ends < oldest->second.ends) oldest = at;
    }
    ++at;
  }
  if (count > 0 && count >= bounds_.max_per_owner) entries_.erase(oldest);
  return entries_.size() < bounds_.max;
}

std::optional<std::string> SealedTokens::find(std::string_view secret, std::string_view purpose, Instant now) const {
  const Digest key = key_of(secret, purpose);
  std::string sealed;
  {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    if (found == entries_.end() || found->second.ends <= now) return std::nullopt;
    sealed = found->second.sealed;
  }
  return unseal(secret, sealed);
}

std::optional<std::string> SealedTokens::take(std::string_view secret, std::string_view purpose, Instant now) {
  const Digest key = key_of(secret, purpose);
  Entry entry;
  {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    if (found == entries_.end()) return std::nullopt;
    entry = std::move(found->second);
    entries_.erase(found);
  }
  return entry.ends <= now ? std::nullopt : unseal(secret, entry.sealed);
}

void SealedTokens::remove(std::string_view secret, std::string_view purpose) {
  const Digest key = key_of(secret, purpose);
  const std::lock_guard lock(mutex_);
  entries_.erase(key);
}

void SealedTokens::remove_all_of(std::string_view owner) {
  const std::lock_guard lock(mutex_);
  for (auto at = entries_.begin(); at != entries_.end();) at = at->second.owner == owner ? entries_.erase(at) : std::next(at);
}

}  // namespace lrt::security
