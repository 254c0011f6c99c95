// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/transport/http/loop.hpp"

namespace lrt::transport {

/// Accepts connections. At the limit it closes an idle one for each. When descriptors run out it accepts clients with reserve
/// descriptors, as reserved connections, and without those it pauses; it never spins.
class Listener final : public Watched {
 public:
  explicit Listener(Loop& loop) : loop_(loop) {}
  ~Listener();

  Result<void> open();
  void close();
  std::uint16_t port() const noexcept { return port_; }

  /// The end of a pause.
  std::optional<Deadlines::Instant> resumes_at() const noexcept { return resumes_at_; }
  void resume(TimePoint now);

  void on_ready(std::uint32_t events) override;
  void go_on() override { on_ready(0); }

 private:
  void admit(Socket socket, const sockaddr_storage& address, bool scarce);
  bool is_below_limit() const noexcept;
  bool make_reserve();
  bool close_idle();
  void fill_reserve();
  bool accept_with_reserve();
  void pause(const char* reason);

  Loop& loop_;
  Socket socket_;
  std::uint16_t port_ = 0;
  std::vector<int> reserve_;  ///< descriptors for reserved connections when there are no others
  std::optional<Deadlines::Instant> resumes_at_;
};

}  // namespace lrt::transport
