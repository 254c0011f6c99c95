// SPDX-License-Identifier: Apache-2.0
// Any bytes as the response of a server: the result is the same in all pieces, within the limits, and bytes that do not belong to it are left.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "src/http/response_parser.hpp"

using namespace lrt;
using Step = http::ResponseParser::Step;

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

http::ResponseLimits limits() {
  http::ResponseLimits result;
  result.max_status_line_bytes = 64;
  result.max_header_bytes = 512;
  result.max_fields = 16;
  result.max_interim = 3;
  result.max_body_bytes = 256;
  result.max_chunk_line_bytes = 48;
  result.max_chunk_extension_bytes = 64;
  result.max_trailer_bytes = 128;
  return result;
}

struct Parsed {
  std::string text, error;  ///< all that was found
  std::size_t consumed = 0;
  bool is_complete = false;
};

Parsed parse(std::string_view bytes, std::size_t size, std::string_view method, bool may_switch) {
  const http::ResponseLimits limits = ::limits();
  http::ResponseParser parser(method, limits, may_switch);
  Parsed result;
  std::size_t body = 0, interim = 0;
  bool has_header = false;
  /// False: it is over.
  const auto take = [&](Step step) {
    switch (step) {
      case Step::more: return true;
      case Step::interim:
        require(!has_header && parser.status() >= 100 && parser.status() < 200 && ++interim <= limits.max_interim);
        result.text += "interim " + parser.fields().block();
        return true;
      case Step::header:
        require(!has_header && (parser.status() >= 200 || (parser.status() == 101 && may_switch)) && parser.status() < 1'000);
        require(parser.fields().block().size() <= limits.max_header_bytes + 2 * limits.max_fields);  // ": " where there was no space
        has_header = true;
        result.text += std::to_string(parser.status()) + " " + parser.fields().block() + "\r\n";
        return true;
      case Step::body:
        require(has_header && parser.has_body() && !parser.body().empty());
        body += parser.body().size();
        require(body <= *limits.max_body_bytes);
        result.text += parser.body();
        return true;
      case Step::complete:
        require(has_header);
        require(parser.trailers().block().size() <= limits.max_trailer_bytes + 2 * limits.max_fields);
        result.text += parser.trailers().block() + (parser.keeps_connection() ? "keep" : "close");
        result.is_complete = true;
        return false;
      case Step::failed: break;
    }
    result.error = parser.error().message;
    require(!result.error.empty() && !parser.keeps_connection());
    require(std::all_of(result.error.begin(), result.error.end(), [](char c) { return c >= ' ' && c <= '~'; }));
    return false;
  };
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    const std::string copy(bytes.substr(at, size));  // a view that is kept is seen
    std::string_view rest = copy;
    Step step;
    do {
      step = parser.parse(rest);
      if (take(step)) continue;
      result.consumed = at + copy.size() - rest.size();
      return result;
    } while (step != Step::more);
    require(rest.empty());
  }
  result.consumed = bytes.size();
  require(!take(parser.end()));
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string_view method = (data[0] & 0x80U) != 0 ? "HEAD" : "GET";
  const bool may_switch = (data[0] & 0x40U) != 0;
  const Parsed whole = parse(bytes, bytes.size() + 1, method, may_switch), pieces = parse(bytes, 1U + data[0] % 32U, method, may_switch);
  require(whole.is_complete == pieces.is_complete);  // which of two faults is found first may differ
  if (!whole.is_complete) return 0;
  require(whole.consumed == pieces.consumed && whole.text == pieces.text);
  // What follows is not read.
  const std::string more = std::string(bytes.substr(0, whole.consumed));
  if (whole.consumed < bytes.size()) require(parse(more, more.size() + 1, method, may_switch).text == whole.text);
  return 0;
}
