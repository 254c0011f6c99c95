// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace lrt::detail {

/// An array whose copies share its blocks. A copy costs one count for each 64 blocks; a change of an element of a shared block copies that block. So an old
/// copy keeps its content while a new one is changed, and both have most of their memory in common.
///
/// @tparam block_bits  a block has two to this power elements
///
/// @par Threads  Distinct objects: any thread, also while they share blocks. One object: one thread at a time, or any number of reading threads, to which a
///               copy counts as reading.
/// @par Time     operator[]: three loads. A copy: size / (64 * block). edit(): constant, the first one in a block copies it and up to 64 pointers.
template <class T, unsigned block_bits>
class SharedArray {
  static_assert(std::is_trivially_copyable_v<T>, "blocks are copied and destroyed without their elements");

 public:
  static constexpr std::uint32_t block_size = 1U << block_bits;

  SharedArray() noexcept = default;
  SharedArray(const SharedArray& other) : branches_(other.branches_), size_(other.size_), is_alone_(false) {
    other.is_alone_.store(false, std::memory_order_relaxed);
    for (Branch* branch : branches_) branch->owners.fetch_add(1, std::memory_order_relaxed);
  }
  SharedArray& operator=(const SharedArray&) = delete;
  ~SharedArray() {
    for (Branch* branch : branches_) release(branch);
  }

  std::uint32_t size() const noexcept { return size_; }
  const T& operator[](std::uint32_t at) const noexcept { return block_of(at)->items[at & (block_size - 1)]; }

  /// The element, to be changed. The reference is valid until the array is copied or destroyed.
  T& edit(std::uint32_t at) {
    const bool is_alone = is_alone_.load(std::memory_order_relaxed);
    Branch& branch = is_alone ? *branches_[at >> (block_bits + branch_bits)] : own_branch(at >> (block_bits + branch_bits));
    Block*& block = branch.blocks[(at >> block_bits) & (branch_size - 1)];
    if (!is_alone && block->owners.load(std::memory_order_acquire) != 1) release(std::exchange(block, new Block(*block)));
    return block->items[at & (block_size - 1)];
  }

  /// Adds an element. If there is no memory, nothing changes.
  void push_back(const T& value) {
    const std::uint32_t last = size_ >> (block_bits + branch_bits);
    if (branches_.size() == last) {
      if (branches_.capacity() == last) branches_.reserve(last + 1 + last / 2);
      branches_.push_back(new Branch);
    }
    Block*& block = own_branch(last).blocks[(size_ >> block_bits) & (branch_size - 1)];
    if (!block) block = new Block;
    T& place = edit(size_);
    place = value;
    ++size_;
  }

  /// Calls a function with the first element and the end of each range in which the two may differ.
  template <class Visit>
  static void for_each_difference(const SharedArray& a, const SharedArray& b, Visit visit) {
    const std::uint32_t end = a.size_ > b.size_ ? a.size_ : b.size_;
    for (std::uint32_t at = 0; at < end;) {
      const Branch* const of_a = a.branch_at(at);
      const Branch* const of_b = b.branch_at(at);
      if (of_a == of_b) {
        at += block_size * branch_size;
        continue;
      }
      for (std::size_t i = 0; i < branch_size && at < end; ++i, at += block_size)
        if (!of_a || !of_b || of_a->blocks[i] != of_b->blocks[i]) visit(at, at + block_size < end ? at + block_size : end);
    }
  }

 private:
  static constexpr unsigned branch_bits = 6;
  static constexpr std::size_t branch_size = 1U << branch_bits;

  struct Block {
    Block() noexcept = default;
    Block(const Block& other) noexcept {
      for (std::uint32_t i = 0; i < block_size; ++i) items[i] = other.items[i];
    }
    Block& operator=(const Block&) = delete;
    T items[block_size]{};
    std::atomic<std::uint32_t> owners{1};
  };
  struct Branch {
    Block* blocks[branch_size]{};  // nullptr: the array ends before
    std::atomic<std::uint32_t> owners{1};
  };

  Branch& own_branch(std::uint32_t at) {
    Branch*& branch = branches_[at];
    if (branch->owners.load(std::memory_order_acquire) == 1) return *branch;
    auto* const copy = new Branch;
    for (std::size_t i = 0; i < branch_size && branch->blocks[i]; ++i) {
      copy->blocks[i] = branch->blocks[i];
      copy->blocks[i]->owners.fetch_add(1, std::memory_order_relaxed);
    }
    release(std::exchange(branch, copy));
    return *branch;
  }
  const Branch* branch_at(std::uint32_t at) const noexcept {
    const std::size_t i = at >> (block_bits + branch_bits);
    return i < branches_.size() ? branches_[i] : nullptr;
  }
  const Block* block_of(std::uint32_t at) const noexcept {
    assert(at < size_);
    return branches_[at >> (block_bits + branch_bits)]->blocks[(at >> block_bits) & (branch_size - 1)];
  }
  static void release(Block* block) noexcept {
    if (block->owners.fetch_sub(1, std::memory_order_acq_rel) == 1) delete block;
  }
  static void release(Branch* branch) noexcept {
    if (branch->owners.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    for (std::size_t i = 0; i < branch_size && branch->blocks[i]; ++i) release(branch->blocks[i]);
    delete branch;
  }

  std::vector<Branch*> branches_;
  std::uint32_t size_ = 0;
  mutable std::atomic<bool> is_alone_{true};  // was never copied: no block is shared
};

}  // namespace lrt::detail
