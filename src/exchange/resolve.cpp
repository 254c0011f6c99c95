// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/resolve.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>

namespace lrt::exchange {
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

}  // namespace

Result<std::vector<Address>> resolve(const std::string& name) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
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

std::optional<Address> literal_address(std::string_view host) {
  in_addr four{};
  in6_addr six{};
  const bool bracketed = host.size() >= 2 && host.front() == '[' && host.back() == ']';
  std::string text(bracketed ? host.substr(1, host.size() - 2) : host);
  if (::inet_pton(bracketed ? AF_INET6 : AF_INET, text.c_str(), bracketed ? static_cast<void*>(&six) : &four) != 1) return std::nullopt;
  return address_of(text);
}

Address address_of(const std::string& text) {
  Address result;
  result.text = text;
  if (text.find(':') == std::string::npos) {
    auto& four = reinterpret_cast<sockaddr_in&>(result.socket);
    four.sin_family = AF_INET;
    ::inet_pton(AF_INET, text.c_str(), &four.sin_addr);
    result.size = sizeof four;
  } else {
    auto& six = reinterpret_cast<sockaddr_in6&>(result.socket);
    six.sin6_family = AF_INET6;
    ::inet_pton(AF_INET6, text.c_str(), &six.sin6_addr);
    result.size = sizeof six;
  }
  return result;
}

}  // namespace lrt::exchange
