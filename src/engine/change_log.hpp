// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

namespace lrt::engine {
inline namespace v0 {

enum class ResourceId : std::uint64_t;

/// Which resources have changed, in order. Each reader remembers how far it has read, and a resource is recorded once between two reads.
/// Nothing is recorded before the first reader.
class ChangeLog {
 public:
  using Place = std::uint64_t;
  /// More changes than these are forgotten: readers that have not read them look at all resources.
  static constexpr std::size_t max_changes = 100'000;

  /// A resource was made, has changed or was removed.
  void add(ResourceId id) noexcept {
    if (!is_read_) return;
    try {
      if (unread_.count(static_cast<std::uint64_t>(id)) != 0) return;
      if (changes_.size() == max_changes) forget();
      changes_.push_back(id);
      unread_.insert(static_cast<std::uint64_t>(id));
    } catch (...) { forget(); }
  }
  /// Begins to record.
  /// @param place  how far it has been read before; set to the end. 0: not at all
  /// @return  the changes since; nullopt: they are not known
  std::optional<std::vector<ResourceId>> read(Place& place) {
    std::optional<std::vector<ResourceId>> read;
    if (is_read_ && place >= first_) read.emplace(changes_.begin() + static_cast<std::ptrdiff_t>(place - first_), changes_.end());
    is_read_ = true;
    place = first_ + changes_.size();
    unread_.clear();
    return read;
  }
  /// There is no reader any more.
  void stop() noexcept {
    if (!is_read_) return;
    is_read_ = false;
    forget();
  }

 private:
  /// No earlier place is known any more, not even the end.
  void forget() noexcept {
    first_ += changes_.size() + 1;
    changes_.clear();
    unread_.clear();
  }

  bool is_read_ = false;
  Place first_ = 1;  ///< of the first of `changes_`
  std::vector<ResourceId> changes_;
  std::unordered_set<std::uint64_t> unread_;  ///< those recorded since the last read
};

}  // namespace v0
}  // namespace lrt::engine
