// SPDX-License-Identifier: Apache-2.0
#include "src/engine/bases.hpp"

#include <memory>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::engine;
using lrt::test::RequestText;

namespace {

/// The base of a request to a host; the error's message if there is none.
std::string base_of(Bases& bases, const std::string& host, bool secure = false, const std::string& mount = {}, std::uint16_t local_port = 0,
                    const std::string& target = "/arm") {
  RequestText text("GET " + target + "\nHost: " + host);
  http::Request& request = text.get();
  request.secure = secure;
  request.mount = mount;
  request.local_port = local_port;
  const auto base = bases.of(request, http::split_target(request.target).value());
  return base ? bases[*base] : base.error().message;
}

bool is_refused(const std::string& text) { return text.find("does not serve the host") != std::string::npos; }

}  // namespace

TEST_CASE("the base is the host that the request names, if it is this server", "[engine][SPEC 3.7]") {
  Bases bases({}, {"robot.local", "other:99"});
  bases.listens_on("192.0.2.1", 8080, false);
  CHECK(base_of(bases, "192.0.2.1:8080") == "http://192.0.2.1:8080");
  CHECK(base_of(bases, "localhost:8080") == "http://localhost:8080");
  CHECK(base_of(bases, "LOCALHOST:8080") == "http://localhost:8080");
  CHECK(base_of(bases, "[::1]:8080") == "http://[::1]:8080");
  CHECK(base_of(bases, "robot.local:8080") == "http://robot.local:8080");
  CHECK(base_of(bases, "other:99") == "http://other:99");
  for (const char* host : {"192.0.2.1", "192.0.2.1:81", "robot.local", "other", "other:8080", "evil.example:8080"}) {
    CAPTURE(host);
    CHECK(is_refused(base_of(bases, host)));
  }
  CHECK(base_of(bases, "evil.example", false, {}, 0, "http://localhost:8080/arm") == "http://localhost:8080");  // the target decides
  CHECK(is_refused(base_of(bases, "localhost:8080", false, {}, 0, "http://evil.example/arm")));
  CHECK(base_of(bases, "") == bases[0]);
}

TEST_CASE("a host name that has given the address is the first base", "[engine][SPEC 3.7]") {
  Bases bases({}, {});
  bases.listens_on("192.0.2.1", 8080, false, "Robot.local");
  CHECK(bases[0] == "http://robot.local:8080");
  CHECK(base_of(bases, "robot.local:8080") == "http://robot.local:8080");
  CHECK(base_of(bases, "192.0.2.1:8080") == "http://192.0.2.1:8080");
  CHECK(base_of(bases, "localhost:8080") == "http://localhost:8080");
  CHECK(is_refused(base_of(bases, "robot.local")));
}

TEST_CASE("the scheme's own port is not part of a base", "[engine][SPEC 3.7]") {
  Bases bases({}, {});
  bases.listens_on("127.0.0.1", 443, true);
  CHECK(base_of(bases, "localhost", true) == "https://localhost");
  CHECK(base_of(bases, "localhost:443", true) == "https://localhost");
  CHECK(base_of(bases, "localhost:", true) == "https://localhost");
  CHECK(bases[0] == "https://127.0.0.1");
}

