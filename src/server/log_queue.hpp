// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/log.hpp>

#include "src/base/mailbox.hpp"

namespace lrt {

/// A queue of log lines for the user's callback. It is called without a lock, because it may call the server.
///
/// @par Threads  Any.
class LogQueue {
 public:
  explicit LogQueue(LogCallback callback) : callback_(std::move(callback)) {}

  /// The log function for the parts of a server; empty if the user has no callback.
  LogCallback sink() {
    if (!callback_) return {};
    return [this](LogLevel level, std::string_view message) { lines_.put({level, std::string(message)}); };
  }
  /// Calls the user's callback. Without a lock of lrt.
  void flush() noexcept {
    if (lines_.empty()) return;
    lines_.take_all([this](const std::pair<LogLevel, std::string>& line) {
      try {
        callback_(line.first, line.second);
      } catch (...) {  // an error in the log callback cannot be logged
      }
    });
  }

 private:
  const LogCallback callback_;
  Mailbox<std::pair<LogLevel, std::string>> lines_;
};

}  // namespace lrt
