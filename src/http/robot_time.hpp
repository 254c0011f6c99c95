// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>

/// The time of a server, by which its clients say until when a command is worth carrying out (SPEC 3.20).
namespace lrt::http {

/// @{
/// Header fields. The first is in each response, the others in requests of clients.
inline constexpr std::string_view robot_time_field = "Robot-Time", valid_until_field = "Valid-Until", start_before_field = "Start-Before";
/// @}

/// @{
/// Problem types (RFC 9457) of the responses to a command that came too late, 412, and to one that must say until when it is valid, 428.
inline constexpr std::string_view late_command_type = "https://w3id.org/lrt/ns#LateCommand",
                                  expiry_required_type = "https://w3id.org/lrt/ns#ExpiryRequired";
/// @}

/// An instant on the clock of one run of one server: `0123456789abcdef/73521`. Clocks of different machines are not compared: a client adds only the time
/// that has passed for itself to a stamp that it has received.
struct LRT_INTERNAL_API RobotTime {
  std::uint64_t instance = 0;      ///< of this run, random; 16 hex digits
  std::uint64_t milliseconds = 0;  ///< since the run began; at most 15 digits

  /// nullopt: the text has another form.
  static std::optional<RobotTime> parse(std::string_view text) noexcept;
  std::string text() const;
};

}  // namespace lrt::http
