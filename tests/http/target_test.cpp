// SPDX-License-Identifier: Apache-2.0
#include "src/http/target.hpp"

#include "tests/support/catch.hpp"

using namespace lrt;
using namespace std::literals;

TEST_CASE("a target is split into authority, path and query", "[http][R0.1]") {
  const auto origin = http::split_target("/a/b?c?d=/");
  REQUIRE(origin);
  CHECK(origin->path == "/a/b");
  CHECK(origin->query == "c?d=/");
  CHECK(origin->authority.empty());
  CHECK_FALSE(origin->absolute);
  const auto absolute = http::split_target("HttpS://r.example:8443/x?");
  REQUIRE(absolute);
  CHECK((absolute->absolute && absolute->secure));
  CHECK(absolute->authority == "r.example:8443");
  CHECK(absolute->path == "/x");
  CHECK(absolute->query.empty());
  const auto bare = http::split_target("http://r?q");
  REQUIRE(bare);
  CHECK(bare->path == "/");
  CHECK(bare->query == "q");
  CHECK_FALSE(bare->secure);
  CHECK(http::split_target("//r/x")->path == "//r/x");
  CHECK(http::split_target("*")->path == "*");
  for (const char* bad : {"", "a", "**", "r:80", "http:", "http://", "http:///", "http://u@r/", "ws://r/", "httpx://r/"}) {
    CAPTURE(bad);
    CHECK_FALSE(http::split_target(bad));
  }
}

TEST_CASE("a host is split from its port", "[http][R0.1]") {
  CHECK(http::parse_host("robot.example")->host == "robot.example");
  CHECK_FALSE(http::parse_host("robot.example")->port);
  CHECK(http::parse_host("robot:080")->port == 80);
  CHECK_FALSE(http::parse_host("robot:")->port);
  CHECK(http::parse_host("127.0.0.1:0")->port == 0);
  CHECK(http::parse_host("[::1]:80")->host == "[::1]");
  CHECK(http::parse_host("[::1]:80")->port == 80);
  for (const char* good : {"[::]", "[1::]", "[1:2:3:4:5:6:7:8]", "[::ffff:127.0.0.1]", "[1:2:3:4:5:6:1.2.3.4]", "[fe80::1:2]", "[1::3:4:5:6:7:8]"}) {
    CAPTURE(good);
    CHECK(http::parse_host(good));
  }
  for (const char* bad : {"",
                          ":",
                          ":80",
                          "u@r",
                          "u:p@r",
                          "r/",
                          "r?",
                          "r#",
                          "r,s",
                          "r s",
                          "r\\",
                          "r:80x",
                          "r:+80",
                          "r:99999",
                          "r:000080",
                          "[",
                          "[]",
                          "[:]",
                          "[:1]",
                          "[1:]",
                          "[:::]",
                          "[1::2::3]",
                          "[1:2:3:4:5:6:7]",
                          "[1:2:3:4:5:6:7:8:9]",
                          "[12345::]",
                          "[g::]",
                          "[::1.2.3]",
                          "[::1.2.3.256]",
                          "[::01.2.3.4]",
                          "[1:2:3:4:5:6:7:1.2.3.4]",
                          "[::1]x",
                          "[::1%25eth0]",
                          "[v1.a]",
                          "[1:2:3:4::5:6:7:8]"}) {
    CAPTURE(bad);
    CHECK_FALSE(http::parse_host(bad));
  }
}