TEST_CASE("a public base is the base of every request whose Host is the server's", "[engine][SPEC 3.7]") {
  Bases bases("https://robot.example/arm", {"alias.example", "gate.example:8443", "other.example:443"});
  bases.listens_on("192.0.2.1", 8080, false);
  for (const char* host : {"robot.example", "Robot.Example", "robot.example:443", "alias.example", "alias.example:8080", "gate.example:8443",
                           "other.example", "192.0.2.1:8080", "localhost:8080", "127.0.0.1:8080", "[::1]:8080", ""}) {
    CAPTURE(host);
    CHECK(base_of(bases, host) == "https://robot.example/arm");
  }
  for (const char* host :
       {"anything", "robot.example:8080", "robot.example.evil.example", "alias.example:81", "gate.example", "192.0.2.1", "evil.example:8080"}) {
    CAPTURE(host);
    CHECK(is_refused(base_of(bases, host)));
  }
  CHECK(is_refused(base_of(bases, "robot.example", false, {}, 0, "http://evil.example/arm")));
  CHECK(base_of(bases, "evil.example", false, {}, 0, "http://robot.example/arm") == "https://robot.example/arm");
  CHECK(bases.origin(0) == "https://robot.example");
  CHECK(bases.public_path() == "/arm");
  CHECK(Bases("http://robot.example:80", {}).public_path().empty());

  Bases odd("http://robot.example:8000", {"alias.example"});
  odd.listens_on("127.0.0.1", 8443, true);
  CHECK(base_of(odd, "alias.example:8000", true) == "http://robot.example:8000");
  CHECK(is_refused(base_of(odd, "alias.example", true)));
  CHECK(base_of(odd, "localhost:9000", false, "/things", 9000) == "http://robot.example:8000");  // behind a host's own server
  CHECK(is_refused(base_of(odd, "evil.example:9000", false, "/things", 9000)));
}

TEST_CASE("public base and allowed hosts are checked", "[engine][SPEC 3.7]") {
  for (const char* base : {"", "https://robot.example", "http://[::1]:8080/a/b"}) CHECK(Bases(base, {"robot.local", "a:80", "[::1]:80"}).check());
  for (const char* base : {"robot.example", "/arm", "ftp://robot.example", "https://robot.example?x", "https://robot.example/#x", "https://a b/"}) {
    CAPTURE(base);
    CHECK(Bases(base, {}).check().error().code == Errc::invalid_option);
  }
  for (const char* host : {"http://robot.local", "robot.local/", "", "a:b"}) {
    CAPTURE(host);
    CHECK(Bases({}, {host}).check().error().message.find("allowed_hosts: expected") == 0);
  }
}

TEST_CASE("with a public base the page may be seen at each name of the server", "[engine][SPEC 3.7]") {
  Bases bases("https://robot.example", {"alias.example"});
  bases.listens_on("127.0.0.1", 8080, false);
  const auto is_own = [&](const std::string& origin, const std::string& host) {
    RequestText text("POST /arm\nHost: " + host);
    return bases.is_own_origin(origin, 0, text.get());
  };
  CHECK(is_own("https://robot.example", "robot.example"));
  CHECK(is_own("https://robot.example", "127.0.0.1:8080"));
  CHECK(is_own("http://127.0.0.1:8080", "127.0.0.1:8080"));
  CHECK(is_own("https://alias.example", "alias.example"));
  CHECK_FALSE(is_own("http://robot.example", "robot.example"));  // not by TLS
  CHECK_FALSE(is_own("https://evil.example", "robot.example"));
  CHECK_FALSE(is_own("https://evil.example", "evil.example"));
  CHECK_FALSE(is_own("http://127.0.0.1:8081", "127.0.0.1:8080"));
}

TEST_CASE("behind a host's own server the base has its port and the prefix", "[engine][SPEC 3.7]") {
  Bases bases({}, {"robot.local"});
  bases.listens_on("127.0.0.1", 0, false);
  CHECK(base_of(bases, "localhost:9000", false, "/things", 9000) == "http://localhost:9000/things");
  CHECK(base_of(bases, "localhost:9000", false, "/things", 9000) == "http://localhost:9000/things");
  CHECK(base_of(bases, "robot.local:9000", false, "/things", 9000) == "http://robot.local:9000/things");
  CHECK(is_refused(base_of(bases, "robot.local:9001", false, "/things", 9000)));
  CHECK(is_refused(base_of(bases, "evil.example:9000", false, "/things", 9000)));
}

