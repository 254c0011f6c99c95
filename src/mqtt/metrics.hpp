// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <lrt/base/metric.hpp>
#include <lrt/mqtt.hpp>

namespace lrt::mqtt {
inline namespace v0 {

/// The numbers of a bridge for Server::add_metrics(). A server may have several bridges: their labels are the broker's URL and the prefix.
std::vector<Metric> metrics_of(const Counters& counters, const std::string& broker, const std::string& prefix);

}  // namespace v0
}  // namespace lrt::mqtt
