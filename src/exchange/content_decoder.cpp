// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/content_decoder.hpp"

#include <zlib.h>

#include <algorithm>
#include <climits>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"

namespace lrt::exchange {
namespace {

using lrt::detail::iequals_ascii;

constexpr std::uint64_t free_bytes = 64 * 1024;  // that the ratio does not count
constexpr std::size_t buffer_bytes = 16 * 1024;  // not on the stack, whose size a host may choose
std::string words(std::string_view found) { return quoted_ascii(found, 60); }

const char* name_of(bool is_gzip) noexcept { return is_gzip ? "gzip" : "deflate"; }

/// RFC 1950 2.2. Many servers send deflate without this header, which RFC 9110 8.4.1.2 calls an error of theirs.
bool has_zlib_header(unsigned first, unsigned second) noexcept {
  return (first & 0x0FU) == 8 && (first >> 4U) <= 7 && (first * 256 + second) % 31 == 0;
}

}  // namespace

Result<std::unique_ptr<ContentDecoder>> ContentDecoder::make(const http::Fields& fields, const DecodingLimits& limits) {
  std::unique_ptr<ContentDecoder> result;
  const std::string all = fields.joined("Content-Encoding");
  for (std::string_view list = all; !list.empty();) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const std::string_view name = lrt::detail::trim(list.substr(0, comma));
    list.remove_prefix(std::min(comma + 1, list.size()));
    if (name.empty() || iequals_ascii(name, "identity")) continue;
    const bool is_gzip = iequals_ascii(name, "gzip") || iequals_ascii(name, "x-gzip");
    if (!is_gzip && !iequals_ascii(name, "deflate"))
      return unexpected(Errc::expected_http, "its response has the Content-Encoding " + words(name) + ", expected gzip, deflate or identity");
    if (!result) result.reset(new ContentDecoder(limits));
    if (result->stages_.size() >= limits.max_codings)
      return unexpected(Errc::limit_exceeded, "its response has more than " + std::to_string(limits.max_codings) + " codings: " + words(all));
    Stage stage;
    stage.coding = is_gzip ? Coding::gzip : Coding::deflate;
    result->stages_.insert(result->stages_.begin(), std::move(stage));
  }
  return result;
}

ContentDecoder::ContentDecoder(const DecodingLimits& limits) : limits_(limits) {}

ContentDecoder::~ContentDecoder() {
  for (const Stage& stage : stages_)
    if (stage.stream) ::inflateEnd(stage.stream.get());
}

/// @param bytes  the first ones, two for deflate
Result<void> ContentDecoder::begin(Stage& stage, std::string_view bytes) {
  stage.is_begun = true;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[at])); };
  constexpr int of_gzip = 16;  // added to the size of the window: the header of gzip; negative: no header
  const int window = stage.coding == Coding::gzip ? MAX_WBITS + of_gzip : has_zlib_header(byte(0), byte(1)) ? MAX_WBITS : -MAX_WBITS;
  if (stage.stream) {
    ::inflateReset2(stage.stream.get(), window);
    return {};
  }
  auto stream = std::make_unique<z_stream>();
  if (::inflateInit2(stream.get(), window) != Z_OK) return unexpected(Errc::io_error, "zlib: out of memory");
  stage.stream = std::move(stream);
  stage.decoded_bytes.reset(new char[buffer_bytes]);
  return {};
}

Result<bool> ContentDecoder::decode(std::string_view bytes, Sink sink) {
  received_ += bytes.size();
  return decode(0, bytes, sink);
}

Result<bool> ContentDecoder::decode(std::size_t at, std::string_view bytes, Sink sink) {
  if (at == stages_.size()) return bytes.empty() || sink(bytes);
  Stage& stage = stages_[at];
  const char* const name = name_of(stage.coding == Coding::gzip);
  std::string joined;
  while (!bytes.empty()) {
    if (stage.is_at_end) {
      // A file of gzip may have several members (RFC 1952 2.2), and zeros as padding.
      if (bytes.front() == '\0') {
        bytes.remove_prefix(1);
        continue;
      }
      if (stage.coding != Coding::gzip || bytes.front() != '\x1F')
        return unexpected(Errc::expected_http, "its response has bytes after the end of its " + std::string(name) + " body");
      stage.is_begun = stage.is_at_end = false;
    }
    if (!stage.is_begun) {
      if (stage.coding == Coding::deflate && stage.begin.size() + bytes.size() < 2) {
        stage.begin += bytes;
        return true;
      }
      if (!stage.begin.empty()) {
        joined = std::exchange(stage.begin, {}).append(bytes);
        bytes = joined;
      }
      if (Result<void> begun = begin(stage, bytes); !begun) return unexpected(std::move(begun).error());
    }
    z_stream& stream = *stage.stream;
    const std::size_t size = std::min<std::size_t>(bytes.size(), INT_MAX);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));  // zlib does not change it
    stream.avail_in = static_cast<uInt>(size);
    int outcome = Z_OK;
    do {
      stream.next_out = reinterpret_cast<Bytef*>(stage.decoded_bytes.get());
      stream.avail_out = static_cast<uInt>(buffer_bytes);
      outcome = ::inflate(&stream, Z_NO_FLUSH);
      if (outcome != Z_OK && outcome != Z_STREAM_END && outcome != Z_BUF_ERROR) {
        const std::string reason = outcome == Z_NEED_DICT ? "it needs a dictionary" : stream.msg != nullptr ? stream.msg : "zlib fails";
        return unexpected(Errc::expected_http, "its body is not valid " + std::string(name) + ": " + reason);
      }
      const std::size_t count = buffer_bytes - stream.avail_out;
      stage.decoded_size += count;
      if (limits_.max_bytes && stage.decoded_size > *limits_.max_bytes)
        return unexpected(Errc::limit_exceeded, "its response, decoded, is longer than " + std::to_string(*limits_.max_bytes) + " bytes");
      if (stage.decoded_size > free_bytes && (stage.decoded_size - free_bytes) / limits_.max_ratio > received_)
        return unexpected(Errc::limit_exceeded, "its response, decoded, is more than " + std::to_string(limits_.max_ratio) + " times as long");
      if (count > 0) {
        Result<bool> goes_on = decode(at + 1, {stage.decoded_bytes.get(), count}, sink);
        if (!goes_on || !*goes_on) return goes_on;
      }
    } while (outcome == Z_OK && stream.avail_out == 0);
    bytes.remove_prefix(size - stream.avail_in);
    if (outcome == Z_STREAM_END) stage.is_at_end = true;
  }
  return true;
}

Result<void> ContentDecoder::finish() const {
  if (received_ == 0) return {};  // a response without content may have the field all the same
  for (const Stage& stage : stages_)
    if (!stage.is_at_end) return unexpected(Errc::expected_http, "its " + std::string(name_of(stage.coding == Coding::gzip)) + " body is incomplete");
  return {};
}

}  // namespace lrt::exchange
