// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/feed.hpp>

#include "src/base/event_waker.hpp"

namespace lrt {
inline namespace v0 {

/// The interface of the server for feeds.
class FeedHost {
 public:
  virtual Result<void> open_feed(const std::shared_ptr<Feed::State>& feed) = 0;
  virtual void close_feed(Feed::State& feed) noexcept = 0;
  virtual Result<engine::Channel> subscribe(Feed::State& feed, engine::FeedSubscription wanted) = 0;
  virtual void unsubscribe(Feed::State& feed, engine::Channel channel) noexcept = 0;
  virtual void repeat_all(Feed::State& feed) = 0;
  virtual std::uint64_t send(Feed::State& feed, const http::Request& request, Feed::As as) = 0;
  virtual void take(Feed::State& feed, const Feed::Bounds& bounds, Feed::Batch& batch) = 0;
  virtual std::string feed_base() const = 0;
  virtual bool is_protected() const = 0;

 protected:
  ~FeedHost() = default;
};

/// @par Threads  All but `waker` and `host` are used with the engine's lock.
class Feed::State {
 public:
  State(FeedHost& server, std::shared_ptr<const security::Principal> whose) : host(server), owner(std::move(whose)) {}

  /// If resources are not taken, they are not stored one by one.
  static constexpr std::size_t max_new_resources = 10'000;

  FeedHost& host;
  const std::shared_ptr<const security::Principal> owner;
  const std::shared_ptr<EventWaker> waker = std::make_shared<EventWaker>();
  std::deque<engine::Channel> newest, queued;         ///< channels with pending messages, by whether their subscriptions have a queue
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
/// @par Threads  All functions are called with the engine's lock.
class Feeds {
 public:
  bool empty() const noexcept { return all_.empty(); }
  const std::vector<std::shared_ptr<Feed::State>>& all() const noexcept { return all_; }
  void add(std::shared_ptr<Feed::State> feed) { all_.push_back(std::move(feed)); }
  void remove(const Feed::State& feed) {
    for (const auto& [channel, queued] : feed.channels) by_channel_.erase(channel);
    for (auto at = by_ticket_.begin(); at != by_ticket_.end();) at = at->second.first == &feed ? by_ticket_.erase(at) : std::next(at);
    all_.erase(std::remove_if(all_.begin(), all_.end(), [&](const auto& other) { return other.get() == &feed; }), all_.end());
  }

  void add(Feed::State& feed, engine::Channel channel, bool queued) {
    by_channel_[number_of(channel)] = &feed;
    feed.channels[number_of(channel)] = queued;
  }
  void remove(Feed::State& feed, engine::Channel channel) noexcept {
    by_channel_.erase(number_of(channel));
    feed.channels.erase(number_of(channel));
    if (++feed.removed < max_removed || 2 * feed.removed < feed.newest.size() + feed.queued.size()) return;
    feed.removed = 0;
    const auto is_gone = [&](engine::Channel other) { return feed.channels.count(number_of(other)) == 0; };
    for (std::deque<engine::Channel>* list : {&feed.newest, &feed.queued})
      list->erase(std::remove_if(list->begin(), list->end(), is_gone), list->end());
  }
  void add(Feed::State& feed, engine::Ticket ticket, std::uint64_t number) { by_ticket_[static_cast<std::uint64_t>(ticket)] = {&feed, number}; }

  /// The channel has a message. False: it does not belong to a feed.
  bool take(engine::Channel channel, engine::Engine& engine) {
    const auto found = by_channel_.find(number_of(channel));
    if (found == by_channel_.end()) return false;
    Feed::State& feed = *found->second;
    if (engine.feed_has_ended(channel)) {
      engine.closed(channel);
      feed.ended.push_back(channel);
      remove(feed, channel);
      feed.waker->wake();
      return true;
    }
    (feed.channels[number_of(channel)] ? feed.queued : feed.newest).push_back(channel);
    feed.waker->wake();
    return true;
  }
  /// Keeps a response for its feed. False: it does not belong to a feed.
  bool take(engine::Reply& reply) {
    const auto found = by_ticket_.find(static_cast<std::uint64_t>(reply.ticket));
    if (found == by_ticket_.end()) return false;
    Feed::State& feed = *found->second.first;
    feed.responses.push_back({found->second.second, std::move(reply.response)});
    feed.waker->wake();
    by_ticket_.erase(found);
    return true;
  }
  void take(std::vector<engine::ObservableResource> resources) {
    if (resources.empty()) return;
    for (const auto& feed : all_) {
      if (feed->lists_all) continue;
      feed->resources.insert(feed->resources.end(), resources.begin(), resources.end());
      feed->lists_all = feed->resources.size() > Feed::State::max_new_resources;
      if (feed->lists_all) feed->resources.clear();
      feed->waker->wake();
    }
  }
  /// Incremented with each change of the structure.
  void see(std::uint64_t structure) noexcept {
    if (std::exchange(structure_, structure) != structure) wake_all();
  }
  void wake_all() noexcept {
    for (const auto& feed : all_) feed->waker->wake();
  }

 private:
  static constexpr std::size_t max_removed = 1'000;
  static std::uint64_t number_of(engine::Channel channel) noexcept { return static_cast<std::uint64_t>(channel); }

  std::vector<std::shared_ptr<Feed::State>> all_;
  std::uint64_t structure_ = 0;
  std::unordered_map<std::uint64_t, Feed::State*> by_channel_;
  std::unordered_map<std::uint64_t, std::pair<Feed::State*, std::uint64_t>> by_ticket_;  ///< with the number of the request
};

}  // namespace v0
}  // namespace lrt
