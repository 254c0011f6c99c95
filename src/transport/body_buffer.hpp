// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/language.hpp>

namespace lrt::transport {
inline namespace v0 {

struct Limits;

/// The memory of all bodies that a transport is receiving, and its limits (Limits::max_total_body_bytes,
/// max_total_body_bytes_per_address).
/// @par Threads  One thread at a time.
class BodyBudget {
 public:
  /// The first bytes of each body are not counted, so small commands are received while large bodies use up the limit.
  /// max_connections bounds them.
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
  std::map<std::string, std::size_t> clients_;  ///< clients that use memory; not a hash table, because clients choose their IPv6 addresses
};

/// The bytes of one body, in a memory mapping. It grows without a copy, and clear() returns it to the system; a block
/// of malloc() could stay with the process.
class BodyBuffer {
 public:
  /// @param peer  numeric address of the client
  BodyBuffer(BodyBudget& budget, std::string_view peer);
  ~BodyBuffer() { clear(); }
  BodyBuffer(const BodyBuffer&) = delete;
  BodyBuffer& operator=(const BodyBuffer&) = delete;

  /// Appends bytes. False: the budget or the client's share of it is used up, or the system has no memory; nothing was
  /// appended.
  [[nodiscard]] bool append(std::string_view bytes) noexcept;
  /// Frees the bytes.
  void clear() noexcept;
  /// Transfers the bytes to the caller; they are no longer counted. The former view() is valid as long as the result,
  /// which any thread may free. nullptr: there are no bytes, or the system has no memory; then nothing has changed.
  std::shared_ptr<const void> release() noexcept;

  std::size_t size() const noexcept { return size_; }
  std::string_view view() const noexcept { return {data_, size_}; }

 private:
  BodyBudget& budget_;
  const std::string client_;  ///< client_key; empty: a client on this machine, which has no limit of its own
  char* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace v0
}  // namespace lrt::transport
