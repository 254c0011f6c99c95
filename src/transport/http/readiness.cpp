// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/readiness.hpp"

#include <algorithm>

#include "src/transport/http/client.hpp"

namespace lrt::transport {

bool Readiness::open() {
  if (!set_.is_open()) set_ = Socket(::epoll_create1(EPOLL_CLOEXEC));
  return set_.is_open();
}

void Readiness::close() noexcept {
  drop();
  set_ = Socket();
}

bool Readiness::watch(Socket& socket, Watched& by, std::uint32_t events) noexcept {
  if (socket.watched_by_ == &by && socket.events_ == events) return true;
  epoll_event event{};
  event.events = events;  // errors are always reported
  event.data.ptr = &by;
  if (::epoll_ctl(set_.descriptor(), socket.watched_by_ ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, socket.descriptor(), &event) != 0) return false;
  socket.watched_by_ = &by;
  socket.events_ = events;
  return true;
}

bool Readiness::add(int descriptor, Watched& by, std::uint32_t events) noexcept {
  epoll_event event{};
  event.events = events;
  event.data.ptr = &by;
  return ::epoll_ctl(set_.descriptor(), EPOLL_CTL_ADD, descriptor, &event) == 0;
}

/// Closing takes a descriptor out of the set only when no child of the host has inherited it, between fork() and exec().
void Readiness::close(Socket& socket) noexcept {
  if (socket.watched_by_) ::epoll_ctl(set_.descriptor(), EPOLL_CTL_DEL, socket.descriptor(), nullptr);
  socket = Socket();
}

void Readiness::defer_delete(std::shared_ptr<Client> client) noexcept {
  client->next_deferred = std::move(deferred_);
  deferred_ = std::move(client);
}

/// One after the other: each would destroy the rest of the list with it.
void Readiness::delete_all() noexcept {
  while (deferred_) deferred_ = std::shared_ptr<Client>(std::move(deferred_->next_deferred));
}

void Readiness::delete_deferred() noexcept {
  if (next_ >= count_) delete_all();
}

void Readiness::drop() noexcept {
  next_ = count_ = 0;
  delete_deferred();
}

bool Readiness::is_over() noexcept {
  const auto now = std::chrono::steady_clock::now();
  if (!end_) end_ = now + budget_;
  return now >= *end_;
}

std::chrono::microseconds Readiness::budget_left() const noexcept {
  if (!end_) return budget_;
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(*end_ - std::chrono::steady_clock::now());
  return std::max(left, std::chrono::microseconds(0));
}

std::size_t Readiness::steps_left(std::chrono::microseconds step, std::size_t max) noexcept {
  begin_budget();
  const auto left = *end_ - std::chrono::steady_clock::now();
  return left <= step ? 1 : std::min(max, static_cast<std::size_t>(left / step));
}

/// At the first step, not after it: two handshakes must not fit into a budget that one of them exceeds.
void Readiness::begin_budget() noexcept {
  if (!end_) end_ = std::chrono::steady_clock::now() + budget_;
}

bool Readiness::serve(int wait) {
  if (has_left()) {
    wait = 0;
    begin_budget();
  }
  if (!serve_round()) return false;
  for (;;) {
    delete_all();
    next_ = 0;
    had_turns_ = false;
    count_ = ::epoll_wait(set_.descriptor(), events_.data(), static_cast<int>(events_.size()), wait);
    wait = 0;
    if (count_ > 0 || !later_.empty()) begin_budget();
    const bool many = count_ > 1;  // there is time for others to become ready
    if (!serve_round()) return false;
    if (!many && later_.empty()) return true;
  }
}

/// The rest of a round. False when the budget ended it.
bool Readiness::serve_round() {
  while (next_ < count_) {
    const auto& event = events_[static_cast<std::size_t>(next_++)];
    auto& watched = *static_cast<Watched*>(event.data.ptr);
    watched.call([&] { watched.on_ready(event.events); });
    if (is_over()) return false;
  }
  return had_turns_ || serve_turns();
}

/// The budget may end them: the next round goes on.
bool Readiness::serve_turns() {
  had_turns_ = true;
  const auto end = std::chrono::steady_clock::now() + turns_time;
  while (!later_.empty()) {
    auto& turn = later_.front();
    turn.unlink();
    turn.call([&] { turn.go_on(); });
    if (is_over()) return false;
    if (std::chrono::steady_clock::now() >= end) return true;
  }
  return true;
}

}  // namespace lrt::transport
