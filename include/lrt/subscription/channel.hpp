// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <lrt/base/language.hpp>

namespace lrt::subscription {
inline namespace v0 {

/// Identifies the connection or callback of one subscriber. Never 0; a server never uses a value twice.
enum class Channel : std::uint64_t {};

}  // namespace v0
}  // namespace lrt::subscription
