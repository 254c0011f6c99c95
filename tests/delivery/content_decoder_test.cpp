// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/content_decoder.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "tests/delivery/compress.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using exchange::ContentDecoder;
using exchange::DecodingLimits;
using test::Coded;
using test::compress;

namespace {

http::Fields coded(std::string_view value) {
  http::Fields fields;
  fields.add("Content-Encoding", value);
  return fields;
}

/// The text, or "error: " and its message.
std::string decode(std::string_view codings, std::string_view bytes, std::size_t piece, const DecodingLimits& limits = {}) {
  Result<std::unique_ptr<ContentDecoder>> decoder = ContentDecoder::make(coded(codings), limits);
  if (!decoder) return "error: " + decoder.error().message;
  REQUIRE(*decoder != nullptr);
  std::string text;
  const auto sink = [&](std::string_view part) {
    text += part;
    return true;
  };
  for (; !bytes.empty(); bytes.remove_prefix(std::min(piece, bytes.size()))) {
    const std::string copy(bytes.substr(0, piece));
    const Result<bool> goes_on = (*decoder)->decode(copy, sink);
    if (!goes_on) return "error: " + goes_on.error().message;
  }
  const Result<void> finished = (*decoder)->finish();
  return finished ? text : "error: " + finished.error().message;
}

std::string long_text() {
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += "<joint" + std::to_string(i) + "> a <Joint> .\n";
  return text;
}

}  // namespace

TEST_CASE("gzip and deflate are decoded in all pieces", "[delivery]") {
  const std::string text = long_text();
  for (const std::size_t piece : {std::size_t{1}, std::size_t{1'000}, std::size_t{10'000'000}}) {
    CHECK(decode("gzip", compress(text), piece) == text);
    CHECK(decode("x-gzip", compress(""), piece).empty());
    CHECK(decode("deflate", compress(text, Coded::zlib), piece) == text);
    CHECK(decode("deflate", compress(text, Coded::raw), piece) == text);
    CHECK(decode("gzip", compress(text) + compress("and more") + std::string(512, '\0'), piece) == text + "and more");
    CHECK(decode("deflate, identity, GZip", compress(compress(text, Coded::raw)), piece) == text);
    CHECK(decode("gzip", compress(text) + "garbage", piece) == "error: its response has bytes after the end of its gzip body");
    CHECK(decode("deflate", compress(text, Coded::zlib) + "x", piece) == "error: its response has bytes after the end of its deflate body");
    const std::string half = compress(text).substr(0, 5'000);
    CHECK(decode("gzip", half, piece) == "error: its gzip body is incomplete");
    CHECK(decode("gzip", "hello, world", piece) == "error: its body is not valid gzip: incorrect header check");
  }
  CHECK(decode("deflate", "\x78", 1) == "error: its deflate body is incomplete");
  CHECK(decode("gzip", "", 1).empty());
}

TEST_CASE("a body without a coding needs no decoder", "[delivery]") {
  CHECK(ContentDecoder::make({}, {}).value() == nullptr);
  CHECK(ContentDecoder::make(coded("identity, Identity"), {}).value() == nullptr);
  CHECK(ContentDecoder::make(coded("zstd"), {}).error().code == Errc::expected_http);
}

TEST_CASE("a bomb ends at the limit of its size or its ratio", "[delivery][security]") {
  const std::string zeros(50'000'000, '\0');
  const auto start = [](const std::string& text) { return text.substr(0, 100); };  // what a failure shows
  DecodingLimits limits;
  limits.max_bytes = 1'000'000;
  limits.max_ratio = 2'000;
  CHECK(start(decode("gzip", compress(zeros), 4'096, limits)) == "error: its response, decoded, is longer than 1000000 bytes");
  // The bytes between two codings count, too: these decode to 50 MB that are no gzip.
  CHECK(decode("gzip, gzip", compress(zeros), 4'096, limits).find("error: ") == 0);
  limits = {};
  CHECK(start(decode("gzip", compress(zeros), 4'096, limits)) == "error: its response, decoded, is more than 200 times as long");
  CHECK(start(decode("gzip, gzip", compress(compress(zeros)), 4'096, limits)) == "error: its response, decoded, is more than 200 times as long");
  CHECK(decode("gzip, gzip, gzip", "", 1, limits) == "error: its response has more than 2 codings: \"gzip, gzip, gzip\"");
  // What is short may be dense.
  CHECK((decode("gzip", compress(zeros.substr(0, 60'000)), 4'096, limits) == zeros.substr(0, 60'000)));
}

TEST_CASE("the one who takes the bytes may end decoding", "[delivery]") {
  auto decoder = ContentDecoder::make(coded("gzip"), {}).value();
  std::size_t calls = 0;
  const auto sink = [&](std::string_view) { return ++calls < 3; };
  CHECK_FALSE(decoder->decode(compress(long_text()), sink).value());
  CHECK(calls == 3);
}
