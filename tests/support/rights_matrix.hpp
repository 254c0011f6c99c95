// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/options.hpp>
#include <lrt/thing.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

namespace lrt::test {

/// Tokens and rules for a robot with hidden parts: everybody with a token reads, operators write and invoke, and what has "veiled" in its name is for
/// administrators.
class Rulebook {
 public:
  static constexpr const char* tokens =
      "anna reader anna-0123456789abcdef\nbert operator bert-0123456789abcdef\ncarl administrator carl-0123456789abcdef\n"
      "dora reader dora-0123456789abcdef\nemil administrator emil-0123456789abcdef 2020-01-01T00:00:00Z\n";
  static constexpr const char* rules = R"(
@prefix acl: <http://www.w3.org/ns/auth/acl#> .
@prefix lrt: <https://w3id.org/lrt/ns#> .
<#readers> a acl:Authorization ; acl:accessTo </> ; acl:default </> ; acl:agentClass acl:AuthenticatedAgent ; acl:mode acl:Read, lrt:Subscribe .
<#operators> a acl:Authorization ; acl:default </> ; acl:agentGroup <#operator> ; acl:mode acl:Write, lrt:Invoke .
<#all> a acl:Authorization ; acl:accessTo </>, </arm/veiled_angle>, </arm/veiled_pose>, </arm/actions/veiled_turn>, </arm/veiled_list>, </veiled_arm>, </arm/veiled_tool> ;
  acl:default </>, </arm/veiled_list>, </arm/actions/veiled_turn>, </veiled_arm>, </arm/veiled_tool> ; acl:agentGroup <#administrator> ;
  acl:mode acl:Read, acl:Write, acl:Control, lrt:Invoke, lrt:Subscribe .
)";

  Rulebook() {
    put_tokens(tokens);
    put_rules(rules);
  }
  void put_tokens(const std::string& text) const { std::ofstream(folder_ / "tokens") << text; }
  void put_rules(const std::string& text) const { std::ofstream(folder_ / "policy.ttl") << text; }
  void apply(Options& options) const {
    options.listen.port = 0;
    options.security.token_file = folder_ / "tokens";
    options.security.policy_file = folder_ / "policy.ttl";
    options.threads.dispatch = Dispatch::io_thread;
    options.callbacks.allow = {"127.0.0.1"};
  }

 private:
  Folder folder_;
};

/// An arm with a Property, an Action and a Collection that all may know of, and one of each that is veiled.
/// @param taken  called with each number that a client writes or sends to an Action
inline Thing ruled_arm(const std::function<void(double)>& taken) {
  Thing arm{"arm"};
  arm.title("An arm").add(vocab::rdfs::seeAlso, Object::resource("veiled_arm"));
  for (const char* name : {"angle", "veiled_angle"}) arm.property<double>(name).on_write([taken](double v) { taken(v); }).publish(1);
  for (const char* name : {"turn", "veiled_turn"}) arm.action(name, [taken](double v) { taken(v); });
  for (const char* name : {"list", "veiled_list"}) arm.collection<double>(name).on_create([](const double&) { return Result<void>(); });
  return arm;
}

/// What clients with each kind of credentials get: the matrix of rights.
/// @param status  of a request: its text without Host, and its token
inline void check_rights(const std::function<int(const std::string& request, const std::string& token)>& status) {
  const std::string number = "\nContent-Type: application/json\n\n5",
                    callback = "\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/";
  struct Row {
    std::string request;
    int reader, other, administrator;
  };
  const std::vector<Row> rows = {
      {"GET /", 200, 200, 200},
      {"HEAD /arm", 200, 200, 200},
      {"OPTIONS /arm/angle", 204, 204, 204},
      {"GET /all", 200, 200, 200},
      {"GET /ns/lrt", 200, 200, 200},
      {"GET /arm/angle", 200, 200, 200},
      {"GET /arm/state", 200, 200, 200},
      {"GET /arm/subscriptions", 200, 200, 200},
      {"GET /arm/angle\nAccept: text/event-stream", 200, 200, 200},
      {"GET /arm/angle" + callback, 201, 201, 201},
      {"PUT /arm/angle" + number, 403, 204, 204},
      {"PUT /arm/blueprint" + number, 403, 405, 405},
      {"POST /arm/actions/turn" + number, 403, 204, 204},
      {"POST /arm/list" + number, 403, 201, 201},
      {"DELETE /arm/list", 403, 405, 405},
      {"GET /arm/veiled_angle", 404, 404, 200},
      {"OPTIONS /arm/veiled_angle", 404, 404, 204},
      {"GET /arm/veiled_angle\nAccept: text/event-stream", 404, 404, 200},
      {"GET /arm/veiled_angle" + callback, 404, 404, 201},
      {"PUT /arm/veiled_angle" + number, 404, 404, 204},
      {"POST /arm/actions/veiled_turn" + number, 404, 404, 204},
      {"POST /arm/veiled_list" + number, 404, 404, 201},
      {"GET /nothing", 404, 404, 404},
  };
  for (const Row& row : rows) {
    CAPTURE(row.request);
    for (const char* token : {"", "emil-0123456789abcdef", "gone-0123456789abcdef"})
      CHECK(status(row.request, token) == 401);  // none, expired, unknown
    CHECK(status(row.request, "anna-0123456789abcdef") == row.reader);
    CHECK(status(row.request, "bert-0123456789abcdef") == row.other);
    CHECK(status(row.request, "carl-0123456789abcdef") == row.administrator);
  }
}

}  // namespace lrt::test
