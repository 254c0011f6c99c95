// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// One instant on two clocks. Deadlines use the steady clock, which is never set. Representations and the Date field
/// use UTC.
struct TimePoint {
  std::chrono::steady_clock::time_point steady{};  ///< for deadlines and durations
  std::chrono::system_clock::time_point utc{};     ///< for times that clients see
};

/// The source of time of a server or client. A test can pass one of its own. Modules below `transport` do not read the
/// system's clocks.
/// @par Threads  now() is called from any thread, also concurrently, and must not throw.
class LRT_API Clock {
 public:
  virtual ~Clock() = default;
  /// The present time. It must not throw.
  virtual TimePoint now() const noexcept = 0;
  /// now().utc. An implementation may override it if UTC alone is cheaper to read.
  virtual std::chrono::system_clock::time_point utc() const noexcept { return now().utc; }
};

/// The system's clocks: std::chrono::steady_clock and system_clock. The object exists until the process ends.
/// @par Threads  Any.
LRT_API const Clock& system_clock() noexcept;

/// A time as xsd:dateTime in UTC with microseconds, "2026-11-21T10:38:39.000125Z".
/// @par Threads  Any.
LRT_API std::string to_xsd_date_time(std::chrono::system_clock::time_point utc);

}  // namespace v0
}  // namespace lrt
