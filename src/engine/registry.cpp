// SPDX-License-Identifier: Apache-2.0
#include "src/engine/registry.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

Registry::Registry(RepresentationCache& cache) : cache_(cache) {}
Registry::~Registry() = default;

bool Registry::add(Resource& resource) {
  const Resource* const holder = find(resource.path);
  if (holder && holder->naming() == resource.naming()) return false;
  by_id_.add(resource);
  try {
    settle(resource);
  } catch (...) {
    by_id_.remove(resource);
    throw;
  }
  record_change(resource);
  return true;
}

void Registry::record_change(Resource& resource) noexcept {
  if (resource.thing) resource.record_change();
  else changes_.add(resource.id);
}

/// Gives a resource without a path the first path that is free or whose resource has to move.
void Registry::settle(Resource& resource) {
  std::uint32_t n = 0;
  std::string path = resource.path_aside(n);
  Resource* holder = find(path);
  while (holder && holder->naming() <= resource.naming()) {
    path = resource.path_aside(++n);
    holder = find(path);
  }
  if (holder) by_path_.remove(*holder);
  if (n != 0 && resource.times_aside == 0) aside_.push_back(&resource);
  if (n == 0 && resource.times_aside != 0) aside_.erase(std::find(aside_.begin(), aside_.end(), &resource));
  const bool moves = n != resource.times_aside;
  resource.path = std::move(path);
  resource.times_aside = n;
  by_path_.add(resource);
  if (is_followed_) new_.push_back(resource.id);
  if (moves) {
    cache_.clear();  // other representations link to it
    resource.record_change();
    resource.path_changed();
  }
  if (holder) settle(*holder);
}

void Registry::remove(Resource& resource) {
  while (!resource.observers.empty()) resource.observers.back()->resource_removed();
  record_change(resource);
  cache_.forget(resource);
  if (find(resource.path) == &resource) by_path_.remove(resource);
  by_id_.remove(resource);
  aside_.erase(std::remove(aside_.begin(), aside_.end(), &resource), aside_.end());
  if (aside_.empty()) return;
  try {
    for (Resource* other : std::vector<Resource*>(aside_)) {
      by_path_.remove(*other);
      settle(*other);
    }
  } catch (const std::bad_alloc&) {}  // those that are left stay where they are: removing must not fail
}

void Registry::follow(bool followed) {
  is_followed_ = followed;
  new_.clear();
}

Resource* Registry::find(std::string_view path) const { return by_path_.find(path); }
Resource* Registry::find(ResourceId id) const { return by_id_.find(id); }

Resource* Registry::find_usual(std::string_view usual_path, std::string_view saved_type) const {
  const auto is_it = [&](const Resource* r) { return r->saved_type().text == saved_type && r->path_aside(0) == usual_path; };
  Resource* const here = find(usual_path);
  if (here && is_it(here)) return here;
  const auto moved = std::find_if(aside_.begin(), aside_.end(), is_it);
  return moved == aside_.end() ? nullptr : *moved;
}

ThingNode* Registry::find_thing(std::string_view path) const {
  const auto found = things_.find(path);
  return found == things_.end() ? nullptr : found->second.get();
}

bool Registry::has_things_below(std::string_view path) const {
  if (find_thing(path)) return true;
  const std::string below = std::string(path) + "/";
  const auto next = things_.lower_bound(below);
  return next != things_.end() && next->first.compare(0, below.size(), below) == 0;
}

void Registry::clear() {
  cache_.clear();
  by_path_.clear();
  by_id_.clear();
  aside_.clear();
  roots_.clear();
  things_.clear();
}

ThinVector<ThingNode*>& Registry::siblings_of(const ThingNode& thing) { return thing.parent ? thing.parent->children : roots_; }

ThingNode& Registry::add_thing(std::unique_ptr<ThingNode> made) {
  ThingNode& thing = *made;
  things_.emplace(thing.self.path, std::move(made));
  std::string_view path = thing.self.path;
  for (std::size_t slash = path.rfind('/'); slash != 0 && slash != std::string_view::npos && !thing.parent; slash = path.rfind('/')) {
    path = path.substr(0, slash);
    thing.parent = find_thing(path);
  }
  ThinVector<ThingNode*>& siblings = siblings_of(thing);
  const std::string prefix = thing.self.path + "/";
  const auto is_below = [&](const ThingNode* other) { return other->self.path.compare(0, prefix.size(), prefix) == 0; };
  // Siblings are searched only if a Thing is below, so that the registration of many siblings takes linear time.
  const auto next = things_.upper_bound(prefix);
  if (next != things_.end() && is_below(next->second.get())) {
    for (ThingNode* other : siblings) {
      if (!is_below(other)) continue;
      other->parent = &thing;
      thing.children.push_back(other);
    }
    siblings.remove_if(is_below);
  }
  siblings.push_back(&thing);
  structure_changed();
  return thing;
}

std::unique_ptr<ThingNode> Registry::remove_thing(ThingNode& thing) {
  ThinVector<ThingNode*>& siblings = siblings_of(thing);
  siblings.remove(&thing);
  for (ThingNode* child : thing.children) {
    child->parent = thing.parent;
    siblings.push_back(child);
  }
  thing.children.clear();
  const auto found = things_.find(thing.self.path);
  std::unique_ptr<ThingNode> out = std::move(found->second);
  things_.erase(found);
  structure_changed();
  return out;
}

}  // namespace lrt::engine
