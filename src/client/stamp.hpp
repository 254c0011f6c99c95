// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lrt::client {

/// What a server sends beside a value (src/http/stamp.hpp). A server without it sends none of it. Texts of a server are hostile input: what
/// cannot be read counts as not sent.
struct Stamp {
  std::optional<std::chrono::system_clock::time_point> at{};
  std::optional<std::uint64_t> sequence{};
  std::optional<std::uint64_t> left_out{};  ///< before this value; nullopt: not known
  std::string series{};                     ///< of the sequence; empty: not known

  void set_at(std::string_view text);
  void set_sequence(std::string_view text) noexcept;
  void set_left_out(std::string_view text) noexcept;
  void set_series(std::string_view text);
};

/// Reads a message that may be a stamp of http::stamped_protocol.
/// @return  nullopt: it is another message, which no representation follows
std::optional<Stamp> read_stamp(std::string_view json);

/// Reads a message of http::stamped_protocol that may be a heartbeat: the time of the server.
/// @return  empty: it is another message
std::string read_heartbeat(std::string_view json);

/// How many values between two were not received; nullopt: not known.
std::optional<std::uint64_t> between(const Stamp& last, const Stamp& next) noexcept;

}  // namespace lrt::client
