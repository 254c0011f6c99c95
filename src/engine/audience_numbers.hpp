// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "src/engine/resource.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Something for each audience that has asked for it and from whom something is hidden (View::reads_everything). Audiences with equal rights share it.
/// The least recently used are removed when there are too many.
template <class T>
class ByAudience {
 public:
  struct Entry {
    Audience audience;  ///< without its principal
    T value;
  };
  static constexpr std::size_t max_entries = 64;

  /// @param removed  called with what was removed to make room
  template <class Make, class Remove>
  T& of(const Audience& audience, Make make, Remove removed) {
    const std::size_t at = find(audience);
    if (at == entries_.size()) {
      if (entries_.size() >= max_entries) {
        removed(entries_.front().value);
        entries_.erase(entries_.begin());
      }
      entries_.push_back({Audience{audience.view, {}}, make()});
    } else if (at + 1 != entries_.size()) {
      Entry used = std::move(entries_[at]);
      entries_.erase(entries_.begin() + static_cast<std::ptrdiff_t>(at));
      entries_.push_back(std::move(used));
    }
    return entries_.back().value;
  }
  /// Calls f(const Audience&, T&) for each.
  template <class F>
  void for_each(F f) {
    for (Entry& entry : entries_) f(std::as_const(entry.audience), entry.value);
  }

 private:
  std::size_t find(const Audience& audience) {
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (entries_[i].audience.view == audience.view) return i;
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (entries_[i].audience.has_rights_of(audience)) {
        entries_[i].audience.view = audience.view;  // of the rules that count now
        return i;
      }
    return entries_.size();
  }

  std::vector<Entry> entries_;  ///< the most recently used last
};

/// The numbers of the changes of one resource for audiences that do not see each of them. Each begins at 1 when the audience first asks. It costs a
/// pointer until then.
class AudienceNumbers {
 public:
  std::uint64_t of(const Audience& audience) const;
  /// A change, for those who see it.
  void count(SeenBy seen);

 private:
  struct Kept {
    ByAudience<std::uint64_t> numbers;
    std::uint64_t least = 1;  ///< of an audience that comes again: numbers do not decrease
  };
  mutable std::unique_ptr<Kept> kept_;
};

}  // namespace v0
}  // namespace lrt::engine
