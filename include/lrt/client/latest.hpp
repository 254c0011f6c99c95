// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include <lrt/client/watch.hpp>

namespace lrt::client {
inline namespace v0 {

/// The newest value of a watched resource, for a control loop: a joint that follows a joint of another robot.
///
///     lrt::client::Latest<double> angle = ...;            // of Client
///     while (robot_ok()) {
///       angle.take(target);                               // wait-free; target keeps its value if there is no new one
///       if (!angle.is_connected() || angle.age() > 100ms) stop_softly();
///       control_step(target);
///     }
///
/// A thread of the client that receives values decodes them. There are three cells: decoder and loop own one each and
/// exchange the third. A moved-from or empty handle returns no values.
///
/// @tparam T  with rdf::traits<T> or what the decoder makes; it owns no memory
/// @par Threads  take(), age(): one thread at a time, the control loop. The others: any.
/// @par Time     take(), age(), is_connected(): no lock, no allocation, no system call.
template <class T>
class Latest {
  static_assert(std::is_trivially_destructible_v<T>,
                "lrt: Latest<T> hands values to a control loop without allocation, so T must not own memory: use numbers, enums, and structs or "
                "std::array of them; watch std::string or std::vector with Client::watch");
  static_assert(std::is_default_constructible_v<T> && std::is_copy_assignable_v<T>, "lrt: Latest<T> needs a default constructor and copies of T");

 public:
  /// Decodes the value of a representation. An error: the value is not a T.
  using Decode = std::function<Result<T>(const Change& change)>;
  /// Begins a watch whose callback runs on the thread that receives.
  using Start = std::function<Result<Watch>(OnChange on_change)>;

  /// Numbers since the watch began.
  struct Counts {
    std::uint64_t values = 0;      ///< decoded values
    std::uint64_t gaps = 0;        ///< times after which changes may be missing
    std::uint64_t unreadable = 0;  ///< representations that are not a T
  };

  /// An empty handle.
  Latest() noexcept = default;
  /// Begins to watch. Property::latest() is the usual way.
  /// @par Errors  those of `start`
  static Result<Latest> follow(const Start& start, Decode decode) {
    auto shared = std::make_shared<Shared>();
    Result<Watch> watch = start([shared, decode = std::move(decode)](const Change& change) { shared->receive(change, decode); });
    if (!watch) return unexpected(std::move(watch).error());
    return Latest(std::move(shared), *std::move(watch));
  }

  /// Copies the newest value, if there is one that was not taken. False: `value` is unchanged.
  bool take(T& value) noexcept(std::is_nothrow_copy_assignable_v<T>) { return shared_ && shared_->take(value); }
  /// Time since the value that was taken last was received; the greatest duration: none was taken.
  std::chrono::nanoseconds age() const noexcept {
    if (!shared_ || !shared_->was_taken) return std::chrono::nanoseconds::max();
    return std::chrono::steady_clock::now() - shared_->taken_received;
  }
  /// When the value that was taken last became what it is, by the clock of the robot (Change::at). nullopt: none was taken,
  /// or the server does not say it.
  std::optional<std::chrono::system_clock::time_point> source_time() const noexcept { return shared_ ? shared_->taken_at : std::nullopt; }
  /// Whether the server is connected, as far as this program knows: see WatchOptions::idle_time. With Via::polling: the
  /// last request succeeded.
  bool is_connected() const noexcept { return watch_.is_connected(); }
  /// Numbers since the watch began.
  Counts counts() const noexcept {
    if (!shared_) return {};
    return {shared_->values.load(std::memory_order_relaxed), shared_->gaps.load(std::memory_order_relaxed),
            shared_->unreadable.load(std::memory_order_relaxed)};
  }
  /// Whether the server has ended the subscription or refuses it. Nothing follows then.
  bool has_ended() const noexcept { return shared_ && shared_->ended.load(std::memory_order_acquire); }
  /// The reason why the last connection was lost, or the last attempt failed.
  std::optional<Error> last_error() const { return watch_.last_error(); }
  const Watch& watch() const noexcept { return watch_; }  ///< the watch
  void stop() noexcept { watch_.stop(); }                 ///< ends the watch

 private:
  struct Cell {
    T value{};
    std::chrono::steady_clock::time_point received{};
    std::optional<std::chrono::system_clock::time_point> at{};
  };
  struct Shared {
    static constexpr std::uint8_t fresh = 4, index = 3;

    void receive(const Change& change, const Decode& decode) {
      if (change.kind == Change::Kind::gap) gaps.fetch_add(1, std::memory_order_relaxed);
      if (change.kind == Change::Kind::ended) ended.store(true, std::memory_order_release);
      if (change.kind != Change::Kind::value) return;
      Result<T> value = decode(change);
      if (!value) {
        unreadable.fetch_add(1, std::memory_order_relaxed);
        return;
      }
      cells[back].value = *value;
      cells[back].received = change.received;
      cells[back].at = change.at;
      back = middle.exchange(static_cast<std::uint8_t>(back | fresh), std::memory_order_acq_rel) & index;
      values.fetch_add(1, std::memory_order_relaxed);
    }
    bool take(T& value) {
      if ((middle.load(std::memory_order_relaxed) & fresh) == 0) return false;
      front = middle.exchange(front, std::memory_order_acq_rel) & index;
      value = cells[front].value;
      taken_received = cells[front].received;
      taken_at = cells[front].at;
      was_taken = true;
      return true;
    }

    std::atomic<std::uint64_t> values{0}, gaps{0}, unreadable{0};
    std::atomic<bool> ended{false};
    /// Bit `fresh`: a value can be taken. The other bits: the cell that neither side owns.
    std::atomic<std::uint8_t> middle{2};
    std::uint8_t back = 0;   // used by the decoder
    std::uint8_t front = 1;  // used by the loop, as those below
    bool was_taken = false;
    std::chrono::steady_clock::time_point taken_received{};
    std::optional<std::chrono::system_clock::time_point> taken_at{};
    Cell cells[3];
  };

  Latest(std::shared_ptr<Shared> shared, Watch watch) noexcept : shared_(std::move(shared)), watch_(std::move(watch)) {}

  std::shared_ptr<Shared> shared_;
  Watch watch_;
};

}  // namespace v0
}  // namespace lrt::client
