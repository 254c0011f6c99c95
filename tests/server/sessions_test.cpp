// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <chrono>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <lrt/served.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "src/security/failed_logins.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string token_of_anna = "reader-0123456789abcdef", token_of_bert = "operator-0123456789abcdef", token_of_guest = "nobody-0123456789abcdef";
const std::string all_tokens = "anna reader " + token_of_anna + "\nbert operator " + token_of_bert + "\nemil guest " + token_of_guest + "\n";
const std::string number = "\nContent-Type: application/json\n\n5";

std::string bearer(const std::string& token) { return "\nAuthorization: Bearer " + token; }

/// A robot with tokens, as a browser on this machine sees it.
struct Guarded {
  explicit Guarded(Security security = {}, const std::string& transport = "", const std::string& public_base = "") {
    write_tokens(all_tokens);
    Options options;
    options.listen.public_base = public_base;
    options.listen.port = 0;
    options.security = std::move(security);
    if (!options.security.authenticate) options.security.token_file = folder / "tokens";
    options.threads.dispatch = Dispatch::io_thread;
    options.clock = &clock;
    options.log = [this](LogLevel, std::string_view text) {
      const std::lock_guard lock(log_mutex);
      log.append(text).append("\n");
    };
    if (transport.empty()) options.listen.transport = transport::no_network;
    else options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    server.emplace(Server::create(std::move(options)).value());
    server->add(robot.arm()).value();
  }
  void write_tokens(const std::string& text) { std::ofstream(folder / "tokens") << text; }

  /// A request to localhost:4711; its fields are below its first line.
  http::Response ask(const std::string& text, bool secure = false, std::string_view peer = "127.0.0.1") {
    const std::size_t end = std::min(text.find("\n\n"), text.size());
    RequestText request(text.substr(0, end) + (text.find("\nHost: ") < end ? "" : "\nHost: localhost:4711") + text.substr(end));
    request.get().local_port = 4711;
    request.get().can_stream = true;
    request.get().secure = secure;
    request.get().peer = peer;
    return server->serve(request.get()).response;
  }
  int status(const std::string& text, bool secure = false) { return ask(text, secure).status; }

  http::Response log_in(const std::string& token, const std::string& fields = "", bool secure = false) {
    return ask("POST /ns/session" + bearer(token) + "\nOrigin: " + (secure ? "https" : "http") + "://localhost:4711" + fields, secure);
  }
  /// The field with which a browser sends what a login has set.
  static std::string cookie_of(const http::Response& response) {
    const std::string set(response.fields.find("Set-Cookie").value_or(""));
    return "\nCookie: " + set.substr(0, set.find(';'));
  }
  std::string session(const std::string& token) { return cookie_of(log_in(token)); }
  std::string ticket(const std::string& token) {
    const http::Response response = ask("POST /ns/ticket" + bearer(token));
    const std::string text(response.content());
    const std::size_t at = text.find(":\"") + 2;
    return text.substr(at, text.find('"', at) - at);
  }

  Folder folder;
  FakeClock clock;
  SampleRobot robot;
  std::mutex log_mutex;
  std::string log;
  std::optional<Server> server;
};

const std::string own = "\nOrigin: http://localhost:4711", foreign = "\nOrigin: http://localhost:1";
const std::string html = "\nAccept: text/html,*/*;q=0.8";

}  // namespace

