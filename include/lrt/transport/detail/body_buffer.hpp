// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::transport {
inline namespace v0 {

struct Limits;

/// The bytes of all bodies that a transport is receiving, and their limits (Limits::max_total_body_bytes, max_total_body_bytes_per_address).
/// @par Threads  One at a time.
class LRT_API BodyBudget {
 public:
  /// Of each body, not counted: small commands are received while large bodies use up the limit. max_connections bounds these.
  static constexpr std::size_t free_bytes = 4096;

  explicit BodyBudget(const Limits& limits) noexcept;
  BodyBudget(const BodyBudget&) = delete;
  BodyBudget& operator=(const BodyBudget&) = delete;

  std::size_t used() const noexcept { return used_; }

 private:
  friend class BodyBuffer;
  bool take(const std::string& client, std::size_t bytes) noexcept;
  void give_back(const std::string& client, std::size_t bytes) noexcept;

  const std::size_t limit_, client_limit_;
  std::size_t used_ = 0;
  std::map<std::string, std::size_t> clients_;  ///< those that use something; not a hash table: clients choose their IPv6 addresses
};

/// The bytes of one body. They are a memory mapping, which grows without a copy and is returned to the system by clear(): a freed block of
/// malloc() would stay with the process.
class LRT_API BodyBuffer {
 public:
  /// @param peer  numeric address of the client
  BodyBuffer(BodyBudget& budget, std::string_view peer);
  ~BodyBuffer() { clear(); }
  BodyBuffer(const BodyBuffer&) = delete;
  BodyBuffer& operator=(const BodyBuffer&) = delete;

  /// False, without effect: the budget is used up, or the client's share of it, or the system has no memory.
  [[nodiscard]] bool append(std::string_view bytes) noexcept;
  /// Frees the bytes.
  void clear() noexcept;
  /// Gives the bytes away, which no longer count: what view() was stays valid as long as the result, which any thread may free.
  /// nullptr: there are none, or there is no memory; then nothing has changed.
  std::shared_ptr<const void> release() noexcept;

  std::size_t size() const noexcept { return size_; }
  std::string_view view() const noexcept { return {data_, size_}; }

 private:
  BodyBudget& budget_;
  const std::string client_;  ///< client_key; empty: of this machine, which has no share
  char* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace v0
}  // namespace lrt::transport
