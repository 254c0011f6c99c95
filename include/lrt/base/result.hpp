#pragma once

#include <cassert>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <variant>

#include <lrt/base/error.hpp>

namespace lrt {

/// Thrown by Result::value() if there is no value. Holds the error.
class BadResult : public std::runtime_error {
 public:
  explicit BadResult(Error error) : std::runtime_error(error.message), error_(std::move(error)) {}
  const Error& error() const noexcept { return error_; }

 private:
  Error error_;
};

/// Converts to a Result without a value: `return lrt::unexpected(Errc::refused, "...")`.
struct Unexpected {
  Error error;
};
inline Unexpected unexpected(Error error) { return Unexpected{std::move(error)}; }
inline Unexpected unexpected(Errc code, std::string message) { return Unexpected{Error{code, std::move(message)}}; }

/// For user code: the robot refuses, because its state or limits exclude the request. The client gets 409 with the reason.
inline Unexpected refused(std::string reason) { return unexpected(Errc::refused, std::move(reason)); }

/// A value, or the Error that explains why there is none. The names are those of std::expected. The definition is the same in every
/// language mode, so hosts of any C++ standard link with one build of the library.
template <class T>
class [[nodiscard]] Result {
 public:
  using value_type = T;
  using error_type = Error;

  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}                       // NOLINT: implicit as in std
  Result(Unexpected error) : state_(std::in_place_index<1>, std::move(error.error)) {}        // NOLINT: implicit as in std
  template <class U, class = std::enable_if_t<std::is_constructible_v<T, U&&> && !std::is_same_v<std::decay_t<U>, Result> &&
                                              !std::is_same_v<std::decay_t<U>, Unexpected> && std::is_convertible_v<U&&, T> &&
                                              !std::is_same_v<std::decay_t<U>, T>>>
  Result(U&& value) : state_(std::in_place_index<0>, std::forward<U>(value)) {}               // NOLINT: implicit as in std

  bool has_value() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }

  /// @pre has_value()
  T& operator*() & noexcept { return assert(has_value()), *std::get_if<0>(&state_); }
  const T& operator*() const& noexcept { return assert(has_value()), *std::get_if<0>(&state_); }
  T&& operator*() && noexcept { return assert(has_value()), std::move(*std::get_if<0>(&state_)); }
  T* operator->() noexcept { return assert(has_value()), std::get_if<0>(&state_); }
  const T* operator->() const noexcept { return assert(has_value()), std::get_if<0>(&state_); }

  /// @throws BadResult  if there is no value
  T& value() & { return require(), *std::get_if<0>(&state_); }
  const T& value() const& { return require(), *std::get_if<0>(&state_); }
  T&& value() && { return require(), std::move(*std::get_if<0>(&state_)); }
  template <class U>
  T value_or(U&& other) const& {
    return has_value() ? **this : static_cast<T>(std::forward<U>(other));
  }

  /// @pre !has_value()
  const Error& error() const& noexcept { return assert(!has_value()), *std::get_if<1>(&state_); }
  Error&& error() && noexcept { return assert(!has_value()), std::move(*std::get_if<1>(&state_)); }

 private:
  void require() const {
    if (!has_value()) throw BadResult(*std::get_if<1>(&state_));
  }
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  using value_type = void;
  using error_type = Error;

  Result() noexcept = default;
  Result(Unexpected error) : error_(std::move(error.error)) {}  // NOLINT: implicit as in std

  bool has_value() const noexcept { return !error_; }
  explicit operator bool() const noexcept { return has_value(); }
  void value() const {
    if (error_) throw BadResult(*error_);
  }
  /// @pre !has_value()
  const Error& error() const& noexcept { return assert(error_), *error_; }
  Error&& error() && noexcept { return assert(error_), std::move(*error_); }

 private:
  std::optional<Error> error_;
};

}  // namespace lrt
