// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <lrt/http/message.hpp>
#include <lrt/subscription/channel.hpp>

namespace lrt::subscription {
inline namespace v0 {

/// A web callback that has a notification to post.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct ReadyCallback {
  Channel channel;       ///< identifies the subscription
  std::string receiver;  ///< scheme, host and port of its URL
};

/// A notification for a web callback, or the request for confirmation of a subscription.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               `body` is immutable.
struct Notification {
  std::string url;                          ///< http or https, of at most 2,048 bytes; AllowedHosts::names() is true for it
  http::Fields fields;                      ///< Content-Type, ETag, Link, Value-Sequence and so on (SPEC 3.6)
  std::shared_ptr<const std::string> body;  ///< the representation
  std::string secret;                       ///< signs the body; empty: unsigned
  bool failed_before = false;               ///< the last delivery to this subscriber failed
  /// @{
  /// Not empty: instead of a POST, a GET of the URL with `query` added to its query. See CallbackOptions::confirmation.
  std::string challenge{}, query{};
  /// @}
};

/// The outcome of one delivery.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct DeliveryResult {
  int status = 0;          ///< of the receiver's response; 0: no response was received
  std::string error{};     ///< the reason, if no response was received
  bool refused = false;    ///< no address of the receiver is allowed; a retry would fail too
  bool confirmed = false;  ///< the body of the response is the challenge
};

}  // namespace v0
}  // namespace lrt::subscription
