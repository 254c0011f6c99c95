// SPDX-License-Identifier: Apache-2.0
#include <lrt/subscription/allowed_hosts.hpp>

#include <string>

#include "src/subscription/callback_url.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using subscription::AllowedHosts;
using subscription::parse_callback_url;

namespace {

AllowedHosts hosts(const std::vector<std::string>& entries) { return AllowedHosts::parse(entries).value(); }

/// Whether a subscription with this URL would be accepted, before the name is resolved.
bool is_named(const AllowedHosts& allowed, std::string_view url) {
  const auto parts = parse_callback_url(url);
  return parts && allowed.names(parts->host, parts->port);
}

}  // namespace

TEST_CASE("without entries no receiver may be called", "[subscription][R0.13]") {
  const AllowedHosts none = hosts({});
  CHECK(none.empty());
  for (const char* host : {"127.0.0.1", "[::1]", "localhost", "receiver.example", "8.8.8.8"}) {
    INFO(host);
    CHECK_FALSE(none.names(host, 80));
    CHECK_FALSE(none.allows(host, 80, "8.8.8.8"));
  }
}

TEST_CASE("an address or a network allows URLs with numeric hosts", "[subscription][R0.13]") {
  const AllowedHosts allowed = hosts({"192.168.1.7", "10.0.0.0/8", "fd00::/8", "2001:db8::1", "172.16.0.0/12:8080", "[2001:db8:1::/48]:443"});
  for (const char* host : {"192.168.1.7", "10.0.0.0", "10.255.255.255", "[fd00::1]", "[fdff:ffff::1]", "[2001:db8::1]", "[2001:DB8:0:0::1]"}) {
    INFO(host);
    CHECK(allowed.names(host, 80));
  }
  for (const char* host : {"192.168.1.8", "11.0.0.0", "9.255.255.255", "[fc00::1]", "[fe00::1]", "[2001:db8::2]", "172.16.0.1"}) {
    INFO(host);
    CHECK_FALSE(allowed.names(host, 80));
  }
  CHECK(allowed.names("172.31.255.255", 8080));
  CHECK_FALSE(allowed.names("172.32.0.0", 8080));
  CHECK(allowed.names("[2001:db8:1:ffff::]", 443));
  CHECK_FALSE(allowed.names("[2001:db8:1::]", 80));
  CHECK(allowed.allows("10.1.2.3", 80, "10.1.2.3"));
  CHECK_FALSE(allowed.allows("10.1.2.3", 80, "10.1.2.4"));  // a numeric host has one address
}

TEST_CASE("an IPv4-mapped address is the IPv4 address, and ::/0 contains no IPv4 address", "[subscription][R0.13]") {
  CHECK(hosts({"192.168.1.7"}).names("[::ffff:192.168.1.7]", 80));
  CHECK(hosts({"::ffff:192.168.1.7"}).names("192.168.1.7", 80));
  CHECK(hosts({"10.0.0.0/8"}).allows("10.0.0.1", 80, "::ffff:10.0.0.1"));
  CHECK(hosts({"0.0.0.0/0"}).names("127.0.0.1", 80));
  CHECK_FALSE(hosts({"0.0.0.0/0"}).names("[::1]", 80));
  CHECK(hosts({"::/0"}).names("[::1]", 80));
  CHECK_FALSE(hosts({"::/0"}).names("127.0.0.1", 80));
  CHECK_FALSE(hosts({"::/0"}).names("[::ffff:127.0.0.1]", 80));
  CHECK_FALSE(hosts({"::/80"}).names("[::ffff:127.0.0.1]", 80));
}

TEST_CASE("a name allows the addresses it resolves to, a leading dot allows names with this ending", "[subscription][R0.13]") {
  const AllowedHosts allowed = hosts({"Receiver.Example", ".robots.example", "other.example:8080"});
  for (const char* host :
       {"receiver.example", "RECEIVER.example", "receiver.example.", "a.robots.example", "a.b.robots.EXAMPLE", "a.robots.example."}) {
    INFO(host);
    CHECK(allowed.names(host, 80));
    CHECK(allowed.allows(host, 80, "192.0.2.1"));
    CHECK(allowed.allows(host, 80, "10.0.0.1"));
    CHECK(allowed.allows(host, 80, "2001:db8::1"));
  }
  for (const char* host : {"example", "robots.example", "evilrobots.example", ".robots.example", "a..robots.example", "receiver.example..",
                           "receiver.example.evil", "xreceiver.example", "a.robots.example.evil", "", ".", "other.example"}) {
    INFO(host);
    CHECK_FALSE(allowed.names(host, 80));
    CHECK_FALSE(allowed.allows(host, 80, "192.0.2.1"));
  }
  CHECK(allowed.names("other.example", 8080));
  CHECK(allowed.allows("other.example", 8080, "192.0.2.1"));
  CHECK_FALSE(allowed.allows("other.example", 8081, "192.0.2.1"));
  CHECK_FALSE(hosts({"10.0.0.0/8"}).names("receiver.example", 80));  // a network allows addresses only
}

