// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/security.hpp>

namespace lrt {

/// The time at which each client may continue, for a bounded number of clients.
///
/// A rate is a token bucket, stored as the time at which it is full again. Each use moves that time forward.
///
/// @par Threads  One at a time.
class RateTable {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  struct Client {
    std::string name;
    Instant requests{}, bytes{};  ///< when the bucket is full again
  };
  /// @param max_clients  at least 16; rounded up to a multiple of it
  explicit RateTable(std::size_t max_clients) : sets_((max_clients + ways - 1) / ways) {}

  /// A client that is not in the table replaces the client of its set with the least use.
  Client& find(std::string_view name);

 private:
  static constexpr std::size_t ways = 16;
  using Set = std::array<Client, ways>;
  std::vector<std::unique_ptr<Set>> sets_;  ///< allocated on first use
};

/// Counts the requests and bytes of clients, and finds clients above their limits (security::ClientLimits).
///
/// @par Threads  any
class ClientLimiter {
 public:
  explicit ClientLimiter(const security::ClientLimits& limits) : limits_(limits), addresses_(limits.max_clients), principals_(limits.max_clients) {}

  /// @par Errors  invalid_option
  static Result<void> check(const security::ClientLimits& limits);

  /// Stores the client in `caller`, unless it is not limited, and counts a request.
  /// @return  how long the client has to wait before it sends that request; nullopt: the request may be served
  std::optional<std::chrono::seconds> count(engine::Caller& caller, std::string_view address, bool has_body, TimePoint now);
  /// Counts the body of a request that may be served.
  void count_body(const engine::Caller& caller, std::uint64_t bytes, TimePoint now);

 private:
  RateTable::Client& find(const engine::Caller& caller);

  const security::ClientLimits limits_;
  std::mutex mutex_;                  ///< guards the tables
  RateTable addresses_, principals_;  ///< separate tables: addresses can be chosen freely and must not displace principals
};

}  // namespace lrt