TEST_CASE("a name of this machine may have any port, for somebody may forward it", "[engine][SPEC 3.7]") {
  Bases bases({}, {});
  bases.listens_on("192.0.2.1", 8080, false, {}, Upgrades{true, true});
  CHECK(base_of(bases, "localhost:9000") == "http://localhost:9000");
  CHECK(base_of(bases, "LocalHost:9001") == "http://localhost:9001");
  CHECK(base_of(bases, "localhost") == "http://localhost");
  CHECK(base_of(bases, "127.0.0.1:9000") == "http://127.0.0.1:9000");
  CHECK(base_of(bases, "127.0.0.2:8080") == "http://127.0.0.2:8080");
  CHECK(base_of(bases, "[::1]:9000") == "http://[::1]:9000");
  CHECK(base_of(bases, "robot.localhost:9000") == "http://robot.localhost:9000");
  CHECK(base_of(bases, "localhost:9000", false, "/things", 7000) == "http://localhost:9000/things");
  CHECK(bases.upgrades("http://localhost:9001").websocket);
  CHECK_FALSE(bases.upgrades("http://localhost:9000/things").websocket);  // of a host's own server
  for (const char* host : {"localhost.evil.example:9000", "evil.example:9000", "127.0.0.1.evil.example:9000", "127.1:9000", "notlocalhost:9000",
                           ".localhost:9000", "[::2]:9000", "128.0.0.1:9000", "192.0.2.1:9000", "0.0.0.0:8080"}) {
    CAPTURE(host);
    CHECK(is_refused(base_of(bases, host)));
  }
  Bases behind("https://robot.example", {});
  behind.listens_on("127.0.0.1", 8080, false);
  CHECK(base_of(behind, "localhost:9000") == "https://robot.example");
}

TEST_CASE("with a forwarded port only a page of that port is this server's", "[engine][security]") {
  for (const char* public_base : {"", "https://robot.example"}) {
    Bases bases(public_base, {});
    bases.listens_on("127.0.0.1", 8080, false);
    const auto is_own = [&](const std::string& origin, const std::string& host) {
      RequestText text("POST /arm\nHost: " + host);
      const std::size_t base = bases.of(text.get(), http::split_target("/arm").value()).value();
      return bases.is_own_origin(origin, base, text.get());
    };
    CHECK(is_own("http://localhost:9000", "localhost:9000"));
    CHECK(is_own("http://localhost:8080", "localhost:8080"));
    CHECK(is_own("http://localhost", "localhost:80"));
    for (const char* origin : {"http://localhost:9001", "http://localhost:8080", "http://127.0.0.1:9000", "http://127.0.0.1:8080", "http://localhost",
                               "https://localhost:9000", "https://robot.example", "null", "http://evil.example"}) {
      CAPTURE(origin);
      CHECK_FALSE(is_own(origin, "localhost:9000"));
    }
    CHECK_FALSE(is_own("http://localhost:9000", "localhost:8080"));
  }
}

TEST_CASE("forwarded bases are few at a time, and none is replaced that is in use", "[engine][SPEC 3.7]") {
  Bases bases({}, {}, 3);
  bases.listens_on("127.0.0.1", 8080, false);
  const auto number_of = [&](int port) {
    RequestText text("GET /arm\nHost: localhost:" + std::to_string(port));
    return bases.of(text.get(), http::split_target("/arm").value()).value();
  };
  const std::size_t first = number_of(1), second = number_of(2), third = number_of(3);
  CHECK(bases.take_replaced().empty());
  CHECK(bases.hold(0) == nullptr);
  auto held = bases.hold(first);
  CHECK(held != nullptr);
  CHECK(number_of(2) == second);
  CHECK(number_of(4) == third);  // used least recently, but for the one that is held
  CHECK(bases.take_replaced() == std::vector<std::size_t>{third});
  CHECK(bases[third] == "http://localhost:4");
  CHECK(bases[first] == "http://localhost:1");
  const auto others = {bases.hold(second), bases.hold(third)};
  CHECK(number_of(5) == 0);  // all are in use: the listening address
  CHECK(number_of(1) == first);
  held = nullptr;
  CHECK(number_of(5) == first);
  CHECK(bases.take_replaced() == std::vector<std::size_t>{first});
  for (int port = 10'000; port < 10'500; ++port) CHECK(bases[number_of(port)] == "http://localhost:" + std::to_string(port));
}

