// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/redirect.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

/// "GET http://a/b", "GET http://a/b, leaves", "stays" or the message of the error.
std::string follow(int status, const std::string& method, const std::string& location, const std::string& url = "http://a.example/robot/arm?x#part") {
  http::Fields fields;
  if (!location.empty()) fields.add("Location", location);
  const auto found = exchange::redirect_of(status, fields, method, url);
  if (!found) return found.error().message;
  if (!*found) return "stays";
  const std::string &end = (*found)->parts.target, &all = (*found)->url;
  CHECK(all.compare(all.size() - end.size(), end.size(), end) == 0);
  return (*found)->method + " " + (*found)->url + ((*found)->leaves_origin ? ", leaves" : "");
}

}  // namespace

TEST_CASE("a redirect changes the method by its status", "[delivery]") {
  const std::string there = "http://a.example/robot/leg";
  for (const char* const reads : {"GET", "HEAD"}) {
    for (const int status : {301, 302, 303, 307, 308}) CHECK(follow(status, reads, "leg") == reads + (" " + there));
  }
  for (const char* const command : {"POST", "PUT", "PATCH", "DELETE"}) {
    CHECK(follow(301, command, "leg") == "stays");
    CHECK(follow(302, command, "leg") == "stays");
    CHECK(follow(303, command, "leg#a") == "GET " + there);
    CHECK(follow(307, command, "leg") == command + (" " + there));
    CHECK(follow(308, command, "leg") == command + (" " + there));
  }
  for (const int status : {200, 201, 300, 304, 305, 306, 404}) CHECK(follow(status, "GET", "leg") == "stays");
  CHECK(follow(302, "GET", "") == "stays");
}

TEST_CASE("a command is not sent to another origin, and the message says where it would have gone", "[delivery][security]") {
  for (const char* const other : {"http://b.example/x", "https://a.example/x", "http://a.example:81/x", "//b.example/x"}) {
    INFO(other);
    for (const int status : {301, 302, 303, 307, 308}) CHECK(follow(status, "GET", other).find(", leaves") != std::string::npos);
    CHECK(follow(303, "POST", other).find(", leaves") != std::string::npos);
    for (const int status : {307, 308}) {
      for (const char* const command : {"POST", "PUT", "PATCH", "DELETE"})
        CHECK(follow(status, command, other).find("a command is not sent there") != std::string::npos);
    }
  }
  CHECK(follow(307, "PUT", "http://b.example/x#y") ==
        "\"http://a.example/robot/arm?x#part\": it redirects the PUT to \"http://b.example/x\", which is of another origin: a command is not sent "
        "there");
  CHECK(follow(307, "PUT", "http://A.example:80/x") == "PUT http://A.example:80/x");
}

TEST_CASE("a redirect to what is no web address is an error", "[delivery]") {
  for (const char* const bad : {"ftp://a.example/", "http://a.example:0/", "http://user@a.example/", "a b"}) {
    INFO(bad);
    CHECK(follow(302, "GET", bad).find("it redirects to ") != std::string::npos);
  }
}
