// SPDX-License-Identifier: Apache-2.0
#include "src/security/failed_logins.hpp"

#include <iterator>

#include "src/base/client_key.hpp"

namespace lrt::security {

/// The key of all addresses that do not fit into the table is empty.
std::string FailedLogins::key_of(std::string_view address) const {
  std::string key = client_key(address);
  if (counts_.size() >= max_addresses && counts_.find(key) == counts_.end()) key.clear();
  return key;
}

void FailedLogins::add(std::string_view address, Instant now) {
  const std::lock_guard lock(mutex_);
  if (counts_.size() >= max_addresses)
    for (auto at = counts_.begin(); at != counts_.end();) at = at->second.ends <= now ? counts_.erase(at) : std::next(at);
  Count& count = counts_[key_of(address)];
  if (count.ends <= now) count = {0, now + window};
  ++count.failed;
}

std::optional<std::chrono::seconds> FailedLogins::pause(std::string_view address, Instant now) const {
  const std::lock_guard lock(mutex_);
  const auto found = counts_.find(key_of(address));
  if (found == counts_.end() || found->second.ends <= now || found->second.failed < max_) return std::nullopt;
  return std::chrono::ceil<std::chrono::seconds>(found->second.ends - now);
}

}  // namespace lrt::security
