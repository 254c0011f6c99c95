// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

TEST_CASE("GET with Range gives part of the representation, 416 what lies beyond it", "[engine][R0.6]") {
  Bench bench;
  bench.add(Thing{"arm"});
  const Answer whole = bench.get("/arm");
  REQUIRE(whole.status == 200);
  CHECK(whole.field("Accept-Ranges") == "bytes");
  const std::string size = std::to_string(whole.body.size());

  const Answer part = bench.send("GET /arm\nRange: bytes=1-7").answer;
  CHECK(part.status == 206);
  CHECK(part.body == whole.body.substr(1, 7));
  CHECK(part.field("Content-Range") == "bytes 1-7/" + size);
  CHECK(part.field("ETag") == whole.field("ETag"));

  const Answer beyond = bench.send("GET /arm\nRange: bytes=" + size + "-").answer;
  CHECK(beyond.status == 416);
  CHECK(beyond.field("Content-Range") == "bytes */" + size);

  CHECK(bench.send("GET /arm\nRange: bytes=0-1,3-4").answer.body == whole.body);
  CHECK(bench.send("HEAD /arm\nRange: bytes=0-1").answer.status == 200);
  CHECK(bench.send("GET /arm\nRange: bytes=0-1\nIf-Range: \"another\"").answer.status == 200);
  CHECK(bench.send("GET /arm\nRange: bytes=0-1\nIf-Range: " + std::string(whole.field("ETag"))).answer.status == 206);
}
