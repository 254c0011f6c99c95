// SPDX-License-Identifier: Apache-2.0
// Rights for parts of a robot. Tokens identify the client, rules state its rights at each path: here in Turtle, as Web Access Control has it; in a
// file of that kind for Security::policy_file, or as a list of security::Rule in code. For each resource the nearest rules count. What a client may
// not see is in no list, link or document, and asked for by its path it is like a resource that does not exist. What it may not do is not in Allow.
#include <utility>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

const char* const rules = R"(
  @prefix acl: <http://www.w3.org/ns/auth/acl#> .
  @prefix lrt: <https://w3id.org/lrt/ns#> .

  # All who have a token read and watch.
  <#guests> a acl:Authorization ; acl:accessTo </> ; acl:default </> ;
    acl:agentClass acl:AuthenticatedAgent ; acl:mode acl:Read, lrt:Subscribe .

  # Operators write and invoke.
  <#operators> a acl:Authorization ; acl:default </> ;
    acl:agentGroup <#operator> ; acl:mode acl:Write, lrt:Invoke .

  # The service counter is for operators only, and they only read it.
  <#service> a acl:Authorization ; acl:accessTo </arm/service> ;
    acl:agentGroup <#operator> ; acl:mode acl:Read .
)";

int main() {
  double speed = 1;
  lrt::Thing arm{"arm"};
  arm.property("speed", [&] { return speed; }).on_write([&](double v) { speed = v; });
  arm.property("service", [] { return 412; });

  lrt::Options options = lesson::options();
  options.security.authenticate = [](const lrt::http::Request& request) -> std::optional<lrt::security::Principal> {
    const auto badge = request.find("X-Badge");  // stands for a check of yours; Security::token_file needs no code
    if (badge == "anna") return lrt::security::Principal{"anna", {"guest"}};
    if (badge == "bert") return lrt::security::Principal{"bert", {"operator"}};
    return std::nullopt;
  };
  options.security.rules = lrt::security::parse_rules(rules).value();
  auto server = lrt::Server::create(std::move(options)).value();
  server.add(std::move(arm)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.get("/arm/speed");
    client.options("/arm/speed", "X-Badge: anna\r\n");
    client.options("/arm/speed", "X-Badge: bert\r\n");
    client.put("/arm/speed", "<> vom:numericalValue 2.0 .", "X-Badge: anna\r\n");
    client.put("/arm/speed", "<> vom:numericalValue 2.0 .", "X-Badge: bert\r\n");
    client.get("/arm/service", "X-Badge: anna\r\nAccept: application/json\r\n");
    client.get("/arm/nothing", "X-Badge: anna\r\nAccept: application/json\r\n");
    client.get("/arm/state", "X-Badge: anna\r\nAccept: application/json\r\n");
    client.get("/arm/state", "X-Badge: bert\r\nAccept: application/json\r\n");
  });
  while (visitor.is_here()) server.poll();
}

// Output:
// GET /arm/speed
// 401 Unauthorized
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Unauthorized","status":401,"detail":"credentials are required; the WWW-Authenticate field states which"}
//
// OPTIONS /arm/speed
// X-Badge: anna
// 204 No Content
// Allow: GET, HEAD, OPTIONS
//
// OPTIONS /arm/speed
// X-Badge: bert
// 204 No Content
// Allow: GET, HEAD, OPTIONS, PUT
//
// PUT /arm/speed
// X-Badge: anna
//   <> vom:numericalValue 2.0 .
// 403 Forbidden
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Forbidden","status":403,"detail":"these credentials do not allow PUT here"}
//
// PUT /arm/speed
// X-Badge: bert
//   <> vom:numericalValue 2.0 .
// 204 No Content
//
// GET /arm/service
// X-Badge: anna
// Accept: application/json
// 404 Not Found
// Content-Type: application/json
// {"type":"about:blank","title":"Not Found","status":404,"detail":"there is no resource at \"/arm/service\"; GET / lists the Things"}
//
// GET /arm/nothing
// X-Badge: anna
// Accept: application/json
// 404 Not Found
// Content-Type: application/json
// {"type":"about:blank","title":"Not Found","status":404,"detail":"there is no resource at \"/arm/nothing\"; GET / lists the Things"}
//
// GET /arm/state
// X-Badge: anna
// Accept: application/json
// 200 OK
// Content-Type: application/json
// {"speed":2}
//
// GET /arm/state
// X-Badge: bert
// Accept: application/json
// 200 OK
// Content-Type: application/json
// {"speed":2,"service":412}
