// SPDX-License-Identifier: Apache-2.0
#include "src/http/response_parser.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/http/framing.hpp"

namespace lrt::http {
namespace {

using namespace detail;
using framing::for_each_element;

/// The server's words, in a message.
std::string words(std::string_view found) { return quoted_ascii(found, 60); }

bool frames_body(std::string_view name) noexcept { return iequals_ascii(name, "Content-Length") || iequals_ascii(name, "Transfer-Encoding"); }

/// CR, LF and NUL are errors wherever they stand in a line (RFC 9110 5.5, RFC 9112 2.2).
const char* forbidden_byte(std::string_view line) noexcept {
  for (const char c : line) {
    if (c == '\r') return "CR without LF";
    if (c == '\0') return "NUL";
  }
  return nullptr;
}

std::string number(std::uint64_t value) { return std::to_string(value); }

}  // namespace

ResponseParser::ResponseParser(std::string_view method, const ResponseLimits& limits, bool may_switch)
    : limits_(limits), is_head_(method == "HEAD"), may_switch_(may_switch) {}

ResponseParser::Step ResponseParser::fail(Errc code, std::string reason) {
  state_ = State::failed;
  error_ = {code, std::move(reason)};
  return Step::failed;
}

void ResponseParser::tolerate(std::string what) {
  if (tolerated_.empty()) tolerated_ = std::move(what);
}

bool ResponseParser::is_too_long(std::uint64_t more) const noexcept {
  const std::uint64_t max = limits_.max_body_bytes.value_or(std::numeric_limits<std::uint64_t>::max() / 2);
  return body_bytes_ > max || more > max - body_bytes_;
}

ResponseParser::Step ResponseParser::fail_too_long() {
  if (!limits_.max_body_bytes) return fail(Errc::limit_exceeded, "its response has a length of more than 63 bits");
  return fail(Errc::limit_exceeded, "its response is longer than " + number(*limits_.max_body_bytes) + " bytes");
}

/// The next line without its CRLF, a view that is valid until the next call. A line is longer than `max` with its CRLF.
ResponseParser::Line ResponseParser::take_line(std::string_view& bytes, std::size_t max, std::string_view& line) {
  if (std::exchange(line_is_taken_, false)) line_.clear();
  const std::size_t end = bytes.find('\n');
  line = bytes.substr(0, end == std::string_view::npos ? end : end + 1);
  if (line_.size() + line.size() > max) return Line::too_long;
  bytes.remove_prefix(line.size());
  if (end == std::string_view::npos || !line_.empty()) {
    line_.append(line);
    if (end == std::string_view::npos) return Line::incomplete;
    line_is_taken_ = true;
    line = line_;
  }
  line.remove_suffix(1);
  const bool is_ended = !line.empty() && line.back() == '\r';
  if (is_ended) line.remove_suffix(1);
  const char* const forbidden = is_ended ? forbidden_byte(line) : "LF without CR";
  if (forbidden != nullptr) {
    fail(Errc::expected_http, "its response has " + std::string(forbidden) + " in the line " + words(line));
    return Line::failed;
  }
  return Line::taken;
}

ResponseParser::Step ResponseParser::parse(std::string_view& bytes) {
  while (true) {
    Step step = Step::more;
    switch (state_) {
      case State::status_line: step = status_line(bytes); break;
      case State::fields: step = field_lines(bytes, Section::header); break;
      case State::no_body: state_ = State::complete; return Step::complete;
      case State::length:
        if (rest_ > 0) return take_body(bytes);
        state_ = State::complete;
        return Step::complete;
      case State::to_end:
        rest_ = bytes.size();
        if (is_too_long(rest_)) return fail_too_long();
        return take_body(bytes);
      case State::chunk_line: step = chunk_line(bytes); break;
      case State::chunk:
        if (rest_ > 0) return take_body(bytes);
        state_ = State::chunk_end;
        rest_ = 2;
        continue;
      case State::chunk_end:
        for (; rest_ > 0 && !bytes.empty(); --rest_, bytes.remove_prefix(1)) {
          if (bytes.front() != (rest_ == 2 ? '\r' : '\n')) return fail(Errc::expected_http, "a chunk of its response is longer than its size");
        }
        if (rest_ > 0) return Step::more;
        state_ = State::chunk_line;
        continue;
      case State::trailers: step = field_lines(bytes, Section::trailer); break;
      case State::complete: return Step::complete;
      case State::failed: return Step::failed;
    }
    if (step != Step::more || bytes.empty()) return step;
  }
}

ResponseParser::Step ResponseParser::end() {
  switch (state_) {
    case State::complete: return Step::complete;
    case State::failed: return Step::failed;
    case State::to_end:
    case State::no_body: state_ = State::complete; return Step::complete;
    case State::length:
      if (rest_ == 0) {
        state_ = State::complete;
        return Step::complete;
      }
      break;
    case State::status_line:
      if ((line_.empty() || line_is_taken_) && interim_ == 0) return fail(Errc::closed, "it closed the connection without a response");
      break;
    default: break;
  }
  std::string reason = "it closed the connection before its response was complete";
  if (state_ == State::status_line && interim_ > 0)
    reason += ": the last one was " + number(static_cast<unsigned>(last_interim_)) + ", which is not final";
  else if (state_ == State::length) reason += ": " + number(rest_) + " bytes are missing";
  else if (state_ == State::trailers) reason += ": its trailer section has no end";
  else if (has_body_) reason += ": the last chunk is missing";
  return fail(Errc::closed, std::move(reason));
}

ResponseParser::Step ResponseParser::status_line(std::string_view& bytes) {
  constexpr std::string_view start = "HTTP/1.";
  const std::string_view begun = line_is_taken_ ? std::string_view() : std::string_view(line_);
  for (std::size_t at = 0; at < start.size() && at < begun.size() + bytes.size(); ++at) {
    if ((at < begun.size() ? begun[at] : bytes[at - begun.size()]) == start[at]) continue;
    std::string found(begun);
    found.append(bytes.substr(0, 80));
    found.resize(std::min(found.find_first_of("\r\n"), found.size()));
    return fail(Errc::expected_http, "its response is not HTTP/1.1: it begins with " + words(found));
  }
  std::string_view line;
  const std::size_t rest = limits_.max_header_bytes - header_bytes_;
  switch (take_line(bytes, std::min(limits_.max_status_line_bytes, rest), line)) {
    case Line::taken: break;
    case Line::incomplete: return Step::more;
    case Line::failed: return Step::failed;
    case Line::too_long:
      if (rest < limits_.max_status_line_bytes) return fail_long_header();
      return fail(Errc::limit_exceeded, "the status line of its response is longer than " + number(limits_.max_status_line_bytes) + " bytes");
  }
  header_bytes_ += line.size() + 2;
  const auto digit = [&](std::size_t at) { return is_digit(line[at]); };
  const bool is_valid = line.size() >= 12 && digit(7) && line[8] == ' ' && line[9] != '0' && digit(9) && digit(10) && digit(11) &&
                        (line.size() == 12 || line[12] == ' ');
  if (!is_valid) return fail(Errc::expected_http, "its response is not HTTP/1.1: its status line is " + words(line));
  version_ = line[7] == '0' ? 10 : 11;
  status_ = (line[9] - '0') * 100 + (line[10] - '0') * 10 + (line[11] - '0');
  if (line.size() == 12) tolerate("the status line has no space after the code (RFC 9112 4)");
  fields_ = {};
  length_ = std::nullopt;
  coding_.clear();
  has_coding_ = false;
  keeps_ = version_ == 11;
  field_count_ = 0;
  state_ = State::fields;
  return Step::more;
}

ResponseParser::Step ResponseParser::fail_long_header() {
  return fail(Errc::limit_exceeded, "the header section of its response is longer than " + number(limits_.max_header_bytes) + " bytes");
}

ResponseParser::Step ResponseParser::field_lines(std::string_view& bytes, Section section) {
  const bool is_header = section == Section::header;
  std::size_t& size = is_header ? header_bytes_ : trailer_bytes_;
  const std::size_t max = is_header ? limits_.max_header_bytes : limits_.max_trailer_bytes;
  while (true) {
    std::string_view line;
    switch (take_line(bytes, max - size, line)) {
      case Line::taken: break;
      case Line::incomplete: return Step::more;
      case Line::failed: return Step::failed;
      case Line::too_long:
        if (is_header) return fail_long_header();
        return fail(Errc::limit_exceeded, "the trailer section of its response is longer than " + number(max) + " bytes");
    }
    size += line.size() + 2;
    if (line.empty()) break;
    if (!take_field_line(line, section)) return Step::failed;
  }
  if (!finish_field(section)) return Step::failed;
  if (is_header) return finish_header();
  state_ = State::complete;
  return Step::complete;
}

bool ResponseParser::take_field_line(std::string_view line, Section section) {
  if (is_ows(line.front())) {  // obs-fold; after a line that was left out, it is left out, too
    if (has_field_) (value_ += ' ').append(trim(line));
    tolerate("the header section has a folded line: " + words(line) + " (RFC 9112 5.2)");
    return true;
  }
  if (!finish_field(section)) return false;
  if (++field_count_ > limits_.max_fields) {
    fail(Errc::limit_exceeded, "its response has more than " + number(limits_.max_fields) + " fields");
    return false;
  }
  const std::size_t colon = line.find(':');
  const std::string_view name = line.substr(0, colon);
  if (colon != std::string_view::npos && framing::is_token(name)) {
    name_ = name;
    value_ = trim(line.substr(colon + 1));
    has_field_ = true;
    return true;
  }
  keeps_ = false;
  tolerate("the header section has a line that is no field: " + words(line) + " (RFC 9112 5)");
  if (section == Section::header && frames_body(trim(name))) {
    fail(Errc::expected_http, "its response has a length in a line that is no field: " + words(line));
    return false;
  }
  return true;
}

/// Takes the field that no line continues.
bool ResponseParser::finish_field(Section section) {
  if (!std::exchange(has_field_, false)) return true;
  const std::string_view value = trim(value_);
  if (section == Section::header && !take_framing_field(value)) return false;
  if (!value.empty()) (section == Section::header ? fields_ : trailers_).add(name_, value);
  return true;
}

bool ResponseParser::take_framing_field(std::string_view value) {
  if (iequals_ascii(name_, "Content-Length")) {
    // Some servers repeat it, and some proxies join what was repeated (RFC 9110 8.6).
    for (std::string_view list = value;;) {
      const std::size_t comma = std::min(list.find(','), list.size());
      const std::optional<std::uint64_t> length = framing::parse_length(trim(list.substr(0, comma)));
      if (!length) {
        fail(Errc::expected_http, "its response has the Content-Length " + words(value));
        return false;
      }
      if (length_ && *length_ != *length) {
        fail(Errc::expected_http, "its response has more than one length: " + number(*length_) + " and " + number(*length));
        return false;
      }
      if (length_) tolerate("Content-Length is there twice (RFC 9110 8.6)");
      length_ = length;
      if (comma == list.size()) return true;
      list.remove_prefix(comma + 1);
    }
  }
  if (iequals_ascii(name_, "Transfer-Encoding")) {
    if (!coding_.empty()) coding_ += ", ";
    coding_ += value;
    has_coding_ = true;
  } else if (iequals_ascii(name_, "Connection")) {
    for_each_element(value, [this](std::string_view option) {
      keeps_ = keeps_ && !iequals_ascii(option, "close");
      return keeps_;
    });
  }
  return true;
}

ResponseParser::Step ResponseParser::finish_header() {
  if (status_ < 200 && status_ != 101) {
    last_interim_ = status_;
    if (++interim_ > limits_.max_interim)
      return fail(Errc::limit_exceeded, "it sent more than " + number(limits_.max_interim) + " interim responses");
    state_ = State::status_line;
    return Step::interim;
  }
  if (status_ == 101 && !may_switch_) return fail(Errc::expected_http, "it switched to another protocol (101), which it was not asked for");
  if (length_ && has_coding_ && reads_despite_length_) {
    tolerate("Content-Length and Transfer-Encoding are both there (RFC 9112 6.2)");
  } else if (length_ && has_coding_) {
    return fail(Errc::expected_http,
                "its response has more than one length: Content-Length " + number(*length_) + " and Transfer-Encoding " + words(coding_));
  }
  return frame_body();
}

/// RFC 9112 6.3.
ResponseParser::Step ResponseParser::frame_body() {
  has_body_ = !is_head_ && may_have_body(status_);
  field_count_ = 0;
  if (!has_body_) {
    // A 204 has no length (RFC 9110 8.6). The server may have sent a body all the same.
    if (status_ == 204 && (has_coding_ || length_.value_or(0) != 0)) keeps_ = false;
    state_ = State::no_body;
    return Step::header;
  }
  if (has_coding_) {
    bool is_chunked = false, is_other = false;
    for_each_element(coding_, [&](std::string_view coding) {
      is_other = is_other || is_chunked || !iequals_ascii(coding, "chunked");
      return is_chunked = true;
    });
    if (!is_chunked || is_other) return fail(Errc::expected_http, "its response has the Transfer-Encoding " + words(coding_) + ", expected chunked");
    state_ = State::chunk_line;
  } else if (length_) {
    if (is_too_long(*length_)) return fail_too_long();
    rest_ = *length_;
    state_ = State::length;
  } else {
    keeps_ = false;
    state_ = State::to_end;
  }
  return Step::header;
}

/// The next part of `rest_` bytes.
ResponseParser::Step ResponseParser::take_body(std::string_view& bytes) {
  if (bytes.empty()) return Step::more;
  body_ = bytes.substr(0, static_cast<std::size_t>(std::min<std::uint64_t>(rest_, bytes.size())));
  bytes.remove_prefix(body_.size());
  rest_ -= body_.size();
  body_bytes_ += body_.size();
  return Step::body;
}

/// chunk-size [ chunk-ext ] CRLF (RFC 9112 7.1)
ResponseParser::Step ResponseParser::chunk_line(std::string_view& bytes) {
  std::string_view line;
  switch (take_line(bytes, limits_.max_chunk_line_bytes, line)) {
    case Line::taken: break;
    case Line::incomplete: return Step::more;
    case Line::failed: return Step::failed;
    case Line::too_long:
      return fail(Errc::limit_exceeded,
                  "the line with the size of a chunk of its response is too long: more than " + number(limits_.max_chunk_line_bytes) + " bytes");
  }
  std::uint64_t size = 0;
  std::size_t at = 0;
  bool is_huge = false;
  for (; at < line.size() && is(line[at], hex); ++at) {
    is_huge = is_huge || (size >> 59U) != 0;
    size = (size << 4U) | hex_value(line[at]);
  }
  const std::string_view extensions = trim(line.substr(at));
  if (at == 0 || (!extensions.empty() && extensions.front() != ';'))
    return fail(Errc::expected_http, "its response has a chunk with the size " + words(line));
  if (is_huge || is_too_long(size)) return fail_too_long();
  constexpr std::size_t usual_digits = 16;
  extension_bytes_ += extensions.size() + (at > usual_digits ? at - usual_digits : 0);
  if (extension_bytes_ > limits_.max_chunk_extension_bytes + body_bytes_) {
    return fail(Errc::limit_exceeded, "the chunk extensions of its response are longer than " + number(limits_.max_chunk_extension_bytes) + " bytes");
  }
  rest_ = size;
  state_ = size > 0 ? State::chunk : State::trailers;
  return Step::more;
}

}  // namespace lrt::http
