// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "src/engine/audience.hpp"
#include "src/engine/resource.hpp"
#include "src/subscription/backlog.hpp"

namespace lrt::engine {

/// The changes of a resource as an audience sees them: those of Properties that it may not read neither count nor show their time.
std::uint64_t change_number(const Resource& resource, const Audience& audience);
subscription::Stamp stamp(const Resource& resource, const Audience& audience);

}  // namespace lrt::engine
