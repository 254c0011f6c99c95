// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/bridge/images.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "src/ros2/types/cdr.hpp"

namespace lrt::ros2 {
namespace {

// --- PNG (ISO/IEC 15948), zlib (RFC 1950) and deflate (RFC 1951) with its fixed codes

std::uint32_t crc_of(std::string_view bytes, std::uint32_t crc) noexcept {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ c >> 1U : c >> 1U;
      t[n] = c;
    }
    return t;
  }();
  for (const char b : bytes) crc = table[(crc ^ static_cast<unsigned char>(b)) & 0xFFU] ^ crc >> 8U;
  return crc;
}

void append_u32(std::string& to, std::uint32_t n) {
  for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(static_cast<unsigned char>(n >> static_cast<unsigned>(shift)));
}

void append_chunk(std::string& to, std::string_view type, std::string_view data) {
  append_u32(to, static_cast<std::uint32_t>(data.size()));
  to.append(type).append(data);
  append_u32(to, ~crc_of(data, crc_of(type, 0xFFFFFFFFU)));
}

/// Writes one deflate block with fixed codes: literals, and runs that repeat what stands one pixel or one row before.
class Deflate {
 public:
  explicit Deflate(std::string& out) : out_(out) {
    out_ += "\x78\x01";
    put(1, 1);  // the last block
    put(1, 2);  // fixed codes
  }
  void literal(unsigned char byte) { byte < 144 ? code(0x30U + byte, 8) : code(0x190U + byte - 144U, 9); }
  /// @param length  3 to 258
  void copy(unsigned length, unsigned distance) {
    static constexpr std::uint16_t first_length[] = {3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                                     31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
    static constexpr std::uint8_t length_bits[] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};
    const auto at = static_cast<unsigned>(std::upper_bound(std::begin(first_length), std::end(first_length), length) - std::begin(first_length) - 1);
    const unsigned symbol = 257 + at;
    symbol < 280 ? code(symbol - 256, 7) : code(0xC0U + symbol - 280, 8);
    put(length - first_length[at], length_bits[at]);
    unsigned d = 0, first = 1, bits = 0;  // distance codes: two for each number of bits, four for none
    while (distance >= first + (1U << bits)) {
      first += 1U << bits;
      ++d;
      if (d >= 4 && d % 2 == 0) ++bits;
    }
    code(d, 5);
    put(distance - first, bits);
  }
  void end(std::uint32_t adler) {
    code(0, 7);
    if (used_ > 0) put(0, 8 - used_);
    append_u32(out_, adler);
  }

 private:
  /// Bits of a number, the lowest first.
  void put(unsigned bits, unsigned count) {
    bits_ |= std::uint64_t{bits} << used_;
    used_ += count;
    for (; used_ >= 8; used_ -= 8, bits_ >>= 8U) out_ += static_cast<char>(static_cast<unsigned char>(bits_));
  }
  /// A code of Huffman, the highest bit first.
  void code(unsigned bits, unsigned count) {
    bits = (bits & 0x5555U) << 1U | (bits >> 1U & 0x5555U);
    bits = (bits & 0x3333U) << 2U | (bits >> 2U & 0x3333U);
    bits = (bits & 0x0F0FU) << 4U | (bits >> 4U & 0x0F0FU);
    bits = (bits & 0x00FFU) << 8U | (bits >> 8U & 0x00FFU);
    put(bits >> (16 - count), count);
  }

  std::string& out_;
  std::uint64_t bits_ = 0;
  unsigned used_ = 0;
};

void compress(std::string& out, std::string_view bytes, std::size_t pixel) {
  Deflate deflate(out);
  std::uint32_t a = 1, b = 0;
  for (std::size_t at = 0; at < bytes.size();) {  // 5552 sums fit into 32 bits
    const std::size_t end = std::min(bytes.size(), at + 5552);
    for (; at < end; ++at) a += static_cast<unsigned char>(bytes[at]), b += a;
    a %= 65521, b %= 65521;
  }
  for (std::size_t at = 0; at < bytes.size();) {
    std::size_t length = 0;
    if (at >= pixel) {
      const std::size_t most = std::min<std::size_t>(258, bytes.size() - at);
      while (length < most && bytes[at + length] == bytes[at + length - pixel]) ++length;
    }
    if (length >= 4) {
      deflate.copy(static_cast<unsigned>(length), static_cast<unsigned>(pixel));
      at += length;
    } else {
      deflate.literal(static_cast<unsigned char>(bytes[at++]));
    }
  }
  deflate.end(b << 16U | a);
}

