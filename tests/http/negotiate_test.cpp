// SPDX-License-Identifier: Apache-2.0
#include "src/http/negotiate.hpp"

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

const std::vector<std::string_view> offers = {"text/turtle", "application/n-triples", "application/rdf+xml", "application/json", "text/html"};

std::string pick(const char* accept) {
  const auto index = http::negotiate(accept, offers);
  return index ? std::string(offers[*index]) : "none";
}

}  // namespace

TEST_CASE("Turtle is the variant when Accept is absent or leaves a choice", "[http][R1.2]") {
  CHECK(http::negotiate(std::nullopt, offers) == std::size_t{0});
  for (const char* open : {"", "  ", "*/*", " */* ", "*/*;q=0.1", "text/*", "text/turtle, application/json", "application/json, text/turtle",
                           "application/json;q=0.5, */*;q=0.6", "text/html;q=0.9, */*", ",", "text/html, image/gif;q=1, text/turtle"}) {
    CAPTURE(open);
    CHECK(pick(open) == "text/turtle");
  }
  CHECK_FALSE(http::negotiate(std::nullopt, {}));
  CHECK_FALSE(http::negotiate("*/*", {}));
}

TEST_CASE("the highest q wins, the most specific range decides it", "[http][R1.2]") {
  struct Case {
    const char *accept, *expected;
  };
  const Case cases[] = {
      {"application/json", "application/json"},
      {"APPLICATION/JSON", "application/json"},
      {"text/turtle;q=0.5, application/json", "application/json"},
      {"text/turtle;q=0.5,application/json;q=0.501", "application/json"},
      {"text/turtle;q=0,*/*", "application/n-triples"},
      {"text/*;q=0, */*;q=0.1", "application/n-triples"},
      {"*/*, text/*;q=0.2, text/turtle;q=0.1, application/*;q=0.3", "application/n-triples"},
      {"*/*;q=0.1, text/*;q=0.2, text/html;q=0.3", "text/html"},
      {"application/*", "application/n-triples"},
      {"text/turtle ; q=0.2 , text/html\t;\tQ=0.3", "text/html"},
      {"text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,*/*;q=0.8", "text/html"},
      {"application/rdf+xml;q=1.000, text/turtle;q=0.999", "application/rdf+xml"},
      {"text/turtle;q=0", "none"},
      {"*/*;q=0", "none"},
      {"*/*;q=0.000", "none"},
      {"image/png", "none"},
      {"image/*", "none"},
      {"text/turtle;q=0, text/turtle", "text/turtle"},  // contradiction: the kinder word
  };
  for (const auto& [accept, expected] : cases) {
    CAPTURE(accept);
    CHECK(pick(accept) == expected);
  }
}

TEST_CASE("at equal weight a type that the client names precedes those that a range includes", "[http][R1.2]") {
  struct Case {
    const char *accept, *expected;
  };
  const Case cases[] = {
      {"application/json, text/plain, */*", "application/json"},  // axios, Angular
      {"*/*, application/json", "application/json"},
      {"application/json, application/*", "application/json"},
      {"application/*, application/json", "application/json"},
      {"text/html, */*;q=1", "text/html"},
      {"text/html, text/*", "text/html"},
      {"application/json;q=0.5, */*;q=0.5", "application/json"},
      {"application/json;charset=utf-8, */*", "application/json"},
      {"application/json;charset=utf-8, text/html, */*", "application/json"},  // parameters do not make it more of a type
      {"text/html;charset=utf-8, application/json, */*", "application/json"},
      {"application/*, */*", "application/n-triples"},
      {"*/*, application/*, text/html", "text/html"},
      {"application/json, text/turtle, */*", "text/turtle"},  // of those that it names, the server's first
      {"application/json;q=0.8, application/rdf+xml;q=0.8, */*;q=0.8", "application/rdf+xml"},
      {"application/json;q=0.8, */*;q=0.9", "text/turtle"},
      {"application/json;q=0, */*", "text/turtle"},
      {"application/json;q=0, application/*, */*", "application/n-triples"},
      {"image/png, */*", "text/turtle"},
      {"image/png, application/*;q=0.1", "application/n-triples"},
  };
  for (const auto& [accept, expected] : cases) {
    CAPTURE(accept);
    CHECK(pick(accept) == expected);
  }
}

TEST_CASE("a range with parameters matches what has them; charset=utf-8 is true of all", "[http][R1.2]") {
  CHECK(pick("text/turtle;charset=utf-8") == "text/turtle");
  CHECK(pick("text/turtle;charset=\"UTF-8\";q=0.4, text/html;q=0.3") == "text/turtle");
  CHECK(pick("text/turtle;charset=iso-8859-1") == "none");
  CHECK(pick("text/turtle;version=1.2") == "none");
  CHECK(pick("text/turtle;version=1.2, text/turtle;q=0.2, text/html;q=0.1") == "text/turtle");
  CHECK(pick("text/html;x=\"a,text/turtle\", application/json") == "application/json");
  CHECK(pick("text/turtle;x=1;q=1, text/html;q=0.5") == "text/html");
  const std::vector<std::string_view> versions = {"text/turtle", "text/turtle;version=1.2"};
  CHECK(http::negotiate("text/turtle;version=1.2", versions) == std::size_t{1});
  CHECK(http::negotiate("text/turtle;version=\"1\\.2\"", versions) == std::size_t{1});
  CHECK(http::negotiate("text/turtle", versions) == std::size_t{0});
  CHECK(http::negotiate("text/turtle;q=0.1, text/turtle;version=1.2", versions) == std::size_t{1});
}

TEST_CASE("malformed members are skipped", "[http][R1.2]") {
  for (const char* broken : {"text", "text/", "/turtle", "*/html", "text/html q=1", "text/html;q", "text/html;q=", "text/html;q=2",
                             "text/html;q=1.001", "text/html;q=0.1234", "text/html;q=-1", "text/html;q=.", "text/html;q=0.x", "text/html;q =1",
                             "text/html;\"q\"=1", "text/html;x=\"a", "t\x01/html", "\xC3\xB6/html"}) {
    CAPTURE(broken);
    CHECK(pick(("application/json;q=0.1, " + std::string(broken)).c_str()) == "application/json");
    CHECK(pick(broken) == "text/turtle");  // nothing was said
  }
}

TEST_CASE("the default Accept of Java's URLConnection is understood", "[http][R1.2]") {
  CHECK(pick("image/gif, image/jpeg, *; q=.2, */*; q=.2") == "text/turtle");
  CHECK(pick("text/html, image/gif, image/jpeg, *; q=.2, */*; q=.2") == "text/html");
  CHECK(pick("text/turtle;q=.1, *;q=.2") == "application/n-triples");
}
