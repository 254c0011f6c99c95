// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/error.hpp>
#include <lrt/base/unique_function.hpp>

namespace lrt::client {
inline namespace v0 {

/// How control of a Thing is taken (Client::control()).
struct ControlOptions {
  /// After this time without a renewal the robot gives control to others; 1 s to 60 s. It is renewed three times as often.
  std::chrono::milliseconds life{10'000};
  std::string name;        ///< what others see of this client if it has no principal; 1 to 64 bytes of UTF-8; empty: none
  bool take_over = false;  ///< from another client that has control: needs the right for it
};

/// Gets the reason why control was lost, once: another client has taken it, or the robot could not be reached in time. Not
/// called after give_back().
using OnControlLost = UniqueFunction<void(const Error& why)>;

/// Control of a Thing and of all Things below it. While it exists a thread renews it, and the client sends its id with each
/// command to this server. Destroying it gives control back.
///
/// Whether it is held is judged by this program's own monotonic clock, from before the request of the last renewal on: a
/// program that was stopped, or whose link froze, knows that it has lost control as soon as it runs again.
///
/// @par Threads  is_held, until, why_lost: any. The others: one thread at a time.
class LRT_API Control {
 public:
  Control() noexcept;                      ///< of nothing; is_held() is false
  Control(Control&&) noexcept;             ///< the other one is of nothing afterwards
  Control& operator=(Control&&) noexcept;  ///< gives back what it had
  /// Calls give_back().
  ~Control();

  bool is_held() const noexcept;  ///< whether this client has control, as far as it can know
  /// Until when it is held without a further renewal.
  std::chrono::steady_clock::time_point until() const noexcept;
  Error why_lost() const;                   ///< why it is not held any more; Errc::closed: it was given back
  const std::string& url() const noexcept;  ///< of the resource that says who has control
  /// The secret that proves it, for commands of other programs of this user (Control-Id); empty: the principal has control.
  const std::string& id() const noexcept;
  /// Gives control back. Other clients can command at once.
  /// @par Time  One request, and that of a renewal that is under way.
  void give_back() noexcept;

  /// @cond internal
  class Impl;
  explicit Control(std::shared_ptr<Impl> impl) noexcept;
  /// @endcond

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::client
