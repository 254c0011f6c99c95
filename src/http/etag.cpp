// SPDX-License-Identifier: Apache-2.0
#include "src/http/etag.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

struct Hash {
  std::uint64_t a = 0, b = 0;
};

constexpr std::uint64_t rotate(std::uint64_t x, int by) noexcept { return (x << by) | (x >> (64 - by)); }

constexpr std::uint64_t finish(std::uint64_t x) noexcept {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdU;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53U;
  return x ^ (x >> 33);
}

/// Little-endian on every machine, so that tags agree between machines. Compilers make one load of it.
std::uint64_t load(const char* from) noexcept {
  const auto byte = [from](int i) { return std::uint64_t{static_cast<unsigned char>(from[i])} << (8 * i); };
  return byte(0) | byte(1) | byte(2) | byte(3) | byte(4) | byte(5) | byte(6) | byte(7);
}

/// MurmurHash3_x64_128 (Austin Appleby, public domain), with both halves of the state as its seed.
Hash murmur3(std::string_view bytes, Hash state) noexcept {
  constexpr std::uint64_t c1 = 0x87c37b91114253d5U;
  constexpr std::uint64_t c2 = 0x4cf5ad432745937fU;
  std::uint64_t a = state.a;
  std::uint64_t b = state.b;
  const char* at = bytes.data();
  for (std::size_t blocks = bytes.size() / 16; blocks > 0; --blocks, at += 16) {
    a = (rotate(a ^ (rotate(load(at) * c1, 31) * c2), 27) + b) * 5 + 0x52dce729;
    b = (rotate(b ^ (rotate(load(at + 8) * c2, 33) * c1), 31) + a) * 5 + 0x38495ab5;
  }
  if (const std::size_t left = bytes.size() % 16; left > 0) {
    char tail[16] = {};
    std::memcpy(tail, at, left);
    b ^= rotate(load(tail + 8) * c2, 33) * c1;
    a ^= rotate(load(tail) * c1, 31) * c2;
  }
  a ^= bytes.size();
  b ^= bytes.size();
  a += b;
  b += a;
  a = finish(a);
  b = finish(b);
  a += b;
  b += a;
  return {a, b};
}

constexpr bool is_etagc(char c) noexcept {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x21 && byte != 0x22 && byte != 0x7F;
}

}  // namespace

std::string entity_tag(std::string_view media_type, std::string_view bytes) {
  // The media type's hash, which has its length in it, seeds that of the bytes: no separator could be mistaken for content.
  const Hash hash = murmur3(bytes, murmur3(media_type, {}));
  static constexpr char base64url[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  char text[24];
  text[0] = '"';
  std::uint64_t a = hash.a;
  std::uint64_t b = hash.b;
  for (int i = 1; i <= 22; ++i) {  // 128 bits, six at a time from the low end
    text[i] = base64url[a & 63];
    a = (a >> 6) | (b << 58);
    b >>= 6;
  }
  text[23] = '"';
  return std::string(text, sizeof text);
}

Match matches(std::string_view field, std::string_view tag, bool weak) noexcept {
  field = detail::trim(field);
  if (field == "*") return Match::yes;
  const auto take_weakness = [](std::string_view& text) {
    if (text.substr(0, 2) != "W/") return false;
    text.remove_prefix(2);
    return true;
  };
  const bool tag_is_weak = take_weakness(tag);
  bool found = false;
  std::size_t at = 0;
  for (;;) {  // #entity-tag, empty elements allowed (RFC 9110 5.6.1.2)
    while (at < field.size() && (detail::is_ows(field[at]) || field[at] == ',')) ++at;
    if (at == field.size()) break;
    std::string_view rest = field.substr(at);
    const bool element_is_weak = take_weakness(rest);
    if (rest.empty() || rest.front() != '"') return Match::malformed;
    std::size_t end = 1;
    // A space is not allowed in a tag, but some clients send it, such as the LDP test suite. Such a tag never matches.
    while (end < rest.size() && (is_etagc(rest[end]) || rest[end] == ' ')) ++end;
    if (end == rest.size() || rest[end] != '"') return Match::malformed;
    const std::string_view opaque = rest.substr(0, end + 1);
    at = field.size() - rest.size() + end + 1;
    found = found || (opaque == tag && (weak || (!element_is_weak && !tag_is_weak)));
    while (at < field.size() && detail::is_ows(field[at])) ++at;
    if (at < field.size() && field[at] != ',') return Match::malformed;
  }
  return found ? Match::yes : Match::no;
}

}  // namespace lrt::http
