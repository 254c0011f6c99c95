// SPDX-License-Identifier: Apache-2.0
#include "src/base/client_key.hpp"

#include "tests/support/catch.hpp"

using lrt::client_key;

TEST_CASE("a client is an IPv4 address or a /64 network of IPv6", "[base][limits]") {
  CHECK(client_key("192.0.2.7") == "192.0.2.7");
  CHECK(client_key("2001:db8:1:2:3:4:5:6") == "2001:db8:1:2::/64");
  CHECK(client_key("2001:db8:1:2::ffff") == client_key("2001:db8:1:2:aaaa:bbbb:cccc:dddd"));
  CHECK(client_key("2001:db8:1:2::1") != client_key("2001:db8:1:3::1"));
  CHECK(client_key("::ffff:192.0.2.7") == "192.0.2.7");
  CHECK(client_key("::1") == "::1");
  CHECK(client_key("fe80::1%eth0") == "fe80::/64%eth0");
  CHECK(client_key("fe80::1%eth0") != client_key("fe80::1%eth1"));
  CHECK(client_key("") == "");
  CHECK(client_key("no address") == "no address");
}
