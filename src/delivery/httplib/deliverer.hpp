#pragma once

#include <lrt/delivery/deliverer.hpp>

#include "src/delivery/httplib/resolve.hpp"

namespace lrt::delivery {

/// What tests replace.
struct Details {
  Resolve look_up = resolve;
  std::chrono::milliseconds idle_time{5'000};   ///< after which a thread without work ends
  std::chrono::milliseconds kept_time{30'000};  ///< for which an unused connection is kept
  std::size_t kept = 32;                        ///< connections
};

Result<std::unique_ptr<Deliverer>> make_httplib_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log,
                                                          Details details);

}  // namespace lrt::delivery
