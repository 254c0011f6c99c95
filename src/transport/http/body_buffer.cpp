#include <lrt/transport/detail/body_buffer.hpp>

#include <sys/mman.h>

#include <algorithm>
#include <cstring>

namespace lrt::transport {
namespace {

/// Only pages that have been written to use memory.
constexpr std::size_t min_capacity = 16 * 1024;

}  // namespace

bool BodyBuffer::append(std::string_view bytes) noexcept {
  if (bytes.empty()) return true;
  if (bytes.size() > budget_.limit_ - budget_.used_) return false;
  if (bytes.size() > capacity_ - size_) {
    const std::size_t capacity = std::max({min_capacity, 2 * capacity_, size_ + bytes.size()});
    void* const moved = data_ ? ::mremap(data_, capacity_, capacity, MREMAP_MAYMOVE)
                              : ::mmap(nullptr, capacity, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (moved == MAP_FAILED) return false;
    data_ = static_cast<char*>(moved);
    capacity_ = capacity;
  }
  std::memcpy(data_ + size_, bytes.data(), bytes.size());
  size_ += bytes.size();
  budget_.used_ += bytes.size();
  return true;
}

void BodyBuffer::clear() noexcept {
  budget_.used_ -= size_;
  if (data_) ::munmap(data_, capacity_);
  data_ = nullptr;
  size_ = capacity_ = 0;
}

}  // namespace lrt::transport
