// SPDX-License-Identifier: Apache-2.0
#include "src/subscription/callback_url.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt;
using subscription::parse_callback_url;

TEST_CASE("a callback URL is parsed", "[subscription][R0.13]") {
  const auto plain = parse_callback_url("HTTP://Receiver.Example").value();
  CHECK_FALSE(plain.secure);
  CHECK(plain.host == "receiver.example");
  CHECK(plain.port == 80);
  CHECK(plain.authority == "receiver.example");
  CHECK(plain.target == "/");

  const auto full = parse_callback_url("https://a_b.example:8443/Path/x%20y?q=1&r=%2F?").value();
  CHECK(full.secure);
  CHECK(full.host == "a_b.example");
  CHECK(full.port == 8443);
  CHECK(full.authority == "a_b.example:8443");
  CHECK(full.target == "/Path/x%20y?q=1&r=%2F?");

  const auto six = parse_callback_url("https://[2001:DB8::1]:443?x").value();
  CHECK(six.host == "[2001:db8::1]");
  CHECK(six.port == 443);
  CHECK(six.authority == "[2001:db8::1]");
  CHECK(six.target == "/?x");

  CHECK(parse_callback_url("http://h:443/").value().authority == "h:443");
  CHECK(parse_callback_url("http://h:65535/?").value().target == "/?");
  CHECK(parse_callback_url("http://xn--bcher-kva.example./").value().host == "xn--bcher-kva.example.");
  CHECK(parse_callback_url("http://127.1/").value().host == "127.1");  // a name that no entry can allow
}

TEST_CASE("the length of a callback URL is limited", "[subscription][R0.13]") {
  const std::string label(63, 'a');
  CHECK(parse_callback_url("http://" + label + ".example/"));
  CHECK_FALSE(parse_callback_url("http://" + label + "a.example/"));
  const std::string longest = label + "." + label + "." + label + "." + std::string(61, 'b');
  CHECK(parse_callback_url("http://" + longest + "/"));
  CHECK(parse_callback_url("http://" + longest + "./"));
  CHECK_FALSE(parse_callback_url("http://" + longest + "b/"));
  const std::string start = "http://receiver.example/";
  CHECK(parse_callback_url(start + std::string(2048 - start.size(), 'x')));
  const auto refused = parse_callback_url(start + std::string(2049 - start.size(), 'x'));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::expected_iri);
  CHECK(parse_callback_url("http://receiver.example/#x").error().offset == 24);
}
