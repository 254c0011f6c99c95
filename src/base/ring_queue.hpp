// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace lrt {

/// A queue in one block of memory, which grows with it and is freed when the queue is empty.
/// @tparam T  unused places hold a default-constructed T
template <class T>
class RingQueue {
 public:
  bool empty() const noexcept { return size_ == 0; }
  std::size_t size() const noexcept { return size_; }
  /// @pre not empty
  const T& front() const noexcept { return places_[first_]; }
  /// @pre not empty
  const T& back() const noexcept { return places_[place_of(size_ - 1)]; }

  void push_back(T item) {
    reserve_one();
    places_[place_of(size_)] = std::move(item);
    ++size_;
  }
  void push_front(T item) {
    reserve_one();
    first_ = (first_ == 0 ? places_.size() : first_) - 1;
    places_[first_] = std::move(item);
    ++size_;
  }
  /// @pre not empty
  T pop_front() noexcept {
    T item = std::exchange(places_[first_], T());
    first_ = place_of(1);
    if (--size_ == 0 && places_.size() > kept_places) std::vector<T>().swap(places_), first_ = 0;
    return item;
  }

 private:
  /// An empty queue keeps this many places, so that alternating insertions and removals do not allocate each time.
  static constexpr std::size_t kept_places = 2;

  std::size_t place_of(std::size_t index) const noexcept {
    const std::size_t place = first_ + index;
    return place < places_.size() ? place : place - places_.size();
  }
  void reserve_one() {
    if (size_ < places_.size()) return;
    std::vector<T> larger(places_.empty() ? 1 : 2 * places_.size());
    for (std::size_t i = 0; i < size_; ++i) larger[i] = std::move(places_[place_of(i)]);
    places_.swap(larger);
    first_ = 0;
  }

  std::vector<T> places_;
  std::size_t first_ = 0, size_ = 0;
};

}  // namespace lrt