TEST_CASE("a login gives a cookie that stands for the token until the logout", "[server][security][R0.2]") {
  Guarded g;
  const http::Response login = g.log_in(token_of_bert);
  CHECK(login.status == 204);
  const std::string set(login.fields.find("Set-Cookie").value_or(""));
  CHECK(set.rfind("lrt-session-4711=", 0) == 0);
  CHECK(set.substr(set.find(';')) == "; Path=/; HttpOnly; SameSite=Strict");
  CHECK(set.find(token_of_bert) == std::string::npos);
  CHECK(login.fields.find("Cache-Control") == "private, no-store");
  const std::string cookie = Guarded::cookie_of(login);
  CHECK(g.status("GET /arm" + cookie) == 200);
  CHECK(g.status("PUT /arm/angle" + cookie + own + number) == 204);
  const http::Response who = g.ask("GET /ns/session" + cookie + html);
  CHECK(who.content() == R"({"name":"bert","roles":["operator"],"session":true})");
  CHECK(who.fields.find("Cache-Control") == "private, no-store");
  CHECK(g.ask("GET /ns/session" + bearer(token_of_anna)).content() == R"({"name":"anna","roles":["reader"],"session":false})");
  CHECK(g.ask("GET /").status == 401);
  CHECK(g.ask("GET /" + cookie).fields.joined("Link").find("<http://localhost:4711/ns/session>; rel=\"https://w3id.org/lrt/ns#session\"") !=
        std::string::npos);

  const http::Response logout = g.ask("DELETE /ns/session" + cookie + own);
  CHECK(logout.status == 204);
  CHECK(logout.fields.find("Set-Cookie") == "lrt-session-4711=; Max-Age=0; Path=/; HttpOnly; SameSite=Strict");
  CHECK(g.status("GET /arm" + cookie) == 401);
  CHECK(g.status("GET /arm" + bearer(token_of_bert)) == 200);
}

TEST_CASE("a browser without credentials gets a form for the token at every address", "[server][security][R0.2]") {
  Guarded g;
  for (const char* path : {"/", "/arm", "/arm/angle", "/nothing", "/ns/session"}) {
    CAPTURE(path);
    const http::Response response = g.ask(std::string("GET ") + path + html + "\nSec-Fetch-Mode: navigate", true);
    CHECK(response.status == 401);
    CHECK(response.fields.find("Content-Type") == "text/html; charset=utf-8");
    CHECK(response.content().find("<form class=\"card\" data-session=\"https://localhost:4711/ns/session\">") != std::string_view::npos);
    CHECK(response.content() == g.ask("GET /arm/name" + html, true).content());  // nothing tells a resource from none
    CHECK(response.fields.find("WWW-Authenticate") == "Bearer realm=\"lrt\"");   // with Basic a browser would show its own dialog
    CHECK(response.fields.find("Referrer-Policy") == "no-referrer");
    CHECK(response.fields.find("X-Frame-Options") == "DENY");
    const std::string policy(response.fields.find("Content-Security-Policy").value_or(""));
    CHECK(policy.find("unsafe") == std::string::npos);
    CHECK(policy.find("form-action 'none'; frame-ancestors 'none'") != std::string::npos);
  }
  CHECK(g.ask("GET /arm").fields.find("Content-Type") == "application/problem+json");
  Security without;
  without.sessions.life = std::chrono::seconds(0);
  Guarded h(without);
  CHECK(h.ask("GET /arm" + html).content().find("<form") == std::string_view::npos);
  CHECK(h.status("GET /ns/session" + bearer(token_of_anna)) == 404);
}

