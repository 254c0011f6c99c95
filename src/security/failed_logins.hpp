// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace lrt::security {

/// Counts failed logins per address, within a minute from the first.
///
/// @par Threads  any
class FailedLogins {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds window{60};
  static constexpr std::size_t max_addresses = 4'096;  ///< beyond, further addresses are counted as one

  explicit FailedLogins(std::size_t max) : max_(max) {}

  void add(std::string_view address, Instant now);
  /// How long an address has to wait; nullopt: it may try.
  std::optional<std::chrono::seconds> pause(std::string_view address, Instant now) const;

 private:
  struct Count {
    std::size_t failed = 0;
    Instant ends;
  };
  std::string key_of(std::string_view address) const;

  const std::size_t max_;
  mutable std::mutex mutex_;  ///< guards counts_
  std::unordered_map<std::string, Count> counts_;
};

}  // namespace lrt::security
