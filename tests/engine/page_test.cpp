// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "src/security/sessions.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {
const std::string browser = "\nAccept: text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,*/*;q=0.8";
const std::string html = "text/html; charset=utf-8";

void check_harmless(const Answer& a) {
  const std::string policy = a.field("Content-Security-Policy");
  CHECK(policy.rfind("default-src 'none'; script-src 'sha256-", 0) == 0);
  for (const char* part : {"; style-src 'sha256-", "; connect-src 'self'", "; base-uri 'none'", "; form-action 'none'", "; frame-ancestors 'none'"})
    CHECK(policy.find(part) != std::string::npos);
  CHECK(policy.find("unsafe") == std::string::npos);
  CHECK(a.field("X-Frame-Options") == "DENY");
  CHECK(a.field("X-Content-Type-Options") == "nosniff");
  CHECK(a.field("Referrer-Policy") == "no-referrer");
  CHECK(a.members("Vary").count("Accept") == 1);
}
}  // namespace

TEST_CASE("a browser gets the same page from every resource, and a client that accepts anything gets Turtle", "[engine][R0.3][R1.2]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const std::string invocation = bench.ask("POST /arm/actions/home").field("Location").substr(std::strlen("http://localhost"));
  const Answer root = bench.ask("GET /" + browser);
  CHECK(root.status == 200);
  for (const std::string& path : {std::string("/arm"), std::string("/arm/state"), std::string("/arm/angle"), std::string("/arm/speed"),
                                  std::string("/arm/broken"), std::string("/arm/actions/home"), std::string("/arm/blueprint"),
                                  std::string("/arm/subscriptions"), std::string("/arm/waypoints"), invocation}) {
    CAPTURE(path);
    const std::string get = "GET " + path;
    const Answer page = bench.ask(get + browser);
    CHECK(page.status == 200);
    CHECK(page.field("Content-Type") == html);
    CHECK(page.body == root.body);
    CHECK(page.field("ETag") == root.field("ETag"));
    CHECK(page.field("Allow").find("GET") != std::string::npos);
    CHECK(page.field("Link").find("ldp#Resource") != std::string::npos);
    check_harmless(page);
    CHECK(bench.ask(get + "\nAccept: text/html").field("Content-Type") == html);
    if (path == "/arm/broken") continue;  // 500: a lambda throws
    for (const char* accept : {"*/*", "text/*", "text/html, text/turtle", "text/html;q=0.5, */*;q=0.6"})
      CHECK(bench.ask(get + "\nAccept: " + accept).field("Content-Type") == "text/turtle");
  }
}

TEST_CASE("the page reads no value: a robot that does not poll shows it all the same", "[engine]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const auto sent = bench.send("GET /arm/speed" + browser);
  CHECK_FALSE(sent.ticket);
  CHECK(sent.answer.status == 200);
}

