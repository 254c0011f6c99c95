// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include <lrt/engine/handler.hpp>
#include <lrt/subscription/notification.hpp>

namespace lrt::engine {

/// Channels with a message or a close, to be reported once to those who send.
struct ReadyChannels {
  std::deque<Channel> urgent;                          ///< to transports and feeds: commands and closes first
  std::deque<Channel> others;                          ///< to transports and feeds
  std::vector<subscription::ReadyCallback> callbacks;  ///< to deliverers

  bool has_pushes() const noexcept { return !urgent.empty() || !others.empty(); }
};

}  // namespace lrt::engine
