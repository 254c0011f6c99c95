// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>

namespace lrt {
inline namespace v0 {
class Action;
}  // namespace v0
}  // namespace lrt

namespace lrt::model {
inline namespace v0 {

/// @cond internal
/// Whether a callable that returns R can refuse by it, or never refuses.
template <class R>
inline constexpr bool refuses_by_result = std::is_void_v<R> || std::is_convertible_v<R, Result<void>>;

/// What a callable of the user returns: void is success.
template <class F>
Result<void> result_of(F f) {
  if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
    f();
    return {};
  } else {
    return f();
  }
}

/// @endcond

/// The common part of the handles of properties, actions and collections. They describe a resource before its thing is
/// added to a server. Copies are handles to the same resource.
///
/// A set-up call after Server::add() has no effect: it writes one message with the resource and the call to the
/// server's log callback, and is a failed assertion unless NDEBUG is defined. A call on an empty handle is a failed
/// assertion, too.
///
/// @tparam Self  the handle that the calls return
/// @par Errors   Set-up calls do not fail. Server::add() returns the first error of a thing.
/// @par Threads  One thread at a time.
template <class Self, class Spec>
class ResourceHandle {
 public:
  /// False for an empty handle.
  explicit operator bool() const noexcept { return spec_ != nullptr; }

  /// Sets the unit of the numbers. Values are never converted.
  Self& unit(const Unit& u) {
    return edit_facets("unit", [&](auto& f) { f.unit(u); });
  }
  /// Sets the lower bound of numbers from clients; `v` itself is allowed. A number outside the bounds is answered with
  /// 422. Values that the robot reads or publishes are not checked.
  Self& at_least(double v) {
    return edit_facets("at_least", [&](auto& f) { f.at_least(v); });
  }
  /// Sets the lower bound, see at_least(); `v` itself is not allowed.
  Self& above(double v) {
    return edit_facets("above", [&](auto& f) { f.above(v); });
  }
  /// Sets the upper bound, see at_least(); `v` itself is allowed.
  Self& at_most(double v) {
    return edit_facets("at_most", [&](auto& f) { f.at_most(v); });
  }
  /// Sets the upper bound, see at_least(); `v` itself is not allowed.
  Self& below(double v) {
    return edit_facets("below", [&](auto& f) { f.below(v); });
  }
  /// Sets both bounds, see at_least(); they themselves are allowed.
  Self& between(double low, double high) {
    return edit_facets("between", [&](auto& f) { f.between(low, high); });
  }
  /// Accepts NaN and infinities from clients.
  Self& allow_non_finite() {
    return edit_facets("allow_non_finite", [](auto& f) { f.allow_non_finite(); });
  }
  /// Bounds the length of a text, in code points.
  Self& length(std::size_t min, std::size_t max) {
    return edit_facets("length", [&](auto& f) { f.length(min, max); });
  }

  /// Sets where the resource's lambdas run, and an action's on_cancel hook. Default: as the thing's lambdas. With
  /// Dispatch::io_thread a command does not wait for Server::poll: an emergency stop that sets an atomic flag works
  /// while the host is busy.
  Self& dispatch(Dispatch where) {
    return edit("dispatch", [&](auto& s) { s.dispatch = where; });
  }

  /// Limits the body of a PUT or POST, in bytes; more: 413 before the body is received. Default: what a value of the
  /// type needs (engine::Limits::max_scalar_body_bytes). transport::Limits::max_body_bytes also applies.
  Self& max_body_bytes(std::size_t n) {
    return edit("max_body_bytes", [&](auto& s) { s.max_body_bytes = n; });
  }

  /// Adds a domain predicate from the thing to this resource, in addition to hybrit:property or hybrit:action (R1.9,
  /// R1.10).
  Self& predicate(Iri p) {
    return edit("predicate", [&](auto& s) { s.predicates.push_back(std::string(p.text)); });
  }
  /// Adds an rdf:type (R1.4).
  Self& type(Iri t) {
    return edit("type", [&](auto& s) { s.classes.push_back(std::string(t.text)); });
  }
  /// Adds dcterms:title, for people.
  Self& title(std::string text) {
    return edit("title", [&](auto& s) { s.statements.push_back({std::string(vocab::dcterms::title.text), Object(std::move(text))}); });
  }
  /// Adds a triple about the resource (R1.12).
  Self& add(Iri predicate, Object object) {
    return edit("add", [&](auto& s) { s.statements.push_back({std::string(predicate.text), std::move(object)}); });
  }

 protected:
  /// @cond internal
  ResourceHandle() noexcept = default;
  explicit ResourceHandle(std::shared_ptr<Spec> spec) noexcept : spec_(std::move(spec)) {}

  template <class F>
  Self& edit(const char* call, F f) {
    if (spec_ && !spec_->sealed.load(std::memory_order_acquire)) f(*spec_);
    else misuse(call, "was called after the thing was added to a server; it has no effect");
    return static_cast<Self&>(*this);
  }
  template <class F>
  Self& edit_facets(const char* call, F f) {
    return edit(call, [&](auto& s) { f(s.facets); });
  }
  void misuse([[maybe_unused]] const char* call, [[maybe_unused]] const char* what) const noexcept {
    if (spec_) spec_->report(call, what);
    assert(spec_ && "lrt: the handle is empty; assign what Thing::property, Thing::action or Thing::collection returns");
    assert(false && "lrt: a set-up call on a handle must precede Server::add()");
  }

  std::shared_ptr<Spec> spec_;
  /// @endcond

 private:
  friend class ::lrt::Action;  // reads the properties that it changes
};

}  // namespace v0
}  // namespace lrt::model
