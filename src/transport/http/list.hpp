// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace lrt::transport {

/// Base of the elements of a List with this Tag. The destructor removes the element.
template <class Tag>
class Linked {
 public:
  Linked(const Linked&) = delete;
  Linked& operator=(const Linked&) = delete;

  bool is_linked() const noexcept { return next_ != nullptr; }
  void unlink() noexcept {
    if (!next_) return;
    previous_->next_ = next_;
    next_->previous_ = previous_;
    previous_ = next_ = nullptr;
  }

 protected:
  Linked() = default;
  ~Linked() { unlink(); }

 private:
  template <class T, class OfTag>
  friend class List;
  Linked* previous_ = nullptr;  ///< nullptr: in no list
  Linked* next_ = nullptr;
};

/// An intrusive list. Each element is in at most one List with this Tag. T derives from Linked<Tag>. No function allocates.
template <class T, class Tag>
class List {
 public:
  List() noexcept { root_.previous_ = root_.next_ = &root_; }
  ~List() {
    while (!empty()) root_.next_->unlink();
  }
  List(const List&) = delete;
  List& operator=(const List&) = delete;

  bool empty() const noexcept { return root_.next_ == &root_; }
  T& front() noexcept { return static_cast<T&>(*root_.next_); }
  const T& front() const noexcept { return static_cast<const T&>(*root_.next_); }
  /// Removes it from the list that it is in.
  void push_back(T& item) noexcept { insert_before(root_, item); }
  /// Removes it from the list that it is in.
  void push_front(T& item) noexcept {
    static_cast<Linked<Tag>&>(item).unlink();
    insert_before(*root_.next_, item);
  }

 private:
  static void insert_before(Linked<Tag>& next, T& item) noexcept {
    Linked<Tag>& entry = item;
    entry.unlink();
    entry.previous_ = next.previous_;
    entry.next_ = &next;
    next.previous_->next_ = &entry;
    next.previous_ = &entry;
  }
  struct Root final : Linked<Tag> {};
  Root root_;
};

}  // namespace lrt::transport