TEST_CASE("a cookie counts for pages of this server only, whatever allowed_origins says", "[server][security][R0.2]") {
  Security security;
  security.allowed_origins = {"http://localhost:1"};
  security.read_origins = {"*"};
  Guarded g(security);
  const std::string cookie = g.session(token_of_bert), token = bearer(token_of_bert);
  const std::string stream = "\nAccept: text/event-stream";
  const std::string same = "\nSec-Fetch-Site: same-origin", other = "\nSec-Fetch-Site: same-site", cross = "\nSec-Fetch-Site: cross-site";
  CHECK(g.status("PUT /arm/angle" + token + foreign + number) == 204);
  for (const std::string& from : {std::string(), foreign, other, cross, foreign + same, own + other, own + own, std::string("\nOrigin: null"),
                                  std::string("\nOrigin: http://localhost:4711.example")}) {
    CAPTURE(from);
    CHECK(g.status("PUT /arm/angle" + cookie + from + number) == 403);
    CHECK(g.status("POST /arm/actions/home" + cookie + from) == 403);
    CHECK(g.status("DELETE /ns/session" + cookie + from) == 403);
    CHECK(g.status("GET /arm/angle" + cookie + from + stream) == 403);
  }
  CHECK(g.robot.homed == 0);
  for (const std::string& from : {own, own + same, same}) {
    CAPTURE(from);
    CHECK(g.status("PUT /arm/angle" + cookie + from + number) == 204);
    CHECK(g.status("GET /arm/angle" + cookie + from + stream) == 200);
  }
  // Reading: what a user opens, and what pages of this server ask for.
  const std::string opened = "\nSec-Fetch-Mode: navigate\nSec-Fetch-Dest: document", framed = "\nSec-Fetch-Mode: navigate\nSec-Fetch-Dest: iframe";
  for (const std::string& from : {std::string(), same, std::string("\nSec-Fetch-Site: none"), other + opened, cross + opened})
    CHECK(g.status("GET /arm" + cookie + from) == 200);
  for (const std::string& from : {other, cross, other + framed, foreign, cross + "\nSec-Fetch-Mode: no-cors\nSec-Fetch-Dest: image"})
    CHECK(g.status("GET /arm" + cookie + from) == 403);
  CHECK_FALSE(g.ask("GET /arm" + cookie).fields.find("Access-Control-Allow-Credentials"));
}

TEST_CASE("only a page of this server may log in", "[server][security][R0.2]") {
  Security security;
  security.allowed_origins = {"*"};
  Guarded g(security);
  const std::string login = "POST /ns/session" + bearer(token_of_bert);
  for (const std::string& from :
       {std::string(), foreign, own + own, std::string("\nOrigin: null"), std::string("\nOrigin: https://localhost:4711")}) {
    CAPTURE(from);
    const http::Response response = g.ask(login + from);
    CHECK(response.status == 403);
    CHECK_FALSE(response.fields.find("Set-Cookie"));
    CHECK(g.status("POST /ns/%73ession" + bearer(token_of_bert) + from) == 403);
  }
  CHECK(g.status("POST /ns/session" + own) == 401);
  CHECK(g.status("POST /ns/session" + own + bearer("wrong-0123456789abcdef")) == 401);
  CHECK(g.status("POST /ns/session" + own + bearer(token_of_guest)) == 403);
  CHECK(g.status(login + own + "\n\ntoken=" + token_of_bert) == 413);
  CHECK(g.status(login + own + "\nHost: robot.example") == 421);
  CHECK(g.status("PUT /ns/session" + own + bearer(token_of_bert)) == 405);
  CHECK(g.status("GET /ns/ticket" + bearer(token_of_bert)) == 200);
}

TEST_CASE("a session ends with its token, and at its own time", "[server][security][R0.2]") {
  Guarded g;
  const std::string anna = g.session(token_of_anna), bert = g.session(token_of_bert);
  g.clock.advance(std::chrono::hours(11));
  CHECK(g.status("GET /arm" + anna) == 200);
  g.write_tokens("bert operator " + token_of_bert + "\n");
  g.clock.advance(std::chrono::seconds(1));
  CHECK(g.status("GET /arm" + anna) == 401);
  CHECK(g.status("GET /arm" + bert) == 200);
  g.write_tokens(all_tokens);
  g.clock.advance(std::chrono::seconds(1));
  CHECK(g.status("GET /arm" + anna) == 401);  // also when its token is there again
  g.clock.advance(std::chrono::hours(1));
  CHECK(g.status("GET /arm" + bert) == 401);
  const std::string soon = "bert reader " + token_of_bert + " 2026-11-22T00:00:00Z\n";
  g.write_tokens(soon);
  g.clock.advance(std::chrono::seconds(1));
  const std::string role = g.session(token_of_bert);
  CHECK(g.status("PUT /arm/angle" + role + own + number) == 403);  // rights are those of now
  g.clock.advance(std::chrono::hours(2));
  CHECK(g.status("GET /arm" + role) == 401);
}