TEST_CASE("a name with a special address also needs an entry for the address", "[subscription][R0.13]") {
  const AllowedHosts by_name = hosts({"receiver.example", ".robots.example"});
  for (const char* address : {"127.0.0.1",
                              "127.255.255.254",
                              "0.0.0.0",
                              "0.1.2.3",
                              "169.254.169.254",
                              "224.0.0.1",
                              "239.255.255.255",
                              "255.255.255.255",
                              "240.0.0.1",
                              "::",
                              "::1",
                              "fe80::1",
                              "febf::1",
                              "ff02::1",
                              "::ffff:127.0.0.1",
                              "::ffff:169.254.169.254",
                              "::ffff:0.0.0.0",
                              "::127.0.0.1",
                              "::169.254.169.254",
                              "64:ff9b::7f00:1",
                              "64:ff9b::169.254.169.254",
                              "64:ff9b:1::7f00:1",
                              "2002:7f00:1::",
                              "2002:a9fe:a9fe::1",
                              "2001:0:4136:e378:8000:63bf:80ff:fffe"}) {
    INFO(address);
    CHECK_FALSE(by_name.allows("receiver.example", 80, address));
    CHECK_FALSE(by_name.allows("a.robots.example", 80, address));
  }
  for (const char* address : {"1.1.1.1", "126.255.255.255", "128.0.0.1", "169.253.255.255", "223.255.255.255", "10.0.0.1", "192.168.0.1", "fec0::1",
                              "2001:db8::1", "64:ff9b::102:304", "2002:102:304::1", "fd00::1"}) {
    INFO(address);
    CHECK(by_name.allows("receiver.example", 80, address));
  }
  const AllowedHosts both = hosts({"receiver.example", "127.0.0.2", "[fe80::/10]:8080"});
  CHECK(both.allows("receiver.example", 80, "127.0.0.2"));
  CHECK(both.allows("receiver.example", 80, "::ffff:127.0.0.2"));
  CHECK_FALSE(both.allows("receiver.example", 80, "127.0.0.1"));
  CHECK_FALSE(both.allows("receiver.example", 80, "fe80::1"));
  CHECK(both.allows("receiver.example", 8080, "fe80::1"));
  CHECK_FALSE(both.allows("stranger.example", 80, "127.0.0.2"));
  // A text that is not a numeric address is never allowed.
  for (const char* address : {"", "receiver.example", "127.1", "1.2.3", "fe80::1%eth0", "[2001:db8::1]", "1.2.3.4 "}) {
    INFO(address);
    CHECK_FALSE(by_name.allows("receiver.example", 80, address));
  }
  CHECK_FALSE(by_name.allows("receiver.example", 80, std::string_view("1.2.3.4\0x", 9)));
}

TEST_CASE("localhost is the name of 127.0.0.1 and ::1", "[subscription][R0.13]") {
  for (const char* host : {"localhost", "LOCALHOST", "localhost.", "LocalHost."}) {
    INFO(host);
    CHECK(hosts({"127.0.0.0/8"}).names(host, 80));
    CHECK(hosts({"127.0.0.1:80"}).allows(host, 80, "127.0.0.1"));
    CHECK_FALSE(hosts({"127.0.0.1:80"}).names(host, 81));
    CHECK_FALSE(hosts({"127.0.0.1"}).allows(host, 80, "::1"));
    CHECK(hosts({"::1"}).allows(host, 80, "::1"));
    CHECK_FALSE(hosts({"127.0.0.0/8"}).allows(host, 80, "127.0.0.2"));  // a forged response of a resolver
    CHECK_FALSE(hosts({"127.0.0.0/8", "10.0.0.0/8"}).allows(host, 80, "10.0.0.1"));
    CHECK_FALSE(hosts({"127.0.0.2"}).names(host, 80));
    CHECK_FALSE(hosts({"receiver.example", "10.0.0.0/8"}).names(host, 80));
    CHECK(hosts({"localhost"}).allows(host, 80, "127.0.0.1"));
    CHECK(hosts({"localhost:80"}).allows(host, 80, "::1"));
    CHECK_FALSE(hosts({"localhost:80"}).names(host, 81));
  }
  CHECK_FALSE(hosts({"127.0.0.0/8"}).names("x.localhost", 80));
  CHECK_FALSE(hosts({"127.0.0.0/8"}).names("localhost.localdomain", 80));
}

