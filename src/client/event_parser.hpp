// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "src/client/stamp.hpp"

namespace lrt::client {

/// An event of an event stream.
struct StreamEvent {
  std::string type;  ///< "message" if the stream names none
  std::string data;
  std::string id;  ///< the last one that the stream has set
  Stamp stamp{};   ///< without a series, which the response has
};

/// Parses text/event-stream (WHATWG HTML 9.2.6): any chunks, lines that end with CR, LF or CRLF, a byte order mark. An event without data is not
/// reported. Sizes are limited, because the stream is hostile input.
class EventParser {
 public:
  /// @param max_event_bytes  of the data of one event, and of one line
  explicit EventParser(std::size_t max_event_bytes) : max_(max_event_bytes) {}

  /// Parses the next bytes, in any pieces, and calls `report` with each event that they complete.
  /// @param report  returns false to stop: the rest is dropped
  /// @return        false: `report` has stopped it, or a limit is exceeded, see is_too_long(). Nothing may follow then
  bool parse(std::string_view bytes, const std::function<bool(StreamEvent&& event)>& report);

  /// The stream has a line or an event above the limit.
  bool is_too_long() const noexcept { return is_too_long_; }
  /// The last value of `retry`: how long a client should wait before it connects again.
  std::optional<std::chrono::milliseconds> retry() const noexcept { return retry_; }

 private:
  bool end_line(const std::function<bool(StreamEvent&& event)>& report);
  bool take_field(std::string_view name, std::string_view value);

  const std::size_t max_;
  std::string line_;
  StreamEvent event_;
  std::optional<std::chrono::milliseconds> retry_;
  unsigned bom_bytes_ = 0;  ///< of a byte order mark at the beginning; 3: it is over
  bool after_cr_ = false;   ///< a line feed belongs to the line end that was before
  bool has_data_ = false;
  bool is_too_long_ = false;
};

}  // namespace lrt::client
