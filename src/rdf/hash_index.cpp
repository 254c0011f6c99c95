// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/detail/hash_index.hpp>

namespace lrt::detail {

void HashIndex::grow() {
  // In the order of the old slots, the new ones are written nearly in sequence.
  std::vector<Slot> old(slots_.empty() ? 64 : slots_.size() * 2);
  slots_.swap(old);
  used_ = 0;
  for (const Slot& slot : old) {
    if (slot.number == none) continue;
    put(slot);
    ++used_;
  }
}

}  // namespace lrt::detail
