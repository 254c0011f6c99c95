#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <lrt/base/result.hpp>

#include "src/transport/http/loop.hpp"

namespace lrt::transport {

/// Accepts connections. At the limit it closes an idle one for each. When descriptors run out it accepts and refuses clients with a reserve
/// descriptor, and without that it pauses; it never spins.
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
  void admit(int descriptor, std::string peer);
  bool is_below_limit() const noexcept;
  bool make_reserve();
  bool close_idle();
  bool refuse_with_reserve();
  void pause(const char* reason);

  Loop& loop_;
  Socket socket_;
  std::uint16_t port_ = 0;
  int reserve_ = -1;
  std::optional<Deadlines::Instant> resumes_at_;
};

}  // namespace lrt::transport
