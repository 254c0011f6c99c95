// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace lrt::engine {

/// Counts the objects of one kind per client.
class ClientCounts {
  using Counts = std::unordered_map<std::string, std::size_t>;

 public:
  /// One object of a client: it counts until it is released or destroyed. It must not outlive the counts.
  class Share {
   public:
    Share() noexcept = default;
    Share(Share&& other) noexcept : counts_(std::exchange(other.counts_, nullptr)), place_(other.place_) {}
    Share& operator=(Share&& other) noexcept {
      release();
      counts_ = std::exchange(other.counts_, nullptr);
      place_ = other.place_;
      return *this;
    }
    ~Share() { release(); }

    void release() noexcept {
      if (Counts* const counts = std::exchange(counts_, nullptr); counts && --place_->second == 0) counts->erase(counts->find(place_->first));
    }

    /// Empty: it is not counted for any.
    std::string_view client() const noexcept { return counts_ ? std::string_view(place_->first) : std::string_view(); }

   private:
    friend class ClientCounts;
    Share(Counts& counts, Counts::value_type& place) noexcept : counts_(&counts), place_(&place) { ++place.second; }
    Counts* counts_ = nullptr;
    Counts::value_type* place_ = nullptr;  // an element stays where it is
  };

  /// @param client  empty: the share is not counted for any client
  Share take(const std::string& client) { return client.empty() ? Share() : Share(counts_, *counts_.try_emplace(client, 0).first); }
  std::size_t of(const std::string& client) const {
    const auto found = counts_.find(client);
    return found == counts_.end() ? 0 : found->second;
  }

 private:
  Counts counts_;
};

}  // namespace lrt::engine
