// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resource_index.hpp"

#include <functional>
#include <stdexcept>

namespace lrt::engine {

namespace {

std::uint32_t hash_of(std::string_view path) noexcept { return static_cast<std::uint32_t>(std::hash<std::string_view>()(path)); }

}  // namespace

Resource* PathIndex::find(std::string_view path) const noexcept {
  if (places_.empty()) return nullptr;
  const std::uint32_t hash = hash_of(path);
  for (std::size_t at = place_of(hash); places_[at]; at = after(at))
    if (hashes_[at] == hash && places_[at]->path == path) return places_[at];
  return nullptr;
}

void PathIndex::add(Resource& resource) {
  if (8 * (size_ + 1) > 7 * places_.size()) grow();
  put(resource, hash_of(resource.path));
  ++size_;
}

void PathIndex::put(Resource& resource, std::uint32_t hash) noexcept {
  std::size_t at = place_of(hash);
  while (places_[at]) at = after(at);
  places_[at] = &resource;
  hashes_[at] = hash;
}

void PathIndex::grow() {
  PathIndex larger;
  larger.places_.resize(places_.empty() ? 64 : 2 * places_.size());
  larger.hashes_.resize(larger.places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i)
    if (places_[i]) larger.put(*places_[i], hashes_[i]);
  places_.swap(larger.places_);
  hashes_.swap(larger.hashes_);
}

void PathIndex::remove(const Resource& resource) noexcept {
  std::size_t hole = place_of(hash_of(resource.path));
  while (places_[hole] != &resource) hole = after(hole);
  // Backward shift: later elements move into the hole, unless their search begins behind it, so that no search stops early.
  for (std::size_t at = after(hole); places_[at]; at = after(at)) {
    const std::size_t from_home = (at - place_of(hashes_[at])) & (places_.size() - 1), from_hole = (at - hole) & (places_.size() - 1);
    if (from_home < from_hole) continue;
    places_[hole] = places_[at];
    hashes_[hole] = hashes_[at];
    hole = at;
  }
  places_[hole] = nullptr;
  --size_;
}

void PathIndex::clear() noexcept { *this = {}; }

Resource* IdIndex::find(ResourceId id) const noexcept {
  const std::size_t place = place_of(id);
  Resource* const found = place < places_.size() ? places_[place] : nullptr;
  return found && found->id == id ? found : nullptr;
}

void IdIndex::add(Resource& resource) {
  std::size_t place = places_.size();
  if (!free_.empty()) {
    place = free_.back();
    free_.pop_back();
    places_[place] = &resource;
  } else {
    if (place >> place_bits != 0) throw std::length_error("too many resources");
    places_.push_back(&resource);
  }
  resource.id = ResourceId{(next_serial_++ << place_bits) | place};
}

void IdIndex::remove(const Resource& resource) noexcept {
  const std::size_t place = place_of(resource.id);
  if (place >= places_.size() || places_[place] != &resource) return;
  places_[place] = nullptr;
  try {
    free_.push_back(static_cast<std::uint32_t>(place));
  } catch (...) {  // out of memory: the place is not used again
  }
}

void IdIndex::clear() noexcept {
  places_.clear();
  free_.clear();
}

}  // namespace lrt::engine
