// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::detail {
inline namespace v0 {
/// Owns the callable of a UniqueFunction of any signature. It has functions instead of virtual ones: the type information of
/// a class with virtual functions takes more room than most callables, because the names of lambdas are long.
struct Callable {
  void (*destroy)(Callable*) noexcept;
};
/// For std::unique_ptr.
struct DestroyCallable {
  void operator()(Callable* callable) const noexcept { callable->destroy(callable); }
};
}  // namespace v0
}  // namespace lrt::detail

namespace lrt {
inline namespace v0 {

template <class Signature>
class UniqueFunction;

/// A callable that may own move-only captures, as C++23's std::move_only_function. Calling an empty one is a violated
/// precondition.
/// @par Threads  Those of the callable.
template <class R, class... Args>
class UniqueFunction<R(Args...)> {
 public:
  UniqueFunction() noexcept = default;
  /// Stores a callable. Allocates.
  template <class F,
            class = std::enable_if_t<!std::is_same_v<std::decay_t<F>, UniqueFunction> && std::is_invocable_r_v<R, std::decay_t<F>&, Args...>>>
  UniqueFunction(F&& f) : impl_(new Holder<std::decay_t<F>>(std::forward<F>(f))) {}  // NOLINT: as std::function

  /// False for an empty one.
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  /// Calls it. Exceptions of the callable pass through.
  R operator()(Args... args) { return static_cast<Base&>(*impl_).call(*impl_, std::forward<Args>(args)...); }

 private:
  struct Base : detail::Callable {
    R (*call)(detail::Callable& self, Args... args);
  };
  template <class F>
  struct Holder final : Base {
    explicit Holder(const F& f) : Base{{destroy_it}, call_it}, function(f) {}
    explicit Holder(F&& f) : Base{{destroy_it}, call_it}, function(std::move(f)) {}
    static R call_it(detail::Callable& self, Args... args) {
      if constexpr (std::is_void_v<R>) static_cast<Holder&>(self).function(std::forward<Args>(args)...);
      else return static_cast<Holder&>(self).function(std::forward<Args>(args)...);
    }
    static void destroy_it(detail::Callable* self) noexcept { delete static_cast<Holder*>(self); }
    F function;
  };
  std::unique_ptr<detail::Callable, detail::DestroyCallable> impl_;
};

}  // namespace v0
}  // namespace lrt
