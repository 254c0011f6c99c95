// SPDX-License-Identifier: Apache-2.0
#include "src/server/feeds.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>
#include <variant>

#include <lrt/server.hpp>

#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

constexpr std::size_t max_removed = 1'000;

}  // namespace

Result<void> Feeds::open(const std::shared_ptr<Feed::State>& feed) {
  if (Result<void> open = server_.check_open(); !open) return open;
  const auto lock = server_.lock();
  if (all_.empty()) server_.engine().follow_resources(true);
  all_.push_back(feed);
  feed->waker->wake();  // all resources are new for it
  return {};
}

void Feeds::close(Feed::State& feed) noexcept {
  if (!server_.is_own_process()) return;
  {
    const auto lock = server_.lock();
    for (const auto& [channel, queued] : feed.channels) {
      server_.close(engine::Channel{channel});
      by_channel_.erase(channel);
    }
    for (auto at = by_ticket_.begin(); at != by_ticket_.end();) at = at->second.first == &feed ? by_ticket_.erase(at) : std::next(at);
    all_.erase(std::remove_if(all_.begin(), all_.end(), [&](const auto& other) { return other.get() == &feed; }), all_.end());
    if (all_.empty()) server_.engine().follow_resources(false);
  }
  server_.flush_log();
}

Result<engine::Subscribed> Feeds::subscribe(Feed::State& feed, engine::FeedSubscription wanted) {
  if (Result<void> open = server_.check_open(); !open) return Unexpected{std::move(open).error()};
  Result<engine::Subscribed> made = server_.use([&] {
    wanted.owner = feed.owner;
    Result<engine::Subscribed> subscribed = server_.engine().subscribe(std::move(wanted), server_.clock().now());
    if (subscribed) {
      by_channel_[number_of(subscribed->channel)] = &feed;
      feed.channels[number_of(subscribed->channel)] = subscribed->queues;
    }
    return subscribed;
  });
  server_.loop().wake_io();  // it observes changes from now on
  return made;
}

void Feeds::unsubscribe(Feed::State& feed, engine::Channel channel) noexcept {
  if (!server_.is_own_process()) return;
  {
    const auto lock = server_.lock();
    if (feed.channels.count(number_of(channel)) == 0) return;
    remove(feed, channel);
    server_.close(channel);
  }
  server_.flush_log();
}

void Feeds::repeat_all(Feed::State& feed) {
  if (!server_.is_open()) return;
  server_.use([&] {
    const auto now = server_.clock().now().steady;
    for (const auto& [channel, queued] : feed.channels)
      if (server_.engine().repeat(engine::Channel{channel})) feed.newest.push_back({engine::Channel{channel}, now});
  });
  feed.waker->wake();
  server_.loop().wake_io();  // of queues
}

std::uint64_t Feeds::send(Feed::State& feed, const http::Request& request, Feed::As as) {
  const bool open = server_.is_open();
  const TimePoint now = server_.clock().now();
  const Result<engine::Caller> caller = !open ? engine::Caller() : as == Feed::As::owner ? owner_of(feed) : server_.admit(request, now);
  const std::uint64_t number = feed.next_number++;  // of the feed's thread
  if (!open) {
    const auto lock = server_.lock();
    feed.responses.push_back({number, closed_response()});
    return number;
  }
  server_.use([&] {
    engine::Outcome outcome = server_.handle(request, caller, now);
    if (const auto* deferred = std::get_if<engine::Deferred>(&outcome)) by_ticket_[number_of(deferred->ticket)] = {&feed, number};
    else if (auto* response = std::get_if<http::Response>(&outcome)) feed.responses.push_back({number, std::move(*response)});
    else feed.responses.push_back({number, closed_response()});  // never: the request can neither stream nor upgrade
  });
  feed.waker->wake();
  server_.loop().wake_io();  // there may be a new deadline, or news for other clients
  return number;
}