TEST_CASE("saved subscriptions of forwarded ports have the same limit", "[engine][SPEC 3.7]") {
  Bases bases({}, {}, 3);
  bases.listens_on("127.0.0.1", 8080, false);
  CHECK(bases.restore("http://127.0.0.1:8080") == 0);
  CHECK(bases[bases.restore("http://localhost:8080")] == "http://localhost:8080");
  std::vector<std::shared_ptr<const void>> held;
  for (int port = 1; port <= 3; ++port) {
    const std::size_t number = bases.restore("http://localhost:" + std::to_string(port));
    CHECK(bases[number] == "http://localhost:" + std::to_string(port));
    held.push_back(bases.hold(number));
    CHECK(held.back() != nullptr);
  }
  for (int port = 4; port < 200; ++port) CHECK(bases.restore("http://localhost:" + std::to_string(port)) == 0);
  CHECK(bases[bases.restore("http://localhost:2")] == "http://localhost:2");
  CHECK(bases[bases.restore("http://robot.example:4")] == "http://robot.example:4");  // a name that the server had before
  CHECK(base_of(bases, "localhost:3") == "http://localhost:3");
  CHECK(base_of(bases, "localhost:4") == "http://127.0.0.1:8080");
  held.clear();
  CHECK(base_of(bases, "localhost:4") == "http://localhost:4");
}

TEST_CASE("a base of a restored subscription is not served", "[engine][SPEC 3.7]") {
  Bases bases({}, {});
  bases.listens_on("127.0.0.1", 8080, false);
  const std::size_t restored = bases.intern("http://old.example", false);
  CHECK(bases.intern("http://old.example", false) == restored);
  CHECK(is_refused(base_of(bases, "old.example")));
  CHECK(bases[restored] == "http://old.example");
  CHECK(bases.path_of("http://old.example/arm/p") == "/arm/p");
}

TEST_CASE("an IRI below a base has a path, others have none", "[engine][SPEC 3.5]") {
  Bases bases({}, {});
  bases.listens_on("127.0.0.1", 8080, false);
  CHECK(bases.path_of("http://127.0.0.1:8080/arm") == "/arm");
  CHECK(bases.path_of("http://localhost:8080/arm/p") == "/arm/p");  // not interned yet
  for (const char* iri : {"http://127.0.0.1:8080/arm?x", "http://127.0.0.1:8080/arm#x", "http://evil.example/arm", "/arm", ""}) {
    CAPTURE(iri);
    CHECK_FALSE(bases.path_of(iri));
  }
}

TEST_CASE("below a public base with a path are its own resources only", "[engine][R0.13][SPEC 3.5]") {
  Bases bases("https://robots.example/cell7", {"alias.example"});
  bases.listens_on("127.0.0.1", 8080, false);
  CHECK(bases.path_of("https://robots.example/cell7/arm") == "/arm");
  CHECK(bases.path_of("https://alias.example/cell7/arm") == "/arm");
  CHECK(bases.path_of("http://localhost:8080/arm") == "/arm");
  CHECK_FALSE(bases.path_of("https://robots.example/cell8/arm"));
  CHECK_FALSE(bases.path_of("https://robots.example/cell78/arm"));
  const auto is_own = [&](const char* url) { return bases.is_this_server(subscription::parse_callback_url(url).value()); };
  CHECK(is_own("https://robots.example/cell7/arm/x?y=/z"));
  CHECK(is_own("https://robots.example:443/cell7/"));
  CHECK_FALSE(is_own("https://robots.example/dashboard"));  // another server behind the proxy
  CHECK_FALSE(is_own("http://robots.example/cell7/"));
}

TEST_CASE("a callback to this server is known by any of its names", "[engine][R0.13]") {
  Bases bases({}, {"robot.local"});
  bases.listens_on("192.0.2.1", 8080, false);
  const auto is_own = [&](const char* url) { return bases.is_this_server(subscription::parse_callback_url(url).value()); };
  for (const char* url : {"http://localhost:8080/x", "http://127.0.0.1:8080/", "http://127.3.2.1:8080/", "http://[::1]:8080/",
                          "http://192.0.2.1:8080/", "http://robot.local:8080/"}) {
    CAPTURE(url);
    CHECK(is_own(url));
  }
  for (const char* url : {"http://localhost:8081/x", "http://192.0.2.2:8080/", "http://robot.local/"}) {
    CAPTURE(url);
    CHECK_FALSE(is_own(url));
  }
}
