// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt {
inline namespace v0 {

class Server;

/// Removes a Thing from its server when it goes out of scope. Server::add_scoped() makes it. As a member of an object whose
/// lambdas the Thing calls, it is declared last, so that the Thing goes first (include lrt/registration.hpp):
///
///     class Arm {
///      public:
///       explicit Arm(lrt::Server& server) {
///         lrt::Thing thing{"arm"};
///         thing.property("angle", [this] { return angle_; });
///         served_ = server.add_scoped(std::move(thing)).value();
///       }
///
///      private:
///       double angle_ = 0;
///       lrt::Registration served_;
///     };
///
/// Lambdas that run on the thread that destroys it, as those in Server::poll() do, are not called afterwards. With
/// Dispatch::io_thread and Dispatch::executor one may still run on another thread: Thing::guard() keeps the object for it.
///
/// It may outlive its server; then it has no effect. A Thing of the same path that was added since is not removed.
///
/// @par Threads  Distinct objects: any thread, also a lambda of the server. One object: one thread at a time.
class LRT_API Registration {
 public:
  /// An empty one, to be assigned later.
  Registration() noexcept;
  Registration(Registration&&) noexcept;
  /// Removes its own Thing first.
  Registration& operator=(Registration&&) noexcept;
  /// Removes the Thing, as remove() does.
  ~Registration();

  /// Removes the Thing and all Things below it, as Server::remove() does. It is empty afterwards.
  /// @par Errors  unknown_path: it was removed before; closed: the server is gone, or it is empty
  Result<void> remove();
  /// The Thing stays until the server ends. It is empty afterwards.
  void keep() noexcept;
  /// False for an empty one.
  explicit operator bool() const noexcept { return state_ != nullptr; }

 private:
  friend class Server;
  struct State;
  explicit Registration(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace v0
}  // namespace lrt
