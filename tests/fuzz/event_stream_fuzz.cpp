// SPDX-License-Identifier: Apache-2.0
// Any bytes as an event stream of a server: the events are the same in all pieces, and nothing is longer than the limit.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "src/client/event_parser.hpp"

using namespace lrt;

namespace {

constexpr std::size_t max_event = 256;

struct Parsed {
  std::vector<std::string> events;
  bool goes_on = true;
  std::optional<std::chrono::milliseconds> retry;
};

/// In pieces of at most `size` bytes.
Parsed parse(std::string_view text, std::size_t size) {
  client::EventParser parser(max_event);
  Parsed result;
  while (!text.empty() && result.goes_on) {
    result.goes_on = parser.parse(text.substr(0, size), [&](client::StreamEvent&& event) {
      if (event.data.size() > max_event || event.id.size() > max_event + 16 || event.type.size() > max_event + 16) std::abort();
      if (event.type.empty() || (event.type + event.id).find_first_of("\r\n") != std::string::npos) std::abort();
      result.events.push_back(event.type + "\n" + event.id + "\n" + event.data);
      return true;
    });
    text.remove_prefix(std::min(size, text.size()));
  }
  if (result.goes_on == parser.is_too_long()) std::abort();
  result.retry = parser.retry();
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Parsed whole = parse(text, text.size() + 1), pieces = parse(text, 1U + data[0] % 32U);
  if (whole.goes_on != pieces.goes_on || whole.events != pieces.events || (whole.goes_on && whole.retry != pieces.retry)) std::abort();
  return 0;
}
