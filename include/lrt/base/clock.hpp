#pragma once

#include <chrono>
#include <string>

namespace lrt {

/// One instant on both clocks: deadlines use the steady one, which never jumps; representations and Date use UTC.
struct TimePoint {
  std::chrono::steady_clock::time_point steady{};
  std::chrono::system_clock::time_point utc{};
};

/// Where time comes from. Injected, so that tests move it by hand; nothing below `transport` asks the system.
/// @par Threads  now() is called from any thread, also concurrently, and must not throw.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const noexcept = 0;
  /// The same instant's UTC half, where that is cheaper alone.
  virtual std::chrono::system_clock::time_point utc() const noexcept { return now().utc; }
};

/// The system's clocks. Lives as long as the program.
const Clock& system_clock() noexcept;

/// xsd:dateTime in UTC with microseconds, "2026-11-21T10:38:39.000125Z".
std::string to_xsd_date_time(std::chrono::system_clock::time_point utc);

}  // namespace lrt
