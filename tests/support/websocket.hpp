// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace lrt::test {

// ------------------------------------------------------------------------------------------------- SHA-1 and base64, for the handshake

inline std::string sha1(std::string_view text) {
  std::array<std::uint32_t, 5> h{0x67452301, 0xEFCDAB89, 0x98BADCFE, 0x10325476, 0xC3D2E1F0};
  std::string bytes(text);
  bytes += '\x80';
  while (bytes.size() % 64 != 56) bytes += '\0';
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>((std::uint64_t{text.size()} * 8) >> shift);
  const auto rotated = [](std::uint32_t x, int n) { return (x << n) | (x >> (32 - n)); };
  for (std::size_t block = 0; block < bytes.size(); block += 64) {
    std::array<std::uint32_t, 80> w{};
    for (std::size_t i = 0; i < 64; ++i) w[i / 4] = (w[i / 4] << 8) | static_cast<unsigned char>(bytes[block + i]);
    for (std::size_t i = 16; i < 80; ++i) w[i] = rotated(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
    auto [a, b, c, d, e] = h;
    for (std::size_t i = 0; i < 80; ++i) {
      const std::uint32_t f = i < 20 ? (b & c) | (~b & d) : i < 40 ? b ^ c ^ d : i < 60 ? (b & c) | (b & d) | (c & d) : b ^ c ^ d;
      const std::uint32_t k = i < 20 ? 0x5A827999 : i < 40 ? 0x6ED9EBA1 : i < 60 ? 0x8F1BBCDC : 0xCA62C1D6;
      const std::uint32_t next = rotated(a, 5) + f + e + k + w[i];
      e = d, d = c, c = rotated(b, 30), b = a, a = next;
    }
    h = {h[0] + a, h[1] + b, h[2] + c, h[3] + d, h[4] + e};
  }
  std::string digest;
  for (const auto word : h)
    for (int shift = 24; shift >= 0; shift -= 8) digest += static_cast<char>(word >> shift);
  return digest;
}

inline std::string base64(std::string_view bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) group = (group << 8) | (at + i < bytes.size() ? static_cast<unsigned char>(bytes[at + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i) text += at + i > bytes.size() ? '=' : digits[(group >> (18 - 6 * i)) & 63];
  }
  return text;
}

/// RFC 6455 4.2.2
inline std::string accept_of(std::string_view key) { return base64(sha1(std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11")); }

/// RFC 3629: no surrogates, no overlong forms, nothing above U+10FFFF.
inline bool is_utf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const auto byte = [&](std::size_t i) -> unsigned { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
    const unsigned first = byte(at);
    const std::size_t size = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
    if (size == 0) return false;
    for (std::size_t i = 1; i < size; ++i)
      if ((byte(at + i) & 0xC0) != 0x80) return false;
    if ((first == 0xE0 && byte(at + 1) < 0xA0) || (first == 0xED && byte(at + 1) > 0x9F) || (first == 0xF0 && byte(at + 1) < 0x90) ||
        (first == 0xF4 && byte(at + 1) > 0x8F))
      return false;
    at += size;
  }
  return true;
}

// ---------------------------------------------------------------------------------------------------------------------- frames

/// RFC 6455 5.2. What a client sends is masked and as short as it can be, unless a test wants it wrong.
struct Frame {
  enum Opcode : unsigned { continuation = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };
  unsigned opcode = text;
  std::string payload;
  bool fin = true;
  unsigned rsv = 0;  ///< 3 bits
  bool masked = true;
  int length_bytes = -1;                     ///< 0, 2 or 8 after the first; -1: the fewest
  std::uint64_t length = ~std::uint64_t{0};  ///< that it says it has; default: the truth

  std::string bytes(std::uint32_t mask = 0x37FA213D) const {
    const std::uint64_t size = length == ~std::uint64_t{0} ? payload.size() : length;
    const int more = length_bytes >= 0 ? length_bytes : size < 126 ? 0 : size < 65536 ? 2 : 8;
    std::string out;
    out += static_cast<char>((fin ? 0x80U : 0U) | (rsv << 4) | opcode);
    out += static_cast<char>((masked ? 0x80U : 0U) | (more == 0 ? static_cast<unsigned>(size) : more == 2 ? 126U : 127U));
    for (int shift = more * 8 - 8; shift >= 0; shift -= 8) out += static_cast<char>(size >> shift);
    if (!masked) return out + payload;
    std::array<char, 4> key{};
    for (std::size_t i = 0; i < 4; ++i) out += key[i] = static_cast<char>(mask >> (24 - 8 * i));
    for (std::size_t i = 0; i < payload.size(); ++i) out += static_cast<char>(payload[i] ^ key[i % 4]);
    return out;
  }
};

inline std::string close_payload(unsigned code, std::string_view reason = {}) {
  std::string payload{static_cast<char>(code >> 8), static_cast<char>(code)};
  return payload.append(reason);
}

/// Takes the frames of a server apart and throws at the first thing that no server may send.
class FrameReader {
 public:
  /// The next whole frame at the front of `bytes`, which it consumes.
  bool next(std::string_view& bytes, Frame& frame) {
    const auto expect = [](bool good, const char* what) {
      if (!good) throw std::runtime_error(std::string("frame of the server: ") + what);
    };
    if (bytes.size() < 2) return false;
    const auto byte = [&](std::size_t i) -> std::uint64_t { return static_cast<unsigned char>(bytes[i]); };
    frame.fin = (byte(0) & 0x80) != 0;
    frame.rsv = static_cast<unsigned>(byte(0) >> 4) & 7;
    frame.opcode = static_cast<unsigned>(byte(0)) & 15;
    frame.masked = (byte(1) & 0x80) != 0;
    expect(!closed_, "something after a close");
    expect(frame.rsv == 0, "reserved bits without an extension");
    expect(!frame.masked, "masked");
    std::uint64_t size = byte(1) & 0x7F;
    const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (bytes.size() < 2 + more) return false;
    if (more != 0) size = 0;
    for (std::size_t i = 0; i < more; ++i) size = (size << 8) | byte(2 + i);
    expect(more != 2 || size >= 126, "16 bits for a length of 7");
    expect(more != 8 || (size >= 65536 && size >> 63 == 0), "64 bits for a length of 16");
    if (frame.opcode >= 8) {
      expect(frame.opcode <= Frame::pong, "unknown control opcode");
      expect(frame.fin && size <= 125, "fragmented or long control frame");
    } else {
      expect(frame.opcode <= Frame::binary, "unknown opcode");
      expect((frame.opcode == Frame::continuation) == in_message_, in_message_ ? "a new message within another" : "a continuation of nothing");
    }
    if (bytes.size() - 2 - more < size) return false;
    frame.payload = std::string(bytes.substr(2 + more, size));
    bytes.remove_prefix(2 + more + size);
    if (frame.opcode < 8) {
      in_message_ = !frame.fin;
      if (frame.opcode == Frame::text && frame.fin) expect(is_utf8(frame.payload), "text that is no UTF-8");
    } else if (frame.opcode == Frame::close) {
      closed_ = true;
      expect(frame.payload.size() != 1, "half a close code");
      if (!frame.payload.empty()) {
        const auto code = static_cast<unsigned char>(frame.payload[0]) * 256 + static_cast<unsigned char>(frame.payload[1]);
        expect(code >= 1000 && code < 5000 && code != 1004 && code != 1005 && code != 1006 && code != 1015, "a close code that is never sent");
        expect(is_utf8(std::string_view(frame.payload).substr(2)), "a reason that is no UTF-8");
      }
    }
    return true;
  }

 private:
  bool in_message_ = false;
  bool closed_ = false;
};

/// A WebSocket client of its own socket that never blocks: step() sends and receives what is possible now. It sends nothing by itself.
class WebSocketClient {
 public:
  static constexpr const char* key = "dGhlIHNhbXBsZSBub25jZQ==";  // RFC 6455 1.3

  explicit WebSocketClient(std::uint16_t port, int receive_buffer = 0) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (receive_buffer > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) throw std::runtime_error("connect failed");
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  }
  WebSocketClient(const WebSocketClient&) = delete;
  WebSocketClient& operator=(const WebSocketClient&) = delete;
  ~WebSocketClient() { end(); }

  static std::string handshake(std::string_view path, std::string_view more = {}) {
    return "GET " + std::string(path) + " HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n" +
           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + key + "\r\n" + std::string(more) + "\r\n";
  }

  void send(std::string_view bytes) { out_ += bytes; }
  void send(const Frame& frame) { out_ += frame.bytes(); }
  void send_text(std::string text) { send(Frame{Frame::text, std::move(text)}); }
  void send_close(unsigned code, std::string_view reason = {}) { send(Frame{Frame::close, close_payload(code, reason)}); }

  void step() {
    if (socket_ < 0) return;
    if (!out_.empty()) {
      const auto sent = ::send(socket_, out_.data(), out_.size(), MSG_NOSIGNAL);
      if (sent > 0) out_.erase(0, static_cast<std::size_t>(sent));
      else if (errno != EAGAIN) out_.clear();
    }
    if (paused) return;
    char buffer[64 * 1024];
    for (;;) {
      const auto got = ::recv(socket_, buffer, sizeof buffer, 0);
      if (got <= 0) {
        if (got == 0) ended = true;
        else if (errno != EAGAIN) ended = failed = true;
        break;
      }
      in_.append(buffer, static_cast<std::size_t>(got));
    }
    take();
  }

  bool all_sent() const { return out_.empty(); }
  void half_close() { ::shutdown(socket_, SHUT_WR); }
  void end() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  /// Ends with RST.
  void reset() {
    const linger hard{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    end();
  }

  /// Code of the close that came; 0: none came, 1005: one without a code.
  unsigned close_code() const {
    if (frames.empty() || frames.back().opcode != Frame::close) return 0;
    const auto& payload = frames.back().payload;
    return payload.empty() ? 1005 : static_cast<unsigned char>(payload[0]) * 256U + static_cast<unsigned char>(payload[1]);
  }
  std::string close_reason() const { return close_code() == 0 || frames.back().payload.empty() ? "" : frames.back().payload.substr(2); }

  std::size_t answers_before = 0;  ///< HTTP responses (with Content-Length) before that of the handshake
  std::string before;              ///< their bytes
  std::string head;                ///< header section of the response to the handshake
  int status = 0;                  ///< 0: there is none yet
  std::string body;                ///< of a response that is no 101, as far as it has come
  std::deque<Frame> frames;
  bool ended = false;   ///< the server closed the connection
  bool failed = false;  ///< ... with RST
  bool cut = false;     ///< ... within a frame
  bool paused = false;  ///< does not read

 private:
  void take() {
    while (status == 0) {
      const auto end = in_.find("\r\n\r\n");
      if (end == std::string::npos) return;
      const std::string found = in_.substr(0, end + 4);
      if (answers_before > 0) {
        const auto length = found.find("\r\nContent-Length: ");
        const std::size_t size = found.size() + (length == std::string::npos ? 0 : std::strtoul(found.c_str() + length + 18, nullptr, 10));
        if (in_.size() < size) return;
        before += in_.substr(0, size);
        in_.erase(0, size);
        --answers_before;
        continue;
      }
      head = found;
      in_.erase(0, head.size());
      status = head.compare(0, 9, "HTTP/1.1 ") == 0 ? std::atoi(head.c_str() + 9) : -1;
      if (status == 101) check_handshake();
    }
    if (status != 101) {
      body += in_;
      in_.clear();
      return;
    }
    std::string_view rest = in_;
    for (Frame frame; reader_.next(rest, frame);) frames.push_back(frame);
    in_.erase(0, in_.size() - rest.size());
    cut = ended && !in_.empty();
  }
  /// RFC 6455 4.1, what the client must validate.
  void check_handshake() const {
    const auto expect = [&](const std::string& line) {
      if (head.find("\r\n" + line + "\r\n") == std::string::npos) throw std::runtime_error("the 101 lacks \"" + line + "\":\n" + head);
    };
    if (head.find("\r\nUpgrade: WebSocket\r\n") == std::string::npos) expect("Upgrade: websocket");  // its case is free
    expect("Connection: Upgrade");
    expect("Sec-WebSocket-Accept: " + accept_of(key));
    if (head.find("Sec-WebSocket-Extensions") != std::string::npos) throw std::runtime_error("an extension nobody asked for");
    if (head.find("Content-Length") != std::string::npos) throw std::runtime_error("a 101 with a length");
  }

  int socket_;
  std::string out_;
  std::string in_;
  FrameReader reader_;
};

}  // namespace lrt::test
