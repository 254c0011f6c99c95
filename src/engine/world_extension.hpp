// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "src/engine/resources/thing.hpp"
#include "src/model/graph_state.hpp"

namespace lrt::engine {

/// What the engine has of the extension of a World.
class WorldExtension : public model::WorldExtension {
 public:
  /// @pre  it is an object of this class, as all are that World's constructor names
  static const WorldExtension& of(const model::WorldSpec& world) { return static_cast<const WorldExtension&>(world.extension); }

  /// The resource of the World.
  virtual std::unique_ptr<ThingResource> make_resource(const std::string& path, ThingNode* thing, const model::WorldSpec& spec) const = 0;

 protected:
  ~WorldExtension() = default;
};

}  // namespace lrt::engine
