#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace lrt::transport {

/// How many connections each address has (Limits::max_connections_per_address). Those of this machine are not counted.
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

  /// nullopt: the address has as many as it may.
  /// @param address  numeric; an IPv4 client of an IPv6 socket as IPv4
  std::optional<Place> take(const std::string& address) {
    if (is_this_machine(address)) return Place();
    const auto [found, added] = counts_.try_emplace(address, 0);
    if (found->second >= limit_) {
      if (added) counts_.erase(found);
      return std::nullopt;
    }
    ++found->second;
    return Place(*this, address);
  }
  std::size_t size() const noexcept { return counts_.size(); }

  static bool is_this_machine(std::string_view address) noexcept { return address == "::1" || address.substr(0, 4) == "127."; }

 private:
  void leave(const std::string& address) noexcept {
    const auto found = counts_.find(address);
    if (--found->second == 0) counts_.erase(found);
  }

  const std::size_t limit_;
  std::map<std::string, std::size_t> counts_;  ///< not a hash table: clients choose their IPv6 addresses
};

}  // namespace lrt::transport
