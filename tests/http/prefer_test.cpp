// SPDX-License-Identifier: Apache-2.0
#include "src/http/prefer.hpp"

#include "tests/support/catch.hpp"

using namespace lrt;
using Return = http::Preferences::Return;
using std::chrono::seconds;

TEST_CASE("return, respond-async and wait are read as in RFC 7240", "[http][R0.7]") {
  CHECK(http::parse_prefer("return=minimal").return_ == Return::minimal);
  CHECK(http::parse_prefer("Return = \"representation\"").return_ == Return::representation);
  const auto both = http::parse_prefer("respond-async, wait=10");
  CHECK(both.respond_async);
  CHECK(both.wait == seconds(10));
  CHECK(http::parse_prefer("RESPOND-ASYNC").respond_async);
  CHECK(http::parse_prefer("respond-async; foo=\"a,b\"; ; bar, wait=\"3\"").wait == seconds(3));
  CHECK(http::parse_prefer("wait=0").wait == seconds(0));
  CHECK(http::parse_prefer("wait=86401").wait == seconds(86400));
  CHECK(http::parse_prefer("wait=99999999999999999999999999").wait == seconds(86400));
  const auto nothing = http::parse_prefer("");
  CHECK((nothing.return_ == Return::unsaid && !nothing.respond_async && !nothing.wait));
}

TEST_CASE("unknown and malformed preferences are ignored, the first of a repeated one counts", "[http][R0.7]") {
  CHECK(http::parse_prefer("return=minimal, return=representation").return_ == Return::minimal);
  CHECK(http::parse_prefer("return=foo, return=representation").return_ == Return::representation);
  CHECK(http::parse_prefer("wait=1, wait=2").wait == seconds(1));
  for (const char* bad : {"wait", "wait=", "wait=-1", "wait=1.5", "wait=\"1", "wait 1", "=1", "wait=1;;=", "wait=1 x", "w\x01=1", "\"wait=1\""}) {
    CAPTURE(bad);
    CHECK_FALSE(http::parse_prefer(bad).wait);
    CHECK(http::parse_prefer(std::string("respond-async, ") + bad).respond_async);
  }
  CHECK(http::parse_prefer("foo=\"a, respond-async\", lenient ,, ;, respond-async").respond_async);
  CHECK_FALSE(http::parse_prefer("foo=\"a, respond-async\"").respond_async);
}

TEST_CASE("include and omit of return=representation are lists of IRIs", "[http]") {
  const auto prefer =
      http::parse_prefer("return=representation; include=\"http://www.w3.org/ns/ldp#PreferMinimalContainer  urn:x relative\"; OMIT=\"http://a\"");
  CHECK(prefer.include == std::vector<std::string>{"http://www.w3.org/ns/ldp#PreferMinimalContainer", "urn:x"});
  CHECK(prefer.omit == std::vector<std::string>{"http://a"});
  CHECK(http::parse_prefer("return=minimal; include=\"http://a\"").include.empty());
}
