// SPDX-License-Identifier: Apache-2.0
#include "src/http/range.hpp"

#include "tests/support/catch.hpp"

using lrt::http::ByteRange;
using lrt::http::parse_range;
using Kind = ByteRange::Kind;

TEST_CASE("a byte range selects part of a representation", "[http][R0.6]") {
  struct {
    const char* field;
    Kind kind;
    std::size_t first, length;
  } const cases[] = {
      {"bytes=0-0", Kind::part, 0, 1},
      {"bytes=0-9", Kind::part, 0, 10},
      {"bytes=3-5", Kind::part, 3, 3},
      {"bytes=8-", Kind::part, 8, 2},
      {"bytes=0-99", Kind::part, 0, 10},
      {"bytes=-3", Kind::part, 7, 3},
      {"bytes=-99", Kind::part, 0, 10},
      {"Bytes=1-1", Kind::part, 1, 1},
      {"bytes=9-99999999999999999999999", Kind::part, 9, 1},
      {"bytes=10-", Kind::unsatisfiable, 0, 0},
      {"bytes=-0", Kind::unsatisfiable, 0, 0},
      {"bytes=99999999999999999999999-", Kind::unsatisfiable, 0, 0},
  };
  for (const auto& c : cases) {
    CAPTURE(c.field);
    const ByteRange range = parse_range(c.field, 10);
    CHECK(range.kind == c.kind);
    CHECK(range.first == c.first);
    CHECK(range.length == c.length);
  }
  CHECK(parse_range("bytes=0-", 0).kind == Kind::unsatisfiable);
}

TEST_CASE("a range that is malformed, of another unit, or not the only one is ignored", "[http][R0.6]") {
  for (const char* field : {"", "bytes", "bytes=", "bytes=-", "bytes=5-3", "bytes=a-b", "bytes=1 - 2", "bytes=0-1,3-4", "lines=1-2", "bytes=+1-2"}) {
    CAPTURE(field);
    CHECK(parse_range(field, 10).kind == Kind::whole);
  }
}
