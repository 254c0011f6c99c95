// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt {

/// An address of the Internet protocols.
struct Address {
  sockaddr_storage socket{};  ///< without a port
  socklen_t size = 0;
  std::string text;  ///< numeric, without the zone of a link-local address

  bool is_v6() const noexcept { return socket.ss_family == AF_INET6; }
  const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&socket); }
  void set_port(std::uint16_t port) noexcept;
};

/// The addresses of a name, in the order in which they should be tried, or of a numeric address. Blocks while the system's resolver runs; cannot be
/// interrupted.
/// @par Errors  io_error, with the resolver's message
LRT_INTERNAL_API Result<std::vector<Address>> resolve(const std::string& name);

using Resolve = std::function<Result<std::vector<Address>>(const std::string& name)>;

/// The address that a numeric text denotes, IPv6 without brackets and perhaps with a zone ("fe80::1%eth0"); nullopt: it is not numeric.
LRT_INTERNAL_API std::optional<Address> numeric_address(const std::string& text);

/// The address that the host of a URL denotes, IPv6 in brackets; nullopt: it is a name, which must be resolved.
LRT_INTERNAL_API std::optional<Address> literal_address(std::string_view host);

}  // namespace lrt
