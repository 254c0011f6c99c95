// SPDX-License-Identifier: Apache-2.0
#include "src/server/metric_sources.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "src/base/process.hpp"

namespace lrt {

class MetricSources::Handle {
 public:
  Handle(std::shared_ptr<List> list, std::shared_ptr<Entry> entry) noexcept : list_(std::move(list)), entry_(std::move(entry)) {}
  ~Handle() {
    if (!process_.is_current()) return;  // a thread that was not copied into this child may hold the locks
    MetricSource ended;                  // destroyed without the locks: it is user code
    {
      const std::lock_guard lock(entry_->mutex);
      std::swap(ended, entry_->source);
    }
    const std::lock_guard lock(list_->mutex);
    auto& entries = list_->entries;
    entries.erase(std::remove(entries.begin(), entries.end(), entry_), entries.end());
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

 private:
  const OwnProcess process_;
  const std::shared_ptr<List> list_;
  const std::shared_ptr<Entry> entry_;
};

std::shared_ptr<void> MetricSources::add(MetricSource source) {
  auto entry = std::make_shared<Entry>();
  entry->source = std::move(source);
  auto handle = std::make_shared<Handle>(list_, entry);
  const std::lock_guard lock(list_->mutex);
  list_->entries.push_back(std::move(entry));
  return handle;
}

std::vector<Metric> MetricSources::collect() const {
  std::vector<std::shared_ptr<Entry>> entries;
  {
    const std::lock_guard lock(list_->mutex);
    entries = list_->entries;
  }
  std::vector<Metric> all;
  for (const auto& entry : entries) {
    const std::lock_guard lock(entry->mutex);
    if (!entry->source) continue;
    try {
      std::vector<Metric> metrics = entry->source();
      all.insert(all.end(), std::make_move_iterator(metrics.begin()), std::make_move_iterator(metrics.end()));
    } catch (...) { all.emplace_back(); }  // user code: its error cannot be reported, but counted
  }
  return all;
}

std::unique_ptr<Service> make_metric_sources(SharedEngine&) { return std::make_unique<MetricSources>(); }

}  // namespace lrt
