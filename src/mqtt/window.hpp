// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace lrt::mqtt {
inline namespace v0 {

/// How many bytes may be on their way to the broker, so that what waits for a slow link waits in the server, where a newer value replaces it.
///
/// A socket accepts megabytes, and so do modems and proxies, which acknowledge to TCP what they have not passed on. Only the broker knows what has
/// arrived. So it is asked: a probe is a request that it answers after all messages before it. The time of the answer is the time that a new value would
/// take. The window shrinks if that is more than max_queue above the shortest one of the connection, and grows if it is less than half of that although
/// the window was full.
class Window {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;
  static constexpr std::size_t min_bytes = 2 * 1024, first_bytes = 8 * 1024, max_bytes = 256 * 1024;
  static constexpr std::chrono::milliseconds max_queue{400};

  /// Another connection: nothing is on its way.
  void begin() { *this = Window(); }

  /// Whether a further message may be sent. One always may, however large it is, if nothing else is on its way.
  bool is_open() const noexcept { return is_off_ || on_way() < limit_; }
  /// Bytes that may be sent.
  std::size_t room() const noexcept { return is_off_ ? max_bytes : is_open() ? limit_ - on_way() : 0; }
  void sent(std::size_t bytes) noexcept { sent_ += bytes; }

  /// Whether a probe is to be sent: the first one at once, which finds the link empty, and then one for each quarter of the window. If the window is closed,
  /// one is under way.
  bool wants_probe() const noexcept { return !is_off_ && (!has_probed_ || is_wanted_ || sent_ - probed_ >= limit_ / 4); }
  /// A probe is to be sent now: its answer says that all before it has arrived.
  void want_probe() noexcept { is_wanted_ = true; }
  void probed(int id, Instant now) {
    probes_.push_back({id, 4 * on_way() >= 3 * limit_, sent_, confirmed_, now});
    probed_ = sent_;
    has_probed_ = true;
    is_wanted_ = false;
  }
  /// The broker has answered a probe, and thereby all before it.
  void confirmed(int id, Instant now) {
    const auto found = std::find_if(probes_.begin(), probes_.end(), [id](const Probe& p) { return p.id == id; });
    if (found == probes_.end()) return;
    const Probe probe = *found;
    probes_.erase(probes_.begin(), found + 1);
    confirmed_ = probe.sent;
    const Duration time = std::max<Duration>(now - probe.at, std::chrono::microseconds(1));
    shortest_ = shortest_ ? std::min(*shortest_, time) : time;
    adapt(time, probe);
  }

  /// The broker does not answer probes: the window is open for the rest of the connection.
  void give_up() {
    is_off_ = true;
    probes_.clear();
  }

  /// When the oldest probe without an answer was sent; nullopt: there is none.
  std::optional<Instant> oldest() const noexcept { return probes_.empty() ? std::nullopt : std::optional(probes_.front().at); }
  bool is_off() const noexcept { return is_off_; }
  std::size_t limit() const noexcept { return limit_; }
  /// @{
  /// Bytes of this connection: that were sent, and that the broker has confirmed.
  std::uint64_t sent_bytes() const noexcept { return sent_; }
  std::uint64_t confirmed_bytes() const noexcept { return confirmed_; }
  /// @}

 private:
  struct Probe {
    int id;
    bool is_last;                   ///< the window was nearly full, so that its time has all of the queue in it
    std::uint64_t sent, confirmed;  ///< bytes, when it was sent
    Instant at;
  };
  std::size_t on_way() const noexcept { return static_cast<std::size_t>(sent_ - confirmed_); }

  void adapt(Duration time, const Probe& probe) noexcept {
    if (probe.sent <= adapted_) return;  // the window had another width when it was sent
    const Duration longest = *shortest_ + max_queue;
    if (time > longest) {
      const double part = static_cast<double>(longest.count()) / static_cast<double>(time.count());
      const auto arrives = static_cast<std::size_t>(static_cast<double>(confirmed_ - probe.confirmed) * part);
      limit_ = std::max(min_bytes, std::clamp(arrives, limit_ / 2, limit_));
    } else if (probe.is_last && time <= *shortest_ + max_queue / 2) {
      limit_ = std::min(limit_ + limit_ / 2, max_bytes);
    } else {
      return;
    }
    adapted_ = sent_;
  }

  std::size_t limit_ = first_bytes;
  std::uint64_t sent_ = 0, confirmed_ = 0, probed_ = 0;  ///< bytes of this connection
  std::uint64_t adapted_ = 0;                            ///< bytes that were sent when the window last grew or shrank
  bool has_probed_ = false, is_wanted_ = false, is_off_ = false;
  std::optional<Duration> shortest_;
  std::deque<Probe> probes_;  ///< without an answer
};

}  // namespace v0
}  // namespace lrt::mqtt