TEST_CASE("a user who has lost all rights gets the form again", "[server][security][R0.2]") {
  Guarded g;
  const std::string cookie = g.session(token_of_anna);
  g.write_tokens("anna guest " + token_of_anna + "\nbert operator " + token_of_bert + "\n");
  g.clock.advance(std::chrono::seconds(1));
  const http::Response response = g.ask("GET /arm" + cookie + html);
  CHECK(response.status == 401);
  CHECK(response.content().find("<form") != std::string_view::npos);
  CHECK(g.status("GET /arm" + bearer(token_of_anna)) == 403);
  CHECK(g.log_in(token_of_bert, cookie).status == 204);
}

TEST_CASE("each login begins a new session, and a cookie that was set beforehand is unknown", "[server][security][R0.2]") {
  Guarded g;
  const std::string fixed = "\nCookie: lrt-session-4711=" + std::string(64, 'a');
  CHECK(g.status("GET /arm" + fixed) == 401);
  const http::Response login = g.log_in(token_of_anna, fixed);
  CHECK(login.status == 204);
  CHECK(g.status("GET /arm" + fixed) == 401);
  const std::string first = Guarded::cookie_of(login), second = Guarded::cookie_of(g.log_in(token_of_anna, first));
  CHECK(first != second);
  CHECK(g.status("GET /arm" + first) == 401);
  CHECK(g.status("GET /arm" + second) == 200);
  CHECK(g.status("GET /arm" + second + "; lrt-session-4711=" + std::string(64, 'a')) == 401);  // one of them was set by somebody else
  CHECK(g.status("GET /arm" + fixed + "; " + second.substr(second.find("lrt-"))) == 401);
  CHECK(g.status("GET /arm" + second + second) == 401);
  CHECK(g.status("GET /arm\nHost: 127.0.0.1:4711" + second) == 401);  // of another host
  CHECK(g.status("GET /arm\nCookie: theme=dark; lrt-session-4711=" + second.substr(second.find('=') + 1) + "; x") == 200);
}

TEST_CASE("over TLS the cookie is Secure, and no other host can have set it", "[server][security][R0.2]") {
  Guarded g;
  const http::Response login = g.log_in(token_of_anna, "", true);
  const std::string set(login.fields.find("Set-Cookie").value_or(""));
  CHECK(set.rfind("__Host-lrt-session-4711=", 0) == 0);
  CHECK(set.substr(set.find(';')) == "; Path=/; HttpOnly; SameSite=Strict; Secure");
  const std::string cookie = Guarded::cookie_of(login), value = cookie.substr(cookie.find('=') + 1);
  CHECK(g.status("GET /arm" + cookie, true) == 200);
  CHECK(g.status("GET /arm\nCookie: lrt-session-4711=" + value, true) == 401);
  CHECK(g.status("GET /arm\nCookie: lrt-session-4711=" + value, false) == 401);
  CHECK(g.status("GET /arm" + g.session(token_of_anna), true) == 401);  // of the plain port
  CHECK(g.ask("DELETE /ns/session" + cookie + "\nOrigin: https://localhost:4711", true).fields.find("Set-Cookie") ==
        "__Host-lrt-session-4711=; Max-Age=0; Path=/; HttpOnly; SameSite=Strict; Secure");
}

