// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/abi.hpp>
#include <lrt/base/log.hpp>

namespace lrt::libwebsockets {

/// Sends libwebsockets' warnings and errors to a callback. Its log is the whole process's: the newest of these has it, and without any it goes
/// to standard error, as libwebsockets has it.
///
/// @par Threads  Any.
class LRT_INTERNAL_API Log {
 public:
  explicit Log(LogCallback log);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
};

}  // namespace lrt::libwebsockets
