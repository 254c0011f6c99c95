// SPDX-License-Identifier: Apache-2.0
#include "src/server/client_limiter.hpp"

#include <algorithm>
#include <functional>

#include "src/base/client_key.hpp"

namespace lrt {
namespace {

using std::chrono::seconds;
using std::chrono::steady_clock;
using Instant = RateTable::Instant;

constexpr std::uint64_t min_bytes_per_second = 1024, max_bytes_per_second = std::uint64_t{1} << 40;
constexpr std::uint32_t max_requests_per_second = 1'000'000;

/// The time in which a rate supplies an amount.
steady_clock::duration time_of(std::uint64_t amount, std::uint64_t per_second) {
  return std::chrono::duration_cast<steady_clock::duration>(
      std::chrono::duration<double>(static_cast<double>(amount) / static_cast<double>(per_second)));
}

void use(Instant& full, steady_clock::duration what, Instant now) { full = std::max(full, now) + what; }

}  // namespace

RateTable::Client& RateTable::find(std::string_view name) {
  std::unique_ptr<Set>& set = sets_[std::hash<std::string_view>()(name) % sets_.size()];
  if (!set) set = std::make_unique<Set>();
  const auto known = std::find_if(set->begin(), set->end(), [&](const Client& client) { return client.name == name; });
  if (known != set->end()) return *known;
  const auto used = [](const Client& client) { return std::max(client.requests, client.bytes); };
  Client& least = *std::min_element(set->begin(), set->end(), [&](const Client& a, const Client& b) { return used(a) < used(b); });
  least = {std::string(name)};
  return least;
}

Result<void> ClientLimiter::check(const security::ClientLimits& limits) {
  const auto invalid = [](const std::string& what) { return unexpected(Errc::invalid_option, "security.clients." + what); };
  if (limits.requests_per_second > max_requests_per_second)
    return invalid("requests_per_second: expected 0 to 1000000, found " + std::to_string(limits.requests_per_second));
  if (const std::uint64_t bytes = limits.body_bytes_per_second; bytes != 0 && (bytes < min_bytes_per_second || bytes > max_bytes_per_second))
    return invalid("body_bytes_per_second: expected 0, or 1024 to 2^40, found " + std::to_string(bytes));
  if (limits.burst < std::chrono::milliseconds(1) || limits.burst > std::chrono::hours(1))
    return invalid("burst: expected 1 ms to 1 h, found " + std::to_string(limits.burst.count()) + " ms");
  if (limits.max_clients < 16 || limits.max_clients > 1'000'000)
    return invalid("max_clients: expected 16 to 1000000, found " + std::to_string(limits.max_clients));
  return {};
}

std::optional<seconds> ClientLimiter::count(engine::Caller& caller, std::string_view address, bool has_body, TimePoint now) {
  if (caller.principal) {
    caller.client = "principal " + caller.principal->name;
  } else {
    if (address.empty() || is_this_machine(address)) return std::nullopt;
    caller.client = client_key(address);
    if (is_this_machine(caller.client)) caller.client.clear();
    if (caller.client.empty()) return std::nullopt;
  }
  if (limits_.requests_per_second == 0 && limits_.body_bytes_per_second == 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  RateTable::Client& client = find(caller);
  steady_clock::duration wait{0}, request{0};
  if (limits_.requests_per_second != 0) {
    request = time_of(1, limits_.requests_per_second);
    wait = client.requests + request - now.steady - std::max<steady_clock::duration>(limits_.burst, request);
  }
  if (has_body && limits_.body_bytes_per_second != 0) wait = std::max<steady_clock::duration>(wait, client.bytes - now.steady - limits_.burst);
  if (wait > steady_clock::duration(0)) return std::chrono::ceil<seconds>(wait);
  use(client.requests, request, now.steady);
  return std::nullopt;
}

void ClientLimiter::count_body(const engine::Caller& caller, std::uint64_t bytes, TimePoint now) {
  if (caller.client.empty() || limits_.body_bytes_per_second == 0) return;
  const std::lock_guard lock(mutex_);
  use(find(caller).bytes, time_of(bytes, limits_.body_bytes_per_second), now.steady);
}

RateTable::Client& ClientLimiter::find(const engine::Caller& caller) { return (caller.principal ? principals_ : addresses_).find(caller.client); }

}  // namespace lrt
