// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/base/canonical_path.hpp"
#include "src/engine/change_log.hpp"
#include "src/engine/representation_cache.hpp"
#include "src/engine/resource.hpp"
#include "src/engine/resource_index.hpp"

namespace lrt::engine {
inline namespace v0 {

/// A reference to a resource that may be removed before it is used.
template <class R>
struct Ref {
  Ref() = default;
  explicit Ref(const R& resource) : id(resource.id) {}
  ResourceId id{};
};

/// The map from paths to resources, and the tree of Things.
class Registry {
 public:
  explicit Registry(RepresentationCache& cache);
  ~Registry();

  /// Gives the resource an id and its path. A resource whose path the user gives to another one moves aside (Resource::Naming), and moves
  /// back when that one is removed. So the paths do not depend on the order of registration.
  /// @return false: another resource has the path, and neither has precedence
  bool add(Resource& resource);
  /// Removes the path: observers are notified, cached representations are removed. Must be called before a resource is destroyed.
  void remove(Resource& resource);

  /// @param path  percent-encoded as canonical_path() does it
  Resource* find(std::string_view path) const;
  Resource* find(ResourceId id) const;
  /// The resource of a kind (Resource::saved_type) with that usual path, also if it has moved aside.
  Resource* find_usual(std::string_view usual_path, std::string_view saved_type) const;
  template <class R>
  R* find(Ref<R> ref) const {
    return static_cast<R*>(find(ref.id));
  }

  /// Adds a Thing to the tree, after its resources. Things whose paths are below become its children.
  ThingNode& add_thing(std::unique_ptr<ThingNode> thing);
  /// Removes a Thing from the tree. Its children become children of its parent.
  std::unique_ptr<ThingNode> remove_thing(ThingNode& thing);
  /// Destroys all Things, before the objects that their resources refer to.
  void clear();
  /// @param path  "/baxter/right_s1"
  ThingNode* find_thing(std::string_view path) const;
  /// Whether a Thing has this path, or one below it.
  bool has_things_below(std::string_view path) const;
  const ThinVector<ThingNode*>& roots() const noexcept { return roots_; }
  const std::map<std::string_view, std::unique_ptr<ThingNode>>& things() const noexcept { return things_; }

  /// From now on take_new() returns the resources that get a path or a new path.
  void follow(bool followed);
  std::vector<ResourceId> take_new() { return std::exchange(new_, {}); }
  /// Calls a function with each resource.
  template <class F>
  void for_each(F f) const {
    by_id_.for_each(f);
  }

  /// Incremented with every change of the structure: Things and their resources.
  std::uint64_t structure() const noexcept { return structure_; }
  void structure_changed() noexcept { ++structure_; }
  /// The resources of Things that were made, have changed or were removed. Of other resources: that were made or removed.
  ChangeLog& changes() const noexcept { return changes_; }

 private:
  void settle(Resource& resource);
  void record_change(Resource& resource) noexcept;
  ThinVector<ThingNode*>& siblings_of(const ThingNode& thing);

  RepresentationCache& cache_;
  PathIndex by_path_;
  IdIndex by_id_;
  std::vector<Resource*> aside_;                                   ///< those that have moved aside
  std::map<std::string_view, std::unique_ptr<ThingNode>> things_;  ///< by the path that the node has
  ThinVector<ThingNode*> roots_;                                   ///< in the order of registration
  std::uint64_t structure_ = 1;
  mutable ChangeLog changes_;
  bool is_followed_ = false;
  std::vector<ResourceId> new_;  ///< while take_new() is in use
};

}  // namespace v0
}  // namespace lrt::engine
