// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::detail {
inline namespace v0 {
/// Owns the callable of a UniqueFunction of any signature.
struct LRT_API Callable {
  virtual ~Callable() = default;
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
  R operator()(Args... args) { return static_cast<Base&>(*impl_).call(std::forward<Args>(args)...); }

 private:
  struct Base : detail::Callable {
    virtual R call(Args... args) = 0;
  };
  template <class F>
  struct Holder final : Base {
    explicit Holder(const F& f) : function(f) {}
    explicit Holder(F&& f) : function(std::move(f)) {}
    R call(Args... args) override {
      if constexpr (std::is_void_v<R>) function(std::forward<Args>(args)...);
      else return function(std::forward<Args>(args)...);
    }
    F function;
  };
  std::unique_ptr<detail::Callable> impl_;
};

}  // namespace v0
}  // namespace lrt
