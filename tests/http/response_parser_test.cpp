// SPDX-License-Identifier: Apache-2.0
#include "src/http/response_parser.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/odd_responses.hpp"

using namespace lrt;
using http::ResponseLimits;
using http::ResponseParser;
using Step = http::ResponseParser::Step;

namespace {

ResponseLimits limits() {
  ResponseLimits result;
  result.max_body_bytes = 64 * 1024;
  return result;
}

struct Parsed {
  int status = 0, version = 0;
  std::string fields, trailers, body, error, rest;
  Errc code{};
  std::vector<int> interim;
  bool keeps = false, is_complete = false;

  bool operator==(const Parsed& other) const {
    return status == other.status && version == other.version && fields == other.fields && trailers == other.trailers && body == other.body &&
           error == other.error && code == other.code && interim == other.interim && keeps == other.keeps && is_complete == other.is_complete;
  }
};

/// @param sizes  of the parts in which the bytes arrive, in turn
Parsed parse(std::string_view bytes, const std::vector<std::size_t>& sizes, std::string_view method = "GET", bool may_switch = false,
             const ResponseLimits& with = limits()) {
  ResponseParser parser(method, with, may_switch);
  Parsed result;
  bool has_header = false;
  const auto take = [&](Step step) {
    if (step == Step::interim) result.interim.push_back(parser.status());
    if (step == Step::header) {
      result.status = parser.status();
      result.version = parser.version();
      result.fields = parser.fields().block();
      has_header = true;
    }
    if (step == Step::body) {
      CHECK(has_header);
      CHECK_FALSE(parser.body().empty());
      result.body += parser.body();
    }
    if (step == Step::complete) {
      result.is_complete = true;
      result.trailers = parser.trailers().block();
      result.keeps = parser.keeps_connection();
    }
    if (step == Step::failed) {
      result.error = parser.error().message;
      result.code = parser.error().code;
    }
    return step == Step::complete || step == Step::failed;
  };
  for (std::size_t part = 0; !bytes.empty(); ++part) {
    // A copy, so that a view into bytes that are gone is seen.
    const std::string copy(bytes.substr(0, sizes[part % sizes.size()]));
    bytes.remove_prefix(copy.size());
    std::string_view some = copy;
    while (true) {
      const Step step = parser.parse(some);
      if (take(step)) {
        result.rest = std::string(some) + std::string(bytes);
        return result;
      }
      if (step == Step::more) break;
    }
    CHECK(some.empty());
  }
  take(parser.end());
  return result;
}

const std::vector<std::size_t> at_once{1'000'000}, by_byte{1};

}  // namespace

TEST_CASE("valid responses are read in all pieces", "[http]") {
  for (const test::OddResponse& odd : test::odd_responses()) {
    INFO(odd.name);
    const Parsed whole = parse(odd.bytes, at_once);
    CHECK(whole.error.empty());
    CHECK(whole.is_complete);
    CHECK(whole.status == odd.status);
    CHECK(whole.rest.empty());
    if (whole.fields.find("Content-Encoding") == std::string::npos) CHECK(whole.body == odd.body);
    CHECK(parse(odd.bytes, by_byte) == whole);
    const std::size_t step = odd.bytes.size() > 1'000 ? 97 : 1;
    for (std::size_t at = 1; at < odd.bytes.size(); at += step) CHECK(parse(odd.bytes, {at, odd.bytes.size()}) == whole);
    // Without its last byte it is incomplete, unless it lasts until the end of the connection.
    const Parsed cut = parse(std::string_view(odd.bytes).substr(0, odd.bytes.size() - 1), at_once);
    CHECK((cut.is_complete || cut.code == Errc::closed));
  }
}

TEST_CASE("invalid responses have their own message, in all pieces", "[http][security]") {
  std::vector<std::string> messages;
  for (const test::BadResponse& bad : test::bad_responses()) {
    if (bad.bytes.find("Content-Encoding") != std::string::npos) continue;
    INFO(bad.name);
    const Parsed whole = parse(bad.bytes, at_once);
    CAPTURE(whole.error);
    CHECK_FALSE(whole.is_complete);
    CHECK(whole.error.find(bad.says) != std::string::npos);
    CHECK(std::all_of(whole.error.begin(), whole.error.end(), [](char c) { return c >= ' ' && c <= '~'; }));
    const Parsed pieces = parse(bad.bytes, by_byte);
    CHECK(pieces.code == whole.code);
    if (whole.error.find("begins with") == std::string::npos) CHECK(pieces.error == whole.error);
  }
}

