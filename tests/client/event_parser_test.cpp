// SPDX-License-Identifier: Apache-2.0
#include "src/client/event_parser.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

namespace lrt {
namespace {

using client::EventParser;
using client::StreamEvent;

struct Parsed {
  std::vector<std::string> data, ids, types;
  bool goes_on = true;
};

/// In pieces of `size` bytes.
Parsed parse(std::string_view text, std::size_t size, EventParser& parser) {
  Parsed result;
  while (!text.empty() && result.goes_on) {
    result.goes_on = parser.parse(text.substr(0, size), [&](StreamEvent&& event) {
      result.data.push_back(event.data);
      result.ids.push_back(event.id);
      result.types.push_back(event.type);
      return true;
    });
    text.remove_prefix(std::min(size, text.size()));
  }
  return result;
}

Parsed parse(std::string_view text) {
  EventParser parser(1000);
  Parsed whole = parse(text, text.size(), parser);
  for (std::size_t size = 1; size < text.size(); ++size) {
    EventParser again(1000);
    const Parsed pieces = parse(text, size, again);
    CHECK(pieces.data == whole.data);
    CHECK(pieces.ids == whole.ids);
    CHECK(pieces.types == whole.types);
  }
  return whole;
}

using Strings = std::vector<std::string>;

TEST_CASE("an event stream is the same in all pieces and with all line ends", "[client][R0.16]") {
  for (const char* const end : {"\n", "\r", "\r\n"}) {
    std::string text = "id: \"a\"\ndata: one\ndata: two\n\n: comment\n\ndata:three\ndata\ndata:  four\n\n";
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += std::string(end).size()) text.replace(at, 1, end);
    const Parsed parsed = parse(text);
    CHECK(parsed.data == Strings{"one\ntwo", "three\n\n four"});
    CHECK(parsed.ids == Strings{"\"a\"", "\"a\""});
    CHECK(parsed.types == Strings{"message", "message"});
  }
}

TEST_CASE("a byte order mark is skipped at the beginning only", "[client]") {
  CHECK(parse("\xEF\xBB\xBF"
              "data: a\n\n")
            .data == Strings{"a"});
  CHECK(parse("\xEF\xBB\xBF\xEF\xBB\xBF"
              "data: a\n\ndata: b\n\n")
            .data == Strings{"b"});
  CHECK(parse("\xEF\xBB"
              "data: a\n\n")
            .data.empty());
}

TEST_CASE("an event without data is none, and one without its empty line is incomplete", "[client]") {
  CHECK(parse("event: x\nid: 1\n\n").data.empty());
  CHECK(parse("data: a\n").data.empty());
  CHECK(parse("data\n\n").data == Strings{""});
  const Parsed parsed = parse("event: x\n\nid: 7\n\ndata: b\n\n");  // the type is forgotten, the id is not
  CHECK(parsed.types == Strings{"message"});
  CHECK(parsed.ids == Strings{"7"});
}

TEST_CASE("unknown fields, and an id with a NUL, are left out", "[client][R1.6]") {
  const std::string text = std::string("id: 1\nid: a") + '\0' + "b\nDATA: x\ndata : y\nfoo\ndata: z\n\n";
  const Parsed parsed = parse(text);
  CHECK(parsed.data == Strings{"z"});
  CHECK(parsed.ids == Strings{"1"});
}

TEST_CASE("retry is a number of milliseconds", "[client]") {
  const auto retry_of = [](const std::string& text) {
    EventParser parser(1000);
    parse(text, text.size(), parser);
    return parser.retry();
  };
  CHECK(retry_of("retry: 250\n") == std::chrono::milliseconds(250));
  CHECK(retry_of("retry: 99999999999999999999999\n") == std::chrono::hours(1));
  for (const char* const bad : {"retry: \n", "retry: -1\n", "retry: 1.5\n", "retry: 1s\n", "retry\n"}) CHECK_FALSE(retry_of(bad));
}

TEST_CASE("a long line and a long event end an event stream", "[client]") {
  EventParser line(100);
  CHECK_FALSE(parse("data: " + std::string(200, 'x'), 7, line).goes_on);
  CHECK(line.is_too_long());
  EventParser comment(100);
  CHECK_FALSE(parse(":" + std::string(200, 'x'), 1000, comment).goes_on);
  EventParser event(100);
  std::string text;
  for (int i = 0; i < 30; ++i) text += "data: 0123456789\n";
  CHECK_FALSE(parse(text, 50, event).goes_on);
  CHECK(event.is_too_long());
  EventParser fits(100);
  CHECK(parse("data: " + std::string(100, 'x') + "\n\n", 7, fits).data.size() == 1);
}

TEST_CASE("who reads an event stream can stop it", "[client]") {
  EventParser parser(1000);
  int count = 0;
  CHECK_FALSE(parser.parse("data: a\n\ndata: b\n\n", [&](StreamEvent&&) { return ++count < 1; }));
  CHECK(count == 1);
  CHECK_FALSE(parser.is_too_long());
}

}  // namespace
}  // namespace lrt
