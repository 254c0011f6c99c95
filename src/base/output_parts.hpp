// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/uio.h>

#include <cstddef>
#include <string_view>

namespace lrt {

/// Bytes for one writing system call, in this order.
class OutputParts {
 public:
  bool empty() const noexcept { return count_ == 0; }
  /// The number of free parts.
  std::size_t room() const noexcept { return max_parts - count_; }
  /// @pre room() > 0
  void add(std::string_view bytes) noexcept {
    if (!bytes.empty()) parts_[count_++] = {const_cast<char*>(bytes.data()), bytes.size()};
  }
  const iovec* data() const noexcept { return parts_; }
  std::size_t size() const noexcept { return count_; }

 private:
  static constexpr std::size_t max_parts = 64;
  std::size_t count_ = 0;
  iovec parts_[max_parts];  // unused elements are not initialised, because this is created for each call
};

}  // namespace lrt
