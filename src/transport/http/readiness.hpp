// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/epoll.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>

#include "src/transport/http/list.hpp"
#include "src/transport/http/socket.hpp"

namespace lrt::transport {

class Client;
struct LaterTag;

/// Base of an object that is called when its descriptor is ready.
class Watched : public Linked<LaterTag> {
 public:
  /// @param events  of epoll_wait(2). They may be outdated: only system calls show the current state.
  virtual void on_ready(std::uint32_t events) = 0;
  /// Follows a call of Readiness::later().
  virtual void go_on() {}
  /// One of the functions above threw an exception: there is no memory. A client is closed, because nobody knows how far it got.
  virtual void failed(const char* why) noexcept { (void)why; }
  /// Calls one of its functions.
  template <class F>
  void call(F f) noexcept {
    try {
      f();
    } catch (const std::exception& e) { failed(e.what()); } catch (...) {
      failed("an exception that is not a std::exception");
    }
  }

 protected:
  Watched() = default;
  ~Watched() = default;
};

/// One epoll set: level-triggered, so that a keep-alive connection is registered once and events that the budget leaves over are not lost. One
/// thread.
///
/// It serves in rounds, each over as many calls as its budgets need: first the descriptors that are ready when the round begins, then, for
/// `turns_time` and at least one step, those that called later(), in that order. So a descriptor that is always ready cannot delay the others, and
/// new events are served before the rest of long work, for any number of descriptors.
class Readiness {
 public:
  bool open();
  /// Deletes the deferred, too.
  void close() noexcept;
  bool is_open() const noexcept { return set_.is_open(); }
  /// The descriptor of the set. It is readable while a descriptor in the set is ready.
  int descriptor() const noexcept { return set_.descriptor(); }

  /// Watched::on_ready() is called for each of `events` and for errors. Replaces the previous Watched and events.
  /// Returns false if the system cannot poll another descriptor.
  bool watch(Socket& socket, Watched& by, std::uint32_t events) noexcept;
  /// Polls a descriptor that lrt does not own. Once.
  bool add(int descriptor, Watched& by, std::uint32_t events) noexcept;
  /// Closes the socket. An event that was fetched before may still be delivered.
  void close(Socket& socket) noexcept;

  /// The time of each round for objects that called later().
  static constexpr std::chrono::microseconds turns_time{100};

  /// Watched::go_on() follows, after the descriptors that are ready now.
  void later(Watched& watched) noexcept {
    if (!watched.is_linked()) later_.push_back(watched);
  }
  /// serve() has work without a system call.
  bool has_left() const noexcept { return next_ < count_ || !later_.empty(); }

  /// Waits until a descriptor is ready, then serves until none is. Returns false if the budget ended that.
  /// @param wait  milliseconds; 0: one system call if none is ready
  bool serve(int wait);

  /// Deletes a closed client when no event can point to it and none of its functions is running.
  void defer_delete(std::shared_ptr<Client> client) noexcept;
  /// Must be called when none is running.
  void delete_deferred() noexcept;
  /// The same, and drops the events that the budget left over of this round: epoll will report them again.
  void drop() noexcept;

  /// The budget begins with the next step, and allows at least that.
  void set_budget(std::chrono::microseconds budget) noexcept {
    budget_ = budget;
    end_.reset();
  }
  /// Whether the budget that set_budget() gave is used up.
  bool is_over() noexcept;
  /// The rest of the budget.
  std::chrono::microseconds budget_left() const noexcept;
  /// How many steps of that time the budget still allows; at least 1.
  std::size_t steps_left(std::chrono::microseconds step, std::size_t max) noexcept;

 private:
  bool serve_round();
  bool serve_turns();
  void delete_all() noexcept;
  void begin_budget() noexcept;

  Socket set_;
  std::array<epoll_event, 128> events_;  ///< of this round
  int next_ = 0;                         ///< of them
  int count_ = 0;
  bool had_turns_ = true;  ///< the round has come to them
  List<Watched, LaterTag> later_;
  std::chrono::microseconds budget_{0};
  std::optional<std::chrono::steady_clock::time_point> end_;
  std::shared_ptr<Client> deferred_;  ///< the first of a list: Client::next_deferred
};

}  // namespace lrt::transport