TEST_CASE("robots of one host and port have sessions of their own, also behind a proxy", "[server][security][R0.2]") {
  Guarded first({}, "", "https://factory.example/cell7"), second({}, "", "https://factory.example/cell8");
  const std::string through_proxy = "\nOrigin: https://factory.example\nHost: factory.example",
                    login = "POST /ns/session" + bearer(token_of_anna) + through_proxy;
  const http::Response one = first.ask(login), other = second.ask(login);
  REQUIRE(one.status == 204);
  CHECK(first.status("POST /cell7/ns/session" + bearer(token_of_anna) + through_proxy) == 204);  // a proxy may keep the path
  CHECK(one.fields.find("Set-Cookie")->substr(0, 19) == "__Host-lrt-session-");                  // the browser came over https
  const std::string both = Guarded::cookie_of(one) + "; " + Guarded::cookie_of(other).substr(9) + "\nHost: factory.example";
  CHECK(first.status("GET /arm" + both) == 200);
  CHECK(second.status("GET /arm" + both) == 200);
  CHECK(second.status("PUT /arm/angle" + both + "\nOrigin: https://factory.example" + number) == 403);  // anna reads only
  const std::string plain = "\nCookie: " + both.substr(both.find("lrt-session"));
  CHECK(first.status("GET /arm" + plain) == 401);
}

TEST_CASE("sessions are limited, and one principal ends no session of others", "[server][security][R0.2]") {
  Security security;
  security.sessions.max_sessions = 3;
  security.sessions.max_sessions_per_principal = 2;
  Guarded g(security);
  const std::string bert = g.session(token_of_bert), first = g.session(token_of_anna);
  g.clock.advance(std::chrono::seconds(1));
  const std::string second = g.session(token_of_anna), third = g.session(token_of_anna);
  CHECK(g.status("GET /arm" + bert) == 200);
  CHECK(g.status("GET /arm" + first) == 401);
  CHECK(g.status("GET /arm" + second) == 200);
  CHECK(g.status("GET /arm" + third) == 200);
  const http::Response full = g.log_in(token_of_bert);
  CHECK(full.status == 503);
  CHECK(full.fields.find("Retry-After"));
  CHECK(g.ask("DELETE /ns/session" + third + own).status == 204);
  CHECK(g.log_in(token_of_bert).status == 204);
}

TEST_CASE("too many failed logins of an address get 429, and others log in", "[server][security][R0.2]") {
  Guarded g;
  const std::string wrong = "POST /ns/session" + own + bearer("wrong-0123456789abcdef"), right = "POST /ns/session" + own + bearer(token_of_anna);
  const std::string before = g.session(token_of_anna);
  CHECK(g.status("POST /ns/session" + foreign + bearer("wrong-0123456789abcdef")) == 403);  // a page elsewhere cannot use them up
  for (int i = 0; i < 10; ++i) CHECK(g.status(wrong) == 401);
  for (const std::string& login : {wrong, right}) {
    const http::Response response = g.ask(login);
    CHECK(response.status == 429);
    CHECK(response.fields.find("Retry-After") == "60");
  }
  CHECK(g.status("POST /ns/%73ession" + own + bearer(token_of_anna)) == 429);
  CHECK(g.status("GET /arm" + before) == 200);
  CHECK(g.status("GET /arm" + bearer(token_of_anna)) == 200);
  CHECK(g.ask(right, false, "192.0.2.7").status == 204);
  g.clock.advance(security::FailedLogins::window);
  CHECK(g.status(right) == 204);
}

TEST_CASE("a session stands for the tokens of the user's own function, too", "[server][security][R0.2]") {
  bool known = true;
  Security security;
  security.authenticate = [&](const http::Request& request) -> std::optional<security::Principal> {
    if (known && request.find("Authorization") == "Bearer its.own.token") return security::Principal{"jo", {"operator"}};
    return std::nullopt;
  };
  Guarded g(security);
  const std::string cookie = g.session("its.own.token");
  CHECK(g.ask("GET /ns/session" + cookie).content() == R"({"name":"jo","roles":["operator"],"session":true})");
  known = false;
  CHECK(g.status("GET /arm" + cookie) == 401);
}