// --- pixels

/// How an encoding becomes channels of PNG.
struct Encoding {
  std::string_view name;
  unsigned bytes;          ///< of a pixel
  unsigned channels;       ///< of the PNG
  unsigned depth;          ///< bits of a channel, of both
  std::uint8_t order[4];   ///< which channel of the pixel is first, second, ...
  bool is_metres = false;  ///< 32 bits of a float
};
constexpr Encoding encodings[] = {
    {"rgb8", 3, 3, 8, {0, 1, 2, 0}},    {"bgr8", 3, 3, 8, {2, 1, 0, 0}},    {"8UC3", 3, 3, 8, {2, 1, 0, 0}},
    {"rgba8", 4, 4, 8, {0, 1, 2, 3}},   {"bgra8", 4, 4, 8, {2, 1, 0, 3}},   {"8UC4", 4, 4, 8, {2, 1, 0, 3}},
    {"mono8", 1, 1, 8, {0, 0, 0, 0}},   {"8UC1", 1, 1, 8, {0, 0, 0, 0}},    {"rgb16", 6, 3, 16, {0, 1, 2, 0}},
    {"bgr16", 6, 3, 16, {2, 1, 0, 0}},  {"rgba16", 8, 4, 16, {0, 1, 2, 3}}, {"bgra16", 8, 4, 16, {2, 1, 0, 3}},
    {"mono16", 2, 1, 16, {0, 0, 0, 0}}, {"16UC1", 2, 1, 16, {0, 0, 0, 0}},  {"32FC1", 4, 1, 16, {0, 0, 0, 0}, true},
};

Unexpected contradiction() { return unexpected(Errc::unsupported_syntax, "the sizes of the image contradict each other"); }
Unexpected too_large(std::size_t bytes, std::size_t most) {
  return unexpected(Errc::limit_exceeded,
                    "it has " + std::to_string(bytes) + " bytes; the limit max_representation_bytes is " + std::to_string(most));
}

}  // namespace

std::string png(std::uint32_t width, std::uint32_t height, unsigned channels, unsigned depth, std::string_view rows) {
  const std::size_t pixel = std::size_t{channels} * depth / 8, row = width * pixel;
  std::string filtered;
  filtered.reserve((row + 1) * height);
  for (std::uint32_t y = 0; y < height; ++y) {
    const std::string_view line = rows.substr(y * row, row);
    if (y > 0 && line == rows.substr((y - 1) * row, row)) {
      filtered += '\2';  // "up": the same as the row before
      filtered.append(row, '\0');
    } else {
      filtered += '\0';
      filtered.append(line);
    }
  }
  std::string out("\x89PNG\r\n\x1A\n", 8);
  std::string header;
  append_u32(header, width);
  append_u32(header, height);
  static constexpr char types[] = {0, 0, 4, 2, 6};  // of colour, by channels
  header += static_cast<char>(depth);
  header += types[channels];
  header.append(3, '\0');
  append_chunk(out, "IHDR", header);
  std::string data;
  compress(data, filtered, pixel);
  append_chunk(out, "IDAT", data);
  append_chunk(out, "IEND", {});
  return out;
}

