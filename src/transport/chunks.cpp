// SPDX-License-Identifier: Apache-2.0
#include "src/transport/chunks.hpp"

#include <algorithm>

#include <lrt/http/message.hpp>

namespace lrt::transport {
namespace {

constexpr std::size_t max_size_digits = 15;

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

bool is_token_char(char c) noexcept {
  if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c)) return true;
  return c != '\0' && std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
}

/// HTAB, SP, visible ASCII and obs-text.
bool is_text_char(char c) noexcept {
  const auto u = static_cast<unsigned char>(c);
  return u == '\t' || (u >= 0x20 && u != 0x7f);
}

bool is_blank(char c) noexcept { return c == ' ' || c == '\t'; }

void skip_blanks(std::string_view& text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
}

bool take_token(std::string_view& text) noexcept {
  std::size_t n = 0;
  while (n < text.size() && is_token_char(text[n])) ++n;
  text.remove_prefix(n);
  return n > 0;
}

bool take_quoted(std::string_view& text) noexcept {
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == '"') {
      text.remove_prefix(i + 1);
      return true;
    }
    if (text[i] == '\\' && ++i == text.size()) return false;
    if (!is_text_char(text[i])) return false;
  }
  return false;
}

/// Takes `c` and the white space around it; without `c` takes nothing.
bool take_spaced(std::string_view& text, char c) noexcept {
  auto rest = text;
  skip_blanks(rest);
  if (rest.empty() || rest.front() != c) return false;
  rest.remove_prefix(1);
  skip_blanks(rest);
  text = rest;
  return true;
}

/// chunk-ext = *( BWS ";" BWS token [ BWS "=" BWS ( token / quoted-string ) ] ) (RFC 9112 7.1.1)
bool is_extension(std::string_view text) noexcept {
  while (!text.empty()) {
    if (!take_spaced(text, ';') || !take_token(text)) return false;
    if (!take_spaced(text, '=')) continue;
    if (text.empty()) return false;
    if (!(text.front() == '"' ? take_quoted(text) : take_token(text))) return false;
  }
  return true;
}

int hex_value(char c) noexcept {
  if (is_digit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

void ChunkDecoder::reset(std::size_t body_limit, std::size_t overhead_limit) noexcept {
  part_ = Part::size;
  left_ = 0;
  body_limit_ = body_limit;
  overhead_left_ = overhead_limit;
  line_.clear();
  problem_ = {};
}

ChunkDecoder::Status ChunkDecoder::feed(std::string_view& input, BodyBuffer& body) {
  for (;;) {
    Status status = Status::more;
    switch (part_) {
      case Part::size:
        if (!take_line(input, status)) return status;
        if (status = size_line(); status != Status::more) return status;
        if (left_ > body_limit_ - body.size()) return Status::too_large;
        part_ = left_ == 0 ? Part::trailer : Part::data;
        break;
      case Part::data: {
        if (input.empty()) return Status::more;
        const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(left_, input.size()));
        if (!body.append(input.substr(0, n))) return Status::no_memory;
        input.remove_prefix(n);
        left_ -= n;
        if (left_ == 0) part_ = Part::data_end;
        break;
      }
      case Part::data_end:
        while (line_.size() < 2) {
          if (input.empty()) return Status::more;
          if (input.front() != "\r\n"[line_.size()]) return fail("a chunk is longer than its size says");
          line_ += input.front();
          input.remove_prefix(1);
        }
        line_.clear();
        part_ = Part::size;
        break;
      case Part::trailer:
        if (!take_line(input, status)) return status;
        if (line_.empty()) return Status::done;
        if (status = trailer_line(); status != Status::more) return status;
        break;
    }
  }
}

/// Completes line_. False: the line is incomplete, and `status` is more or bad.
bool ChunkDecoder::take_line(std::string_view& input, Status& status) {
  const auto end = input.find('\n');
  const auto part = input.substr(0, end);
  // A size line of up to 15 digits and every trailer's CRLF are free; all else is overhead.
  if (line_.size() + part.size() > overhead_left_ + max_size_digits + 1) {
    status = fail("the chunk extensions or trailers are too long");
    return false;
  }
  line_.append(part);
  if (end == std::string_view::npos) {
    input = {};
    return false;
  }
  input.remove_prefix(end + 1);
  if (line_.empty() || line_.back() != '\r') {
    status = fail("a line of the chunked coding does not end in CRLF");
    return false;
  }
  line_.pop_back();
  return true;
}

ChunkDecoder::Status ChunkDecoder::size_line() {
  std::size_t digits = 0;
  left_ = 0;
  for (; digits < line_.size() && hex_value(line_[digits]) >= 0; ++digits) {
    if (digits == max_size_digits) return fail("a chunk size has more than 15 digits");
    left_ = left_ * 16 + static_cast<std::uint64_t>(hex_value(line_[digits]));
  }
  if (digits == 0) return fail("a chunk size does not begin with a hexadecimal digit");
  const auto extension = std::string_view(line_).substr(digits);
  if (!is_extension(extension)) return fail("a chunk size is followed by text that is not a chunk extension");
  overhead_left_ -= std::min(overhead_left_, extension.size());
  line_.clear();
  return Status::more;
}

ChunkDecoder::Status ChunkDecoder::trailer_line() {
  std::string_view rest = line_;
  if (!take_token(rest) || rest.empty() || rest.front() != ':') return fail("a trailer does not begin with a field name and ':'");
  const auto name = std::string_view(line_).substr(0, line_.size() - rest.size());
  if (!std::all_of(rest.begin(), rest.end(), is_text_char)) return fail("a trailer contains a control character");
  for (const std::string_view framing : {"Content-Length", "Transfer-Encoding", "Host"}) {
    if (http::iequals(name, framing)) return fail("a trailer would change how the message is framed or routed");
  }
  overhead_left_ -= std::min(overhead_left_, line_.size() + 2);
  line_.clear();
  return Status::more;
}

ChunkDecoder::Status ChunkDecoder::fail(std::string_view problem) noexcept {
  problem_ = problem;
  return Status::bad;
}

}  // namespace lrt::transport
