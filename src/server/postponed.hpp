// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>

#include "src/engine/context.hpp"

namespace lrt {

/// What poll() could not hand to the engine because another thread had it: requests, and the ends of requests and channels. It does not wait; what is
/// here is done as soon as it finds the engine free, a few items each time. To its transport such a request is deferred, with a ticket of this class.
///
/// @par Threads  The one that serves the network, except renamed() and rename(), which are called with the engine's lock.
class Postponed {
 public:
  /// A request that waits, then its response.
  struct Request {
    Request(const http::Request& request, const Result<engine::Caller>& its_caller, engine::Ticket its_ticket);
    /// As it was; views of this object.
    http::Request view() const;

    const engine::OwnedRequest head;
    const std::shared_ptr<const void> body_owner;
    const std::string own_body;  ///< without an owner
    const std::string_view body;
    const Result<engine::Caller> caller;
    const std::string client;  ///< under which its body is counted
    engine::Reply reply;
  };
  /// What the transport has reported.
  struct End {
    enum class Kind : std::uint8_t { closed, abandoned, input_ended };
    Kind kind;
    std::uint64_t number;  ///< of the channel or ticket
  };

  /// Nothing waits for the engine.
  bool empty() const noexcept { return requests_.empty() && ends_.empty(); }

  // Requests.
  /// @return  its ticket; nullopt: as many wait as may, or max_waiting_body_bytes of larger bodies, a quarter of it of one client
  std::optional<engine::Ticket> add(const http::Request& request, const Result<engine::Caller>& caller, const engine::Limits& limits);
  /// Calls handle(Request&) -> bool with up to `most` requests; true: `reply` is the response.
  template <class F>
  void hand_over(std::size_t most, F handle) {
    for (; most > 0 && !requests_.empty(); --most) {
      std::list<Request> first;
      first.splice(first.begin(), requests_, requests_.begin());
      uncount(first.front());
      if (handle(first.front())) replies_.splice(replies_.end(), first);
    }
  }
  bool has_reply() const noexcept { return !replies_.empty(); }
  std::optional<engine::Reply> take_reply();
  /// A ticket of this class.
  static bool is_own(engine::Ticket ticket) noexcept { return (static_cast<std::uint64_t>(ticket) & own_bit) != 0; }
  /// The client of a waiting request has gone. False: it does not wait here any more.
  bool forget(engine::Ticket ticket) noexcept;

  // Tickets of requests that the engine has deferred.
  bool has_renamed() const noexcept { return !renamed_.empty(); }
  void rename(engine::Ticket from, engine::Ticket to) { renamed_.emplace_back(from, to); }
  /// The engine's ticket behind one of this class; nullopt: there is none.
  std::optional<engine::Ticket> renamed(engine::Ticket own) const noexcept;
  void forget_renamed(engine::Ticket own) noexcept;
  /// Gives the reply the ticket that the transport knows.
  void give_back_name(engine::Reply& reply) noexcept;

  // Ends.
  void add(End end) { ends_.push_back(end); }
  std::vector<End> take_ends() noexcept { return std::exchange(ends_, {}); }

 private:
  static constexpr std::uint64_t own_bit = std::uint64_t{1} << 63;
  /// Bodies up to this are not counted, so that no stop is refused for the bodies of others.
  static constexpr std::size_t small_body_bytes = 4096;

  void uncount(const Request& waiting) noexcept;

  std::uint64_t next_ = 1;
  std::list<Request> requests_, replies_;
  std::size_t bytes_ = 0;                        ///< of larger bodies in requests_
  std::map<std::string, std::size_t> bytes_of_;  ///< the same of each client; not a hash table, because clients choose their IPv6 addresses
  std::vector<End> ends_;
  std::vector<std::pair<engine::Ticket, engine::Ticket>> renamed_;  ///< the engine's, the transport's
};

}  // namespace lrt
