// SPDX-License-Identifier: Apache-2.0
#include "src/server/listen_addresses.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>

namespace lrt {
inline namespace v0 {
namespace {

bool is_numeric(const std::string& address) noexcept {
  in6_addr ignored{};
  return ::inet_pton(AF_INET, address.c_str(), &ignored) == 1 || ::inet_pton(AF_INET6, address.c_str(), &ignored) == 1;
}

std::string numeric(const addrinfo& found) {
  char text[INET6_ADDRSTRLEN] = "";
  if (found.ai_family == AF_INET) ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(*found.ai_addr).sin_addr, text, sizeof text);
  if (found.ai_family == AF_INET6) ::inet_ntop(AF_INET6, &reinterpret_cast<const sockaddr_in6&>(*found.ai_addr).sin6_addr, text, sizeof text);
  return text;
}

}  // namespace

Result<std::vector<std::string>> listen_addresses(const std::string& address) {
  if (is_numeric(address)) return std::vector<std::string>{address};
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failure = ::getaddrinfo(address.c_str(), nullptr, &wanted, &found);
  if (failure != 0) {
    const std::string reason = failure == EAI_SYSTEM ? std::system_category().message(errno) : ::gai_strerror(failure);
    return unexpected(Errc::invalid_option,
                      "listen.address: expected a numeric address or a host name that resolves, found \"" + address + "\": " + reason);
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> list(found, ::freeaddrinfo);
  std::vector<std::string> result;
  for (const addrinfo* item = found; item != nullptr; item = item->ai_next) {
    std::string text = numeric(*item);
    if (!text.empty() && std::find(result.begin(), result.end(), text) == result.end()) result.push_back(std::move(text));
  }
  std::stable_partition(result.begin(), result.end(), [](const std::string& text) { return text.find(':') == std::string::npos; });
  return result;
}

bool is_loopback(const std::string& address) noexcept { return address == "::1" || address.compare(0, 4, "127.") == 0; }

}  // namespace v0
}  // namespace lrt
