// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include <lrt/base/language.hpp>
#include <lrt/base/thread_options.hpp>

namespace lrt::subscription {
inline namespace v0 {

/// Which receivers of web callbacks must confirm that they want a subscription, before its first notification.
enum class Confirmation : unsigned char {
  none,          ///< no receiver
  not_loopback,  ///< all receivers except those at 127.0.0.0/8, ::1 and localhost
  all,           ///< all receivers
};

/// Web callbacks: allowed receivers, limits, times and retries.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               Servers and deliverers copy it when they are created.
struct CallbackOptions {
  /// Receivers that may be called, see AllowedHosts. Empty: requests for callbacks are answered with 403, and no thread
  /// is started.
  std::vector<std::string> allow;
  std::size_t max_callbacks = 200;                 ///< callback subscriptions of the server; beyond: 503
  std::string secret;                              ///< signs notifications of subscriptions without a secret; empty: these are unsigned
  std::chrono::milliseconds connect_time{2'000};   ///< for connecting, including the TLS handshake
  std::chrono::milliseconds response_time{5'000};  ///< for the whole exchange
  std::size_t max_response_bytes = 64 * 1024;      ///< of a receiver's response; a longer one counts as a failure
  std::size_t max_threads = 32;                    ///< threads that deliver; idle ones end
  std::string ca_file;                             ///< certificate authorities, PEM; empty: those of the system

  /// A failed notification is retried after first_pause, then after twice that, and so on up to max_pause. Each pause
  /// is multiplied by a random factor of 0.5 to 1.5. After this number of failures the subscription is suspended: only
  /// the newest representation is sent, every suspended_pause. After suspended_attempts further failures it is removed.
  /// A response 410 removes it at once.
  unsigned attempts = 5;
  std::chrono::milliseconds first_pause{500};         ///< see attempts
  std::chrono::milliseconds max_pause{30'000};        ///< see attempts
  std::chrono::milliseconds suspended_pause{60'000};  ///< see attempts
  unsigned suspended_attempts = 10;                   ///< see attempts
  ThreadOptions threads;                              ///< of the threads that deliver; a server sets them to its Threads::own

  /// A receiver confirms a subscription as in WebSub (5.3): it gets a GET of the callback URL with the parameters
  /// hub.mode=subscribe, hub.topic (the resource) and hub.challenge (a random text), and responds with a status 2xx and
  /// the challenge as body. Otherwise the subscription ends. If the receiver cannot be reached or fails (5xx, 408,
  /// 429), lrt asks again after the pauses above. So clients cannot make a robot post to a server that has not agreed,
  /// such as another robot. `lrt:confirmed` of the subscription states whether it has confirmed; with a file of
  /// subscriptions it is not asked again after a restart.
  Confirmation confirmation = Confirmation::not_loopback;

  /// Time for resolving the name of a receiver, including the wait for a thread; more than 0. Beyond it the
  /// notification has failed. It is not part of response_time, and a notification that waits for a name uses none of
  /// max_threads.
  std::chrono::milliseconds resolve_time{2'000};
  /// Threads that resolve names, besides max_threads; at least 1. They exist while they resolve: one for each name,
  /// half of them for names with the same two last labels. The system's resolver cannot be interrupted, so a name whose
  /// server hangs keeps its thread after resolve_time.
  std::size_t max_resolver_threads = 8;
};

/// Subscriptions: limits, and how changes reach the engine from the control loop.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               Servers copy it when they are created.
struct SubscriptionOptions {
  std::size_t max_subscriptions = 1'500;     ///< of the server; beyond: 503. Less than Limits::max_connections, so that requests are served
  std::size_t max_queue_length = 1'000;      ///< notifications that a client may request to be queued; beyond: 422, in a query 400
  std::size_t default_queue_length = 64;     ///< for actions and invocations, if the client requests no length
  std::size_t max_queue_bytes = 256 * 1024;  ///< queued for one subscriber; beyond: the oldest are dropped
  std::size_t max_total_queue_bytes = 32 * 1024 * 1024;  ///< queued for all subscribers; beyond: each queue keeps one notification
  /// Memory for the published values that one property keeps between two scans while a subscriber has a queue: at most
  /// max_queue_length values, fewer if they are large (PushedProperty::keep). Allocated for the first such subscriber
  /// and freed with the property. The size of values that own memory is estimated from RDF and representations of the
  /// last value that was scanned; if a property has representations, at least 64 KiB.
  std::size_t max_kept_bytes = 1024 * 1024;
  /// How long the engine may process values for queues at a time; with Io::in_poll at most 0.5 ms. Queues that it did
  /// not reach come first the next time. Then values that have waited for more than 50 ms are dropped, except for the
  /// newest, and the queues count them. So a queue on a large state at 1 kHz delays other clients by about this time.
  std::chrono::microseconds max_catch_up_time{5000};
  /// Default of PulledProperty::sample: the period at which observed pulled properties are read. 0: only after
  /// PulledProperty::changed().
  std::chrono::milliseconds sample_period{100};
  /// While observed properties are published at irregular times, the engine scans them for changes at this period, and
  /// publish() makes no system call. Where the intervals are regular and at most four times as long, it scans when the
  /// next publish() is due; where they are longer, it sleeps. If a scan takes long, the period is extended: scans take
  /// at most a fifth of the time.
  std::chrono::microseconds scan_period{500};
  /// After this number of scans without an irregular change the engine sleeps, unless something is published at short
  /// regular intervals. The next publish() of an observed property wakes it with one system call.
  unsigned idle_scans_before_sleep = 20;
  /// The engine does not sleep while a resource is observed: publish() makes no system call, unless the property is
  /// urgent().
  bool always_scan = false;
  std::size_t max_feed_subscriptions = 20'000;  ///< of all feeds (lrt::Feed), besides max_subscriptions, so that neither can exhaust the other
};

}  // namespace v0
}  // namespace lrt::subscription
