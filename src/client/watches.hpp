// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/client/watch.hpp>

#include "src/client/http_client.hpp"
#include "src/base/resolve.hpp"

namespace lrt::client {
inline namespace v0 {

struct WatchContext;

/// The watches of a client: connections, pauses between them, and the queues of what they have received.
///
/// @par Threads  Any; poll(): one at a time.
class LRT_INTERNAL_API Watches {
 public:
  /// Parameters that tests replace, and the wake-up of the host.
  struct Hooks {
    const Clock* clock = nullptr;      ///< measures pauses; nullptr: the system's. If it is moved by hand, check_clock() must follow
    std::function<double()> random{};  ///< in [0, 1), for pauses; empty: the system's
    std::function<void()> wake{};      ///< called from any thread when poll() has something to do; must not block or call Watches
    Resolve resolve{};                 ///< of names for WebSockets; empty: the system's resolver
  };
  /// The thread that runs the callback of a watch.
  enum class Delivery : unsigned char {
    as_options,  ///< Options::callbacks
    at_once,     ///< the thread that has received the value, for decoding. The callback must not block
  };

  explicit Watches(std::shared_ptr<HttpClient> http);
  Watches(std::shared_ptr<HttpClient> http, Hooks hooks);
  /// Calls stop().
  ~Watches();
  Watches(const Watches&) = delete;
  Watches& operator=(const Watches&) = delete;

  /// Starts to watch a resource. Responses of the server are reported as a Change: a refusal as `ended`.
  /// @param url  http or https; also "ws" and "wss"
  /// @par Errors  expected_iri, invalid_option; closed: after stop()
  Result<Watch> watch(std::string url, const WatchOptions& options, OnChange on_change, Delivery delivery = Delivery::as_options);

  /// Runs callbacks that are due, with Callbacks::in_poll, for about `budget`. Never waits.
  /// @return  more are due
  bool poll(std::chrono::microseconds budget) noexcept;
  /// Ends all watches, deletes callback subscriptions on their servers (at most 2 s), stops the HttpClient, and waits for the threads; for that of
  /// the caller it does not wait.
  void stop() noexcept;
  void check_clock() noexcept;

 private:
  std::shared_ptr<WatchContext> context_;
};

}  // namespace v0
}  // namespace lrt::client
