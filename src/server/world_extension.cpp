// SPDX-License-Identifier: Apache-2.0
#include "src/server/world_extension.hpp"

#include <utility>

#include <lrt/world.hpp>

#include "src/engine/resources/world.hpp"

namespace lrt {
namespace {

/// Only World's constructor names this.
class Extension final : public WorldExtension {
 public:
  std::unique_ptr<engine::ThingResource> make_resource(const std::string& path, engine::ThingNode* thing,
                                                       const model::WorldSpec& spec) const override {
    return std::make_unique<engine::WorldResource>(path, thing, spec);
  }
  Result<KeptGraphs::Opened> open_files(const model::WorldSpec& spec, const LogCallback& log, const ThreadOptions& threads) const override {
    return KeptGraph::open(spec, log, threads);
  }
};
constexpr Extension extension;

}  // namespace

World::World(std::string_view path, WorldOptions options) : Thing(path) {
  if (options.clients_may_create && !options.created.shapes.empty()) shapes(options.created.shapes);
  if (const Result<void> set_up = model::set_up_world(*spec_, std::move(options), extension); !set_up) remember(set_up.error());
}

}  // namespace lrt
