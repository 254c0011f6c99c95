#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/subscription/channel.hpp>
#include <lrt/subscription/notification.hpp>
#include <lrt/subscription/options.hpp>

namespace lrt::delivery {

/// Where notifications come from: the server, which asks the engine. Both functions are called from any thread.
class Source {
 public:
  virtual ~Source() = default;
  /// What to post for a callback subscription now; nullopt: nothing (it is cancelled, or not due). A notification is followed by one
  /// delivered(), unless the deliverer is stopped. Between the two this is not called for that channel.
  virtual std::optional<subscription::Notification> next_notification(subscription::Channel channel) = 0;
  /// What became of the last one. The source names the channel anew, by Deliverer::notify(), when there is more to do.
  virtual void delivered(subscription::Channel channel, subscription::DeliveryResult receipt) noexcept = 0;
};

/// Posts notifications to web callbacks. The only part of lrt that calls strangers.
///
/// @par Threads  notify: any. stop: once, not from one of the deliverer's threads.
class Deliverer {
 public:
  virtual ~Deliverer() = default;
  /// A channel has something to post. Each channel has at most one exchange under way; order is the source's.
  /// @param receiver  where its URL leads, the same text for the same scheme, host and port
  virtual void notify(subscription::Channel channel, std::string_view receiver) = 0;
  /// Ends what is under way, without waiting for receivers, and all threads. The source is not called afterwards; calls of it that are
  /// under way are waited for, so hold nothing that they need. A thread in the system's resolver, which nothing can interrupt, is left to
  /// end by itself when the resolver lets it go; it touches nothing but memory of its own then.
  virtual void stop() noexcept = 0;
};

/// By cpp-httplib, on threads of its own that come with work and go without.
///
/// A name is resolved for each connection, every address is checked against `options.allow`, and the connection goes to an address
/// that was checked, with Host and SNI of the URL. Redirects are not followed. https checks the certificate and its name. A body with a
/// secret carries `X-Hub-Signature: sha256=<hex of HMAC-SHA256>` (WebSub 7.1). A connection is kept and used again for
/// one subscription; one that turns out to be closed before anything of an answer came is replaced, once, and the notification is
/// sent again. At most `options.max_threads` exchanges at once. Of these one receiver gets a quarter, subscriptions that failed before get half in
/// all and an eighth at one receiver (each at least one): who hangs delays nobody else. An answer that is not complete, not HTTP/1.1, or longer than
/// stated is none.
/// @par Errors  invalid_option (an entry of `allow`, or lrt was built without LRT_CALLBACKS), io_error
Result<std::unique_ptr<Deliverer>> make_deliverer(Source& source, const subscription::CallbackOptions& options, LogCallback log);

}  // namespace lrt::delivery
