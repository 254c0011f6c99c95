// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/engine/options.hpp>
#include <lrt/transport/options.hpp>

namespace lrt {
inline namespace v0 {

/// Limits of what clients can use: memory, connections and time. The members are those of both base classes.
/// @par Threads  Set-up only, as Options.
struct Limits : transport::Limits, engine::Limits {};

}  // namespace v0
}  // namespace lrt
