// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// How important a log message is.
enum class LogLevel : unsigned char {
  debug,    ///< details for developers
  info,     ///< normal events, for example a failed invocation
  warning,  ///< something needs attention, and lrt continues: a lambda that failed, a limit that was reached
  error,    ///< misuse by the program, or a failure of the system
};

/// Receives the log messages of lrt. lrt itself never prints. The text is one sentence in UTF-8 without a line end; the
/// view is valid during the call.
///
/// The callback may throw; lrt ignores the exception. It must not call functions of the server or client that owns it.
///
/// @par Threads  Called from any thread of lrt and from threads that call lrt, also concurrently. It must be safe for
///               that.
/// @par Time     Called on I/O threads: it should return at once.
using LogCallback = std::function<void(LogLevel, std::string_view)>;

}  // namespace v0
}  // namespace lrt
