// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <deque>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "src/exchange/wire.hpp"

namespace lrt::exchange {

/// Open connections without an exchange, kept for the next one with their peer. Not synchronised.
class IdleWires {
 public:
  std::unique_ptr<Wire> take(const std::string& peer) {
    const auto found = std::find_if(wires_.rbegin(), wires_.rend(), [&](const Idle& idle) { return idle.peer == peer; });
    if (found == wires_.rend()) return nullptr;
    std::unique_ptr<Wire> wire = std::move(found->wire);
    wires_.erase(std::next(found).base());
    return wire;
  }
  void put(std::string peer, std::unique_ptr<Wire> wire) { wires_.push_back({std::move(peer), std::move(wire), std::chrono::steady_clock::now()}); }
  /// Removes the connections above `max` and those kept since before `oldest`. The caller closes them without holding a lock.
  std::vector<std::unique_ptr<Wire>> take_surplus(std::size_t max, Instant oldest) {
    std::vector<std::unique_ptr<Wire>> result;
    while (!wires_.empty() && (wires_.size() > max || wires_.front().since < oldest)) {
      result.push_back(std::move(wires_.front().wire));
      wires_.pop_front();
    }
    return result;
  }
  bool empty() const noexcept { return wires_.empty(); }

 private:
  struct Idle {
    std::string peer;
    std::unique_ptr<Wire> wire;
    Instant since;
  };
  std::deque<Idle> wires_;  // in the order of `since`
};

}  // namespace lrt::exchange
