// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "src/engine/resource.hpp"

namespace lrt::engine {

/// Resources by path. 12 bytes for each place of a table with open addressing, of which at most 7 of 8 are taken.
class PathIndex {
 public:
  /// nullptr: no resource has the path.
  Resource* find(std::string_view path) const noexcept;
  /// @pre no resource has its path. The path must not change until it is removed.
  void add(Resource& resource);
  /// @pre it was added
  void remove(const Resource& resource) noexcept;
  void clear() noexcept;

 private:
  std::size_t place_of(std::uint32_t hash) const noexcept { return hash & (places_.size() - 1); }
  std::size_t after(std::size_t place) const noexcept { return (place + 1) & (places_.size() - 1); }
  void put(Resource& resource, std::uint32_t hash) noexcept;
  void grow();

  std::vector<Resource*> places_;      // nullptr: free; as many as a power of two
  std::vector<std::uint32_t> hashes_;  // of the paths, of the same index
  std::size_t size_ = 0;
};

/// Resources by id: 8 bytes each. A place is used again, an id is not.
class IdIndex {
 public:
  Resource* find(ResourceId id) const noexcept;
  /// Gives the resource an id.
  void add(Resource& resource);
  void remove(const Resource& resource) noexcept;
  void clear() noexcept;
  template <class F>
  void for_each(F f) const {
    for (Resource* resource : places_)
      if (resource) f(*resource);
  }

 private:
  static constexpr unsigned place_bits = 28;
  static std::size_t place_of(ResourceId id) noexcept { return static_cast<std::uint64_t>(id) & ((std::uint64_t{1} << place_bits) - 1); }

  std::vector<Resource*> places_;    // nullptr: free
  std::vector<std::uint32_t> free_;  // places to be used again
  std::uint64_t next_serial_ = 1;
};

}  // namespace lrt::engine
