// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <new>
#include <utility>

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// A value in static storage that is never destroyed. Threads of lrt run until the process has ended. So no destructor
/// of what they use may run in exit(). Use it for static objects in your own rdf::traits, too:
///
///     static const Type& type() {
///       static const Immortal<Type> t(make_type());
///       return *t;
///     }
///
/// @par Threads  Those of T. The compiler initialises a function-local static once.
template <class T>
class Immortal {
 public:
  /// Constructs the value.
  template <class... Args>
  explicit Immortal(Args&&... args) {
    ::new (static_cast<void*>(storage_)) T(std::forward<Args>(args)...);
  }
  Immortal(const Immortal&) = delete;
  Immortal& operator=(const Immortal&) = delete;

  /// @{
  /// The value. Never null.
  const T& operator*() const noexcept { return *std::launder(reinterpret_cast<const T*>(storage_)); }
  T& operator*() noexcept { return *std::launder(reinterpret_cast<T*>(storage_)); }
  const T* operator->() const noexcept { return &**this; }
  T* operator->() noexcept { return &**this; }

  /// @}

 private:
  alignas(T) unsigned char storage_[sizeof(T)];
};

}  // namespace v0
}  // namespace lrt
