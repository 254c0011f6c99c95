// SPDX-License-Identifier: Apache-2.0
#include "src/engine/lapses.hpp"

#include <algorithm>
#include <utility>

namespace lrt::engine {
inline namespace v0 {

LapseQueue::~LapseQueue() {
  while (first_) {
    model::ValueLife& life = *first_->life;
    first_ = std::exchange(life.next, nullptr);
    const auto kept = std::move(life.queued);  // may be the last owner of the property, and so of the life
  }
}

void LapseQueue::add(const std::shared_ptr<model::PropertySpec>& property) noexcept {
  model::ValueLife& life = *property->life;
  if (!life.queued) {
    life.queued = property;
    life.next = std::exchange(first_, property.get());
  }
  set_next(std::min(next(), life.until()));
}

std::shared_ptr<model::PropertySpec> LapseQueue::take_due(Instant now) noexcept {
  if (!is_due(now)) return nullptr;
  std::shared_ptr<model::PropertySpec> due;
  Instant next = Instant::max();
  for (model::PropertySpec** at = &first_; *at;) {
    model::ValueLife& life = *(*at)->life;
    const Instant until = life.until();
    const bool is_over = until == Instant::max() || until <= now;
    if (!is_over || (due && until != Instant::max())) {  // one at a time: the caller has a budget
      next = std::min(next, until);
      at = &life.next;
      continue;
    }
    *at = std::exchange(life.next, nullptr);
    std::shared_ptr<model::PropertySpec> left = std::move(life.queued);
    if (until != Instant::max()) due = std::move(left);
  }
  set_next(next);
  return due;
}

void Lapses::written(const std::shared_ptr<model::PropertySpec>& property, Dispatch where, Instant written, bool known) {
  known ? property->life->renew(written) : property->life->begin(written);
  switch (where) {
    case Dispatch::executor: property->life->on_executor = true; return arrived_.put(property);
    case Dispatch::io_thread: return io.add(property);
    default: return host.add(property);
  }
}

void Lapses::collect() {
  if (arrived_.empty()) return;
  arrived_.take_all([this](const std::shared_ptr<model::PropertySpec>& property) noexcept { io.add(property); });
}

}  // namespace v0
}  // namespace lrt::engine
