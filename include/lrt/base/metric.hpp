// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// One number for a monitoring system, in the data model of Prometheus. Metrics of the same name differ in their labels.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Metric {
  /// How the number changes.
  enum class Kind : unsigned char {
    counter,  ///< it only grows, from 0 when its source was made
    gauge,    ///< a present number
  };
  /// Letters, digits and '_', not a digit first: "lrt_mqtt_published_total". The name of a counter ends with "_total", that of a gauge does not; none
  /// ends with "_bucket", "_count" or "_sum", as parts of a histogram do. A unit is the last word, or the one before "_total": "_seconds", "_bytes".
  std::string name;
  std::string help;         ///< one sentence about the name, in UTF-8; not empty
  Kind kind = Kind::gauge;  ///< the same for all metrics of a name
  double value = 0;         ///< in the unit of the name
  /// Names (letters, digits and '_', not "__" first) and values in UTF-8. Few different ones: each combination is stored for itself.
  std::vector<std::pair<std::string, std::string>> labels{};
};

/// Returns the present numbers of one part of a program. It must not wait.
using MetricSource = std::function<std::vector<Metric>()>;

}  // namespace v0
}  // namespace lrt
