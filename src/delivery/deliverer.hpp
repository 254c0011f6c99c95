// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/delivery/deliverer.hpp>

#include "src/base/resolve.hpp"

namespace lrt::delivery {
inline namespace v0 {

/// Parameters that tests replace.
struct Details {
  Resolve look_up = resolve;
  std::chrono::milliseconds failed_time{2'000};  ///< a name without an address is not resolved again before this time has passed
  std::chrono::milliseconds idle_time{5'000};    ///< a thread without work ends after this time
  std::chrono::milliseconds kept_time{30'000};   ///< an idle connection is closed after this time
  std::size_t kept = 32;                         ///< limit of idle connections
};

Result<std::unique_ptr<Deliverer>> make_thread_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log,
                                                         Details details);

}  // namespace v0
}  // namespace lrt::delivery
