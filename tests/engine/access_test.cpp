// SPDX-License-Identifier: Apache-2.0
#include "src/engine/access.hpp"

#include <memory>
#include <stdexcept>
#include <string>

#include "src/engine/parts.hpp"
#include "src/http/target.hpp"
#include "src/security/sessions.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using security::Right;

namespace {

EngineOptions with_sessions(std::vector<std::string> commanders = {}) {
  EngineOptions options;
  options.sessions = std::make_shared<security::Sessions>(security::SessionOptions{}, "");
  options.allowed_origins = std::move(commanders);
  options.challenge = "Test";
  return options;
}

const std::string own = "\nOrigin: http://localhost", foreign = "\nOrigin: http://evil.example", same_site = "\nSec-Fetch-Site: same-origin";

struct Control {
  explicit Control(EngineOptions options = with_sessions()) : parts(std::move(options)) {}

  std::optional<http::Response> denied(const std::string& text, const Result<Caller>& caller = Caller()) {
    RequestText request(text);
    return parts.access.denied(context(request), caller);
  }
  int status(const std::string& text, const Result<Caller>& caller = Caller()) {
    const auto response = denied(text, caller);
    return response ? response->status : 0;
  }
  std::optional<http::Response> login(const std::string& fields, const Caller& caller) {
    RequestText request("POST /ns/session" + fields);
    return parts.access.refused_login(context(request), caller);
  }
  /// @param has_resource  false: the target names nothing
  std::optional<http::Response> refused(const std::string& text, security::Rights rights, bool has_principal, bool has_resource = true) {
    RequestText request(text);
    Context c = context(request);
    if (has_resource) c.resource = &parts.root;
    Caller caller;
    if (has_principal) caller.principal = anna;
    c.audience = {std::make_shared<const security::View>(rights), caller.principal};
    auto response = parts.access.refused_right(c, caller);
    found = c.resource != nullptr;
    return response;
  }
  Context context(RequestText& request) {
    Context c(request.get(), clock.now());
    c.base = parts.bases.of(request.get(), http::split_target(request.get().target).value()).value();
    return c;
  }

  const std::shared_ptr<const security::Principal> anna = std::make_shared<const security::Principal>(security::Principal{"anna", {}});
  FakeClock clock;
  Parts parts;
  bool found = false;
};

Caller by_cookie() {
  Caller caller;
  caller.by_cookie = true;
  return caller;
}

}  // namespace

TEST_CASE("the authorizer gets a request without its body, and its exceptions are errors", "[engine][security][R0.2]") {
  RequestText request("PUT /arm/angle\nX-Mark: yes\n\n43.5");
  const auto of_header = [](const http::Request& header) {
    CHECK(header.body.empty());
    return Caller(header.find("X-Mark") == "yes" ? engine::Access::forbidden : engine::Access::granted);
  };
  CHECK(caller_of(request.get(), of_header).value().access == engine::Access::forbidden);
  CHECK(caller_of(request.get(), [](const http::Request&) -> Caller { throw std::runtime_error("no"); }).error().message == "it threw: no");
}

TEST_CASE("the caller of a judged header section is not looked for again", "[engine][security]") {
  Caller caller;
  caller.client = "anna";
  RequestText request("PUT /arm/angle");
  request.get().judged = judged_caller(caller);
  const auto fails = [](const http::Request&) -> Caller { throw std::runtime_error("asked again"); };
  CHECK(caller_of(request.get(), fails).value().client == "anna");
  // All callers with all rights share one object, which costs no allocation.
  CHECK(judged_caller(Caller()) == judged_caller(Caller()));
  CHECK(judged_caller(caller) != judged_caller(caller));
}

