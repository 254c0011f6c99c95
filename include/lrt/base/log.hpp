// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

enum class LogLevel : unsigned char { debug, info, warning, error };

/// Receives the log messages of lrt, which never prints.
/// @par Threads  Called from any thread of lrt, also concurrently.
using LogCallback = std::function<void(LogLevel, std::string_view)>;

}  // namespace v0
}  // namespace lrt