namespace {

/// A server whose own function knows the tokens "jo-1", "jo-2" ... of jo, and the same of ann.
struct OfOne {
  explicit OfOne(const std::string& transport = "") : g(security(), transport) {}
  Security security() {
    Security made;
    made.authenticate = [this](const http::Request& request) -> std::optional<security::Principal> {
      const std::string token(request.find("Authorization").value_or(""));
      const std::string name = token.substr(0, 10) == "Bearer jo-" ? "jo" : token.substr(0, 11) == "Bearer ann-" ? "ann" : "";
      if (name.empty() || refused == name) return std::nullopt;
      if (meanwhile) meanwhile();
      security::Principal principal{name, {"operator"}};
      principal.expires = expires;
      return principal;
    };
    return made;
  }
  Served stream(const std::string& credentials) {
    RequestText request("GET /arm/angle\nAccept: text/event-stream\nHost: localhost:4711" + credentials);
    request.get().local_port = 4711;
    request.get().can_stream = true;
    return g.server->serve(request.get());
  }
  /// Within a minute. Requests wake the thread that serves, because the clock is moved by hand.
  bool ends(Served& stream) {
    for (const auto late = std::chrono::steady_clock::now() + std::chrono::minutes(1); std::chrono::steady_clock::now() < late;)
      if (has_ended(stream)) return true;
    return false;
  }
  bool has_ended(Served& stream) {
    (void)g.status("GET /nothing");
    for (int i = 0; i < 20; ++i)
      if (stream.events->next(std::chrono::milliseconds(1)).end) return true;
    return false;
  }

  std::function<void()> meanwhile;  ///< called while a request is authenticated
  std::string refused;
  std::optional<std::chrono::system_clock::time_point> expires;
  Guarded g;
};

const std::string jo = "\nAuthorization: Bearer jo-0123456789abcdef", ann = "\nAuthorization: Bearer ann-0123456789abcdef";

}  // namespace

TEST_CASE("sign_out() ends what a principal has open, and nothing of others", "[server][security][R0.2]") {
  OfOne o;
  const std::string cookie = o.g.session("jo-0123456789abcdef"), of_ann = o.g.session("ann-0123456789abcdef");
  const std::string ticket = o.g.ticket("jo-0123456789abcdef");
  Served first = o.stream(jo), second = o.stream(cookie + own), third = o.stream(ann);
  REQUIRE((first.events && second.events && third.events));
  CHECK_FALSE(o.has_ended(first));
  o.g.server->sign_out("nobody");
  CHECK_FALSE(o.has_ended(first));
  o.refused = "jo";
  CHECK_FALSE(o.has_ended(second));  // to refuse requests is not enough
  o.g.server->sign_out("jo");
  CHECK(o.ends(first));
  CHECK(o.ends(second));
  CHECK_FALSE(o.has_ended(third));
  CHECK(o.g.server->counters().event_streams == 1);
  o.refused.clear();
  CHECK(o.g.status("GET /arm" + cookie) == 401);  // also when it is let in again
  CHECK(o.g.status("GET /arm/angle?ticket=" + ticket + "\nAccept: text/event-stream") == 401);
  CHECK(o.g.status("GET /arm" + of_ann) == 200);
  CHECK(o.g.status("GET /arm" + jo) == 200);
}

TEST_CASE("who is signed out while its request is authenticated opens no stream", "[server][security][R0.2]") {
  OfOne o;
  const auto elsewhere = [&o](const char* name) { return [&o, name] { std::thread([&o, name] { o.g.server->sign_out(name); }).join(); }; };
  o.meanwhile = elsewhere("jo");
  CHECK(o.g.status("GET /arm" + jo) == 200);  // what has begun goes on
  const Served late = o.stream(jo);
  CHECK(late.response.status == 401);
  CHECK_FALSE(late.events);
  o.meanwhile = elsewhere("ann");
  CHECK(o.stream(jo).response.status == 200);
  o.meanwhile = [&o] { o.g.server->sign_out("jo"); };  // by the function itself, which lets it in again
  CHECK(o.stream(jo).response.status == 200);
  o.meanwhile = nullptr;
  CHECK(o.stream(jo).response.status == 200);
}