TEST_CASE("fields are those of the final response, and trailers are apart", "[http]") {
  const Parsed found = parse(
      "HTTP/1.1 103 Early Hints\r\nLink: <a>; rel=preload\r\n\r\nHTTP/1.1 200 OK\r\nA: 1\r\n first\r\nBad Name: x\r\n left out\r\n: y\r\na: "
      "2\r\nB:\r\n"
      "Transfer-Encoding: chunked\r\n\r\n1\r\nx\r\n0\r\nA: 3\r\nConnection: close\r\n\r\n",
      by_byte);
  CHECK(found.interim == std::vector<int>{103});
  CHECK(found.fields == "A: 1 first\r\na: 2\r\nTransfer-Encoding: chunked\r\n");
  CHECK(found.trailers == "A: 3\r\nConnection: close\r\n");
  CHECK_FALSE(found.keeps);  // a line was left out
}

TEST_CASE("a response has no body by its status or by the request's method", "[http]") {
  const std::string length = "Content-Length: 5\r\n\r\nnext";
  for (const char* const status : {"204 No Content", "304 Not Modified"}) {
    const Parsed found = parse("HTTP/1.1 " + std::string(status) + "\r\n" + length, at_once);
    CHECK(found.is_complete);
    CHECK(found.body.empty());
    CHECK(found.rest == "next");
    CHECK(found.keeps == (found.status == 304));
  }
  CHECK(parse("HTTP/1.1 200 OK\r\n" + length, at_once, "HEAD").rest == "next");
  CHECK(parse("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nnext", at_once, "HEAD").rest == "next");
  CHECK(parse("HTTP/1.1 200 OK\r\n\r\n", at_once, "HEAD").keeps);
}

TEST_CASE("101 is final where the request asked for it", "[http]") {
  const std::string bytes = "HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n\r\n\x81\x01x";
  const Parsed found = parse(bytes, at_once, "GET", true);
  CHECK(found.status == 101);
  CHECK(found.interim == std::vector<int>{103});
  CHECK(found.rest == "\x81\x01x");
  CHECK(parse(bytes, at_once).code == Errc::expected_http);
}

TEST_CASE("a connection is kept after HTTP/1.1 without close", "[http]") {
  const std::string rest = " 200 OK\r\nContent-Length: 0\r\n";
  CHECK(parse("HTTP/1.1" + rest + "\r\n", at_once).keeps);
  CHECK(parse("HTTP/1.1" + rest + "Connection: keep-alive, upgrade\r\n\r\n", at_once).keeps);
  CHECK_FALSE(parse("HTTP/1.0" + rest + "\r\n", at_once).keeps);
  CHECK_FALSE(parse("HTTP/1.1" + rest + "Connection: x , Close\r\n\r\n", at_once).keeps);
  CHECK_FALSE(parse("HTTP/1.1" + rest + "Connection: x\r\nConnection: close\r\n\r\n", at_once).keeps);
}

TEST_CASE("a body without a limit has a length of at most 63 bits", "[http]") {
  const ResponseLimits none;
  CHECK(parse("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n8000000000000000\r\nx", at_once, "GET", false, none).code ==
        Errc::limit_exceeded);
  CHECK(parse("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n7000000000000000\r\nx", at_once, "GET", false, none).body == "x");
  CHECK(parse("HTTP/1.1 200 OK\r\nContent-Length: 9999999999999999999\r\n\r\nx", at_once, "GET", false, none).code == Errc::limit_exceeded);
}

TEST_CASE("extensions are limited beyond the size of the body, so that a long stream may have them", "[http]") {
  std::string bytes = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 3'000; ++i) bytes += "10;name=value\r\n0123456789abcdef\r\n";
  CHECK(parse(bytes + "0\r\n\r\n", at_once).is_complete);
}

TEST_CASE("what a server must not send is named, also where it is read", "[http]") {
  const auto tolerated = [](std::string bytes) {
    ResponseParser parser("GET", limits());
    parser.read_chunks_despite_length();
    std::string_view rest = bytes;
    Step step = Step::more;
    do step = parser.parse(rest);
    while (step != Step::more && step != Step::complete && step != Step::failed);
    CHECK(step == Step::complete);
    return parser.tolerated();
  };
  const std::string length = "Content-Length: 0\r\n";
  CHECK(tolerated("HTTP/1.1 200 \r\n" + length + "\r\n").empty());
  CHECK(tolerated("HTTP/1.1 200\r\n" + length + "\r\n").find("no space after the code") != std::string::npos);
  CHECK(tolerated("HTTP/1.1 200 OK\r\n" + length + "A: b\r\n c\r\n\r\n").find("a folded line: \" c\"") != std::string::npos);
  CHECK(tolerated("HTTP/1.1 200 OK\r\n" + length + "A b: c\r\n\r\n").find("a line that is no field: \"A b: c\"") != std::string::npos);
  CHECK(tolerated("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n" + length + "\r\n1\r\nx\r\n0\r\n\r\n").find("are both there") !=
        std::string::npos);
  CHECK(tolerated("HTTP/1.1 200 OK\r\n" + length + length + "\r\n").find("Content-Length is there twice") != std::string::npos);
}
