// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <lrt/subscription/notification.hpp>

#include "src/exchange/wire.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::delivery {

/// The outcome of one POST.
struct PostResult {
  int status = 0;          ///< of the response; 0: no complete response was received
  std::string error{};     ///< the reason, if status is 0
  bool silent = false;     ///< the receiver closed the connection before the first byte of a response
  bool keep = false;       ///< the connection can be used again
  bool confirmed = false;  ///< the body of the response is the notification's challenge
};

/// Sends a notification or a request for confirmation, and reads the response.
/// @param max_response_bytes  limit of the response's body; a longer one is an error
PostResult post(exchange::Wire& wire, const subscription::CallbackUrl& url, const subscription::Notification& notification,
                std::size_t max_response_bytes, exchange::WaitLimit limit);

}  // namespace lrt::delivery
