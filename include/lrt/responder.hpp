// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/model/responder_base.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt {
inline namespace v0 {

/// Ends an invocation of an asynchronous action without output, by succeed() or fail().
///
///     joint.action("rotate", [&](double target, lrt::Responder done) {
///       if (target > upper_limit) return done.fail({lrt::Errc::out_of_range, "the target is beyond the limit"});
///       start_motion(target, [done] { done.succeed(); });   // later, from any thread
///     });
///
/// Copies refer to the same invocation, so a std::function can hold one. The first call of succeed() or fail() on any
/// copy counts; later calls have no effect. If the last copy is destroyed before either call, the invocation ends as
/// failed, and a waiting client gets 500.
///
/// @par Threads  Any. Several copies may be used at the same time; one copy by one thread at a time.
/// @par Time     As ResponderBase. Calls on parts of split() share a lock, and may run hooks of on_cancel() of other
///               parts.
/// @par Implements  R0.8, paper 5.4
class LRT_API Responder : public model::ResponderBase {
 public:
  using ResponderBase::ResponderBase;
  /// Ends the invocation as succeeded.
  void succeed() const { finish(rdf::Value()); }

  /// Splits the invocation into parts, for an action that is composed of others (Action::composed_of). Give each part
  /// to the code of one of them, which uses it as the responder of its own invocation. Afterwards use the parts instead
  /// of this responder.
  ///
  /// The invocation succeeds when all parts have succeeded. If a part fails or its last copy is destroyed, the
  /// invocation fails with its error, and the other parts are cancelled; their on_cancel hooks run on the thread of
  /// that call. Its progress is the mean of the parts' progress. If it is cancelled, all parts are cancelled. With 0
  /// parts it succeeds at once.
  ///
  ///     std::vector<lrt::Responder> parts = done.split(2);
  ///     rotate(shoulder, angles.shoulder, parts[0]);
  ///     rotate(elbow, angles.elbow, parts[1]);
  ///
  /// @par Implements  paper 5.4
  std::vector<Responder> split(std::size_t parts) const;
};

/// Ends an invocation of an asynchronous action that produces a T. Otherwise as Responder.
/// @par Threads  As Responder.
/// @par Implements  R0.8, paper 5.4
template <class T>
class ResponderOf : public model::ResponderBase {
 public:
  using ResponderBase::ResponderBase;
  /// Ends the invocation as succeeded, with its output.
  void succeed(const T& output) const { finish(rdf::traits<T>::encode(output)); }
};

}  // namespace v0
}  // namespace lrt
