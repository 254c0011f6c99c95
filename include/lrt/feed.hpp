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
#include <lrt/identity.hpp>
#include <lrt/security.hpp>

namespace lrt {
inline namespace v0 {

class Server;

/// Subscriptions and requests of a host that connects a server to another protocol. lrt::mqtt::Bridge uses it.
///
/// The subscriptions are those of any client: the same limits of queues, the same counters, newest value or queue,
/// minimum interval. They are resources that clients can read. Messages are pulled: while the host takes none, a
/// subscription stores one flag, or its queue, and nothing else. Of subscriptions that have ended the queues are kept
/// until they are taken, those of 1,000 and 4 MiB at most; beyond that the oldest are dropped. publish() in the control loop is not affected. take()
/// reports Things that are added later, and invocations.
///
/// A feed must not outlive its server. After Server::stop() it returns nothing more.
///
/// @par Threads  One thread at a time, any; not from a lambda of the server. waker() returns an object whose wake() any
///               thread may call.
class LRT_API Feed {
 public:
  using Channel = subscription::Channel;  ///< identifies a subscription

  /// Limits of one take().
  struct Bounds {
    std::size_t max_messages = 64;       ///< without those that say `end`; 0: waiting messages do not make the descriptor readable
    std::size_t max_bytes = 256 * 1024;  ///< no further message is taken when the bodies have reached this size
    bool queued = true;                  ///< false: only newest values; they are taken before the messages in queues
  };
  /// The response to a request of send().
  struct Response {
    std::uint64_t number;     ///< as send() returned it
    http::Response response;  ///< the response
  };
  /// What take() returns.
  struct Batch {
    std::vector<engine::ObservableResource> resources;  ///< first call: all observable resources; later: those that are new or have another path
    std::vector<engine::FeedMessage> messages;          ///< messages of subscriptions
    std::vector<Response> responses;                    ///< responses to requests of send()
    std::uint64_t structure = 0;  ///< changes when a Thing is added or removed, or its description changes, such as the availability of an action
    bool more = false;            ///< more may be available at once
    bool closed = false;          ///< the server has stopped
    /// How long the longest waiting subscription has had a message, or has had the chance of one, that was not taken; 0: none
    /// waits.
    std::chrono::milliseconds waiting{0};
  };

  /// The identity with which a request is authorized.
  enum class As : std::uint8_t {
    sender,  ///< the principal of the request's own credentials
    owner,   ///< the owner of the feed
  };

  /// Makes a feed.
  /// @param server  the server; it must outlive the feed
  /// @param owner   the principal of its subscriptions, which show what this principal may read. nullptr: everything
  /// @par Errors    closed; io_error: no descriptor
  static Result<Feed> create(Server& server, std::shared_ptr<const security::Principal> owner = nullptr);
  Feed(Feed&&) noexcept;
  Feed& operator=(Feed&&) noexcept;
  /// Ends its subscriptions. Pending responses are dropped.
  ~Feed();

  /// Subscribes to a resource. Its first message is the present representation.
  /// @par Errors  unknown_path: there is no such resource; refused: it cannot be observed, or the owner may not subscribe
  ///              to it; unsupported_syntax: it does not have the media type; limit_exceeded:
  ///              SubscriptionOptions::max_feed_subscriptions; closed: the server has stopped
  Result<Channel> add(engine::FeedSubscription subscription);
  /// The same, and says what the values mean, for a host that sends them without RDF.
  /// @par Errors  as add()
  Result<engine::Subscribed> subscribe(engine::FeedSubscription subscription);
  /// Ends a subscription. No message of it follows.
  void remove(Channel channel);
  /// Marks the present representations of all its subscriptions without a queue as messages again, although they were
  /// taken; with a queue, if FeedSubscription::repeats is set and the queue is empty.
  void repeat_all();

  /// Handles a request as Server::serve() does, with the same authorization, and does not wait. The views of `request`
  /// need to be valid during the call.
  /// @return  the number of its response, which take() returns, perhaps only after Server::poll()
  std::uint64_t send(const http::Request& request, As as = As::sender);

  /// Takes what is available, within the bounds, and does not wait. Channels take turns.
  Batch take(const Bounds& bounds);
  /// A descriptor that is readable while take() has something to return, or after wake() of waker(). take() makes it
  /// unreadable.
  int descriptor() const noexcept;
  /// An object whose wake() makes the descriptor readable, from any thread.
  std::shared_ptr<Waker> waker() const;

  /// The base IRI of its representations, without a slash at the end: Listen::public_base, or where the server listens.
  std::string base() const;
  /// The stamp of the present time, "0123456789abcdef/73521": this run of the server, and milliseconds since it began.
  /// A request says in such stamps until when it is valid (Valid-Until, SPEC 3.20).
  std::string robot_time() const;
  /// Options::identity. Without one its `iri` is Listen::public_base; empty: the server has neither, and another name
  /// after each change of its address.
  Identity identity() const;
  /// Whether the server's security restricts requests without credentials.
  bool is_protected() const;

  /// The state of a feed; defined in src/server.
  class State;

 private:
  explicit Feed(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace v0
}  // namespace lrt
