// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lrt/base/metric.hpp>
#include <lrt/mirror.hpp>

namespace lrt::mirror {
inline namespace v0 {

/// The numbers of a mirror with the URL of its store as a label.
std::vector<Metric> metrics_of(const MirrorCounts& counts, const std::string& store, std::size_t robots);

}  // namespace v0
}  // namespace lrt::mirror
