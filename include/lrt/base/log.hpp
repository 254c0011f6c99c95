#pragma once

#include <functional>
#include <string_view>

namespace lrt {

enum class LogLevel : unsigned char { debug, info, warning, error };

/// Receives what lrt has to say; lrt itself never prints. Called from any of lrt's threads, one call at a time is not promised.
using LogCallback = std::function<void(LogLevel, std::string_view)>;

}  // namespace lrt
