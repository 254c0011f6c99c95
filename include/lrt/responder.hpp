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
/// One invocation as the robot's code sees it; implemented by the engine. Every call from any thread; after the first finish() and
/// after a cancellation the rest have no effect.
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
  /// Dropping a Responder that has not answered ends the invocation as failed; a client that waits gets 500.
  ~ResponderBase();

  /// True while it holds an invocation that has not been answered. An empty one may be kept for the next command.
  explicit operator bool() const noexcept { return link_ != nullptr; }

  /// Ends the invocation as failed, with `error` in its representation. Errc::refused says that the robot's state or limits exclude
  /// the command (a client that waits gets 409), anything else that it tried (500).
  void fail(Error error) &&;
  void fail(std::string message) && { std::move(*this).fail(Error{Errc::failed, std::move(message)}); }
  /// Says how far the invocation is, 0 to 1.
  void progress(double fraction) noexcept {
    if (link_) link_->progress(fraction);
  }
  /// True once the invocation was cancelled or preempted: stop, and drop the responder.
  bool cancelled() const noexcept { return link_ && link_->cancelled(); }
  /// Runs `hook` once when the invocation is cancelled or preempted, or its thing removed, where the thing's Dispatch says and so
  /// possibly after Server::remove has returned; at once if it already was.
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

/// Answers an asynchronous action without output: exactly one `succeed() &&` or `fail(...) &&`, from any thread.
///
/// @par Threads  Any, one at a time.
/// @par Implements  R0.8, paper 5.4
class Responder : public model::ResponderBase {
 public:
  using ResponderBase::ResponderBase;
  void succeed() && { finish(rdf::Value()); }
};

/// Answers an asynchronous action that produces a T.
template <class T>
class ResponderOf : public model::ResponderBase {
 public:
  using ResponderBase::ResponderBase;
  void succeed(const T& output) && { finish(rdf::traits<T>::encode(output)); }
};

}  // namespace lrt
