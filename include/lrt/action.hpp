#pragma once

#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>
#include <lrt/model/resource_handle.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/responder.hpp>

namespace lrt {

/// Handle to an Action of a Thing. Unit and bounds are those of the input.
class Action : public model::ResourceHandle<Action, model::ActionSpec> {
 public:
  /// An empty handle, to be assigned later.
  Action() noexcept = default;

  /// Unit and bounds of the input. What `f` does not set stays as it is.
  Action& consumes(const rdf::Facets& f) {
    return edit("consumes", [&](auto& s) { s.facets.merge(f); });
  }
  /// Unit and bounds of the output. What `f` does not set stays as it is.
  Action& produces(const rdf::Facets& f) {
    return edit("produces", [&](auto& s) { s.output_facets.merge(f); });
  }
  /// What happens to an invocation while another one is pending or running. Default: queue(16).
  Action& policy(ActionPolicy p) {
    return edit("policy", [&](auto& s) { s.policy = p; });
  }

 private:
  friend class Thing;
  explicit Action(std::shared_ptr<model::ActionSpec> spec) noexcept : ResourceHandle(std::move(spec)) {}
};

namespace model {

template <class F, class = void>
struct Signature {
  static_assert(rdf::detail::always_false<F>,
                "lrt: an action expects a callable with explicit parameter types: a lambda without `auto` parameters, or a function");
};
template <class F>
struct Signature<F, std::void_t<decltype(&F::operator())>> : Signature<decltype(&F::operator())> {};
template <class R, class... A>
struct Signature<R (*)(A...)> {
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

/// The signature of an action's callable: `R()`, `R(In)`, `void(Responder)`, `void(In, Responder)`.
template <class F>
struct ActionShape {
  using Args = typename Signature<F>::Args;
  using Return = typename Signature<F>::Return;
  static constexpr std::size_t count = std::tuple_size_v<Args>;
  using Last = std::tuple_element_t<count == 0 ? 0 : count - 1, std::conditional_t<count == 0, std::tuple<void*>, Args>>;
  static constexpr bool asynchronous = count > 0 && ResponderTraits<Last>::value;
  static constexpr std::size_t inputs = count - (asynchronous ? 1 : 0);
  static_assert(inputs <= 1, "lrt: an action takes at most one input, followed by an optional Responder; put several inputs into a struct");
  static_assert(!asynchronous || std::is_void_v<Return>, "lrt: an action with a Responder must return void");
  using Input = std::conditional_t<inputs == 1, std::tuple_element_t<0, std::conditional_t<count == 0, std::tuple<void*>, Args>>, void>;
};

/// Erases the type of an action's callable.
template <class F>
auto erase_action(F f) {
  using Shape = ActionShape<F>;
  return [f = std::move(f)](const rdf::Value& input, const std::shared_ptr<InvocationLink>& link) mutable {
    const auto call = [&](auto&&... more) -> typename Shape::Return {
      if constexpr (std::is_void_v<typename Shape::Input>) {
        return f(std::forward<decltype(more)>(more)...);
      } else {
        Result<typename Shape::Input> value = rdf::traits<typename Shape::Input>::decode(input);
        return f(std::move(value).value(), std::forward<decltype(more)>(more)...);
      }
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

}  // namespace model
}  // namespace lrt