Result<engine::Caller> Feeds::owner_of(const Feed::State& feed) {
  if (!server_.callers() || !feed.owner) return engine::Caller();
  const std::uint64_t revision = server_.engine().rights_revision();
  std::optional<engine::Caller> caller = server_.callers()->renew(feed.owner.get());
  if (caller) caller->rights_revision = revision;
  return caller ? *std::move(caller) : engine::Caller(engine::Access::forbidden);
}

Feed::Batch Feeds::take(Feed::State& feed, const Feed::Bounds& bounds) {
  Feed::Batch batch;
  batch.closed = !server_.is_open();
  feed.waker->clear();
  if (!server_.is_own_process()) return batch;
  bool has_timer = false;
  server_.use([&] {
    engine::Engine& engine = server_.engine();
    batch.responses = std::exchange(feed.responses, {});
    batch.structure = engine.structure();
    if (server_.is_stopping()) return;
    if (std::exchange(feed.lists_all, false)) {
      feed.resources.clear();
      batch.resources = engine.observable_resources();
    } else {
      batch.resources = std::exchange(feed.resources, {});
    }
    const auto deadline = engine.next_deadline();
    take_messages(feed, bounds, batch);
    const auto next = engine.next_deadline();
    has_timer = next && (!deadline || *next < *deadline);
    batch.more = bounds.max_messages != 0 && (!feed.newest.empty() || (bounds.queued && !feed.queued.empty()));
    batch.waiting = longest_wait(feed);
  });
  if (batch.more) feed.waker->wake();
  if (has_timer) server_.loop().wake_io();
  return batch;
}

std::chrono::milliseconds Feeds::longest_wait(const Feed::State& feed) const {
  std::chrono::steady_clock::duration longest{0};
  const auto now = server_.clock().now().steady;
  for (const auto* list : {&feed.newest, &feed.queued})
    if (!list->empty()) longest = std::max(longest, now - list->front().since);
  return std::chrono::ceil<std::chrono::milliseconds>(longest);
}

void Feeds::take_messages(Feed::State& feed, const Feed::Bounds& bounds, Feed::Batch& batch) {
  const TimePoint now = server_.clock().now();
  std::size_t bytes = 0;
  const auto take_from = [&](std::deque<Feed::State::Waiting>& list, std::size_t max) {
    while (!list.empty() && batch.messages.size() < max && bytes < bounds.max_bytes) {
      const engine::Channel channel = list.front().channel;
      list.pop_front();
      if (feed.channels.count(number_of(channel)) == 0) continue;  // it was removed
      std::optional<engine::FeedMessage> message = server_.engine().next_feed_message(channel, now);
      if (!message) continue;
      bytes += message->body ? message->body->size() : 0;
      if (message->end) remove(feed, channel);
      else list.push_back({channel, now.steady});
      batch.messages.push_back(*std::move(message));
    }
  };
  if (bounds.queued) take_from(feed.queued, (bounds.max_messages + 1) / 2);  // commands first, and some of both
  take_from(feed.newest, bounds.max_messages);
  if (bounds.queued) take_from(feed.queued, bounds.max_messages);
  for (const engine::Channel channel : std::exchange(feed.ended, {})) {
    engine::FeedMessage last;
    last.channel = channel;
    last.end = true;
    batch.messages.push_back(std::move(last));
  }
}

std::string Feeds::base() const {
  const auto lock = server_.lock();
  return server_.engine().base();
}

std::string Feeds::robot_time() const { return server_.robot_time(); }
Identity Feeds::robot_identity() const { return server_.identity(); }
bool Feeds::is_protected() const { return server_.callers() != nullptr; }

void Feeds::take(engine::Outputs& outputs) {
  if (outputs.structure) wake_all();
  if (outputs.new_resources.empty()) return;
  for (const auto& feed : all_) {
    if (feed->lists_all) continue;
    feed->resources.insert(feed->resources.end(), outputs.new_resources.begin(), outputs.new_resources.end());
    feed->lists_all = feed->resources.size() > Feed::State::max_new_resources;
    if (feed->lists_all) feed->resources.clear();
    feed->waker->wake();
  }
  outputs.new_resources.clear();
}

