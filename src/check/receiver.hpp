// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/http/message.hpp>

#include "src/base/thread.hpp"

namespace lrt::check {

/// Receives web callbacks on a port of its own: one connection after the other, within limits. A request for confirmation (WebSub 5.3) is confirmed.
/// @par Threads  Any.
class Receiver {
 public:
  struct Notification {
    http::Fields fields;
    std::string body;
    std::string text;  ///< as it was received, for evidence
  };

  /// @param address  numeric, with a port or without: "127.0.0.1", "192.168.1.5:9000", "[::1]:0"
  /// @par Errors  invalid_option, io_error
  static Result<std::unique_ptr<Receiver>> open(const std::string& address, std::size_t max_bytes, const ThreadOptions& threads);
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// Where notifications are expected; other paths get 404.
  const std::string& url() const noexcept { return url_; }
  /// The next notification. Of very many only the first ones are kept.
  std::optional<Notification> wait(std::chrono::steady_clock::time_point until);

 private:
  Receiver() = default;
  void run();
  void serve(int connection);

  int listener_ = -1, stop_read_ = -1, stop_write_ = -1;
  std::size_t max_bytes_ = 0;
  std::string url_, path_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Notification> notifications_;
  Thread thread_;
};

}  // namespace lrt::check
