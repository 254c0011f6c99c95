// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <new>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/error.hpp>
#include <lrt/base/misuse.hpp>

namespace lrt {
inline namespace v0 {

/// Thrown by Result::value() if there is no value. Holds the error.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API BadResult : public std::runtime_error {
 public:
  /// @param error  the error; its message is what()
  explicit BadResult(Error error) : std::runtime_error(error.message), error_(std::move(error)) {}
  /// The error that the Result had.
  const Error& error() const noexcept { return error_; }

 private:
  Error error_;
};

/// An error that converts to any Result: `return lrt::unexpected(Errc::refused, "...")`.
struct Unexpected {
  Error error;  ///< the error
};
/// @{
/// Makes an Unexpected.
inline Unexpected unexpected(Error error) { return Unexpected{std::move(error)}; }
inline Unexpected unexpected(Errc code, std::string message) { return Unexpected{Error{code, std::move(message)}}; }
/// @}

/// The return value of user code that refuses a request, because the robot's state or limits exclude it. The client
/// gets 409 with the reason.
inline Unexpected refused(std::string reason) { return unexpected(Errc::refused, std::move(reason)); }

}  // namespace v0
}  // namespace lrt

namespace lrt::detail {
inline namespace v0 {

/// Deletes copies of what derives from it if T cannot be copied.
template <bool copyable>
struct CopyableIf {};
template <>
struct CopyableIf<false> {
  CopyableIf() = default;
  CopyableIf(CopyableIf&&) = default;
  CopyableIf& operator=(CopyableIf&&) = default;
};

/// A T or an Error. std::variant does the same, but every file that uses lrt would compile it for many types.
template <class T>
struct ValueOrError {
  template <class... Args>
  explicit ValueOrError(std::in_place_t, Args&&... args) : value(std::forward<Args>(args)...), has_value(true) {}
  explicit ValueOrError(Error&& e) noexcept : error(std::move(e)), has_value(false) {}
  ValueOrError(const ValueOrError& other) { take(other); }
  ValueOrError(ValueOrError&& other) noexcept(std::is_nothrow_move_constructible_v<T>) { take(std::move(other)); }
  ValueOrError& operator=(const ValueOrError& other) { return *this = ValueOrError(other); }
  ValueOrError& operator=(ValueOrError&& other) noexcept {
    static_assert(std::is_nothrow_move_constructible_v<T>, "lrt: a Result is assigned only if moving its value does not throw");
    if (this == &other) return *this;
    destroy();
    take(std::move(other));
    return *this;
  }
  ~ValueOrError() { destroy(); }

  union {
    T value;
    Error error;
  };
  bool has_value;

 private:
  template <class Other>
  void take(Other&& other) {
    if (other.has_value) ::new (&value) T(std::forward<Other>(other).value);
    else ::new (&error) Error(std::forward<Other>(other).error);
    has_value = other.has_value;
  }
  void destroy() noexcept {
    if (has_value) value.~T();
    else error.~Error();
  }
};

}  // namespace v0
}  // namespace lrt::detail

namespace lrt {
inline namespace v0 {

/// A value, or the Error that explains why there is none. Names and meaning are those of std::expected. The definition
/// is the same in every language mode, so programs of any C++ standard link with one build of the library.
///
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
template <class T>
class [[nodiscard]] Result : detail::CopyableIf<std::is_copy_constructible_v<T>> {
 public:
  using value_type = T;      ///< type of the value
  using error_type = Error;  ///< type of the error

  /// @{
  /// A result with a value, or with an error. The conversions are implicit, as in std::expected.
  Result(T value) : state_(std::in_place, std::move(value)) {}  // NOLINT: implicit as in std
  Result(Unexpected error) : state_(std::move(error.error)) {}  // NOLINT: implicit as in std
  template <class U, class = std::enable_if_t<std::is_constructible_v<T, U&&> && !std::is_same_v<std::decay_t<U>, Result> &&
                                              !std::is_same_v<std::decay_t<U>, Unexpected> && std::is_convertible_v<U&&, T> &&
                                              !std::is_same_v<std::decay_t<U>, T>>>
  Result(U&& value) : state_(std::in_place, std::forward<U>(value)) {}  // NOLINT: implicit as in std
  /// @}

  /// @{
  /// Whether there is a value.
  bool has_value() const noexcept { return state_.has_value; }
  explicit operator bool() const noexcept { return has_value(); }
  /// @}

  /// @{
  /// The value. @pre has_value()
  T& operator*() & noexcept { return require_value(), state_.value; }
  const T& operator*() const& noexcept { return require_value(), state_.value; }
  T&& operator*() && noexcept { return require_value(), std::move(state_.value); }
  T* operator->() noexcept { return require_value(), &state_.value; }
  const T* operator->() const noexcept { return require_value(), &state_.value; }
  /// @}

  /// @{
  /// The value.
  /// @throws BadResult  if there is no value
  T& value() & { return require(), state_.value; }
  const T& value() const& { return require(), state_.value; }
  T&& value() && { return require(), std::move(state_.value); }
  /// @}
  /// The value, or `other` if there is none.
  template <class U>
  T value_or(U&& other) const& {
    return has_value() ? **this : static_cast<T>(std::forward<U>(other));
  }

  /// @{
  /// The error. @pre !has_value()
  const Error& error() const& noexcept { return require_error(), state_.error; }
  Error&& error() && noexcept { return require_error(), std::move(state_.error); }
  /// @}

 private:
  void require() const {
    if (!has_value()) throw BadResult(state_.error);
  }
  void require_value() const noexcept { LRT_REQUIRE(has_value(), "a Result without a value was used: test it with `if (result)` before * or ->"); }
  void require_error() const noexcept { LRT_REQUIRE(!has_value(), "error() of a Result with a value: test it with `if (!result)` before"); }
  detail::ValueOrError<T> state_;
};

/// Success, or the Error that explains the failure.
template <>
class [[nodiscard]] Result<void> {
 public:
  using value_type = void;   ///< there is no value
  using error_type = Error;  ///< type of the error

  /// Success.
  Result() noexcept = default;
  /// A failure.
  Result(Unexpected error) : error_(std::move(error.error)) {}  // NOLINT: implicit as in std

  /// @{
  /// Whether it is a success.
  bool has_value() const noexcept { return !error_; }
  explicit operator bool() const noexcept { return has_value(); }
  /// @}
  /// Does nothing after a success.
  /// @throws BadResult  after a failure
  void value() const {
    if (error_) throw BadResult(*error_);
  }
  /// @{
  /// The error. @pre !has_value()
  const Error& error() const& noexcept { return require_error(), *error_; }
  Error&& error() && noexcept { return require_error(), std::move(*error_); }
  /// @}

 private:
  void require_error() const noexcept { LRT_REQUIRE(error_, "error() of a Result of success: test it with `if (!result)` before"); }
  std::optional<Error> error_;
};

}  // namespace v0
}  // namespace lrt
