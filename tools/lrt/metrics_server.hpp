// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <lrt/base/metric.hpp>
#include <lrt/base/result.hpp>
#include <lrt/server.hpp>

namespace lrt::tool {

/// Serves the numbers of a command for Prometheus until it is destroyed.
class MetricsServer {
 public:
  /// @param where   "[ADDRESS:]PORT"; without an address this machine only, port 0: any
  /// @param source  must be callable until the object is destroyed
  /// @par Errors  invalid_option; those of Server::create()
  static Result<MetricsServer> create(const std::string& where, MetricSource source);
  /// Where the text is.
  std::string url() const { return server_.url() + "server/metrics"; }

 private:
  MetricsServer(Server server, MetricSource source);
  Server server_;
  std::shared_ptr<void> shown_;
};

}  // namespace lrt::tool
