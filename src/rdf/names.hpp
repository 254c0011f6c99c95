// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/rdf/detail/hash_index.hpp>

#include "src/rdf/hash.hpp"

namespace lrt::rdf {

/// Values by names that are views of the document. Keyed by the process, so that a document cannot choose names that collide.
template <class T>
class Names {
 public:
  T* find(std::string_view name) noexcept {
    if (last_ < entries_.size() && entries_[last_].first == name) return &entries_[last_].second;
    const std::uint32_t at = index_.find(hash(name), [&](std::uint32_t i) { return entries_[i].first == name; });
    if (at == lrt::detail::HashIndex::none) return nullptr;
    last_ = at;
    return &entries_[at].second;
  }
  /// @pre  find(name) is nullptr
  T& add(std::string_view name, T value) {
    index_.insert(hash(name), static_cast<std::uint32_t>(entries_.size()));
    return entries_.emplace_back(name, std::move(value)).second;
  }

 private:
  static std::uint32_t hash(std::string_view name) noexcept { return to_32_bits(hash_bytes(name, hash_seeds().bytes)); }
  std::vector<std::pair<std::string_view, T>> entries_;
  lrt::detail::HashIndex index_;
  std::size_t last_ = 0;  // found
};

}  // namespace lrt::rdf
