// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace lrt::test {

/// A receiver of web callbacks that connects and never responds, so that the exchange stays open until response_time.
class SilentReceiver {
 public:
  SilentReceiver() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    if (::bind(listener_, reinterpret_cast<const sockaddr*>(&at), size) != 0 || ::listen(listener_, 8) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
      throw std::runtime_error("no receiver");
    port_ = ntohs(at.sin_port);
  }
  ~SilentReceiver() { ::close(listener_); }
  SilentReceiver(const SilentReceiver&) = delete;
  SilentReceiver& operator=(const SilentReceiver&) = delete;

  /// A request that subscribes this receiver to a resource below /arm, for Socket::ask().
  std::string subscription(const std::string& resource) const {
    return "POST /arm/subscriptions\nContent-Type: text/turtle\n\n<> <https://hybr-it-projekt.de/ns/hybr-it#onResource> "
           "<../arm/" +
           resource + "> ; <https://hybr-it-projekt.de/ns/hybr-it#callbackURL> \"http://127.0.0.1:" + std::to_string(port_) +
           "/\"^^<http://www.w3.org/2001/XMLSchema#anyURI> .";
  }

 private:
  int listener_;
  std::uint16_t port_ = 0;
};

}  // namespace lrt::test
