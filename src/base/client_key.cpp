// SPDX-License-Identifier: Apache-2.0
#include "src/base/client_key.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstdint>

namespace lrt {

std::string client_key(std::string_view address) {
  const std::string without_zone(address.substr(0, address.find('%')));
  in6_addr six{};
  if (::inet_pton(AF_INET6, without_zone.c_str(), &six) != 1) return std::string(address);
  char text[INET6_ADDRSTRLEN] = "";
  if (IN6_IS_ADDR_V4MAPPED(&six)) return ::inet_ntop(AF_INET, six.s6_addr + 12, text, sizeof text);
  if (IN6_IS_ADDR_LOOPBACK(&six)) return "::1";
  std::fill(six.s6_addr + 8, six.s6_addr + 16, std::uint8_t{0});
  std::string key = ::inet_ntop(AF_INET6, &six, text, sizeof text);
  key += "/64";
  const std::size_t zone = address.find('%');
  return zone == std::string_view::npos ? key : key.append(address.substr(zone));
}

bool is_this_machine(std::string_view address) noexcept { return address == "::1" || address.substr(0, 4) == "127."; }

}  // namespace lrt
