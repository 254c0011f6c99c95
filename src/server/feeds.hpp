// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/feed.hpp>

#include "src/base/event_waker.hpp"
#include "src/server/service.hpp"

namespace lrt {
inline namespace v0 {

class Feeds;

/// @par Threads  All but `waker` and `feeds` are used with the engine's lock.
class LRT_LOCAL Feed::State {
 public:
  State(Feeds& server, std::shared_ptr<const security::Principal> whose) : feeds(server), owner(std::move(whose)) {}

  /// If resources are not taken, they are not stored one by one.
  static constexpr std::size_t max_new_resources = 10'000;

  Feeds& feeds;
  const std::shared_ptr<const security::Principal> owner;
  const std::shared_ptr<EventWaker> waker = std::make_shared<EventWaker>();
  /// A channel that may have a message, since when.
  struct Waiting {
    engine::Channel channel;
    std::chrono::steady_clock::time_point since;
  };
  std::deque<Waiting> newest, queued;                 ///< by whether their subscriptions have a queue, the longest waiting first
  std::deque<engine::Channel> ended;                  ///< channels whose only message is their end
  std::size_t removed = 0;                            ///< channels that may be left in `newest` and `queued`
  std::unordered_map<std::uint64_t, bool> channels;   ///< its subscriptions, and whether they have a queue
  std::vector<engine::ObservableResource> resources;  ///< that are new
  bool lists_all = true;                              ///< the next take() has all resources
  std::uint64_t next_number = 1;
  std::vector<Feed::Response> responses;
};

/// The feeds of a server, with their channels and tickets.
///
/// @par Threads  Any; the functions for a feed are called by the thread of the feed.
class Feeds final : public Service, public Receiver {
 public:
  static constexpr char key = 0;
  const char* identity() const noexcept override { return &key; }
  Receiver* receiver() noexcept override { return this; }

  explicit Feeds(SharedEngine& server) : server_(server) {}

  // As those of Feed.
  Result<void> open(const std::shared_ptr<Feed::State>& feed);
  void close(Feed::State& feed) noexcept;
  Result<engine::Subscribed> subscribe(Feed::State& feed, engine::FeedSubscription wanted);
  void unsubscribe(Feed::State& feed, engine::Channel channel) noexcept;
  void repeat_all(Feed::State& feed);
  std::uint64_t send(Feed::State& feed, const http::Request& request, Feed::As as);
  Feed::Batch take(Feed::State& feed, const Feed::Bounds& bounds);
  std::string base() const;
  std::string robot_time() const;
  bool is_protected() const;
  Identity robot_identity() const;

  void take(engine::Outputs& outputs) override;
  bool claim(engine::Reply& reply) override;
  bool claim(engine::Channel channel) override;
  void wake_all() noexcept override;

 private:
  Result<engine::Caller> owner_of(const Feed::State& feed);
  std::chrono::milliseconds longest_wait(const Feed::State& feed) const;
  void take_messages(Feed::State& feed, const Feed::Bounds& bounds, Feed::Batch& batch);
  void remove(Feed::State& feed, engine::Channel channel) noexcept;

  SharedEngine& server_;
  std::vector<std::shared_ptr<Feed::State>> all_;
  std::unordered_map<std::uint64_t, Feed::State*> by_channel_;
  std::unordered_map<std::uint64_t, std::pair<Feed::State*, std::uint64_t>> by_ticket_;  ///< with the number of the request
};

}  // namespace v0
}  // namespace lrt