TEST_CASE("a caller is refused by its verdict, and every refusal says why", "[engine][security][R0.2]") {
  Control access;
  CHECK_FALSE(access.denied("GET /arm"));
  Caller busy(engine::Access::too_many_requests);
  busy.retry_after = std::chrono::seconds(7);
  const auto too_many = access.denied("GET /arm" + foreign, busy);
  CHECK(too_many.value().status == 429);
  CHECK(too_many->denial == http::Denial::rate);
  CHECK(too_many->fields.find("Retry-After") == "7");
  Caller unknown(engine::Access::unauthenticated);
  CHECK(access.denied("GET /arm", unknown).value().fields.find("WWW-Authenticate") == "Test");
  unknown.challenge = "Bearer realm=\"lrt\"";
  CHECK(access.denied("GET /arm", unknown).value().fields.find("WWW-Authenticate") == unknown.challenge);
  const auto forbidden = access.denied("GET /arm", Caller(engine::Access::forbidden));
  CHECK(forbidden.value().status == 403);
  CHECK(forbidden->denial == http::Denial::right);
  CHECK(access.status("GET /arm", unexpected(Errc::failed, "it threw")) == 500);
}

TEST_CASE("pages of other origins and notifications are refused before the authorizer's verdict", "[engine][security]") {
  Control access(with_sessions({"http://dashboard.example"}));
  const Caller forbidden(engine::Access::forbidden);
  CHECK(access.denied("PUT /arm/angle" + foreign, forbidden).value().denial == http::Denial::origin);
  CHECK(access.status("GET /arm" + foreign) == 0);  // a read; CORS decides
  CHECK(access.status("PUT /arm/angle" + own) == 0);
  CHECK(access.status("PUT /arm/angle\nOrigin: http://dashboard.example") == 0);
  const std::string notification = "\nLrt-Notification-Of: x; base=\"http://other.example\"";
  CHECK(access.denied("PUT /arm/angle" + notification, forbidden).value().denial == http::Denial::notification);
  CHECK(access.status("GET /arm" + notification) == 0);
}

TEST_CASE("a cookie commands only for pages of this server", "[engine][security]") {
  Control access(with_sessions({"*"}));
  CHECK(access.status("PUT /arm/angle" + own, by_cookie()) == 0);
  CHECK(access.status("PUT /arm/angle" + same_site, by_cookie()) == 0);
  CHECK(access.status("PUT /arm/angle", by_cookie()) == 403);
  CHECK(access.status("PUT /arm/angle" + foreign, by_cookie()) == 403);
  CHECK(access.status("PUT /arm/angle" + own + "\nSec-Fetch-Site: same-site", by_cookie()) == 403);
  CHECK(access.status("GET /arm", by_cookie()) == 0);
  CHECK(access.status("GET /arm\nSec-Fetch-Site: cross-site", by_cookie()) == 403);
  CHECK(access.status("GET /arm\nSec-Fetch-Site: cross-site\nSec-Fetch-Mode: navigate\nSec-Fetch-Dest: document", by_cookie()) == 0);
}

TEST_CASE("a resource that the caller may not read is missing, unless it has no right at all", "[engine][security][rights]") {
  Control access;
  CHECK_FALSE(access.refused("GET /", Right::read, true));
  CHECK(access.found);
  const auto forbidden = access.refused("PUT /", Right::read, true);
  CHECK(forbidden.value().status == 403);
  CHECK(access.refused("PUT /", Right::read, false).value().status == 401);
  CHECK(access.refused("GET /nowhere", Right::read, true, false).value().status == 404);
  CHECK(access.refused("GET /", security::Rights(), true).value().status == 403);
  CHECK_FALSE(access.found);
  CHECK(access.refused("GET /", security::Rights(), false).value().status == 401);
}

TEST_CASE("only a page of this server logs in, and failed logins take time", "[engine][security]") {
  Control access;
  Caller known, unknown(engine::Access::unauthenticated);
  known.principal = access.anna;
  CHECK(access.login("", known).value().denial == http::Denial::origin);
  CHECK(access.login(foreign, known).value().denial == http::Denial::origin);
  CHECK_FALSE(access.login(own, known));
  int tries = 0;
  while (!access.login(own, unknown)) REQUIRE(++tries < 100);
  const auto paused = access.login(own, known);  // also with the right token
  CHECK(paused.value().status == 429);
  CHECK(paused->fields.find("Retry-After"));
  access.clock.advance(std::chrono::hours(24));
  CHECK_FALSE(access.login(own, known));
}