TEST_CASE("a principal of the user's own function ends when it says, with its streams", "[server][security][R0.2]") {
  using std::chrono::seconds;
  OfOne o;
  const auto now = o.g.clock.now().utc;
  o.expires = now + seconds(60);
  Served first = o.stream(jo);
  o.expires = std::nullopt;
  Served endless = o.stream(ann);
  o.g.clock.advance(seconds(59));
  CHECK_FALSE(o.has_ended(first));
  o.g.clock.advance(seconds(2));
  CHECK(o.ends(first));
  CHECK_FALSE(o.has_ended(endless));
  o.expires = now + seconds(60);
  CHECK(o.g.status("GET /arm" + jo) == 401);  // the function says that it has ended
  // A later token of the same name keeps the streams of the earlier one.
  o.expires = now + seconds(120);
  Served second = o.stream(jo);
  o.expires = now + seconds(180);
  CHECK(o.g.status("GET /arm" + jo) == 200);
  o.g.clock.advance(seconds(70));
  CHECK_FALSE(o.has_ended(second));
  o.g.clock.advance(seconds(60));
  CHECK(o.ends(second));
  CHECK_FALSE(o.has_ended(endless));
  // The ends of the clock's range.
  o.expires = std::chrono::system_clock::time_point::max();
  Served third = o.stream(jo);
  REQUIRE(third.events);
  o.g.clock.advance(std::chrono::hours(24));
  CHECK_FALSE(o.has_ended(third));
  o.expires = std::chrono::system_clock::time_point::min();
  CHECK(o.g.status("GET /arm" + jo) == 401);
}

TEST_CASE("a ticket opens one event stream within 30 s, and nothing else", "[server][security][R0.2]") {
  Guarded g;
  const std::string stream = "\nAccept: text/event-stream";
  const auto target = [](const std::string& ticket) { return "GET /arm/angle?queueLength=2&ticket=" + ticket; };
  const http::Response made = g.ask("POST /ns/ticket" + bearer(token_of_anna));
  CHECK(made.content().find("\"expires_in\":30") != std::string_view::npos);
  CHECK(made.fields.find("Cache-Control") == "private, no-store");
  const std::string once = g.ticket(token_of_anna);
  CHECK(once.size() == 64);
  CHECK(g.status(target(once) + stream) == 200);
  CHECK(g.status(target(once) + stream) == 401);
  const std::string elsewhere = g.ticket(token_of_bert);
  CHECK(g.status(target(elsewhere)) == 401);
  CHECK(g.status("PUT /arm/angle?ticket=" + elsewhere + number) == 401);
  CHECK(g.status("GET /arm/angle?ticket=" + elsewhere + "\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/") == 401);
  CHECK(g.status(target(elsewhere) + stream) == 200);  // it was not used up by that
  const std::string late = g.ticket(token_of_anna);
  g.clock.advance(std::chrono::seconds(30));
  CHECK(g.status(target(late) + stream) == 401);
  const std::string revoked = g.ticket(token_of_anna);
  g.write_tokens("bert operator " + token_of_bert + "\n");
  g.clock.advance(std::chrono::seconds(1));
  CHECK(g.status(target(revoked) + stream) == 401);
  const std::string of_page = g.ticket(token_of_bert);
  CHECK(g.status(target(of_page) + stream + foreign) == 403);  // of a page that is not in allowed_origins
  CHECK(g.status("POST /ns/ticket") == 401);
  CHECK(g.status("POST /ns/ticket" + g.session(token_of_bert) + own) == 400);
  CHECK(g.log.find(once) == std::string::npos);
  CHECK(g.log.find(token_of_anna) == std::string::npos);
}