TEST_CASE("the page has at most 100,000 bytes and fetches nothing from elsewhere", "[engine]") {
  Bench bench;
  const Answer page = bench.ask("GET /" + browser);
  CHECK(page.body.size() <= 100'000);
  CHECK(page.body.find("<script type=\"module\">") != std::string::npos);
  for (const char* other : {"src=", "@import", " url(", "{{", "onclick=\"", "style=\"", "innerHTML"}) {
    CAPTURE(other);
    CHECK(page.body.find(other) == std::string::npos);
  }
}

TEST_CASE("the page has a tag of its own: 304, 412, HEAD, ranges", "[engine][R0.11]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const Answer page = bench.ask("GET /arm" + browser);
  const std::string tag = page.field("ETag");
  CHECK(tag != bench.get("/arm").field("ETag"));
  const Answer same = bench.ask("GET /arm" + browser + "\nIf-None-Match: " + tag);
  CHECK(same.status == 304);
  CHECK(same.field("ETag") == tag);
  CHECK(same.field("Vary") == "Accept");
  CHECK(bench.ask("GET /arm\nIf-None-Match: " + tag).status == 200);
  CHECK(bench.ask("GET /arm" + browser + "\nIf-Match: \"other\"").status == 412);
  const Answer head = bench.ask("HEAD /arm" + browser);
  CHECK(head.status == 200);
  CHECK(head.field("ETag") == tag);
  CHECK(head.field("Content-Type") == html);
  const Answer part = bench.ask("GET /arm" + browser + "\nRange: bytes=0-14");
  CHECK(part.status == 206);
  CHECK(part.body == "<!doctype html>");
}

TEST_CASE("a WebSocket never gets HTML, whatever a browser accepts", "[engine][R0.17]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const auto channel = bench.open("/arm/angle", browser.substr(1) + "\n");
  const auto messages = bench.messages(channel);
  REQUIRE_FALSE(messages.empty());
  CHECK(messages.front().find("<html") == std::string::npos);
  CHECK(bench.upgrade("/arm/angle", "Accept: text/html\n").answer.status == 406);
}

TEST_CASE("406 names the page too", "[engine][R0.6]") {
  Bench bench;
  CHECK(bench.ask("GET /\nAccept: image/png").says("text/html"));
}

TEST_CASE("an error is a page with the script for the stops, and what a stranger sent is only text in it", "[engine][R0.6]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const Answer missing = bench.ask("GET /nowhere" + browser);
  CHECK(missing.status == 404);
  CHECK(missing.field("Content-Type") == html);
  CHECK(missing.says("<h1>404 Not Found</h1>"));
  CHECK(missing.says("there is no resource at"));
  CHECK(missing.says("/\">Back to the list of Things</a>"));
  check_harmless(missing);
  CHECK(missing.says("data-home=\"http://localhost/\""));
  CHECK(missing.says("<div id=\"stops\""));
  CHECK(missing.body.size() < 100'000);
  const Answer foreign = bench.ask("POST /arm/actions/home" + browser + "\nOrigin: http://x/<script>alert(\"1\")</script>&'{{home}}");
  CHECK(foreign.status == 403);
  CHECK(foreign.says("http://x/&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&amp;&#39;{{home}}"));
  CHECK_FALSE(foreign.says("<script>alert"));
  CHECK(bench.ask("DELETE /arm" + browser).field("Allow").find("GET") != std::string::npos);
  CHECK(bench.ask("GET /nowhere\nAccept: */*").field("Content-Type") == "application/problem+json");
}

TEST_CASE("commands of the page are of the same origin and are taken; those of another page are not", "[engine]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const auto post = [&](const std::string& origin) {
    return bench.ask("POST /arm/actions/home\nAccept: application/n-triples, application/problem+json;q=0.9\nOrigin: " + origin);
  };
  CHECK(post("http://elsewhere.example").status == 403);
  CHECK(robot.homed == 0);
  CHECK(post("http://localhost").status == 204);
  CHECK(robot.homed == 1);
}

namespace {

/// A page of a host's own, without a login page.
class OwnPage : public engine::PageSource {
 public:
  const std::shared_ptr<const std::string>& html() const override { return html_; }
  const std::string& tag() const override { return tag_; }
  std::string error(int status, std::string_view detail, std::string_view home) const override {
    return "error " + std::to_string(status) + " " + std::string(detail) + " " + std::string(home);
  }
  void add_fields(http::Fields& fields) const override {
    fields.add("Content-Type", "text/html; charset=utf-8");
    fields.add("Content-Security-Policy", "default-src 'none'");
  }

 private:
  std::shared_ptr<const std::string> html_ = std::make_shared<const std::string>("own page");
  std::string tag_ = "\"own\"";
};

class PageWithLogin final : public OwnPage {
 public:
  bool add_login(http::Response& response, std::string_view session) const override {
    response.fields.add("Content-Type", "text/html; charset=utf-8");
    response.fields.add("X-Frame-Options", "DENY");
    response.set_body("log in at " + std::string(session));
    return true;
  }
};

/// An engine that knows nobody.
engine::EngineOptions closed_to_all(std::shared_ptr<const engine::PageSource> page, bool has_sessions) {
  engine::EngineOptions options;
  options.page = std::move(page);
  options.authorize = [](const http::Request& request) {
    return engine::Caller(request.find("Who") ? engine::Access::forbidden : engine::Access::unauthenticated);
  };
  if (has_sessions) options.sessions = std::make_shared<security::Sessions>(security::SessionOptions{}, "");
  return options;
}

}  // namespace

TEST_CASE("a page of the host's own has the fields that it adds, also as an error page", "[engine]") {
  engine::EngineOptions options;
  options.page = std::make_shared<const OwnPage>();
  Bench bench(std::move(options));
  const Answer page = bench.ask("GET /" + browser);
  CHECK(bench.ask("GET /ns/lrt" + browser).body == "own page");  // it has none for lists of terms
  CHECK(page.body == "own page");
  CHECK(page.tag() == "\"own\"");
  CHECK(page.field("Content-Type") == html);
  CHECK(page.field("Content-Security-Policy") == "default-src 'none'");
  const Answer missing = bench.ask("GET /nowhere" + browser);
  CHECK(missing.status == 404);
  CHECK(missing.body.find("error 404 ") == 0);
  CHECK(missing.says(" http://localhost/"));
  CHECK(missing.field("Content-Type") == html);
  CHECK(missing.field("Content-Security-Policy") == "default-src 'none'");
  CHECK_FALSE(bench.ask("GET /\nAccept: text/turtle").has("Content-Security-Policy"));
}

TEST_CASE("a browser without credentials gets the login page, if there is one and somebody can log in", "[engine][security][R0.2]") {
  const std::string ask = "GET /" + browser;
  Bench with(closed_to_all(std::make_shared<const PageWithLogin>(), true));
  const Answer login = with.ask(ask);
  CHECK(login.status == 401);
  CHECK(login.body == "log in at http://localhost/ns/session");
  CHECK(login.field("Content-Type") == html);
  CHECK(login.field("X-Frame-Options") == "DENY");
  CHECK(login.field("Content-Security-Policy") != "default-src 'none'");  // has the fields of the login page, not those of others
  CHECK(login.has("WWW-Authenticate"));
  CHECK(with.ask("GET /\nAccept: application/json").field("Content-Type") == "application/json");
  const Answer forbidden = with.ask(ask + "\nWho: anna");
  CHECK(forbidden.status == 403);
  CHECK(forbidden.body.find("error 403 ") == 0);

  Bench no_sessions(closed_to_all(std::make_shared<const PageWithLogin>(), false)), no_page(closed_to_all(std::make_shared<const OwnPage>(), true));
  for (Bench* const bench : {&no_sessions, &no_page}) {
    const Answer error = bench->ask(ask);
    CHECK(error.status == 401);
    CHECK(error.body.find("error 401 ") == 0);
    CHECK(error.field("Content-Type") == html);
    CHECK(error.field("Content-Security-Policy") == "default-src 'none'");
  }
}

TEST_CASE("the login page of lrt contains the IRI of the session as text, and has a policy of its own", "[engine][security]") {
  const auto page = page::console();
  http::Response response;
  response.status = 401;
  CHECK(page->add_login(response, "http://robot/ns/session?\"><script>alert('1')</script>&{{session}}"));
  CHECK(response.status == 401);
  const std::string body(response.content());
  CHECK(body.find("http://robot/ns/session?&quot;&gt;&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&amp;{{session}}") != std::string::npos);
  CHECK(body.find("<script>alert") == std::string::npos);
  http::Fields fields;
  page->add_fields(fields);
  for (const char* const name : {"Content-Type", "X-Frame-Options", "Referrer-Policy"}) {
    CAPTURE(name);
    CHECK(response.fields.joined(name) == fields.joined(name));
    CHECK_FALSE(fields.joined(name).empty());
  }
  CHECK(fields.joined("Content-Security-Policy").find("default-src 'none'; script-src 'sha256-") == 0);
  CHECK(response.fields.joined("Content-Security-Policy").find("default-src 'none'; script-src 'sha256-") == 0);
  CHECK(response.fields.joined("Content-Security-Policy") != fields.joined("Content-Security-Policy"));  // it has another script
}
