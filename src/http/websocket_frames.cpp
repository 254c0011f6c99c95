// SPDX-License-Identifier: Apache-2.0
#include "src/http/websocket_frames.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "src/base/random.hpp"
#include "src/base/utf8.hpp"
#include "src/http/websocket.hpp"

namespace lrt::http {
namespace {

/// RFC 6455 5.2
constexpr unsigned continuation = 0, text_frame = 1, binary_frame = 2, close_frame = 8, ping_frame = 9, pong_frame = 10;
constexpr std::uint16_t normal = 1000, protocol_error = 1002, no_utf8 = 1007, too_large = 1009;

/// An empty queue keeps the capacity for this many messages.
constexpr std::size_t kept_messages = 1;

constexpr bool is_control(unsigned opcode) noexcept { return opcode >= close_frame; }
/// RFC 6455 5.5: a control frame has at most 125 bytes, two of a close are its code.
constexpr std::size_t max_control_bytes = 125, max_reason_bytes = 123;

/// Whether bytes can follow that make it a character.
bool may_begin_character(std::string_view part) {
  if (part.empty()) return true;
  const auto lead = static_cast<unsigned char>(part[0]);
  std::string whole(part);
  if (whole.size() == 1) whole += lead == 0xE0 || lead == 0xF0 ? '\xBF' : '\x80';
  whole.resize(lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2, '\x80');
  return !utf8::find_invalid(whole);
}

std::uint64_t big_endian(std::string_view bytes) noexcept {
  std::uint64_t value = 0;
  for (const char c : bytes) value = value << 8 | static_cast<unsigned char>(c);
  return value;
}

/// The header of a final frame without a mask and extensions (RFC 6455 5.2). Returns its size.
unsigned char write_header(std::array<char, 10>& header, unsigned opcode, std::uint64_t size) noexcept {
  const int length_bytes = size < 126 ? 0 : size <= 0xFFFF ? 2 : 8;
  header[0] = static_cast<char>(0x80U | opcode);
  header[1] = static_cast<char>(length_bytes == 0 ? size : length_bytes == 2 ? 126U : 127U);
  for (int i = 0; i < length_bytes; ++i) header[2 + static_cast<std::size_t>(i)] = static_cast<char>(size >> (8 * (length_bytes - 1 - i)));
  return static_cast<unsigned char>(2 + length_bytes);
}

void clear(std::string& buffer) { std::string().swap(buffer); }

}  // namespace

WebSocketFrames::WebSocketFrames(std::size_t max_message_bytes, Side side)
    : max_message_bytes_(std::max<std::size_t>(max_message_bytes, 1)), remarks_(side == Side::client ? new Remarks : nullptr) {}

WebSocketFrames::~WebSocketFrames() = default;

// ---------------------------------------------------------------------------------------------------------------- reading

void WebSocketFrames::receive(std::string_view bytes) {
  if (over_ || bytes.empty()) return;
  input_.erase(0, std::exchange(used_, 0));
  input_.append(bytes);
  has_unread_ = true;
}

std::optional<WebSocketFrames::Message> WebSocketFrames::next() {
  while (!over_ && control_.empty()) {
    if (in_payload_) {
      if (auto message = take_payload()) return message;
      if (in_payload_) break;
    } else if (const auto frame = take_frame()) {
      take_control(*frame);
    } else if (!in_payload_) {
      break;
    }
  }
  return std::nullopt;
}

/// Takes what was received of a data frame. Returns the message if this completes it.
std::optional<WebSocketFrames::Message> WebSocketFrames::take_payload() {
  const std::size_t size = std::min<std::size_t>(left_, input_.size() - used_);
  if (!closing_) {
    for (std::size_t i = 0; i < size; ++i) message_ += static_cast<char>(input_[used_ + i] ^ mask_[(mask_at_ + i) % mask_bytes]);
  }
  mask_at_ = (mask_at_ + size) % mask_bytes;
  used_ += size;
  left_ -= size;
  has_unread_ = used_ < input_.size();
  in_payload_ = left_ > 0;
  if (closing_) return std::nullopt;
  const bool is_whole = !in_payload_ && !in_message_;
  if (is_text_ && !check_text(is_whole)) return fail(no_utf8, "a text message is not UTF-8 (RFC 6455 5.6)"), std::nullopt;
  if (!is_whole) return std::nullopt;
  return Message{std::exchange(message_, {}), is_text_};
}

/// Whether what was received of a text can be UTF-8.
bool WebSocketFrames::check_text(bool is_whole) {
  const std::string_view unchecked = std::string_view(message_).substr(checked_);
  const bool is_incomplete = !is_whole && utf8::ends_within_character(unchecked);
  const std::size_t size = is_incomplete ? utf8::prefix(unchecked, unchecked.size() - 1).size() : unchecked.size();
  if (utf8::find_invalid(unchecked.substr(0, size)) || !may_begin_character(unchecked.substr(size))) return false;
  checked_ = is_whole ? 0 : checked_ + size;
  return true;
}

/// The next control frame, if all of it has been received. Of a data frame it takes the header, and take_payload() follows. Ends the connection if the
/// frame is not allowed.
std::optional<WebSocketFrames::Frame> WebSocketFrames::take_frame() {
  const std::string_view input = std::string_view(input_).substr(used_);
  has_unread_ = false;  // unless a whole frame is found
  if (input.empty()) {
    clear(input_);
    used_ = 0;
  }
  if (input.size() < 2) return std::nullopt;
  const auto first = static_cast<unsigned char>(input[0]), second = static_cast<unsigned char>(input[1]);
  if (const char* const rule = broken_rule(first, second)) return fail(protocol_error, rule), std::nullopt;
  std::uint64_t length = second & 0x7FU;
  std::size_t header = 2;
  if (length >= 126) {
    const std::size_t length_bytes = length == 126 ? 2 : 8;
    header += length_bytes;
    if (input.size() < header) return std::nullopt;
    length = big_endian(input.substr(2, length_bytes));
    const bool is_shortest = length_bytes == 2 ? length >= 126 : length > 0xFFFF;
    if (!is_shortest) return fail(protocol_error, "a length does not have the fewest bytes (RFC 6455 5.2)"), std::nullopt;
  }
  const unsigned opcode = first & 0x0FU;
  if (!is_control(opcode) && length > max_message_bytes_ - message_.size()) return fail(too_large, "a message is too large"), std::nullopt;
  const std::size_t of_mask = is_client() ? 0 : mask_bytes;
  const std::size_t begin = used_ + header + of_mask, size = static_cast<std::size_t>(length);
  if (input_.size() < begin + (is_control(opcode) ? size : 0)) return std::nullopt;
  has_unread_ = true;
  std::copy_n(input_.begin() + static_cast<std::ptrdiff_t>(begin - of_mask), of_mask, mask_.begin());
  used_ = begin;
  if (!is_control(opcode)) {
    if (!in_message_) is_text_ = opcode == text_frame;
    in_message_ = (first & 0x80U) == 0;
    in_payload_ = true;
    left_ = size;
    mask_at_ = 0;
    return std::nullopt;
  }
  for (std::size_t i = 0; i < size; ++i) input_[begin + i] = static_cast<char>(input_[begin + i] ^ mask_[i % mask_bytes]);
  used_ += size;
  has_unread_ = used_ < input_.size();
  return Frame{opcode, std::string_view(input_).substr(begin, size)};
}

/// RFC 6455 5.1, 5.2, 5.4, 5.5, by the first two bytes of a frame. nullptr: it may come.
const char* WebSocketFrames::broken_rule(unsigned char first, unsigned char second) const noexcept {
  const unsigned opcode = first & 0x0FU;
  const bool is_last = (first & 0x80U) != 0, has_extension = (first & 0x70U) != 0, is_masked = (second & 0x80U) != 0;
  if (has_extension) return "a reserved bit is set, and no extension was agreed on (RFC 6455 5.2)";
  if (is_masked == is_client())
    return is_masked ? "a frame of the server is masked (RFC 6455 5.1)" : "a frame of the client is not masked (RFC 6455 5.1)";
  if (opcode > pong_frame || (opcode > binary_frame && !is_control(opcode))) return "a frame has a reserved opcode (RFC 6455 5.2)";
  if (is_control(opcode)) {
    const bool is_short = (second & 0x7FU) <= max_control_bytes;
    return is_last && is_short ? nullptr : "a control frame is longer than 125 bytes or fragmented (RFC 6455 5.5)";
  }
  return (opcode == continuation) == in_message_ ? nullptr : "a message begins within another, or a continuation without one (RFC 6455 5.4)";
}

void WebSocketFrames::take_control(const Frame& frame) {
  if (frame.opcode == close_frame) return take_close(frame.payload);
  if (frame.opcode == pong_frame && is_client()) remarks_->pong = frame.payload;
  if (frame.opcode != ping_frame || closing_) return;
  ++pings_;
  add_control(pong_frame, frame.payload);
}

/// RFC 6455 5.5.1: a close gets one with the same bytes, or with 1000 if it has no code, unless it is the response to ours.
void WebSocketFrames::take_close(std::string_view payload) {
  if (!is_close_payload(payload)) return fail(protocol_error, "a close has a code or a reason that may not be sent (RFC 6455 5.5.1, 7.4)");
  if (is_client()) remarks_->close = payload;
  if (!closing_ && payload.empty()) add_close(normal, {});
  else if (!closing_) add_control(close_frame, payload);
  end();
}

// ---------------------------------------------------------------------------------------------------------------- writing

void WebSocketFrames::send(std::shared_ptr<const std::string> message, bool text) {
  assert(state() == State::open && (control_.empty() || is_client()));
  if (is_client()) return add_control(text ? text_frame : binary_frame, *message);
  Outgoing& out = outgoing_.emplace_back();
  out.header_size = write_header(out.header, text ? text_frame : binary_frame, message->size());
  out.message = std::move(message);
}

void WebSocketFrames::add_output(OutputParts& parts) const noexcept {
  std::size_t skip = first_sent_;
  for (std::size_t i = first_; i < outgoing_.size(); ++i) {
    if (parts.room() < 2) return;
    const Outgoing& out = outgoing_[i];
    const std::size_t of_header = std::min<std::size_t>(skip, out.header_size);
    parts.add(std::string_view(out.header.data(), out.header_size).substr(of_header));
    parts.add(std::string_view(*out.message).substr(skip - of_header));
    skip = 0;
  }
  if (parts.room() > 0) parts.add(std::string_view(control_).substr(control_sent_));
}

void WebSocketFrames::ping(std::string_view payload) {
  assert(state() == State::open && !has_output() && payload.size() <= max_control_bytes);
  add_control(ping_frame, payload);
}

/// A client masks each frame with a new mask that nobody can predict (RFC 6455 5.3, 10.3).
void WebSocketFrames::add_control(unsigned opcode, std::string_view payload) {
  std::array<char, 10> header{};
  const std::size_t header_size = write_header(header, opcode, payload.size());
  if (!is_client()) {
    control_.append(header.data(), header_size).append(payload);
    return;
  }
  header[1] = static_cast<char>(static_cast<unsigned char>(header[1]) | 0x80U);
  std::array<unsigned char, mask_bytes> mask{};
  fill_random(mask.data(), mask.size());
  control_.append(header.data(), header_size).append(mask.begin(), mask.end());
  for (std::size_t i = 0; i < payload.size(); ++i) control_ += static_cast<char>(static_cast<unsigned char>(payload[i]) ^ mask[i % mask_bytes]);
}

void WebSocketFrames::sent(std::size_t bytes) {
  if (bytes == 0) return;
  for (; first_ < outgoing_.size(); ++first_, first_sent_ = 0) {
    const std::size_t left = outgoing_[first_].size() - first_sent_;
    if (bytes < left) {
      first_sent_ += bytes;
      return;
    }
    bytes -= left;
    outgoing_[first_].message.reset();
  }
  outgoing_.clear();
  if (outgoing_.capacity() > kept_messages) std::vector<Outgoing>().swap(outgoing_);
  first_ = 0;
  control_sent_ += bytes;
  if (control_sent_ < control_.size()) return;
  clear(control_);
  control_sent_ = 0;
}

// ---------------------------------------------------------------------------------------------------------------- closing

void WebSocketFrames::close(std::uint16_t code, std::string_view reason) {
  if (state() != State::open) return;
  add_close(code, reason);
  clear(message_);
  checked_ = 0;
}

void WebSocketFrames::add_close(std::uint16_t code, std::string_view reason) {
  closing_ = true;
  std::string payload{static_cast<char>(code >> 8), static_cast<char>(code & 0xFFU)};
  payload += utf8::prefix(reason, max_reason_bytes);
  add_control(close_frame, payload);
}

/// RFC 6455 7.1.7: the peer has broken the protocol.
void WebSocketFrames::fail(std::uint16_t code, const char* reason) {
  if (is_client()) {
    remarks_->fault = code;
    remarks_->reason = reason;
  }
  if (!closing_) add_close(code, {});
  end();
}

void WebSocketFrames::end() noexcept {
  over_ = true;
  has_unread_ = in_payload_ = false;
  clear(input_);
  clear(message_);
  used_ = 0;
}

}  // namespace lrt::http
