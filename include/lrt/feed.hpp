// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/waker.hpp>
#include <lrt/engine/feed.hpp>
#include <lrt/http/message.hpp>
#include <lrt/security.hpp>

namespace lrt {
inline namespace v0 {

class Server;

/// The way out of a server for a host that passes on what its resources say, and the way in for what comes back: lrt::mqtt::Bridge is one.
///
/// Its subscriptions are those of any client: the same limits of queues, the same counters, newest value or queue, minimum interval. They are resources
/// that clients can read. Messages are pulled: as long as the host takes none, a subscription keeps one flag, or its queue, and nothing else.
/// publish() in the control loop does not know of it. Things that are added later, and invocations, are told by take().
///
/// It must not outlive its server. After Server::stop() it has nothing more.
///
/// @par Threads  One at a time, any; not a lambda of the server. wake() of waker(): any.
class LRT_API Feed {
 public:
  using Channel = subscription::Channel;

  /// Bounds of one take().
  struct Bounds {
    std::size_t max_messages = 64;       ///< 0: none, and what waits does not make the descriptor readable
    std::size_t max_bytes = 256 * 1024;  ///< after a message by which the bodies reach this, it takes no more
    bool queued = true;                  ///< false: only newest values, which then precede what waits in queues
  };
  /// The response to a request of send().
  struct Response {
    std::uint64_t number;
    http::Response response;
  };
  /// What take() has found.
  struct Batch {
    std::vector<engine::ObservableResource> resources;  ///< with the first call all that can be observed, then those that came, or have another path
    std::vector<engine::FeedMessage> messages;
    std::vector<Response> responses;
    std::uint64_t structure = 0;  ///< moves whenever a Thing comes or goes, or what one promises changes, such as the availability of an action
    bool more = false;            ///< there may be more at once
    bool closed = false;          ///< the server has stopped
  };

  /// Who sends a request.
  enum class As : std::uint8_t {
    sender,  ///< whom the credentials of the request name
    owner,   ///< the owner of the feed
  };

  /// @param owner  whose feed it is: its subscriptions show what this principal may see. nullptr: everything
  /// @par Errors   closed; io_error: no descriptor
  static Result<Feed> create(Server& server, std::shared_ptr<const security::Principal> owner = nullptr);
  Feed(Feed&&) noexcept;
  Feed& operator=(Feed&&) noexcept;
  /// Ends its subscriptions. Responses that are to come are dropped.
  ~Feed();

  /// Subscribes to a resource. Its first message is the present representation.
  /// @par Errors  unknown_path; refused; unsupported_syntax; limit_exceeded: SubscriptionOptions::max_feed_subscriptions; closed
  Result<Channel> add(engine::FeedSubscription subscription);
  /// Ends a subscription. No message of it follows.
  void remove(Channel channel);
  /// The present representations of all its subscriptions without a queue are messages again, although they were taken.
  void repeat_all();

  /// Handles a request as Server::serve() does, with the same authorization, and does not wait. The views of `request` need to live for the call.
  /// @return  the number of its response, which take() has, perhaps only after Server::poll()
  std::uint64_t send(const http::Request& request, As as = As::sender);

  /// Takes what there is, within the bounds, and does not wait. Channels take turns.
  Batch take(const Bounds& bounds);
  /// Readable while take() has something, or after wake() of the waker. take() makes it unreadable.
  int descriptor() const noexcept;
  std::shared_ptr<Waker> waker() const;

  /// The base IRI of its representations, without a slash at the end: Listen::public_base, or where the server listens.
  std::string base() const;
  /// Security of the server restricts what a request without credentials may do.
  bool is_protected() const;

  /// What a server has of one feed; known to src/server only.
  class State;

 private:
  explicit Feed(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace v0
}  // namespace lrt
