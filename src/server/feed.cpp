// SPDX-License-Identifier: Apache-2.0
#include <lrt/feed.hpp>

#include <system_error>
#include <utility>

#include <lrt/server.hpp>

#include "src/server/feeds.hpp"

namespace lrt {
inline namespace v0 {

Feed::Feed(std::shared_ptr<State> state) : state_(std::move(state)) {}
Feed::Feed(Feed&&) noexcept = default;
Feed& Feed::operator=(Feed&& other) noexcept {
  state_.swap(other.state_);
  return *this;
}
Feed::~Feed() {
  if (state_) state_->host.close_feed(*state_);
}

Result<Feed> Feed::create(Server& server, std::shared_ptr<const security::Principal> owner) {
  auto state = std::make_shared<State>(server.feed_host(), std::move(owner));
  if (state->waker->descriptor() < 0)
    return unexpected(Errc::io_error, "cannot create an event descriptor for a feed: " + std::system_category().message(state->waker->error()));
  if (Result<void> opened = state->host.open_feed(state); !opened) return Unexpected{std::move(opened).error()};
  return Feed(std::move(state));
}

Result<Feed::Channel> Feed::add(engine::FeedSubscription subscription) { return state_->host.subscribe(*state_, std::move(subscription)); }
void Feed::remove(Channel channel) { state_->host.unsubscribe(*state_, channel); }
void Feed::repeat_all() { state_->host.repeat_all(*state_); }
std::uint64_t Feed::send(const http::Request& request, As as) { return state_->host.send(*state_, request, as); }
Feed::Batch Feed::take(const Bounds& bounds) {
  Batch batch;
  state_->host.take(*state_, bounds, batch);
  return batch;
}
int Feed::descriptor() const noexcept { return state_->waker->descriptor(); }
std::shared_ptr<Waker> Feed::waker() const { return state_->waker; }
std::string Feed::base() const { return state_->host.feed_base(); }
bool Feed::is_protected() const { return state_->host.is_protected(); }

}  // namespace v0
}  // namespace lrt
