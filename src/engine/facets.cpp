// SPDX-License-Identifier: Apache-2.0
#include "src/engine/facets.hpp"

#include <algorithm>

#include "src/engine/audience.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {

std::vector<Resource*> Container::members(const Audience& audience) const {
  std::vector<Resource*> all = members();
  if (audience.is_restricted()) all.erase(std::remove_if(all.begin(), all.end(), [&](const Resource* m) { return !audience.sees(*m); }), all.end());
  return all;
}

void Container::describe_member(const Resource& member, About& about, const Description& d) const { member.describe_types(about, d); }

}  // namespace lrt::engine
