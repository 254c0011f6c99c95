// SPDX-License-Identifier: Apache-2.0
#include "src/base/resolve.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>

namespace lrt {
namespace {

/// The numeric text without the zone of a link-local address, as AllowedHosts expects it.
std::string numeric(const sockaddr& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const void* bytes = nullptr;
  if (address.sa_family == AF_INET) bytes = &reinterpret_cast<const sockaddr_in&>(address).sin_addr;
  if (address.sa_family == AF_INET6) bytes = &reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  if (bytes == nullptr || ::inet_ntop(address.sa_family, bytes, text.data(), text.size()) == nullptr) return {};
  return text.data();
}

template <class Socket>
Address address_of(const Socket& socket) {
  Address address;
  std::memcpy(&address.socket, &socket, sizeof socket);
  address.size = sizeof socket;
  address.text = numeric(reinterpret_cast<const sockaddr&>(socket));
  return address;
}

Result<std::vector<Address>> look_up(const std::string& name, int flags) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = flags;
  addrinfo* found = nullptr;
  const int failure = ::getaddrinfo(name.c_str(), nullptr, &wanted, &found);
  if (failure != 0) {
    const std::string reason = failure == EAI_SYSTEM ? std::system_category().message(errno) : ::gai_strerror(failure);
    return unexpected(Errc::io_error, "no address of \"" + name + "\": " + reason);
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> list(found, ::freeaddrinfo);
  std::vector<Address> result;
  for (const addrinfo* item = found; item != nullptr; item = item->ai_next) {
    Address address;
    if (item->ai_addrlen > sizeof address.socket) continue;
    address.text = numeric(*item->ai_addr);
    if (address.text.empty()) continue;
    std::memcpy(&address.socket, item->ai_addr, item->ai_addrlen);
    address.size = item->ai_addrlen;
    result.push_back(std::move(address));
  }
  if (result.empty()) return unexpected(Errc::io_error, "no address of \"" + name + "\"");
  return result;
}

}  // namespace

void Address::set_port(std::uint16_t port) noexcept {
  if (is_v6()) reinterpret_cast<sockaddr_in6&>(socket).sin6_port = htons(port);
  else reinterpret_cast<sockaddr_in&>(socket).sin_port = htons(port);
}

Result<std::vector<Address>> resolve(const std::string& name) { return look_up(name, 0); }

std::optional<Address> numeric_address(const std::string& text) {
  if (text.find(':') == std::string::npos) {  // the resolver knows forms such as "127.1", too
    sockaddr_in four{};
    four.sin_family = AF_INET;
    if (::inet_pton(AF_INET, text.c_str(), &four.sin_addr) != 1) return std::nullopt;
    return address_of(four);
  }
  if (text.find('%') == std::string::npos) {
    sockaddr_in6 six{};
    six.sin6_family = AF_INET6;
    if (::inet_pton(AF_INET6, text.c_str(), &six.sin6_addr) != 1) return std::nullopt;
    return address_of(six);
  }
  Result<std::vector<Address>> found = look_up(text, AI_NUMERICHOST);  // it knows zones
  if (!found) return std::nullopt;
  return std::move(found->front());
}

std::optional<Address> literal_address(std::string_view host) {
  const bool bracketed = host.size() >= 2 && host.front() == '[' && host.back() == ']';
  const std::string text(bracketed ? host.substr(1, host.size() - 2) : host);
  if (bracketed != (text.find(':') != std::string::npos) || text.find('%') != std::string::npos) return std::nullopt;
  return numeric_address(text);
}

}  // namespace lrt
