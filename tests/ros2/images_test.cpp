// SPDX-License-Identifier: Apache-2.0
// PNG, and coordinates of clouds. The PNG are read by a decoder that is written from RFC 1950 and RFC 1951 here.
#include "src/ros2/bridge/images.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <random>
#include <string>

#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using namespace lrt::ros2;

std::uint32_t u32(std::string_view s, std::size_t at) {
  std::uint32_t n = 0;
  for (std::size_t i = 0; i < 4; ++i) n = n << 8U | static_cast<unsigned char>(s[at + i]);
  return n;
}

/// zlib with one block of fixed codes.
std::optional<std::string> inflated(std::string_view in) {
  std::size_t bit = 16;
  const auto one = [&]() -> unsigned { return bit / 8 < in.size() ? static_cast<unsigned char>(in[bit / 8]) >> (bit % 8) & 1U : 0U; };
  const auto number = [&](unsigned count) {
    unsigned n = 0;
    for (unsigned i = 0; i < count; ++i, ++bit) n |= one() << i;
    return n;
  };
  const auto code = [&](unsigned count) {
    unsigned n = 0;
    for (unsigned i = 0; i < count; ++i, ++bit) n = n << 1U | one();
    return n;
  };
  if (in.size() < 6 || u32(in, 0) >> 16U != 0x7801 || number(1) != 1 || number(2) != 1) return std::nullopt;
  std::string out;
  while (bit / 8 < in.size()) {
    unsigned symbol = code(7);
    if (symbol < 24) {
      symbol += 256;
    } else {
      symbol = symbol << 1U | code(1);
      if (symbol >= 0x30 && symbol < 0xC0) symbol -= 0x30;
      else if (symbol >= 0xC0 && symbol < 0xC8) symbol = symbol - 0xC0 + 280;
      else symbol = (symbol << 1U | code(1)) - 0x190 + 144;
    }
    if (symbol < 256) {
      out += static_cast<char>(static_cast<unsigned char>(symbol));
      continue;
    }
    if (symbol == 256) {
      std::uint32_t a = 1, b = 0;
      for (const char c : out) a = (a + static_cast<unsigned char>(c)) % 65521, b = (b + a) % 65521;
      const std::size_t end = (bit + 7) / 8;
      if (end + 4 != in.size() || u32(in, end) != (b << 16U | a)) return std::nullopt;
      return out;
    }
    unsigned length = 258;
    if (symbol < 265) length = symbol - 254;
    else if (symbol < 285) length = (4 + (symbol - 265) % 4) * (1U << ((symbol - 261) / 4)) + 3 + number((symbol - 261) / 4);
    const unsigned d = code(5);
    const unsigned distance = d < 4 ? d + 1 : (2 + d % 2) * (1U << (d / 2 - 1)) + 1 + number(d / 2 - 1);
    if (distance > out.size()) return std::nullopt;
    for (unsigned i = 0; i < length; ++i) out += out[out.size() - distance];
  }
  return std::nullopt;
}

struct Read {
  std::uint32_t width = 0, height = 0;
  unsigned depth = 0, colour = 0;
  std::string rows;  ///< without filters
};
std::optional<Read> read_png(const std::string& png) {
  if (png.compare(0, 8, "\x89PNG\r\n\x1A\n") != 0 || png.compare(12, 4, "IHDR") != 0) return std::nullopt;
  Read r;
  r.width = u32(png, 16), r.height = u32(png, 20);
  r.depth = static_cast<unsigned char>(png[24]), r.colour = static_cast<unsigned char>(png[25]);
  const std::size_t size = u32(png, 33);
  if (png.compare(37, 4, "IDAT") != 0 || png.compare(41 + size + 8, 4, "IEND") != 0) return std::nullopt;
  const std::optional<std::string> data = inflated(std::string_view(png).substr(41, size));
  if (!data) return std::nullopt;
  const unsigned channels[] = {1, 0, 3, 0, 2, 0, 4};
  const std::size_t row = std::size_t{r.width} * channels[r.colour] * r.depth / 8;
  if (data->size() != (row + 1) * r.height) return std::nullopt;
  for (std::size_t y = 0; y < r.height; ++y) {
    std::string line = data->substr(y * (row + 1) + 1, row);
    if ((*data)[y * (row + 1)] == 2)
      for (std::size_t i = 0; i < row; ++i) line[i] = static_cast<char>(line[i] + r.rows[(y - 1) * row + i]);
    r.rows += line;
  }
  return r;
}

constexpr std::size_t most = 1 << 24;

