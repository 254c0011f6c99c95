// SPDX-License-Identifier: Apache-2.0
#include "src/engine/control_extension.hpp"

#include <lrt/thing.hpp>

#include "src/engine/resources/control.hpp"

namespace lrt {
namespace {

/// Only Thing::control() names this, so that a program without control does not link it.
class Extension final : public engine::ControlExtension {
 public:
  std::unique_ptr<engine::ControlBase> make_resource(const std::string& path, engine::ThingNode* thing,
                                                     const ControlOptions& options) const override {
    return std::make_unique<engine::ControlResource>(path, thing, options);
  }
};
constexpr Extension extension;

}  // namespace

inline namespace v0 {

Thing& Thing::control(ControlOptions options) {
  described().control = std::make_unique<const model::ControlSpec>(model::ControlSpec{extension, options});
  return *this;
}

}  // namespace v0
}  // namespace lrt
