#pragma once

#include <memory>
#include <string>
#include <utility>

#include <lrt/base/error.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt {

namespace model {
/// One invocation, for the robot's code. Implemented by the engine. After the first finish() or a cancellation, calls have no effect.
/// @par Threads  Any.
class InvocationLink {
 public:
  virtual ~InvocationLink() = default;
  virtual void finish(Result<rdf::Value> result) noexcept = 0;
  virtual void progress(double fraction) noexcept = 0;
  virtual bool cancelled() const noexcept = 0;
  virtual void on_cancel(UniqueFunction<void()> hook) = 0;
};

class ResponderBase {
 public:
  ResponderBase() = default;
  explicit ResponderBase(std::shared_ptr<InvocationLink> link) : link_(std::move(link)) {}
  ResponderBase(ResponderBase&&) noexcept = default;
  ResponderBase& operator=(ResponderBase&& other) noexcept;
  /// If neither succeed() nor fail() was called, ends the invocation as failed; a waiting client gets 500.
  ~ResponderBase();

  /// True while it holds an unfinished invocation. An empty responder may be stored and assigned later.
  explicit operator bool() const noexcept { return link_ != nullptr; }

  /// Ends the invocation as failed, with `error` in its representation. Errc::refused: the robot's state or limits exclude the command, a
  /// waiting client gets 409. Any other code: the robot tried and failed, 500.
  void fail(Error error) &&;
  void fail(std::string message) && { std::move(*this).fail(Error{Errc::failed, std::move(message)}); }
  /// Sets the progress of the invocation, 0 to 1.
  void progress(double fraction) noexcept {
    if (link_) link_->progress(fraction);
  }
  /// True after the invocation was cancelled or preempted. Then stop the robot's action and destroy the responder.
  bool cancelled() const noexcept { return link_ && link_->cancelled(); }
  /// Runs `hook` once when the invocation is cancelled or preempted or its thing is removed; at once if that has happened already. The hook
  /// runs where the thing's Dispatch says, so possibly after Server::remove() has returned.
  void on_cancel(UniqueFunction<void()> hook) {
    if (link_) link_->on_cancel(std::move(hook));
  }

 protected:
  void finish(Result<rdf::Value> result) {
    if (auto link = std::move(link_)) link->finish(std::move(result));
  }

 private:
  std::shared_ptr<InvocationLink> link_;
};
}  // namespace model

/// Ends an invocation of an asynchronous action without output: call exactly one of `succeed() &&` and `fail(...) &&`.
///
/// @par Threads  Any, one at a time.
/// @par Implements  R0.8, paper 5.4
class Responder : public model::ResponderBase {
 public:
  using ResponderBase::ResponderBase;
  void succeed() && { finish(rdf::Value()); }
};

/// Ends an invocation of an asynchronous action that produces a T.
template <class T>
class ResponderOf : public model::ResponderBase {
 public:
  using ResponderBase::ResponderBase;
  void succeed(const T& output) && { finish(rdf::traits<T>::encode(output)); }
};

}  // namespace lrt
