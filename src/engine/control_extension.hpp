// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "src/engine/control.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {

/// What the engine has of the extension of a Thing with control.
class ControlExtension : public model::ControlExtension {
 public:
  /// @pre  it is an object of this class, as all are that Thing::control() names
  static const ControlExtension& of(const model::ControlSpec& control) { return static_cast<const ControlExtension&>(control.extension); }

  virtual std::unique_ptr<ControlBase> make_resource(const std::string& path, ThingNode* thing, const ControlOptions& options) const = 0;

 protected:
  ~ControlExtension() = default;
};

}  // namespace lrt::engine
