// SPDX-License-Identifier: Apache-2.0
// The client's side of a WebSocket: the first byte says how the rest is cut, the rest is what a server sends. What the client hears must not depend on
// the cuts.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "src/http/websocket_frames.hpp"

namespace {

using lrt::http::WebSocketFrames;

constexpr std::size_t max_message_bytes = 4096;

struct Heard {
  std::vector<std::string> messages;
  std::uint16_t fault = 0;
  std::string close;
  bool operator==(const Heard& other) const { return messages == other.messages && fault == other.fault && close == other.close; }
};

void send_all(WebSocketFrames& frames) {
  while (frames.has_output()) {
    lrt::OutputParts parts;
    frames.add_output(parts);
    std::size_t size = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) size += parts.data()[i].iov_len;
    if (size == 0) std::abort();
    frames.sent(size);
  }
}

Heard hear(std::string_view bytes, std::size_t at_once) {
  WebSocketFrames frames(max_message_bytes, WebSocketFrames::Side::client);
  Heard heard;
  const auto take = [&] {
    do {
      while (auto message = frames.next()) {
        if (message->bytes.size() > max_message_bytes) std::abort();
        heard.messages.push_back(std::move(message->bytes));
      }
      send_all(frames);
    } while (!frames.wants_input() && frames.state() == WebSocketFrames::State::open);
  };
  take();
  while (!bytes.empty() && frames.wants_input()) {
    const std::string part(bytes.substr(0, at_once));  // a copy, so that a later read is an error
    bytes.remove_prefix(part.size());
    frames.receive(part);
    take();
  }
  heard.fault = frames.remarks().fault;
  heard.close = frames.remarks().close.value_or("none");
  return heard;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (!(hear(bytes, bytes.size()) == hear(bytes, 1U + data[0] % 16U))) std::abort();
  return 0;
}
