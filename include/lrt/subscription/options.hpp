#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace lrt::subscription {

/// Web callbacks: who may be called and how patiently.
struct CallbackOptions {
  /// Receivers that may be called, see AllowedHosts. Empty: callbacks are refused with 403, and there is no thread for them.
  std::vector<std::string> allow;
  std::size_t most = 200;                        ///< callback subscriptions in all; more: 503
  std::string secret;                            ///< signs notifications whose subscriber gave none; empty: those are not signed
  std::chrono::milliseconds connect_time{2'000}; ///< to connect, TLS included
  std::chrono::milliseconds answer_time{5'000};  ///< for the whole exchange
  std::size_t answer_bytes = 64 * 1024;          ///< of a receiver's answer; more: a failure
  std::size_t threads = 32;                      ///< at most, at work at once; they end when idle
  std::string ca_file;                           ///< PEM of certificate authorities; empty: the system's

  // A notification that fails is tried again after first_pause, then twice that, ... up to longest_pause, each times 0.5 to 1.5 by chance.
  // After `attempts` the subscription is suspended: only its present state is tried, every suspended_pause. After suspended_attempts of
  // these it is removed. 410 removes it at once.
  unsigned attempts = 5;
  std::chrono::milliseconds first_pause{500};
  std::chrono::milliseconds longest_pause{30'000};
  std::chrono::milliseconds suspended_pause{60'000};
  unsigned suspended_attempts = 10;
};

/// Subscriptions: what may be asked for, and how news travels from the control loop.
struct Options {
  std::size_t most = 1'500;                      ///< subscriptions in all; more: 503. Fewer than connections, which requests need too
  std::size_t longest_queue = 1'000;             ///< notifications a client may ask to be queued; more: 422, in a query 400
  std::size_t queue = 64;                        ///< of actions and invocations, when the client does not say
  std::size_t queue_bytes = 256 * 1024;          ///< of what is queued for one subscriber; older ones are dropped
  std::size_t all_queue_bytes = 32 * 1024 * 1024;  ///< of all queues; beyond that one notification each
  /// How often observed pulled properties are read that do not say themselves (Property::sample); 0: on changed() only.
  std::chrono::milliseconds sample_period{100};
  /// While observed properties are being published, the network side looks for news this often, and publish() makes no system call. Less
  /// often when a look takes long: it has a fifth of the time at most.
  std::chrono::microseconds push_period{500};
  /// After so many looks without news it sleeps, and the next publish() of an observed property wakes it: one system call.
  unsigned looks_before_sleep = 20;
  /// Never sleeps while something is observed, so that publish() never makes a system call.
  bool tick = false;
  CallbackOptions callbacks;
};

}  // namespace lrt::subscription
