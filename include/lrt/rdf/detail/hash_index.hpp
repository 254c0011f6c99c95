// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <lrt/base/abi.hpp>

namespace lrt::detail {
inline namespace v0 {

/// Finds the numbers of items by the items' hash. Open addressing; at most two thirds of the slots are in use.
class LRT_API HashIndex {
 public:
  static constexpr std::uint32_t none = 0xFFFFFFFF;

  /// The number with this hash for which `is(number)` is true, or none.
  template <class Is>
  std::uint32_t find(std::uint32_t hash, Is is) const noexcept {
    if (slots_.empty()) return none;
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = hash & mask; slots_[at].number != none; at = (at + 1) & mask) {
      if (slots_[at].hash == hash && is(slots_[at].number)) return slots_[at].number;
    }
    return none;
  }

  /// @pre  the index does not have the number
  void insert(std::uint32_t hash, std::uint32_t number) {
    if ((used_ + 1) * 3 > slots_.size() * 2) grow();
    put({hash, number});
    ++used_;
  }

  /// Moves later slots back, so that find() remains fast after many changes.
  /// @pre  the index has the number with this hash
  void erase(std::uint32_t hash, std::uint32_t number) noexcept {
    const std::size_t mask = slots_.size() - 1;
    std::size_t gap = hash & mask;
    while (slots_[gap].number != number) gap = (gap + 1) & mask;
    for (std::size_t at = gap;;) {
      at = (at + 1) & mask;
      if (slots_[at].number == none) break;
      const std::size_t home = slots_[at].hash & mask;
      if (((at - home) & mask) >= ((at - gap) & mask)) slots_[gap] = slots_[at], gap = at;
    }
    slots_[gap] = Slot{};
    --used_;
  }

  /// The memory that it takes.
  std::size_t bytes() const noexcept { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    std::uint32_t hash = 0, number = none;
  };

  void put(Slot slot) noexcept {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = slot.hash & mask;
    while (slots_[at].number != none) at = (at + 1) & mask;
    slots_[at] = slot;
  }
  void grow();

  std::vector<Slot> slots_;  // a power of two
  std::size_t used_ = 0;
};

}  // namespace v0
}  // namespace lrt::detail