TEST_CASE("an image is a PNG with the same pixels", "[ros2][images]") {
  std::mt19937 random(7);
  for (const unsigned flat : {1U, 7U, 1000U}) {
    std::string pixels;
    char byte = 0;
    for (int i = 0; i < 37 * 3 * 29; ++i) {
      if (random() % flat == 0) byte = static_cast<char>(random());
      pixels += byte;
    }
    const std::optional<Read> read = read_png(png_of({37, 29, 111, "rgb8", false, pixels}, most).value());
    REQUIRE(read);
    CHECK(read->width == 37);
    CHECK(read->height == 29);
    CHECK(read->colour == 2);
    CHECK(read->rows == pixels);
  }
}

TEST_CASE("channels are put in order, padding goes, and 16 bits are in the order of PNG", "[ros2][images]") {
  CHECK(read_png(png_of({1, 2, 5, "bgr8", false, "abc..def.."}, most).value())->rows == "cbafed");
  CHECK(read_png(png_of({1, 1, 4, "bgra8", false, "abcd"}, most).value())->rows == "cbad");
  CHECK(read_png(png_of({2, 1, 4, "mono16", false, "abcd"}, most).value())->rows == "badc");
  CHECK(read_png(png_of({2, 1, 4, "mono16", true, "abcd"}, most).value())->rows == "abcd");
  CHECK(read_png(png_of({2, 1, 2, "bayer_rggb8", false, "ab"}, most).value())->colour == 0);
  std::string metres(16, '\0');
  const float numbers[] = {1.5F, std::numeric_limits<float>::quiet_NaN(), -1.0F, 70.0F};
  std::memcpy(metres.data(), numbers, 16);
  CHECK(read_png(png_of({4, 1, 16, "32FC1", false, metres}, most).value())->rows == std::string("\x05\xDC\0\0\0\0\0\0", 8));
}

TEST_CASE("sizes that contradict each other are no image", "[ros2][images]") {
  const std::string bytes(100, 'x');
  for (const Pixels& p : {Pixels{10, 10, 9, "mono8", false, bytes}, Pixels{10, 11, 10, "mono8", false, bytes},
                          Pixels{0, 10, 10, "mono8", false, bytes}, Pixels{4'000'000'000U, 1, 4'000'000'000U, "mono8", false, bytes},
                          Pixels{2, 4'000'000'000U, 2, "mono8", false, bytes}, Pixels{10, 10, 10, "yuv422", false, bytes}})
    CHECK(png_of(p, most).error().code == Errc::unsupported_syntax);
  CHECK(png_of({10, 10, 10, "mono8", false, bytes}, 99).error().code == Errc::limit_exceeded);
}

TEST_CASE("a grid is grey: free white, occupied black, unknown between, the greatest y first", "[ros2][images]") {
  const std::optional<Read> read = read_png(png_of_grid(2, 2, std::string("\0\x64\xFF\x32", 4), most).value());
  REQUIRE(read);
  CHECK(read->rows == std::string("\xCD\x7F\xFE\0", 4));
  CHECK_FALSE(png_of_grid(3, 2, "12345", most));
  CHECK_FALSE(png_of_grid(65'536, 65'536, "12345", most));
}

TEST_CASE("coordinates of a cloud are float32 in little endian", "[ros2][images]") {
  CloudLayout layout{2, 1, 16, 32, {0, 4, 8}, {false, false, false}, false};
  std::string data(32, '\0');
  const float numbers[] = {1, 2, 3, 9, 4, 5, 6, 9}, expected[] = {1, 2, 3, 4, 5, 6};
  std::memcpy(data.data(), numbers, 32);
  CHECK(coordinates_of(layout, data, most).value() == std::string(reinterpret_cast<const char*>(expected), 24));
  CloudLayout outside = layout;
  outside.offsets[2] = 13;
  CHECK_FALSE(coordinates_of(outside, data, most));
  outside.offsets[2] = 0xFFFFFFFFU;
  CHECK_FALSE(coordinates_of(outside, data, most));
  outside = layout;
  outside.height = 2;
  CHECK_FALSE(coordinates_of(outside, data, most));
  outside = layout;
  outside.row_step = 31;
  CHECK_FALSE(coordinates_of(outside, data, most));
  outside = layout;
  outside.width = outside.height = 0xFFFFFFFFU;
  outside.row_step = 0xFFFFFFFFU;
  CHECK_FALSE(coordinates_of(outside, data, most));
  CHECK(coordinates_of(layout, data, 23).error().code == Errc::limit_exceeded);
  layout.width = 0;
  CHECK(coordinates_of(layout, {}, most).value().empty());
}

}  // namespace
