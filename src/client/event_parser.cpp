// SPDX-License-Identifier: Apache-2.0
#include "src/client/event_parser.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "src/http/stamp.hpp"

namespace lrt::client {
namespace {

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
constexpr std::chrono::milliseconds max_retry = std::chrono::hours(1);

}  // namespace

bool EventParser::parse(std::string_view bytes, const std::function<bool(StreamEvent&& event)>& report) {
  if (is_too_long_) return false;
  while (bom_bytes_ < byte_order_mark.size() && !bytes.empty()) {
    if (bytes.front() != byte_order_mark[bom_bytes_]) {
      line_.assign(byte_order_mark.substr(0, bom_bytes_));  // there was no byte order mark
      bom_bytes_ = byte_order_mark.size();
      break;
    }
    ++bom_bytes_;
    bytes.remove_prefix(1);
  }
  while (!bytes.empty()) {
    if (std::exchange(after_cr_, false) && bytes.front() == '\n') {
      bytes.remove_prefix(1);
      continue;
    }
    const std::size_t end = std::min(bytes.find_first_of("\r\n"), bytes.size());
    // The name of a field and its colon do not count.
    if (line_.size() + end > max_ + 16) return is_too_long_ = true, false;
    line_.append(bytes.substr(0, end));
    if (end == bytes.size()) return true;
    after_cr_ = bytes[end] == '\r';
    bytes.remove_prefix(end + 1);
    const bool goes_on = end_line(report);
    line_.clear();
    if (!goes_on) return false;
  }
  return true;
}

bool EventParser::end_line(const std::function<bool(StreamEvent&& event)>& report) {
  if (!line_.empty()) {
    const std::string_view line = line_;
    const std::size_t colon = line.find(':');
    if (colon == 0) return true;  // a comment
    std::string_view value = colon == std::string_view::npos ? std::string_view() : line.substr(colon + 1);
    if (!value.empty() && value.front() == ' ') value.remove_prefix(1);
    return take_field(line.substr(0, colon), value);
  }
  const bool is_event = std::exchange(has_data_, false);
  StreamEvent event{std::exchange(event_.type, {}), std::exchange(event_.data, {}), event_.id, event_.stamp};
  event_.stamp.at.reset();
  event_.stamp.sequence.reset();
  event_.stamp.left_out.reset();
  if (!is_event) return true;
  if (event.stamp.sequence && !event.stamp.left_out) event.stamp.left_out = 0;  // the field is there only if there are any
  event.data.pop_back();                                                        // the line feed after the last line
  if (event.type.empty()) event.type = "message";
  return report(std::move(event));
}

bool EventParser::take_field(std::string_view name, std::string_view value) {
  if (name == "data") {
    if (event_.data.size() + value.size() > max_) return is_too_long_ = true, false;
    event_.data.append(value).append("\n");
    has_data_ = true;
  } else if (name == "event") {
    event_.type = value;
  } else if (name == "id") {
    if (value.find('\0') == std::string_view::npos) event_.id = value;
  } else if (name == http::event_time) {
    event_.stamp.set_at(value);
  } else if (name == http::event_sequence) {
    event_.stamp.set_sequence(value);
  } else if (name == http::event_left_out) {
    event_.stamp.set_left_out(value);
  } else if (name == "retry") {
    std::uint64_t number = 0;
    const auto parsed = std::from_chars(value.data(), value.data() + value.size(), number);
    if (parsed.ptr == value.data() + value.size() && !value.empty())
      retry_ = parsed.ec == std::errc() ? std::chrono::milliseconds(std::min<std::uint64_t>(number, static_cast<std::uint64_t>(max_retry.count())))
                                        : max_retry;
  }
  return true;
}

}  // namespace lrt::client
