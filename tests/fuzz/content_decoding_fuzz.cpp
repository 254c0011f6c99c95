// SPDX-License-Identifier: Apache-2.0
// Any bytes as a body in a coding: the result is the same in all pieces and within the limits, and what zlib makes is read.
#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "src/exchange/content_decoder.hpp"

using namespace lrt;
using exchange::ContentDecoder;
using exchange::DecodingLimits;

namespace {

constexpr std::size_t max_bytes = 256 * 1024;
constexpr const char* codings[] = {"gzip", "deflate", "gzip, deflate", "deflate, gzip", "x-gzip, gzip"};

void require(bool condition) {
  if (!condition) std::abort();
}

struct Decoded {
  std::string text, error;
};

Decoded decode(const char* coding, std::string_view bytes, std::size_t size) {
  http::Fields fields;
  fields.add("Content-Encoding", coding);
  DecodingLimits limits;
  limits.max_bytes = max_bytes;
  const auto decoder = ContentDecoder::make(fields, limits).value();
  Decoded result;
  const auto sink = [&](std::string_view part) {
    result.text += part;
    return true;
  };
  const std::size_t all = bytes.size();
  for (; !bytes.empty(); bytes.remove_prefix(std::min(size, bytes.size()))) {
    const std::string copy(bytes.substr(0, size));
    if (const Result<bool> goes_on = decoder->decode(copy, sink); !goes_on) {
      result.error = goes_on.error().message;
      break;
    }
  }
  require(result.text.size() <= max_bytes && result.text.size() <= 64 * 1024 + 201 * all);
  if (result.error.empty())
    if (const Result<void> finished = decoder->finish(); !finished) result.error = finished.error().message;
  return result;
}

std::string compress(std::string_view text, int window) {
  z_stream stream{};
  require(deflateInit2(&stream, 1, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string result(deflateBound(&stream, text.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  require(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  result.resize(result.size() - stream.avail_out);
  deflateEnd(&stream);
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const char* const coding = codings[data[0] % 5];
  const std::size_t piece = 1U + data[0] / 5U;
  const Decoded whole = decode(coding, bytes, bytes.size() + 1), pieces = decode(coding, bytes, piece);
  // Where it is not valid, and at which limit it ends, may be found later or earlier in pieces; whether it is, not.
  const bool at_limit = whole.error.find("decoded, is") != std::string::npos || pieces.error.find("decoded, is") != std::string::npos;
  require(at_limit || (whole.error.empty() == pieces.error.empty() && (!whole.error.empty() || whole.text == pieces.text)));
  if (bytes.size() > 1'000) return 0;
  require(decode("gzip", compress(bytes, MAX_WBITS + 16), piece).text == bytes);
  require(decode("deflate", compress(bytes, MAX_WBITS), piece).text == bytes);
  // What begins like the header of zlib is taken for it.
  const std::string raw = compress(bytes, -MAX_WBITS);
  const unsigned first = static_cast<unsigned char>(raw[0]), second = static_cast<unsigned char>(raw[1]);
  if ((first & 0x0FU) != 8 || (first * 256 + second) % 31 != 0) require(decode("deflate", raw, piece).text == bytes);
  return 0;
}