Result<std::string> png_of(const Pixels& p, std::size_t max_bytes) {
  std::string_view name = p.encoding;
  if (name.substr(0, 6) == "bayer_") name = name.size() > 2 && name.substr(name.size() - 2) == "16" ? "mono16" : "mono8";
  const auto found = std::find_if(std::begin(encodings), std::end(encodings), [name](const Encoding& e) { return e.name == name; });
  if (found == std::end(encodings))
    return unexpected(Errc::unsupported_syntax, "no PNG is made of the encoding \"" + std::string(p.encoding.substr(0, 40)) + '"');
  const Encoding& e = *found;
  if (p.width == 0 || p.height == 0 || p.width > 65'535 || p.height > 65'535 || p.step < std::uint64_t{p.width} * e.bytes ||
      p.bytes.size() / p.step < p.height)
    return contradiction();
  const std::size_t width = e.depth / 8, row = std::size_t{p.width} * e.channels * width;
  if (row * p.height > max_bytes) return too_large(row * p.height, max_bytes);
  std::string rows(row * p.height, '\0');
  char* to = rows.data();
  for (std::uint32_t y = 0; y < p.height; ++y) {
    const char* from = p.bytes.data() + std::size_t{y} * p.step;
    for (std::uint32_t x = 0; x < p.width; ++x, from += e.bytes) {
      if (e.is_metres) {
        const double mm = std::round(widened(load<std::uint32_t>(from, !p.big_endian)) * 1000);
        const auto n = static_cast<unsigned>(mm >= 0 && mm <= 65'535 ? mm : 0);
        *to++ = static_cast<char>(static_cast<unsigned char>(n >> 8U));
        *to++ = static_cast<char>(static_cast<unsigned char>(n));
        continue;
      }
      for (unsigned c = 0; c < e.channels; ++c) {
        const char* one = from + e.order[c] * width;
        if (width == 1) {
          *to++ = *one;
        } else {
          *to++ = one[p.big_endian ? 0 : 1];
          *to++ = one[p.big_endian ? 1 : 0];
        }
      }
    }
  }
  return png(p.width, p.height, e.channels, e.depth, rows);
}

Result<std::string> png_of_grid(std::uint32_t width, std::uint32_t height, std::string_view cells, std::size_t max_bytes) {
  if (width == 0 || height == 0 || cells.size() / width < height) return contradiction();
  const std::size_t size = std::size_t{width} * height;
  if (size > max_bytes) return too_large(size, max_bytes);
  std::string rows;
  rows.reserve(size);
  for (std::uint32_t y = height; y-- > 0;)
    for (const char c : cells.substr(std::size_t{y} * width, width)) {
      const unsigned value = static_cast<unsigned char>(c);  // -1 is unknown, as all above 100
      rows += static_cast<char>(static_cast<unsigned char>(value > 100 ? 205 : 254 - value * 254 / 100));
    }
  return png(width, height, 1, 8, rows);
}

Result<std::string> coordinates_of(const CloudLayout& l, std::string_view data, std::size_t max_bytes) {
  const std::uint64_t points = std::uint64_t{l.width} * l.height;
  if (points == 0) return std::string();
  for (int i = 0; i < 3; ++i)
    if (l.offsets[i] > l.point_step || l.point_step - l.offsets[i] < (l.is_double[i] ? 8U : 4U)) return contradiction();
  const std::uint64_t row = std::uint64_t{l.width} * l.point_step;
  if (l.row_step < row || (l.height > 0 && data.size() / l.row_step < l.height)) return contradiction();
  if (points > max_bytes / 12) return too_large(static_cast<std::size_t>(std::min<std::uint64_t>(points, UINT32_MAX) * 12), max_bytes);
  std::string out(points * 12, '\0');
  char* to = out.data();
  for (std::uint32_t y = 0; y < l.height; ++y)
    for (std::uint32_t x = 0; x < l.width; ++x)
      for (int i = 0; i < 3; ++i, to += 4) {
        const char* from = data.data() + std::size_t{y} * l.row_step + std::size_t{x} * l.point_step + l.offsets[i];
        std::uint32_t bits = 0;
        if (l.is_double[i]) {
          const auto wide = load<std::uint64_t>(from, !l.big_endian);
          double d = 0;
          std::memcpy(&d, &wide, sizeof d);
          bits = narrowed(d);
        } else {
          bits = load<std::uint32_t>(from, !l.big_endian);
        }
        for (unsigned b = 0; b < 4; ++b) to[b] = static_cast<char>(static_cast<unsigned char>(bits >> 8U * b));
      }
  return out;
}

}  // namespace lrt::ros2
