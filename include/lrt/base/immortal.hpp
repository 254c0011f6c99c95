// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <new>
#include <utility>

namespace lrt {
inline namespace v0 {

/// A value in static storage that is never destroyed. Threads of lrt run until the process has ended, so what they use must not have a destructor
/// that runs in exit(). Write it in traits of your own, too:
///
///     static const Type& type() {
///       static const Immortal<Type> t(make_type());
///       return *t;
///     }
///
/// @par Threads  Those of T. A function-local static is initialised once.
template <class T>
class Immortal {
 public:
  template <class... Args>
  explicit Immortal(Args&&... args) {
    ::new (static_cast<void*>(storage_)) T(std::forward<Args>(args)...);
  }
  Immortal(const Immortal&) = delete;
  Immortal& operator=(const Immortal&) = delete;

  const T& operator*() const noexcept { return *std::launder(reinterpret_cast<const T*>(storage_)); }
  T& operator*() noexcept { return *std::launder(reinterpret_cast<T*>(storage_)); }
  const T* operator->() const noexcept { return &**this; }
  T* operator->() noexcept { return &**this; }

 private:
  alignas(T) unsigned char storage_[sizeof(T)];
};

}  // namespace v0
}  // namespace lrt
