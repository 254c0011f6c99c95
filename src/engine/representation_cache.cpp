// SPDX-License-Identifier: Apache-2.0
#include "src/engine/representation_cache.hpp"

#include <iterator>

#include "src/engine/languages.hpp"

namespace lrt::engine {

Representation* RepresentationCache::find(const Resource& resource, std::size_t base, Variant variant, std::size_t page, const Audience& audience,
                                          const Languages* languages) const {
  const std::string_view name = audience.name_in(resource);
  const auto suits = [&](const Representation& kept) {
    return !kept.has_languages() || kept.languages->wanted == (languages ? languages->wanted_of(kept.languages->offered) : std::string());
  };
  for (const Place place : resource.representations)
    if (place->base == base && place->variant == variant && place->page == page && place->view == audience.view && place->name == name &&
        suits(*place))
      return &*place;
  return nullptr;
}

Representation& RepresentationCache::keep(Representation made) {
  Resource& resource = *made.resource;
  for (const Place place : resource.representations) {
    if (place->base != made.base || place->variant != made.variant || place->page != made.page || place->view != made.view ||
        place->name != made.name)
      continue;
    if (place->state == made.state && place->has_languages() && made.has_languages() && place->languages->wanted != made.languages->wanted) continue;
    erase(place);
    break;
  }
  const std::size_t bytes = made.bytes();
  kept_.push_front(std::move(made));
  try {
    resource.representations.push_back(kept_.begin());
  } catch (...) {
    kept_.pop_front();
    throw;
  }
  bytes_ += bytes;
  while (bytes_ > max_bytes_ && kept_.size() > 1) erase(std::prev(kept_.end()));
  return kept_.front();
}

void RepresentationCache::mark_used(Representation& kept) noexcept {
  for (const Place place : kept.resource->representations)
    if (&*place == &kept) return kept_.splice(kept_.begin(), kept_, place);
}

void RepresentationCache::forget(Resource& resource) noexcept {
  while (!resource.representations.empty()) erase(resource.representations.back());
}

void RepresentationCache::forget_base(std::size_t base) noexcept {
  for (auto place = kept_.begin(); place != kept_.end();) {
    const Place next = std::next(place);
    if (place->base == base) erase(place);
    place = next;
  }
}

void RepresentationCache::clear() noexcept {
  while (!kept_.empty()) erase(kept_.begin());
}

void RepresentationCache::erase(Place place) noexcept {
  place->resource->representations.remove(place);
  bytes_ -= place->bytes();
  kept_.erase(place);
}

}  // namespace lrt::engine
