// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <utility>

namespace lrt {

/// A lock-free queue with many writers and one reader.
///
/// @par Threads  put(), reserve(), empty(): any. take_all(): one at a time.
template <class T>
class Mailbox {
  struct Node {
    T item;
    Node* next;
  };

 public:
  Mailbox() = default;
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;
  ~Mailbox() { free_all(newest_.load(std::memory_order_relaxed)); }

  /// An item that has its memory already.
  using Reserved = std::unique_ptr<Node>;
  static Reserved reserve(T item) { return Reserved(new Node{std::move(item), nullptr}); }

  void put(T item) { put(reserve(std::move(item))); }
  void put(Reserved item) noexcept {
    Node* const node = item.release();
    node->next = newest_.load(std::memory_order_relaxed);
    while (!newest_.compare_exchange_weak(node->next, node, std::memory_order_release, std::memory_order_relaxed)) {}
  }

  bool empty() const noexcept { return newest_.load(std::memory_order_acquire) == nullptr; }

  /// Calls `f` with each item, in the order of put(). Items that `f` puts are taken by the next call. `f` must not throw.
  template <class F>
  void take_all(F f) {
    Node* node = newest_.exchange(nullptr, std::memory_order_acquire);
    Node* in_order = nullptr;
    while (node) {
      Node* next = node->next;
      node->next = in_order;
      in_order = node;
      node = next;
    }
    while (in_order) {
      const std::unique_ptr<Node> first(in_order);
      in_order = first->next;
      f(std::move(first->item));
    }
  }

 private:
  static void free_all(Node* node) noexcept {
    while (node) {
      const std::unique_ptr<Node> first(node);
      node = first->next;
    }
  }
  std::atomic<Node*> newest_{nullptr};
};

}  // namespace lrt
