#pragma once

#include <cstddef>
#include <string>

#include <lrt/subscription/allowed_hosts.hpp>
#include <lrt/subscription/notification.hpp>

#include "src/delivery/httplib/wire.hpp"

namespace lrt::delivery {

/// What came back for a notification.
struct Answer {
  int status = 0;        ///< 0: no complete answer
  std::string error{};   ///< then: why, a sentence
  bool silent = false;   ///< then: the receiver hung up before the first byte of an answer
  bool keep = false;     ///< the connection can be used again
};

/// Sends a notification and reads the answer, once, by cpp-httplib. No redirects, no decompression, nothing of the environment.
/// @param max_response_bytes  of the answer's body that are read; a longer one is no answer
Answer post(Wire& wire, const subscription::CallbackUrl& url, const subscription::Notification& notification, std::size_t max_response_bytes,
            Patience patience);

}  // namespace lrt::delivery
