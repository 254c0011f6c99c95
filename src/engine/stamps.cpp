// SPDX-License-Identifier: Apache-2.0
#include "src/engine/stamps.hpp"

#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {
namespace {

/// A resource with values of others, which have rights of their own.
bool is_state(const Resource& resource) noexcept { return resource.thing && &resource == &resource.thing->state; }

}  // namespace

std::uint64_t change_number(const Resource& resource, const Audience& audience) {
  if (!audience.sees(resource)) return 0;
  if (!audience.hides_something()) return resource.change_number();
  if (!is_state(resource)) return resource.change_number(audience);
  std::uint64_t sum = 0;
  for (const PropertyResource* p : resource.thing->in_state())
    if (audience.sees(*p)) sum += p->change_number() + p->failure_changes();
  return sum;
}

subscription::Stamp stamp(const Resource& resource, const Audience& audience) {
  if (!audience.sees(resource)) return {};
  if (!audience.hides_something()) return resource.stamp();
  if (!is_state(resource)) return {resource.value_time(), resource.change_number(audience)};
  subscription::Stamp stamp{std::nullopt, change_number(resource, audience)};
  for (const PropertyResource* p : resource.thing->in_state())
    if (const auto at = p->value_time(); at && !p->is_failing() && audience.sees(*p) && (!stamp.at || *stamp.at < *at)) stamp.at = at;
  return stamp;
}

}  // namespace lrt::engine
