// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/misuse.hpp>
#include <lrt/model/resource_handle.hpp>
#include <lrt/property.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/responder.hpp>

namespace lrt {
inline namespace v0 {

/// In Action::effect(): the value that the invocation gets as its input, and how exactly the property has it afterwards.
/// lrt::from_input is the whole input, exactly.
///
///     lrt::from_input.within(0.001)                        // at most 0.001 away, in the unit of the property
///     lrt::from_input.modulo(360)                          // the property differs by a multiple of 360 from it
///     lrt::from_input.field("x", "x").within(0.001)        // a field of the input, and the field of the property that gets it
struct FromInput {
  std::string_view input_field{};     ///< name of a field of the input, a record; empty: the whole input
  std::string_view property_field{};  ///< name of a field of the property's value, a record; empty: the whole value
  double tolerance = 0;               ///< largest distance from the input's value, in the property's unit; 0: none
  double period = 0;                  ///< the value may differ by multiples of it, in the property's unit; 0: it may not

  /// A field of the input, and the field of the property that gets its value. An empty name: the whole.
  constexpr FromInput field(std::string_view of_input, std::string_view of_property = {}) const noexcept {
    return {of_input, of_property, tolerance, period};
  }
  /// Afterwards the property is at most `distance` away from the value, in the unit of the property (or of its field).
  constexpr FromInput within(double distance) const noexcept { return {input_field, property_field, distance, period}; }
  /// Afterwards the property may differ by multiples of `length`, in the unit of the property (or of its field).
  constexpr FromInput modulo(double length) const noexcept { return {input_field, property_field, tolerance, length}; }
};
/// In Action::effect(): the value that the invocation gets as its input.
inline constexpr FromInput from_input{};

/// Handle to an Action of a Thing: a command that clients invoke by POST. Thing::action() makes it.
///
/// Unit and bounds (unit(), between(), ...) are those of the input. available() has an effect before and after
/// Server::add(), until the thing is removed.
///
/// @par Threads  Set-up: one thread at a time, before Server::add(). available(): any.
/// @par Implements  R0.5, R0.8, R1.10, paper 5.4
class LRT_API Action : public model::ResourceHandle<Action, model::ActionSetup> {
 public:
  /// An empty handle, to be assigned later.
  Action() noexcept = default;

  /// Sets unit and bounds of the input. What `f` does not set stays as it is.
  Action& consumes(const rdf::Facets& f) {
    if (is_editable("consumes")) facets_of().merge(f);
    return *this;
  }
  /// Sets unit and bounds of a field of the input, a record: those that are known at run time only, such as the limits of
  /// a joint. What `f` does not set stays as the traits of the record say. The other uses of the record are not concerned.
  /// @par Errors  invalid_option, from Server::add(): the input is not a record with this field
  Action& consumes(std::string_view field, const rdf::Facets& f) {
    if (is_editable("consumes")) merge_field_facets(field, f);
    return *this;
  }
  /// Sets unit and bounds of the output. What `f` does not set stays as it is.
  Action& produces(const rdf::Facets& f) {
    if (is_editable("produces")) output_facets_of().merge(f);
    return *this;
  }
  /// Sets what happens to an invocation while another one of this action is pending or running. Default:
  /// ActionPolicy::queue(16).
  Action& policy(ActionPolicy p) {
    if (is_editable("policy")) set_policy(p);
    return *this;
  }

  /// Marks the action as a stop: it brings the robot to a standstill, and the server serves it even when every limit is
  /// reached.
  ///
  /// - The lambda runs on the I/O thread (Dispatch::io_thread), before all other lambdas that wait there. It should set
  ///   an atomic flag that the control loop obeys, and return. With Io::in_poll that thread is the one that polls.
  /// - Connections: transport::Limits::reserved_connections are kept for it. Requests: the limits of waiting requests
  ///   and of open calls do not apply.
  /// - Invocations run in parallel and are neither queued nor refused. If `policy().limit` of them (default: 16) have
  ///   not ended, the oldest is cancelled.
  /// - A body and its header fields are ignored. TLS, the authorizer and the check of foreign origins apply.
  /// - Clients find it by lrt:stop at the root and at its Thing, and by the class lrt:StopAction; in JSON by `stops` of
  ///   the root and `stop` of the action. The console page shows its button in each view.
  ///
  /// A later call of dispatch() may set Dispatch::executor, and a later call of policy() another limit by
  /// ActionPolicy::parallel(n).
  ///
  /// @par Errors  invalid_option, from Server::add(): the action has an input, a dispatch that waits for Server::poll,
  ///              or another policy
  Action& stop() {
    if (is_editable("stop")) set_stop();
    return *this;
  }
  /// The same, and declares the stop state of the Thing: clients see whether it is stopped, since when and by whom, and
  /// while it is stopped, what moves is unavailable.
  ///
  ///     lrt::Action release = base.action("release", [&] { stopped = false; });
  ///     base.action("stop", [&] { stopped = true; }).stop([&] { return stopped.load(); }, release);
  ///
  /// - The host's word is the truth. `state` is read before the first command, and then as an observed Property is: a
  ///   lambda at each SubscriptionOptions::sample_period, where the lambdas of the Thing run; a Property as it is
  ///   published, or where and as often as it says. So a stop that is pressed at the hardware shows, too. While the state
  ///   is unknown or its lambda throws, the Thing counts as stopped.
  /// - A POST of any stop of the Thing counts at once, before its lambda has run, until `state` confirms it with true. If
  ///   `state` never does, the Thing remains stopped until a release succeeds or the server restarts.
  /// - The Thing gets a read-only Property "stopped" (lrt:StopState), which is observed like others. lrt:stopState links
  ///   to it from the Thing and from the root; in JSON it is in their `stopStates`.
  /// - While it is stopped, each Action, each writable Property and each Collection of the Thing and of all Things below
  ///   it is unavailable, except those that are harmless(), stops and releases: 409. Invocations that wait or run end as
  ///   failed, and their responders see cancelled(). Graphs of Worlds are not concerned.
  /// - `release` needs the right security::Right::release, and a time until which it is valid. It succeeds when its
  ///   lambda has, and `state` then says false within a second; else it fails with 409, and the Thing remains stopped.
  ///   A stop fails each release that was sent before it.
  ///
  /// @param state    a callable `bool()`, or a handle of a Property of bool of the same Thing: true while it is stopped
  /// @param release  the Action of the same Thing that ends the stop; empty: only the robot itself does
  /// @par Errors  invalid_option, from Server::add(): see stop(); the Property or the release belongs to another Thing;
  ///              the Thing has a stop state already; the release is a stop
  /// @par Threads  `state` runs where the Thing's Dispatch says. A Property may have another: then that counts.
  template <class State>
  Action& stop(State state, const Action& release = Action()) {
    if constexpr (std::is_same_v<State, PushedProperty<bool>> || std::is_same_v<State, PulledProperty<bool>>) {
      if (is_editable("stop")) set_stop_state(not_empty(state), release);
    } else if constexpr (std::is_invocable_r_v<bool, State&>) {
      if constexpr (model::can_be_null<State>)
        if (!state) return refuse_null("stop"), *this;
      if (is_editable("stop")) set_stop_state(UniqueFunction<bool()>([state = std::move(state)]() mutable -> bool { return state(); }), release);
    } else {
      static_assert(rdf::detail::always_false<State>,
                    "lrt: stop expects what says whether the robot is stopped: a callable that returns bool, or a Property of bool");
    }
    return *this;
  }

  /// Requires that each invocation says until when it is worth carrying out (the request field Valid-Until): without it
  /// the response is 428, and says how curl sends it. lrt::Client, the command `lrt` and the console page always do. A
  /// stop and the cancelling of an invocation never need it. See Thing::requires_expiry().
  Action& requires_expiry() {
    if (is_editable("requires_expiry")) set_requires_expiry();
    return *this;
  }

  /// @{
  /// States the effect: what a successful invocation changes. Clients can search for the action that leads to their
  /// goal. The action gets hybrit:produces with a shape that refers to the property by sosa:forProperty. The property's
  /// representation conforms to this shape afterwards. Each call adds an effect. lrt publishes the statement and does
  /// not verify it: state no more than what holds when the invocation has succeeded, and publish the value before.
  ///
  ///     joint.action("rotate", ...).effect(position, lrt::from_input);              // the value of the input, in the property's own unit
  ///     joint.action("rotate", ...).effect(position, lrt::from_input.within(0.01)); // a value near it: see FromInput
  ///     gripper.action("open", ...).effect(state, GripperState::open);              // the property gets this value
  ///     arm.action("calibrate", ...).effect(offset);                                // the property may get any other value
  ///
  /// @param property  a handle; or, without a value, the path of a property below the server's root:
  ///                  "baxter/right_s1/rotation"
  /// @par Errors  expected_iri (a path), invalid_option (from_input without an input, without this field, or of another
  ///              type than the property; a tolerance or a period of what is not a number): from Server::add()
  /// @par Implements  paper 5.4, Figure 5a
  template <class Self, class T>
  Action& effect(const model::PropertyHandle<Self, T>& property) {
    return with_effect(not_empty(property), static_cast<const FromInput*>(nullptr));
  }
  template <class Self, class T, class From, class = std::enable_if_t<std::is_same_v<From, FromInput>>>  // never from braces
  Action& effect(const model::PropertyHandle<Self, T>& property, const From& value) {
    return with_effect(not_empty(property), &value);
  }
  template <class Self, class T>
  Action& effect(const model::PropertyHandle<Self, T>& property, const std::common_type_t<T>& value) {
    return with_effect(not_empty(property), rdf::traits<T>::encode(value));
  }
  Action& effect(std::string_view property) { return with_effect(property, static_cast<const FromInput*>(nullptr)); }
  Action& effect(std::string_view property, const FromInput& value) { return with_effect(property, &value); }
  /// @}
  /// States the effect by a shape in Turtle with the name `<#effect>`. The base IRI is the action, so `<../rotation>`
  /// is the property "rotation" of its thing.
  /// @par Errors  expected_rdf: from Server::add()
  Action& effect_turtle(std::string text) {
    if (is_editable("effect_turtle")) add_effect_turtle(std::move(text));
    return *this;
  }

  /// Adds a header field of the request to the action's binding (http-core:headers), for example one that a proxy or an
  /// authorizer requires. lrt states Content-Type (if there is an input) and Accept, both with text/turtle; a field
  /// with one of these names replaces lrt's.
  /// @par Errors  expected_http: from Server::add()
  Action& header(std::string name, std::string value) {
    if (is_editable("header")) add_header(std::move(name), std::move(value));
    return *this;
  }

  /// @{
  /// States that this action is composed of another one (dcterms:hasPart), as moving an arm is composed of turning its
  /// joints. Each call adds one part. The lambda calls the parts itself; Responder::split() passes progress and
  /// cancellation between them.
  /// @param part  a handle; or the path of an action below the server's root: "baxter/right_s1/actions/rotate"
  /// @par Errors  expected_iri (a path): from Server::add()
  /// @par Implements  paper 5.4
  Action& composed_of(const Action& part) {
    if (is_editable("composed_of")) add_part(not_empty(part));
    return *this;
  }
  Action& composed_of(std::string_view part) {
    if (is_editable("composed_of")) add_part(part);
    return *this;
  }
  /// @}

  /// Sets whether the action can be invoked now. Default: true.
  ///
  /// While it is not available, its Thing does not link to it (Link fields, hybrit:action, overviews), a POST is
  /// answered with 409 with the reason, and a queued invocation fails with the reason when it would begin. If this is
  /// called on the thread where the action's lambda runs, the lambda is not called afterwards. Running invocations
  /// continue. GET of the action still works and states the reason in lrt:unavailable. Observers of the Thing, of its
  /// state and of the action get the new representation.
  ///
  /// @param yes     whether it can be invoked
  /// @param reason  a string literal, for people: "the gripper is empty". Only its address is stored, so nothing is
  ///                allocated. For several reasons write several calls.
  /// @par Threads  Any; the last call counts.
  /// @par Time     No lock and no allocation. One system call, only if the state changes while something is observed
  ///               and the engine sleeps.
  /// @par Implements  R1.10, paper 5.4
  template <class Reason>
  Action& available(bool yes, Reason&& reason) noexcept {
    using Text = std::remove_reference_t<Reason>;
    if constexpr (!std::is_array_v<Text> || !std::is_same_v<std::remove_extent_t<Text>, const char>) {
      static_assert(rdf::detail::always_false<Reason>,
                    "lrt: the reason of available() is stored as an address; write a string literal: available(false, \"the gripper is empty\")");
    } else {
      if (spec_) set_unavailable(yes ? nullptr : reason);
      else if constexpr (detail::checks) report_empty("available");
    }
    return *this;
  }
  /// As above, with the reason "the robot does not offer it now".
  Action& available(bool yes) noexcept { return available(yes, "the robot does not offer it now"); }

  /// @cond internal
  /// For libraries: a POST is answered when the invocation has ended, although `f` is asynchronous: it ends soon, as a call of another program.
  Action& ends_soon() {
    if (is_editable("ends_soon")) set_ends_soon();
    return *this;
  }
  /// @endcond

 private:
  friend class Thing;
  explicit Action(std::shared_ptr<model::ResourceSpec> spec) noexcept : ResourceHandle(std::move(spec)) {}

  static const model::ResourceSetup& not_empty(const model::ResourceSetup& resource) {
    if constexpr (detail::checks)
      if (!resource) detail::misuse("an action refers to an empty handle: pass what Thing::property() or Thing::action() returns");
    return resource;
  }
  template <class Property, class What>
  Action& with_effect(const Property& property, What&& what) {
    if (is_editable("effect")) add_effect(property, std::forward<What>(what));
    return *this;
  }
};

}  // namespace v0
}  // namespace lrt

