// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/subscription/channel.hpp>
#include <lrt/subscription/notification.hpp>
#include <lrt/subscription/options.hpp>

namespace lrt::delivery {
inline namespace v0 {

/// Provides the notifications of a Deliverer. The server implements it on top of the engine.
/// @par Threads  Any, concurrently.
class LRT_API Source {
 public:
  virtual ~Source() = default;
  /// The notification to post now for a callback subscription. The deliverer then calls delivered() once, unless it is
  /// stopped, and does not call next_notification() for that channel in between.
  /// @return  nullopt: nothing is to be posted; the subscription was cancelled or is not due
  virtual std::optional<subscription::Notification> next_notification(subscription::Channel channel) = 0;
  /// Reports the outcome. When there is another notification, the source calls Deliverer::notify() again.
  virtual void delivered(subscription::Channel channel, subscription::DeliveryResult receipt) noexcept = 0;
};

/// Posts notifications to web callbacks. It is the only part of a server that opens connections to other hosts.
///
/// @par Threads  notify: any. stop: once, not from one of the deliverer's threads.
class LRT_API Deliverer {
 public:
  virtual ~Deliverer() = default;
  /// Reports that a channel has a notification to post. Each channel has at most one exchange at a time; the source
  /// defines the order.
  /// @param receiver  scheme, host and port of the URL, in one spelling
  virtual void notify(subscription::Channel channel, std::string_view receiver) = 0;
  /// Cancels running exchanges and ends all threads. Does not wait for receivers. Waits for running calls of the
  /// source, so the caller must not hold a lock that these need; afterwards the source is not called. A thread inside
  /// the system's resolver cannot be interrupted: stop() does not wait for it. It ends when the resolver returns, and
  /// until then uses only memory of its own.
  virtual void stop() noexcept = 0;
};

/// Makes a Deliverer on sockets and threads of its own. It starts threads on demand and ends idle ones.
///
/// - A name is resolved for each connection, on one of `options.max_resolver_threads` threads and within
///   `options.resolve_time`. A notification that waits for a name counts in none of the limits below. Subscriptions
///   that wait for the same name share one resolution. A name without an address fails at once for 2 s. Addresses in
///   URLs are not resolved.
/// - Every address is checked against `options.allow`; only a checked address is connected to. Host and SNI are those
///   of the URL.
/// - A confirmation is a GET without body and signature. White space after the challenge in the response is ignored.
/// - Redirects are not followed. For https the certificate and its name are checked.
/// - If there is a secret, the request has the field `X-Hub-Signature: sha256=<hex of HMAC-SHA256>` (WebSub 7.1).
/// - A connection is reused for one subscription only. If it is closed before the first byte of a response, the
///   notification is sent once more on a new connection.
/// - At most `options.max_threads` exchanges run at the same time: a quarter of them for one receiver, half for
///   subscriptions whose last delivery failed, an eighth for such subscriptions of one receiver; each at least one. A
///   hanging receiver cannot delay others.
/// - A response that is incomplete, too long or not HTTP/1.1 counts as a failure.
///
/// @par Errors   invalid_option (an entry of `allow`, a limit of 0, or lrt was built without LRT_CALLBACKS), io_error
/// @par Threads  Any.
/// @par Time     Reads ca_file. Connects to nothing and starts no thread yet.
LRT_API Result<std::unique_ptr<Deliverer>> make_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log);

}  // namespace v0
}  // namespace lrt::delivery
