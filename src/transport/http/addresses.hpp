// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "src/base/client_key.hpp"

namespace lrt::transport {

/// How many connections each client (client_key) has (Limits::max_connections_per_address). Those of this machine are not counted.
class Addresses {
 public:
  explicit Addresses(std::size_t limit) : limit_(limit) {}

  /// One connection of an address, for as long as it lives. Must not outlive the Addresses.
  class Place {
   public:
    Place() = default;  ///< of an address that is not counted
    Place(Place&& other) noexcept : all_(std::exchange(other.all_, nullptr)), address_(std::move(other.address_)) {}
    Place& operator=(Place&& other) noexcept {
      std::swap(all_, other.all_);
      std::swap(address_, other.address_);
      return *this;
    }
    ~Place() {
      if (all_) all_->leave(address_);
    }

   private:
    friend class Addresses;
    Place(Addresses& all, std::string address) : all_(&all), address_(std::move(address)) {}
    Addresses* all_ = nullptr;
    std::string address_;
  };

  /// nullopt: the address has reached its limit.
  /// @param address  numeric
  std::optional<Place> take(const std::string& address) {
    const std::string client = client_key(address);
    if (is_this_machine(client)) return Place();
    const auto [found, added] = counts_.try_emplace(client, 0);
    if (found->second >= limit_) {
      if (added) counts_.erase(found);
      return std::nullopt;
    }
    ++found->second;
    return Place(*this, client);
  }
  std::size_t size() const noexcept { return counts_.size(); }

 private:
  void leave(const std::string& address) noexcept {
    const auto found = counts_.find(address);
    if (--found->second == 0) counts_.erase(found);
  }

  const std::size_t limit_;
  std::map<std::string, std::size_t> counts_;  ///< not a hash table: clients choose their IPv6 addresses
};

}  // namespace lrt::transport