TEST_CASE("known tricks to bypass a list of hosts are refused", "[subscription][R0.13][R0.16]") {
  const AllowedHosts allowed = hosts({"receiver.example", ".robots.example", "192.0.2.0/24", "2001:db8::/32"});
  REQUIRE(is_named(allowed, "http://receiver.example/"));
  for (const char* url : {"http://127.0.0.1/",
                          "http://127.1/",
                          "http://0x7f000001/",
                          "http://0x7f.0.0.1/",
                          "http://2130706433/",
                          "http://0177.0.0.1/",
                          "http://[::ffff:127.0.0.1]/",
                          "http://[::127.0.0.1]/",
                          "http://0.0.0.0/",
                          "http://[::]/",
                          "http://[::1]/",
                          "http://169.254.169.254/",
                          "http://[fe80::1]/",
                          "http://[64:ff9b::7f00:1]/",
                          "http://[2002:7f00:1::]/",
                          "http://localhost/",
                          "http://localhost./",
                          "http://LOCALHOST/",
                          "http://127.0.0.1./",
                          "http://192.0.2.1./",
                          "http://192.0.2/",
                          "http://192.0.2.1.robots/",
                          "http://192.0.512/",
                          "http://192.000.002.001/",
                          "http://192.0.2.01/",
                          "http://receiver.example@127.0.0.1/",
                          "http://127.0.0.1@receiver.example/",
                          "http://receiver.example:80@evil/",
                          "http://@receiver.example/",
                          "http://evil#@receiver.example/",
                          "http://receiver.example#@evil/",
                          "http://evil\\@receiver.example/",
                          "http://receiver.example\\.evil/",
                          "http:\\\\receiver.example/",
                          "http://receiver.example\t/",
                          "http://receiver.example\r\n/",
                          "http://receiver.example /",
                          "http://receiver.exam%70le/",
                          "http://%31%32%37.0.0.1/",
                          "http://receiver.example%00.evil/",
                          "http://receiver.example%2eevil/",
                          "http://receiver.example,evil/",
                          "http://receiver.example;evil/",
                          "http://receiver.example&evil/",
                          "http://evil.receiver.example/",
                          "http://receiver.example.evil/",
                          "http://..robots.example/",
                          "http://.robots.example/",
                          "http://a..robots.example/",
                          "http://-.robots.example/",
                          "http://a-.robots.example/",
                          "http://ｒeceiver.example/",
                          "http://xn--receiver-.example/",
                          "http:///receiver.example/",
                          "http:receiver.example/",
                          "//receiver.example/",
                          "/receiver.example/",
                          "receiver.example",
                          "",
                          "http://",
                          "http:///",
                          "https://",
                          "ftp://receiver.example/",
                          "file:///etc/passwd",
                          "gopher://receiver.example/",
                          "javascript:alert(1)",
                          "http://[receiver.example]/",
                          "http://[2001:db8::1/",
                          "http://2001:db8::1/",
                          "http://[2001:db8::1%25eth0]/",
                          "http://[2001:db8::1]x/",
                          "http://receiver.example:0/",
                          "http://receiver.example:65536/",
                          "http://receiver.example:/",
                          "http://receiver.example:080/",
                          "http://receiver.example:00000000080/",
                          "http://receiver.example:+80/",
                          "http://receiver.example:8 0/",
                          "http://receiver.example:80:80/",
                          "http://receiver.example:http/",
                          " http://receiver.example/",
                          "http://receiver.example/ ",
                          "http://receiver.example/a b",
                          "http://receiver.example/%",
                          "http://receiver.example/%4",
                          "http://receiver.example/%zz",
                          "http://receiver.example/\x7f",
                          "http://receiver.example/\"",
                          "http://receiver.example/#a",
                          "http://receiver.example/{}"}) {
    INFO(url);
    CHECK_FALSE(is_named(allowed, url));
  }
  CHECK_FALSE(is_named(allowed, std::string_view("http://receiver.example\0.evil/", 30)));
  CHECK_FALSE(is_named(allowed, std::string_view("http://receiver.example/\0", 25)));
}

TEST_CASE("an invalid entry is named in the error", "[subscription]") {
  for (const char* entry : {"",
                            ".",
                            "..",
                            "-a",
                            "a-",
                            "a..b",
                            "a b",
                            "*.example",
                            "http://receiver.example",
                            "receiver.example/",
                            "receiver.example:0",
                            "receiver.example:",
                            "receiver.example:65536",
                            "receiver.example:x",
                            "127.1",
                            "0x7f000001",
                            "2130706433",
                            "0177.0.0.1",
                            "10.0.0.0/33",
                            "10.0.0.0/",
                            "10.0.0.0/-1",
                            "10.0.0.0/08",
                            "10.0.0.1/8",
                            "fd00::1/8",
                            "fd00::/129",
                            "[::1",
                            "::1]",
                            "[127.0.0.1]",
                            "[receiver.example]",
                            "[::1]:0",
                            "[::1]x",
                            "fe80::1%eth0",
                            ".1",
                            ".0x1",
                            "user@receiver.example",
                            "receiver.example#",
                            "r\xC3\xA9.example"}) {
    INFO(entry);
    const auto parsed = AllowedHosts::parse({"127.0.0.1", entry});
    REQUIRE_FALSE(parsed);
    CHECK(parsed.error().code == Errc::invalid_option);
    CHECK(parsed.error().message.find('"' + std::string(entry) + '"') != std::string::npos);
  }
}