TEST_CASE("tickets are limited, and one principal ends no ticket of others", "[server][security][R0.2]") {
  Security security;
  security.sessions.max_tickets = 2;
  security.sessions.max_tickets_per_principal = 1;
  Guarded g(security);
  const std::string stream = "\nAccept: text/event-stream";
  const std::string anna = g.ticket(token_of_anna), first = g.ticket(token_of_bert), second = g.ticket(token_of_bert);
  CHECK(g.status("GET /arm/angle?ticket=" + first + stream) == 401);
  CHECK(g.status("GET /arm/angle?ticket=" + second + stream) == 200);
  CHECK(g.status("GET /arm/angle?ticket=" + anna + stream) == 200);
}

TEST_CASE("sessions and tickets work on each transport, WebSockets included", "[server][security][R0.2]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    Security security;
    security.allowed_origins = {"http://dashboard.example"};
    Guarded g(security, std::string(transport));
    const std::string authority = "127.0.0.1:" + std::to_string(g.server->port()), host = "\nHost: " + authority,
                      mine = "\nOrigin: http://" + authority;
    const std::string handshake =
        host + "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    const auto ask = [&](const std::string& request) { return Socket(g.server->port()).ask(request); };
    const Answer login = ask("POST /ns/session" + host + mine + bearer(token_of_bert) + "\nContent-Length: 0");
    REQUIRE(login.status == 204);
    const std::string set = login.field("Set-Cookie"), cookie = "\nCookie: " + set.substr(0, set.find(';'));
    CHECK(ask("GET /arm" + host + cookie).status == 200);
    CHECK(ask("GET /arm" + host + cookie + "\nSec-Fetch-Site: same-site").status == 403);
    CHECK(ask("PUT /arm/angle" + host + cookie + "\nSec-Fetch-Site: same-origin" + number).status == 204);
    CHECK(ask("PUT /arm/angle" + host + cookie + mine + number).status == 204);
    CHECK(ask("PUT /arm/angle" + host + cookie + number).status == 403);
    CHECK(ask("GET /arm/angle" + handshake + cookie + mine).status == 101);
    CHECK(ask("GET /arm/angle" + handshake + cookie).status == 403);
    CHECK(ask("GET /arm/angle" + handshake + cookie + "\nOrigin: http://dashboard.example").status == 403);
    const auto ticket = [&] {
      const std::string text =
          ask("POST /ns/ticket" + host + "\nOrigin: http://dashboard.example" + bearer(token_of_anna) + "\nContent-Length: 0").body;
      const std::size_t at = text.find(":\"") + 2;
      return text.substr(at, text.find('"', at) - at);
    };
    const std::string once = ticket();
    CHECK(ask("GET /arm/angle?ticket=" + once + handshake + "\nOrigin: http://dashboard.example").status == 101);
    CHECK(ask("GET /arm/angle?ticket=" + once + handshake + "\nOrigin: http://dashboard.example").status == 401);
    CHECK(ask("GET /arm/angle?ticket=" + ticket() + handshake + "\nOrigin: http://elsewhere.example").status == 403);
    CHECK(ask("DELETE /ns/session" + host + cookie + mine).status == 204);
    CHECK(ask("GET /arm" + host + cookie).status == 401);
  }
}

TEST_CASE("what sessions may be is checked", "[server][security][R0.2]") {
  for (const auto& [life, ticket_life] :
       {std::pair(std::chrono::seconds(-1), std::chrono::seconds(30)), std::pair(std::chrono::seconds(1), std::chrono::seconds(0)),
        std::pair(std::chrono::seconds(365 * 86'400 + 1), std::chrono::seconds(30)),
        std::pair(std::chrono::seconds(1), std::chrono::seconds(3'601))}) {
    Options options;
    options.listen.transport = transport::no_network;
    options.security.authenticate = [](const http::Request&) { return std::nullopt; };
    options.security.sessions.life = life;
    options.security.sessions.ticket_life = ticket_life;
    const auto made = Server::create(std::move(options));
    REQUIRE_FALSE(made);
    CHECK(made.error().code == Errc::invalid_option);
  }
}
