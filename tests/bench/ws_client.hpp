// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

namespace bench {

inline std::string websocket_request(int port, const std::string& target) {
  return "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
}

/// Opens a WebSocket on loopback and leaves its socket non-blocking. `received` gets what followed the answer's head. Ends the program
/// when that fails: these programs measure, they do not test.
inline int open_websocket(int port, const std::string& target, std::string& received, int receive_buffer = 0) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer > 0) ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string request = websocket_request(port, target);
  if (fd < 0 || ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      ::send(fd, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size())) {
    std::perror("websocket");
    std::exit(1);
  }
  char buffer[4096];
  std::size_t end = std::string::npos;
  while ((end = received.find("\r\n\r\n")) == std::string::npos) {
    const ssize_t n = ::recv(fd, buffer, sizeof buffer, 0);
    if (n <= 0) std::fprintf(stderr, "websocket: no answer\n"), std::exit(1);
    received.append(buffer, static_cast<std::size_t>(n));
  }
  if (received.compare(0, 12, "HTTP/1.1 101") != 0) std::fprintf(stderr, "websocket: %s\n", received.c_str()), std::exit(1);
  received.erase(0, end + 4);
  ::fcntl(fd, F_SETFL, O_NONBLOCK);
  return fd;
}

/// Takes the next whole frame of a server off the front of `bytes`; false: it is not complete. Only the payload of text frames is given.
inline bool next_frame(std::string_view& bytes, std::string_view& payload) {
  if (bytes.size() < 2) return false;
  std::size_t head = 2, size = static_cast<unsigned char>(bytes[1]) & 0x7F;
  const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
  if (bytes.size() < head + more) return false;
  if (more > 0) size = 0;
  for (std::size_t i = 0; i < more; ++i) size = size << 8 | static_cast<unsigned char>(bytes[head + i]);
  head += more;
  if (bytes.size() < head + size) return false;
  payload = (bytes[0] & 0x0F) == 1 ? bytes.substr(head, size) : std::string_view();
  bytes.remove_prefix(head + size);
  return true;
}

}  // namespace bench
