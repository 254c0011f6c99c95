// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>
#include <lrt/subscription/channel.hpp>

namespace lrt {
inline namespace v0 {

class GuestRequests;

/// The events of one event stream that Server::serve() has opened. Destroying it ends the subscription. It must not
/// outlive the server.
///
/// @par Threads  One thread at a time.
/// @par Implements  WHATWG HTML 9.2 (server-sent events)
class LRT_API EventSource {
 public:
  /// What next() returns.
  struct Event {
    std::shared_ptr<const std::string> bytes;  ///< to be sent unchanged; nullptr: there was no event within the time
    bool end = false;                          ///< the stream has ended: nothing follows
  };
  EventSource(EventSource&& other) noexcept;
  EventSource& operator=(EventSource&& other) noexcept;
  ~EventSource();
  /// Waits for the next event, at most a day.
  Event next(std::chrono::milliseconds max_wait);

 private:
  friend class Server;
  EventSource(GuestRequests& guests, subscription::Channel channel);
  GuestRequests* guests_;
  subscription::Channel channel_;
};

/// What Server::serve() returns.
struct Served {
  http::Response response;            ///< the response
  std::optional<EventSource> events;  ///< the response is an event stream: send its header section, then these events
};

}  // namespace v0
}  // namespace lrt
