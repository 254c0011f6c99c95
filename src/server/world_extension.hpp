// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "src/engine/world_extension.hpp"
#include "src/server/kept_graphs.hpp"

namespace lrt {

/// What the server has of the extension of a World.
class WorldExtension : public engine::WorldExtension {
 public:
  /// @pre  as engine::WorldExtension::of()
  static const WorldExtension& of(const model::WorldSpec& world) { return static_cast<const WorldExtension&>(world.extension); }

  /// As KeptGraph::open().
  virtual Result<KeptGraphs::Opened> open_files(const model::WorldSpec& spec, const LogCallback& log, const ThreadOptions& threads) const = 0;

 protected:
  ~WorldExtension() = default;
};

}  // namespace lrt
