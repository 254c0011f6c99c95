// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <list>
#include <utility>

#include "src/engine/resource.hpp"

namespace lrt::engine {

class Languages;

/// The cached representations. The least recently used are removed when there are too many bytes.
class RepresentationCache {
 public:
  explicit RepresentationCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// The cached representation of that kind, or nullptr. It may show an earlier state of the resource.
  /// @param languages  that the client wants; nullptr: none
  Representation* find(const Resource& resource, std::size_t base, Variant variant, std::size_t page, const Audience& audience,
                       const Languages* languages) const;
  /// Keeps a representation, and removes the one of the same kind.
  Representation& keep(Representation made);
  void mark_used(Representation& kept) noexcept;
  /// A representation has grown.
  void grown(std::size_t bytes) noexcept { bytes_ += bytes; }
  /// A part of one was replaced.
  void shrunk(std::size_t bytes) noexcept { bytes_ -= bytes; }
  /// Removes all representations of a resource. Must be called before the resource is destroyed.
  void forget(Resource& resource) noexcept;
  /// Removes all representations of a base.
  void forget_base(std::size_t base) noexcept;
  void clear() noexcept;

 private:
  using Place = std::list<Representation>::iterator;
  void erase(Place place) noexcept;

  const std::size_t max_bytes_;
  std::list<Representation> kept_;  ///< least recently used last; each resource knows the places of its own
  std::size_t bytes_ = 0;
};

}  // namespace lrt::engine
