// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include <lrt/base/clock.hpp>

#include "src/transport/http/loop.hpp"
#include "src/base/output_parts.hpp"

namespace lrt::transport {

/// The number of reads in one turn: a fast sender must not delay the others.
inline constexpr int reads_per_turn = 4;

/// A client's place in the loop: an HTTP connection, or the WebSocket that it became. Either may carry a channel of the handler: an event
/// stream or a WebSocket's messages, which are pulled from the handler when those before have been sent.
class Client : public Watched, public Linked<TurnTag>, public std::enable_shared_from_this<Client> {
 public:
  virtual ~Client() = default;

  /// How many messages of its channel it accepts now; 0: none, or it has no channel.
  std::size_t max_messages() const noexcept { return channel_ ? room_for_messages() : 0; }
  std::optional<engine::Channel> channel() const noexcept { return channel_; }
  /// Sends messages of its channel, at most max_messages().
  /// @param later  it keeps them, and sends them when it has its turn: the budget is used up
  void push(engine::Push* pushes, std::size_t count, TimePoint now, bool later) noexcept {
    call([&] {
      take_turn(pushes, count, now, later);
      update(now);
    });
  }
  /// When messages were sent last, as the number of that turn; 0: never.
  std::uint64_t last_turn() const noexcept { return last_turn_; }

  /// The server stops: closes what can be closed now.
  virtual void begin_stop(TimePoint now) = 0;
  /// True while stop() should wait for a response or for the client's half of a closing handshake.
  virtual bool is_busy() const noexcept = 0;
  /// Called when the time limit of stop() has passed.
  virtual void give_up(TimePoint now) = 0;
  virtual void close() noexcept = 0;
  void failed(const char* why) noexcept override;

  std::shared_ptr<Client> next_deferred;  ///< Readiness::defer_delete()

 protected:
  explicit Client(Loop& loop) : loop_(loop) {}

  /// Sends like send(2), at most max_bytes_per_call of plain text: the system copies a long message in one step, which no budget can interrupt.
  /// @param tls  nullptr: plain
  static ssize_t send(const Socket& socket, TlsStream* tls, const OutputParts& output);

  /// Enters the loop's list.
  void join();
  /// Leaves it; deleted later.
  void leave() noexcept;
  /// Replaces this by `next` in the loop's list.
  void make_way(std::shared_ptr<Client> next) noexcept;

  /// From now on push() is called when the handler has messages for the channel.
  void open_channel(engine::Channel channel, const Socket& socket);
  void close_channel() noexcept;
  /// Sends the handler's messages for the channel, while the client accepts them and for one turn.
  void push_some(TimePoint now);

  /// More than 0: the channel is open, and everything before has been sent.
  virtual std::size_t room_for_messages() const noexcept = 0;
  /// @param later  keeps them, and sends them in a later turn
  virtual void send_messages(engine::Push* pushes, std::size_t count, TimePoint now, bool later) = 0;
  /// Updates the events to wait for, and closes a finished connection.
  virtual void update(TimePoint now) = 0;

  Loop& loop_;

 private:
  void take_turn(engine::Push* pushes, std::size_t count, TimePoint now, bool later) {
    last_turn_ = ++loop_.turn;
    send_messages(pushes, count, now, later);
  }

  std::size_t index_ = 0;  ///< in loop_.clients
  std::uint64_t last_turn_ = 0;
  std::optional<engine::Channel> channel_;
};

}  // namespace lrt::transport
