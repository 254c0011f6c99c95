#pragma once

#include <cstddef>
#include <string_view>

#include <lrt/base/language.hpp>

namespace lrt::transport {

/// The bytes of all bodies that a transport is receiving, and their limit.
/// @par Threads  One at a time.
class BodyBudget {
 public:
  explicit BodyBudget(std::size_t limit) noexcept : limit_(limit) {}
  BodyBudget(const BodyBudget&) = delete;
  BodyBudget& operator=(const BodyBudget&) = delete;

  std::size_t limit() const noexcept { return limit_; }
  std::size_t used() const noexcept { return used_; }

 private:
  friend class BodyBuffer;
  const std::size_t limit_;
  std::size_t used_ = 0;
};

/// The bytes of one body. They are a memory mapping, which grows without a copy and is returned to the system by clear(): a freed block of
/// malloc() would stay with the process.
class BodyBuffer {
 public:
  explicit BodyBuffer(BodyBudget& budget) noexcept : budget_(budget) {}
  ~BodyBuffer() { clear(); }
  BodyBuffer(const BodyBuffer&) = delete;
  BodyBuffer& operator=(const BodyBuffer&) = delete;

  /// False, without effect: the budget is used up, or the system has no memory.
  [[nodiscard]] bool append(std::string_view bytes) noexcept;
  /// Frees the bytes.
  void clear() noexcept;

  std::size_t size() const noexcept { return size_; }
  std::string_view view() const noexcept { return {data_, size_}; }

 private:
  BodyBudget& budget_;
  char* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace lrt::transport
