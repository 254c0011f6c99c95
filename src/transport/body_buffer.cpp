// SPDX-License-Identifier: Apache-2.0
#include "src/transport/body_buffer.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include <lrt/transport/transport.hpp>

#include "src/base/client_key.hpp"

namespace lrt::transport {
namespace {

/// The smallest capacity. Pages of it that were never written use no memory.
constexpr std::size_t min_capacity = 16 * 1024;

/// Owns the memory of bytes that were moved out of a buffer.
struct Mapping {
  Mapping() = default;
  ~Mapping() {
    if (data) ::munmap(data, size);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  char* data = nullptr;
  std::size_t size = 0;
};

std::size_t counted(std::size_t bytes) noexcept { return bytes - std::min(bytes, BodyBudget::free_bytes); }

std::string key_of(std::string_view peer) {
  std::string client = client_key(peer);
  return is_this_machine(client) ? std::string() : client;
}

}  // namespace

BodyBudget::BodyBudget(const Limits& limits) noexcept
    : limit_(limits.max_total_body_bytes), client_limit_(limits.max_total_body_bytes_per_address.value_or(limits.max_total_body_bytes / 2)) {}

bool BodyBudget::take(const std::string& client, std::size_t bytes) noexcept {
  if (bytes == 0) return true;
  if (bytes > limit_ - used_) return false;
  if (!client.empty()) try {
      const auto known = clients_.find(client);
      const std::size_t before = known == clients_.end() ? 0 : known->second;
      if (before > client_limit_ || bytes > client_limit_ - before) return false;
      if (known != clients_.end()) known->second += bytes;
      else clients_.emplace(client, bytes);
    } catch (const std::bad_alloc&) { return false; }
  used_ += bytes;
  return true;
}

void BodyBudget::give_back(const std::string& client, std::size_t bytes) noexcept {
  if (bytes == 0) return;
  used_ -= bytes;
  if (client.empty()) return;
  const auto known = clients_.find(client);
  if ((known->second -= bytes) == 0) clients_.erase(known);
}

BodyBuffer::BodyBuffer(BodyBudget& budget, std::string_view peer) : budget_(budget), client_(key_of(peer)) {}

bool BodyBuffer::append(std::string_view bytes) noexcept {
  if (bytes.empty()) return true;
  const std::size_t more = counted(size_ + bytes.size()) - counted(size_);
  if (!budget_.take(client_, more)) return false;
  if (bytes.size() > capacity_ - size_) {
    const std::size_t capacity = std::max({min_capacity, 2 * capacity_, size_ + bytes.size()});
    void* const moved = data_ ? ::mremap(data_, capacity_, capacity, MREMAP_MAYMOVE)
                              : ::mmap(nullptr, capacity, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (moved == MAP_FAILED) return budget_.give_back(client_, more), false;
    data_ = static_cast<char*>(moved);
    capacity_ = capacity;
  }
  std::memcpy(data_ + size_, bytes.data(), bytes.size());
  size_ += bytes.size();
  return true;
}

std::shared_ptr<const void> BodyBuffer::release() noexcept {
  if (!data_) return nullptr;
  const std::shared_ptr<Mapping> mapping = [&]() noexcept -> std::shared_ptr<Mapping> {
    try {
      return std::make_shared<Mapping>();
    } catch (const std::bad_alloc&) { return nullptr; }
  }();
  if (!mapping) return nullptr;
  mapping->data = std::exchange(data_, nullptr);
  mapping->size = std::exchange(capacity_, 0);
  budget_.give_back(client_, counted(std::exchange(size_, 0)));
  return mapping;
}

void BodyBuffer::clear() noexcept {
  budget_.give_back(client_, counted(size_));
  if (data_) ::munmap(data_, capacity_);
  data_ = nullptr;
  size_ = capacity_ = 0;
}

}  // namespace lrt::transport