/// @cond internal
namespace lrt::model {
inline namespace v0 {

/// The parameters and the result of a callable. `known` is false for generic lambdas, std::bind, and types that are not
/// callable.
template <class F, class = void>
struct Signature {
  static constexpr bool known = false;
};
template <class F>
struct Signature<F, std::void_t<decltype(&F::operator())>> : Signature<decltype(&F::operator())> {};
template <class R, class... A>
struct Signature<R (*)(A...)> {
  static constexpr bool known = true;
  using Return = R;
  using Args = std::tuple<std::decay_t<A>...>;
};
template <class R, class... A>
struct Signature<R (*)(A...) noexcept> : Signature<R (*)(A...)> {};
template <class C, class R, class... A>
struct Signature<R (C::*)(A...)> : Signature<R (*)(A...)> {};
template <class C, class R, class... A>
struct Signature<R (C::*)(A...) const> : Signature<R (*)(A...)> {};
template <class C, class R, class... A>
struct Signature<R (C::*)(A...) noexcept> : Signature<R (*)(A...)> {};
template <class C, class R, class... A>
struct Signature<R (C::*)(A...) const noexcept> : Signature<R (*)(A...)> {};

template <class T>
struct ResponderTraits : std::false_type {};
template <>
struct ResponderTraits<Responder> : std::true_type {
  using Output = void;
};
template <class T>
struct ResponderTraits<ResponderOf<T>> : std::true_type {
  using Output = T;
};

template <class T>
struct Unwrapped {
  using type = rdf::detail::stored_t<T>;
};
template <>
struct Unwrapped<void> {
  using type = void;
};
template <class T>
struct Unwrapped<Result<T>> : Unwrapped<T> {};

template <class F, class... A>
constexpr bool is_callable_with(std::tuple<A...>*) {
  return std::is_invocable_v<F&, A...>;
}

/// The signature of an action's callable: `R()`, `R(In)`, `void(Responder)`, `void(In, Responder)`.
template <class F>
struct ActionShape {
  using Args = typename Signature<F>::Args;
  using Return = typename Signature<F>::Return;
  static constexpr std::size_t count = std::tuple_size_v<Args>;
  using Last = std::tuple_element_t<count == 0 ? 0 : count - 1, std::conditional_t<count == 0, std::tuple<void*>, Args>>;
  static constexpr bool asynchronous = count > 0 && ResponderTraits<Last>::value;
  static constexpr std::size_t inputs = count - (asynchronous ? 1 : 0);
  using Parameter = std::conditional_t<inputs == 1, std::tuple_element_t<0, std::conditional_t<count == 0, std::tuple<void*>, Args>>, void>;
  /// The input is a view of a text, which is valid during the call.
  static constexpr bool takes_view = rdf::detail::is_text_view<Parameter>;
  using Input = std::conditional_t<takes_view, std::string, Parameter>;
};

/// What an action's callable gives: by its Responder, or as what it returns.
template <class F, bool asynchronous = ActionShape<F>::asynchronous>
struct OutputOf : Unwrapped<typename ActionShape<F>::Return> {};
template <class F>
struct OutputOf<F, true> {
  using type = typename ResponderTraits<typename ActionShape<F>::Last>::Output;
};

/// The static_asserts about an action's callable, one after another, so that there is one error.
template <class F>
constexpr bool check_action() {
  using rdf::detail::always_false;
  if constexpr (std::is_member_pointer_v<F>) {
    static_assert(always_false<F>, "lrt: an action expects a callable; for a member function write a lambda: [this](double in) { return turn(in); }");
  } else if constexpr (!Signature<F>::known) {
    static_assert(always_false<F>,
                  "lrt: an action expects a callable with explicit parameter types; write a lambda without `auto` parameters instead of a "
                  "generic lambda or std::bind");
  } else {
    using Shape = ActionShape<F>;
    if constexpr (Shape::inputs > 1) {
      static_assert(always_false<F>, "lrt: an action takes at most one input, followed by an optional Responder; put several inputs into a struct");
    } else if constexpr (Shape::asynchronous && !std::is_void_v<typename Shape::Return>) {
      static_assert(always_false<F>, "lrt: an action with a Responder must return void; end it by succeed() or fail() of the Responder");
    } else if constexpr (Shape::asynchronous && Shape::takes_view) {
      static_assert(
          always_false<F>,
          "lrt: the text of a std::string_view or const char* ends with the call, but an action with a Responder goes on; take a std::string");
    } else if constexpr (std::is_same_v<typename Shape::Parameter, char*> || !is_callable_with<F>(static_cast<typename Shape::Args*>(nullptr))) {
      static_assert(always_false<F>, "lrt: an action takes its input by value or by const reference; drop the `&` or write `const`");
    } else {
      return true;
    }
  }
  return false;
}

/// Decodes the input of an action; a Result<void> if it has none.
template <class T>
Result<T> decode_input([[maybe_unused]] const rdf::Value& input) {
  if constexpr (std::is_void_v<T>) return {};
  else return rdf::traits<T>::decode(input);
}

/// Erases the type of an action's callable.
template <class F>
auto erase_action(F f) {
  using Shape = ActionShape<F>;
  return [f = std::move(f)](const rdf::Value& input, const std::shared_ptr<InvocationLink>& link) mutable {
    Result<typename Shape::Input> value = decode_input<typename Shape::Input>(input);
    if (!value) throw BadResult(std::move(value).error());
    const auto call = [&](auto&&... more) -> typename Shape::Return {
      if constexpr (std::is_void_v<typename Shape::Input>) return f(std::forward<decltype(more)>(more)...);
      else if constexpr (std::is_same_v<typename Shape::Parameter, const char*>) return f(value->c_str(), std::forward<decltype(more)>(more)...);
      else return f(*std::move(value), std::forward<decltype(more)>(more)...);
    };
    using Return = typename Shape::Return;
    if constexpr (Shape::asynchronous) {
      call(typename Shape::Last(link));
    } else if constexpr (std::is_void_v<Return>) {
      call();
      link->finish(rdf::Value());
    } else if constexpr (std::is_same_v<Return, Result<void>>) {
      Return r = call();
      if (r) link->finish(rdf::Value());
      else link->finish(Unexpected{std::move(r).error()});
    } else if constexpr (std::is_same_v<Return, Result<typename Unwrapped<Return>::type>>) {
      Return r = call();
      if (r) link->finish(rdf::traits<typename Unwrapped<Return>::type>::encode(*r));
      else link->finish(Unexpected{std::move(r).error()});
    } else {
      link->finish(rdf::traits<rdf::detail::stored_t<Return>>::encode(call()));
    }
  };
}

}  // namespace v0
}  // namespace lrt::model
/// @endcond
