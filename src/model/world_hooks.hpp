// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>

namespace lrt {
inline namespace v0 {
class KeptGraph;
}  // namespace v0
}  // namespace lrt

namespace lrt::engine {
inline namespace v0 {
class ThingResource;
struct ThingNode;
}  // namespace v0
}  // namespace lrt::engine

namespace lrt::model {
inline namespace v0 {

struct WorldSpec;

/// What other modules do for a World. Only World's constructor names these functions: a linker leaves them out of a program without a World.
struct WorldHooks {
  /// Its resource.
  std::unique_ptr<engine::ThingResource> (*make_resource)(const std::string& path, engine::ThingNode* thing, const WorldSpec& spec);
  /// KeptGraph::open().
  Result<std::vector<std::unique_ptr<KeptGraph>>> (*open_files)(const WorldSpec& spec, const LogCallback& log, const ThreadOptions& threads);
};
/// Defined in src/server/kept_graphs.cpp.
const WorldHooks& world_hooks() noexcept;

}  // namespace v0
}  // namespace lrt::model
