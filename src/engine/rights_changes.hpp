// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace lrt::engine {

/// Counts the changes of rights, and knows who was signed out at which. A request that was judged before the last one is judged again before it opens
/// what lasts.
class RightsChanges {
 public:
  /// Principals that are kept by name. When there are more, requests from before count as those of any of them.
  static constexpr std::size_t max_names = 1'000;

  /// How many there were.
  /// @par Threads  any
  std::uint64_t number() const noexcept { return number_; }
  /// Rights may have changed.
  void add() noexcept { ++number_; }
  void sign_out(std::string_view principal) {
    if (signed_out_.size() >= max_names) {
      signed_out_.clear();
      forgotten_ = number_;
    }
    signed_out_.insert_or_assign(std::string(principal), number_ + 1);
    add();
  }
  /// Whether a principal was signed out after the change of that number.
  bool was_signed_out(std::string_view principal, std::uint64_t since) const {
    const auto found = signed_out_.find(principal);
    return since < forgotten_ || (found != signed_out_.end() && since < found->second);
  }

 private:
  std::atomic<std::uint64_t> number_{0};
  std::map<std::string, std::uint64_t, std::less<>> signed_out_;  ///< by name: the change
  std::uint64_t forgotten_ = 0;                                   ///< the last change of which the name is not kept
};

}  // namespace lrt::engine