bool Feeds::claim(engine::Channel channel) {
  const auto found = by_channel_.find(number_of(channel));
  if (found == by_channel_.end()) return false;
  Feed::State& feed = *found->second;
  if (server_.engine().feed_has_ended(channel)) {
    server_.engine().closed(channel);
    feed.ended.push_back(channel);
    remove(feed, channel);
  } else {
    (feed.channels[number_of(channel)] ? feed.queued : feed.newest).push_back({channel, server_.clock().now().steady});
  }
  feed.waker->wake();
  return true;
}

bool Feeds::claim(engine::Reply& reply) {
  const auto found = by_ticket_.find(number_of(reply.ticket));
  if (found == by_ticket_.end()) return false;
  Feed::State& feed = *found->second.first;
  feed.responses.push_back({found->second.second, std::move(reply.response)});
  feed.waker->wake();
  by_ticket_.erase(found);
  return true;
}

void Feeds::wake_all() noexcept {
  for (const auto& feed : all_) feed->waker->wake();
}

void Feeds::remove(Feed::State& feed, engine::Channel channel) noexcept {
  by_channel_.erase(number_of(channel));
  feed.channels.erase(number_of(channel));
  if (++feed.removed < max_removed || 2 * feed.removed < feed.newest.size() + feed.queued.size()) return;
  feed.removed = 0;
  const auto is_gone = [&](const Feed::State::Waiting& other) { return feed.channels.count(number_of(other.channel)) == 0; };
  for (std::deque<Feed::State::Waiting>* list : {&feed.newest, &feed.queued})
    list->erase(std::remove_if(list->begin(), list->end(), is_gone), list->end());
}

// ------------------------------------------------------------------------------------------------------------------ Feed

Feed::Feed(std::shared_ptr<State> state) : state_(std::move(state)) {}
Feed::Feed(Feed&&) noexcept = default;
Feed& Feed::operator=(Feed&& other) noexcept {
  state_.swap(other.state_);
  return *this;
}
Feed::~Feed() {
  if (state_) state_->feeds.close(*state_);
}

Result<Feed> Feed::create(Server& server, std::shared_ptr<const security::Principal> owner) {
  Feeds* const feeds = server.feeds();
  if (!feeds) return unexpected(Errc::closed, "the Server was moved from: use the one to which it was moved");
  auto state = std::make_shared<State>(*feeds, std::move(owner));
  if (state->waker->descriptor() < 0)
    return unexpected(Errc::io_error, "cannot create an event descriptor for a feed: " + std::system_category().message(state->waker->error()));
  if (Result<void> opened = state->feeds.open(state); !opened) return Unexpected{std::move(opened).error()};
  return Feed(std::move(state));
}

Result<Feed::Channel> Feed::add(engine::FeedSubscription subscription) {
  const Result<engine::Subscribed> made = subscribe(std::move(subscription));
  if (!made) return Unexpected{made.error()};
  return made->channel;
}
Result<engine::Subscribed> Feed::subscribe(engine::FeedSubscription subscription) {
  return state_->feeds.subscribe(*state_, std::move(subscription));
}
void Feed::remove(Channel channel) { state_->feeds.unsubscribe(*state_, channel); }
void Feed::repeat_all() { state_->feeds.repeat_all(*state_); }
std::uint64_t Feed::send(const http::Request& request, As as) { return state_->feeds.send(*state_, request, as); }
Feed::Batch Feed::take(const Bounds& bounds) { return state_->feeds.take(*state_, bounds); }
int Feed::descriptor() const noexcept { return state_->waker->descriptor(); }
std::shared_ptr<Waker> Feed::waker() const { return state_->waker; }
std::string Feed::base() const { return state_->feeds.base(); }
std::string Feed::robot_time() const { return state_->feeds.robot_time(); }
Identity Feed::identity() const { return state_->feeds.robot_identity(); }
bool Feed::is_protected() const { return state_->feeds.is_protected(); }

std::unique_ptr<Service> make_feeds(SharedEngine& server) { return std::make_unique<Feeds>(server); }

}  // namespace lrt
