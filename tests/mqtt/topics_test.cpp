// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/topics.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::mqtt;

TEST_CASE("a star stands for characters of one level, two stars for any", "[mqtt]") {
  CHECK(fits("/**", "/arm/angle"));
  CHECK(fits("**", ""));
  CHECK(fits("", ""));
  CHECK_FALSE(fits("", "/"));
  CHECK(fits("/*/state", "/arm/state"));
  CHECK_FALSE(fits("/*/state", "/arm/tool/state"));
  CHECK(fits("/**/state", "/arm/tool/state"));
  CHECK(fits("/arm/j*", "/arm/j12"));
  CHECK_FALSE(fits("/arm/j*", "/arm/j12/x"));
  CHECK(fits("/arm/*1*", "/arm/j12"));
  CHECK(fits("/**/j*/x", "/a/b/j1/y/j2/x"));
  CHECK_FALSE(fits("/arm", "/arm/"));
  CHECK_FALSE(fits("/arm/", "/arm"));
  CHECK(fits("/a**b*c", "/axx/ybzc"));
}

TEST_CASE("a pattern of many stars takes no exponential time", "[mqtt]") {
  std::string pattern, path(2'000, 'a');
  for (int i = 0; i < 200; ++i) pattern += i % 2 == 0 ? "*a" : "**a";
  CHECK_FALSE(fits(pattern + "b", path));
}

TEST_CASE("a topic is the prefix with the path, and a plus sign is encoded", "[mqtt]") {
  const Topics topics = Topics::create("robots/r1").value();
  CHECK(topics.of("/arm/angle") == "robots/r1/arm/angle");
  CHECK(topics.of("/a+b/c%23") == "robots/r1/a%2Bb/c%23");
  CHECK(topics.of(Topics::Command::put, "/arm/angle") == "robots/r1/ns/put/arm/angle");
  CHECK(topics.filter(Topics::Command::remove) == "robots/r1/ns/delete/#");
  CHECK(is_topic(topics.of("/a+b")));
}

TEST_CASE("topics of commands name method and path", "[mqtt]") {
  const Topics topics = Topics::create("robots/r1").value();
  const auto demand = topics.demand("robots/r1/ns/post/arm/actions/turn");
  REQUIRE(demand);
  CHECK(demand->command == Topics::Command::post);
  CHECK(demand->path == "/arm/actions/turn");
  for (const char* topic : {"", "robots", "robots/r1", "robots/r1/ns", "robots/r1/ns/", "robots/r1/ns/put", "robots/r1/ns/put/",
                            "robots/r1/ns/puts/x", "robots/r10/ns/put/x", "robots/r1/arm", "robots/r1/ns/get/x", "xrobots/r1/ns/put/x"})
    CHECK_FALSE(topics.demand(topic));
}

TEST_CASE("no response goes to topics of a robot or of commands", "[mqtt]") {
  const Topics topics = Topics::create("robots/r1").value();
  CHECK(topics.may_respond_to("replies/c1"));
  CHECK(topics.may_respond_to("robots/r10/x"));
  CHECK(topics.may_respond_to("a/ns/putter"));
  for (const std::string& topic : {std::string(), std::string("robots/r1"), std::string("robots/r1/arm"), std::string("robots/r2/ns/put/arm"),
                                   std::string("a/ns/post"), std::string("a/ns/putter/ns/delete/x"), std::string("a/+"), std::string("a/#"),
                                   std::string("$SYS/a"), std::string("a\0b", 3), std::string("\xFF"), std::string(70'000, 'a')})
    CHECK_FALSE(topics.may_respond_to(topic));
}
