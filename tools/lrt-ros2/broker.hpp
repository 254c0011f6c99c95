// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/log.hpp>
#include <lrt/server.hpp>

#include "tools/lrt-ros2/settings.hpp"

namespace lrt::ros2_tool {

/// A connection to an MQTT broker; without lrt::mqtt there is none.
class BrokerLink {
 public:
  virtual ~BrokerLink() = default;
  /// @return      nullptr: no broker is wanted
  /// @par Errors  invalid_option: this build has no MQTT, or a setting is wrong; those of mqtt::Bridge
  static Result<std::unique_ptr<BrokerLink>> create(Server& server, const Broker& broker, const LogCallback& log);
};

}  // namespace lrt::ros2_tool
