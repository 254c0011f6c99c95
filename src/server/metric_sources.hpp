// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include <lrt/base/metric.hpp>

#include "src/server/service.hpp"

namespace lrt {

/// The sources that parts beside the server have added to its metrics. The server does not know the parts.
///
/// @par Threads  any
class MetricSources final : public Service {
 public:
  static constexpr char key = 0;
  const char* identity() const noexcept override { return &key; }

  /// @return  as long as it exists, the source is called. It may outlive the server; its end waits for a call of the source
  std::shared_ptr<void> add(MetricSource source);
  /// The metrics of all sources. A source that throws stands as a metric without a name, which no text can show.
  std::vector<Metric> collect() const;

 private:
  /// Held while its source is called, so that what the source uses can be destroyed when its handle has ended.
  struct Entry {
    std::mutex mutex;
    MetricSource source;  ///< empty: its handle has ended
  };
  struct List {
    std::mutex mutex;
    std::vector<std::shared_ptr<Entry>> entries;
  };
  class Handle;
  const std::shared_ptr<List> list_ = std::make_shared<List>();
};

}  // namespace lrt
