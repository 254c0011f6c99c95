// SPDX-License-Identifier: Apache-2.0
#include "src/base/utf8.hpp"

#include <cstdint>
#include <cstring>

namespace lrt::utf8 {
namespace {

unsigned byte(std::string_view text, std::size_t at) noexcept { return static_cast<unsigned char>(text[at]); }

/// The length of the well-formed sequence at `at`, or 0. The bounds of the second byte (RFC 3629 4) exclude overlong forms,
/// surrogates and code points above U+10FFFF.
std::size_t sequence(std::string_view text, std::size_t at) noexcept {
  const unsigned lead = byte(text, at);
  if (lead < 0x80) return 1;
  std::size_t length = 0;
  unsigned low = 0x80;
  unsigned high = 0xBF;
  if (lead >= 0xC2 && lead <= 0xDF) {
    length = 2;
  } else if (lead >= 0xE0 && lead <= 0xEF) {
    length = 3;
    if (lead == 0xE0) low = 0xA0;
    if (lead == 0xED) high = 0x9F;
  } else if (lead >= 0xF0 && lead <= 0xF4) {
    length = 4;
    if (lead == 0xF0) low = 0x90;
    if (lead == 0xF4) high = 0x8F;
  } else {
    return 0;
  }
  if (text.size() - at < length) return 0;
  if (byte(text, at + 1) < low || byte(text, at + 1) > high) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if ((byte(text, at + i) & 0xC0U) != 0x80U) return 0;
  }
  return length;
}

}  // namespace

std::optional<std::size_t> find_invalid(std::string_view text) noexcept {
  std::size_t at = 0;
  while (at < text.size()) {
    if (text.size() - at >= 8) {  // eight ASCII bytes at a time
      std::uint64_t word;
      std::memcpy(&word, text.data() + at, sizeof word);
      if ((word & 0x8080808080808080U) == 0) {
        at += 8;
        continue;
      }
    }
    const std::size_t length = sequence(text, at);
    if (length == 0) return at;
    at += length;
  }
  return std::nullopt;
}

bool ends_within_character(std::string_view text) noexcept {
  const auto byte = [text](std::size_t from_end) { return static_cast<unsigned char>(text[text.size() - 1 - from_end]); };
  std::size_t tail = 0;
  while (tail < text.size() && tail < 3 && (byte(tail) & 0xC0U) == 0x80) ++tail;
  if (tail == text.size()) return false;
  const unsigned lead = byte(tail);
  return tail < (lead >= 0xF0 ? 3U : lead >= 0xE0 ? 2U : lead >= 0xC0 ? 1U : 0U);
}

std::string_view prefix(std::string_view text, std::size_t limit) noexcept {
  if (text.size() <= limit) return text;
  while (limit > 0 && (byte(text, limit) & 0xC0U) == 0x80) --limit;
  return {text.data(), limit};
}

void append(std::string& out, char32_t code_point) {
  const auto put = [&out](char32_t value) { out += static_cast<char>(static_cast<unsigned char>(value)); };
  if (code_point < 0x80) {
    put(code_point);
  } else if (code_point < 0x800) {
    put(0xC0 | (code_point >> 6));
    put(0x80 | (code_point & 0x3F));
  } else if (code_point < 0x10000) {
    put(0xE0 | (code_point >> 12));
    put(0x80 | ((code_point >> 6) & 0x3F));
    put(0x80 | (code_point & 0x3F));
  } else {
    put(0xF0 | (code_point >> 18));
    put(0x80 | ((code_point >> 12) & 0x3F));
    put(0x80 | ((code_point >> 6) & 0x3F));
    put(0x80 | (code_point & 0x3F));
  }
}

char32_t decode(std::string_view text, std::size_t& offset) noexcept {
  const unsigned lead = byte(text, offset++);
  if (lead < 0x80) return lead;
  int more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : 1;
  char32_t result = lead & (0x3FU >> more);
  for (; more > 0 && offset < text.size(); --more) result = (result << 6) | (byte(text, offset++) & 0x3FU);
  return result;
}

}  // namespace lrt::utf8
