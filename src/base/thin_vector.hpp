// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <lrt/base/immortal.hpp>

namespace lrt {

/// A vector whose object is one pointer, and which owns no memory while it is empty. For members that are empty in most
/// objects. The functions are those of std::vector.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
/// @par Time     push_back: constant on average, allocates. remove, remove_if, clear: linear. The others: constant.
template <class T>
class ThinVector {
 public:
  /// @{
  /// As std::vector.
  bool empty() const noexcept { return !items_; }
  std::size_t size() const noexcept { return items_ ? items_->size() : 0; }
  T* begin() noexcept { return items_ ? items_->data() : nullptr; }
  T* end() noexcept { return begin() + size(); }
  const T* begin() const noexcept { return items_ ? items_->data() : nullptr; }
  const T* end() const noexcept { return begin() + size(); }
  T& operator[](std::size_t i) { return (*items_)[i]; }
  const T& operator[](std::size_t i) const { return (*items_)[i]; }
  T& back() { return items_->back(); }
  const T& back() const { return items_->back(); }
  /// @}
  /// As a std::vector.
  operator const std::vector<T>&() const {  // NOLINT: it is one
    static const Immortal<std::vector<T>> none;
    return items_ ? *items_ : *none;
  }

  /// Appends an item.
  void push_back(T item) {
    if (items_) return items_->push_back(std::move(item));
    auto made = std::make_unique<std::vector<T>>();
    made->push_back(std::move(item));
    items_ = std::move(made);
  }
  /// As std::vector: new items are T().
  void resize(std::size_t size) {
    if (size == 0) return clear();
    if (!items_) items_ = std::make_unique<std::vector<T>>();
    items_->resize(size);
  }
  /// Removes all items and frees their memory.
  void clear() noexcept { items_ = nullptr; }
  /// Removes the first item that equals `item`.
  void remove(const T& item) noexcept {
    const auto found = std::find(begin(), end(), item);
    if (found == end()) return;
    items_->erase(items_->begin() + (found - begin()));
    if (items_->empty()) clear();
  }
  /// Removes all items for which `predicate` returns true.
  template <class Predicate>
  void remove_if(Predicate predicate) {
    if (!items_) return;
    items_->erase(std::remove_if(items_->begin(), items_->end(), predicate), items_->end());
    if (items_->empty()) clear();
  }

 private:
  std::unique_ptr<std::vector<T>> items_;  // null: empty
};

}  // namespace lrt
