// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/http_authentication.hpp"

#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::exchange;

namespace {

std::vector<Challenge> read(std::initializer_list<std::string_view> values) {
  http::Fields fields;
  for (const std::string_view value : values) fields.add("WWW-Authenticate", value);
  return challenges_of(fields);
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("the response of HTTP Digest is that of the examples of RFC 2617 and RFC 7616", "[client]") {
  const auto old =
      digest_challenge(read({"Digest realm=\"testrealm@host.com\", qop=\"auth,auth-int\", nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\", "
                             "opaque=\"5ccc069c403ebaf9f0171e9517f40e41\""}));
  REQUIRE(old);
  const std::string first = digest_authorization(*old, "Mufasa", "Circle Of Life", "GET", "/dir/index.html", 1, "0a4f113b").value();
  CHECK(has(first, "response=\"6629fae49393a05397450978507c4ef1\""));
  CHECK(has(first, "nc=00000001"));
  CHECK(has(first, "opaque=\"5ccc069c403ebaf9f0171e9517f40e41\""));
  CHECK_FALSE(has(first, "algorithm"));

  const std::string rest =
      "realm=\"http-auth@example.org\", qop=\"auth, auth-int\", nonce=\"7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v\", "
      "opaque=\"FQhe/qaU925kfnzjCev0ciny7QMkPqMAFRtzCUYo5tdS\"";
  const std::string cnonce = "f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ";
  const auto sha = digest_challenge(read({"Digest " + rest + ", algorithm=SHA-256", "Digest " + rest + ", algorithm=MD5"}));
  REQUIRE(sha);
  CHECK(sha->algorithm == HashAlgorithm::sha256);
  CHECK(has(digest_authorization(*sha, "Mufasa", "Circle of Life", "GET", "/dir/index.html", 1, cnonce).value(),
            "response=\"753927fa0e85d155564e2e272a28d1802ca10daf4496794697cf8db5856cb6c1\""));
  const auto md5 = digest_challenge(read({"Digest " + rest + ", algorithm=MD5"}));
  REQUIRE(md5);
  CHECK(has(digest_authorization(*md5, "Mufasa", "Circle of Life", "GET", "/dir/index.html", 1, cnonce).value(),
            "response=\"8ca523f5e9506fed4657c9700eebdbec\""));
  // Without qop it is the response of RFC 2069, which has neither a count nor a text of the client's.
  const auto oldest = digest_challenge(read({"Digest realm=\"r\", nonce=\"n\""}));
  REQUIRE(oldest);
  CHECK_FALSE(has(digest_authorization(*oldest, "a", "b", "GET", "/", 1, "c").value(), "cnonce"));
  CHECK_FALSE(digest_authorization(*oldest, "a\r\nX: y", "b", "GET", "/", 1, "c").has_value());
}

TEST_CASE("challenges are told apart where their parameters have commas, too", "[client]") {
  const std::vector<Challenge> all =
      read({"Basic realm=\"a, b=c\", charset=UTF-8 , Negotiate abc==, digest NONCE = \"x\\\"y\", stale=TRUE", "Bearer"});
  REQUIRE(all.size() == 4);
  CHECK(all[0].scheme == "basic");
  CHECK(all[0].parameter("realm") == "a, b=c");
  CHECK(all[0].parameter("charset") == "UTF-8");
  CHECK(all[1].scheme == "negotiate");
  CHECK(all[1].parameters.empty());
  CHECK(all[2].parameter("nonce") == "x\"y");
  CHECK(digest_challenge(all)->is_stale);
  CHECK(all[3].scheme == "bearer");
}

TEST_CASE("challenges that are hostile or unknown are left out", "[client]") {
  CHECK(read({"=", "\"", "a=b", ",,,"}).empty());
  CHECK(read({"Digest nonce=\"never closed"}).size() == 1);
  std::string many;
  for (int i = 0; i < 1'000; ++i) many += "Scheme" + std::to_string(i) + " a=b, ";
  CHECK(read({many}).size() == 16);
  CHECK_FALSE(digest_challenge(read({"Digest realm=x, nonce=y, algorithm=SHA-512-256", "Digest realm=x, nonce=y, qop=auth-int", "Digest realm=x"})));
}
