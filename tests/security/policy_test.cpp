// SPDX-License-Identifier: Apache-2.0
#include "src/security/policy.hpp"

#include <cstddef>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <lrt/security.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::security;

namespace {

const std::string prefixes =
    "@prefix acl: <http://www.w3.org/ns/auth/acl#> . @prefix foaf: <http://xmlns.com/foaf/0.1/> . @prefix lrt: <https://w3id.org/lrt/ns#> .\n";

Rights at(const std::vector<Rule>& rules, const std::string& path, const Principal* who) {
  return Policy::create(rules).value()->view(who)->at(path);
}

std::string error_of(const std::string& body) {
  const auto rules = parse_rules(prefixes + body);
  return rules ? "" : rules.error().message;
}

}  // namespace

TEST_CASE("the nearest rules decide", "[security][R0.2]") {
  const Principal anna{"anna", {"reader"}}, bert{"bert", {"operator", "reader"}};
  const std::vector<Rule> rules = {
      {"/", Scope::tree, {Who::Kind::role, "reader"}, Right::read},
      {"/", Scope::below, {Who::Kind::role, "operator"}, Right::write | Right::invoke},
      {"/arm", Scope::below, {Who::Kind::role, "operator"}, Right::subscribe},
      {"/arm/j1", Scope::here, {Who::Kind::principal, "anna"}, Right::write},
      {"/open", Scope::tree, {}, Right::read},
      {"/known", Scope::tree, {Who::Kind::authenticated}, Right::read},
  };
  CHECK(at(rules, "/", &anna) == Right::read);
  CHECK(at(rules, "/x/y", &anna) == Right::read);
  CHECK(at(rules, "/x/y", &bert) == (Right::read | Right::write | Right::invoke));  // rules of one path add up
  CHECK(at(rules, "/", &bert) == Right::read);
  CHECK(at(rules, "/arm", &bert) == (Right::read | Right::write | Right::invoke));  // a rule for what is below is not for itself
  CHECK(at(rules, "/arm/j2", &bert) == Right::subscribe);
  CHECK(at(rules, "/arm/j2", &anna).empty());  // nearer rules take away what those above give
  CHECK(at(rules, "/arm/j1", &anna) == Right::write);
  CHECK(at(rules, "/arm/j1", &bert).empty());
  CHECK(at(rules, "/arm/j1/deep", &bert) == Right::subscribe);  // a rule for a resource is not for those below
  CHECK(at(rules, "/armory", &anna) == Right::read);
  CHECK(at(rules, "/open/x", nullptr) == Right::read);
  CHECK(at(rules, "/known", nullptr).empty());
  CHECK(at(rules, "/known", &anna) == Right::read);
  CHECK(at(rules, "/x", nullptr).empty());
}

TEST_CASE("callers with equal rights share a view, and what it gives anywhere is known", "[security]") {
  const auto policy = Policy::create({{"/", Scope::tree, {Who::Kind::role, "reader"}, Right::read},
                                      {"/arm", Scope::tree, {Who::Kind::principal, "bert"}, Right::write}})
                          .value();
  const Principal anna{"anna", {"reader"}}, emil{"emil", {"reader", "guest"}}, bert{"bert", {"reader"}};
  const auto view = policy->view(&anna);
  CHECK(view == policy->view(&emil));
  CHECK(view != policy->view(&bert));
  CHECK(policy->view(&bert)->anywhere() == (Right::read | Right::write));
  CHECK(policy->view(nullptr)->anywhere().empty());
}

TEST_CASE("paths of rules are those of resources, however they are spelled", "[security][R0.3]") {
  const Principal anna{"anna", {}};
  const std::vector<Rule> rules = {
      {"/%61rm/gr\xC3\xB6\xC3\x9F"
       "e/",
       Scope::here,
       {Who::Kind::authenticated},
       Right::read}};
  CHECK(at(rules, "/arm/gr%C3%B6%C3%9Fe", &anna) == Right::read);
  CHECK(Policy::create({{"arm", Scope::here, {}, Right::read}}).error().message == "rules: expected a path such as /arm, found \"arm\"");
  CHECK(Policy::create({{"/a/../b", Scope::here, {}, Right::read}}).error().code == Errc::invalid_option);
  CHECK(Policy::create({{"/a", Scope::here, {Who::Kind::role, ""}, Right::read}}).error().message ==
        "rules: /a: a role or principal has a name, and nobody else");
}

TEST_CASE("rules are read from Web Access Control", "[security][R0.2]") {
  const auto rules = parse_rules(
      prefixes +
      "<#a> a acl:Authorization ; acl:accessTo </arm> ; acl:default </arm> ; acl:agent <#anna>, <https://anna.example/me> ; acl:mode acl:Read, "
      "lrt:Subscribe .\n[] a acl:Authorization ; acl:default </> ; acl:agentGroup <#operator> ; acl:agentClass acl:AuthenticatedAgent ; acl:mode "
      "acl:Write, lrt:Invoke, acl:Control .");
  REQUIRE(rules);
  const Principal anna{"anna", {}}, web{"https://anna.example/me", {}}, bert{"bert", {"operator"}};
  CHECK(at(*rules, "/arm", &anna) == (Right::read | Right::subscribe));
  CHECK(at(*rules, "/arm/j1", &web) == (Right::read | Right::subscribe));
  CHECK(at(*rules, "/arm/j1", &bert).empty());
  CHECK(at(*rules, "/leg", &bert) == (Right::write | Right::invoke | Right::manage));
  CHECK(at(*rules, "/leg", nullptr).empty());
}

TEST_CASE("a policy that says something else than it seems to is refused with the place", "[security]") {
  CHECK(error_of("") == "expected at least one acl:Authorization, found none");
  CHECK(error_of("<#a> a acl:Authorization ; acl:agent <#b> ; acl:mode acl:Read .") ==
        "the authorization <#a>: expected acl:accessTo or acl:default, found neither");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo </x> ; acl:mode acl:Read .") ==
        "the authorization <#a>: expected acl:agent, acl:agentGroup or acl:agentClass, found none");
  CHECK(error_of("[] a acl:Authorization ; acl:accessTo </x> ; acl:agent <#b> .") ==
        "the authorization without an IRI: expected acl:mode, found none");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo </x> ; acl:agent <#b> ; acl:mode acl:Append .") ==
        "the authorization <#a>: acl:mode: expected acl:Read, acl:Write, acl:Control, lrt:Invoke, lrt:Release, lrt:Subscribe or lrt:TakeOver, found "
        "<http://www.w3.org/ns/auth/acl#Append>");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo <http://other.example/x> ; acl:agent <#b> ; acl:mode acl:Read .") ==
        "the authorization <#a>: acl:accessTo: expected a path of this server such as </arm>, found <http://other.example/x>");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo </x> ; acl:agentClass foaf:Person ; acl:mode acl:Read .") ==
        "the authorization <#a>: acl:agentClass: expected foaf:Agent or acl:AuthenticatedAgent, found <http://xmlns.com/foaf/0.1/Person>");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo </x> ; acl:agent <#b> ; acl:origin <http://o.example> ; acl:mode acl:Read .") ==
        "the authorization <#a>: acl:origin is not supported");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo </x> ; acl:agent </b> ; acl:mode acl:Read .") ==
        "the authorization <#a>: acl:agent: expected <#NAME> or an absolute IRI, found </b>");
  CHECK(error_of("<#a> a acl:Authorization ; acl:accessTo </x> ; acl:agent \"b\" ; acl:mode acl:Read .") ==
        "the authorization <#a>: acl:agent: expected an IRI");
  CHECK(error_of("<#a> a acl:Authorization") ==
        "line 2, column 25: expected ',', ';' or '.', found the end of the text");  // the place in the document
}

TEST_CASE("rules are read from a file, and an error has its name", "[security][R0.2]") {
  const test::Folder folder;
  const std::string file = folder / "rules.ttl";
  const auto load = [&](const std::string& text) {
    std::ofstream(file) << text;
    return load_rules(file);
  };
  const std::string rule = prefixes + "<#a> a acl:Authorization ; acl:accessTo </arm> ; acl:agent <#anna> ; acl:mode acl:Read .\n";
  const Result<std::vector<Rule>> rules = load(rule);
  REQUIRE(rules);
  REQUIRE(rules->size() == 1);
  CHECK(rules->front().path == "/arm");
  CHECK(rules->front().scope == Scope::here);
  CHECK(rules->front().who.kind == Who::Kind::principal);
  CHECK(rules->front().who.name == "anna");
  CHECK(rules->front().rights == Right::read);

  REQUIRE(load("\xEF\xBB\xBF" + rule));
  CHECK(load("\xEF\xBB\xBF" + rule)->size() == 1);
  const Error none = load_rules(folder / "none.ttl").error();
  CHECK(none.code == Errc::io_error);
  CHECK(none.message.find(folder / "none.ttl: ") == 0);
  CHECK(load_rules(folder.path().string()).error().code == Errc::io_error);  // a folder
  const Error empty = load("").error();
  CHECK(empty.code == Errc::invalid_option);
  CHECK(empty.message == file + ": expected at least one acl:Authorization, found none");
  const Error damaged = load(rule.substr(0, rule.size() - 3)).error();
  CHECK(damaged.code == Errc::expected_rdf);
  CHECK(damaged.message.find(file + ": line 2, column ") == 0);
}

TEST_CASE("a file of rules has at most 1 MiB", "[security]") {
  const test::Folder folder;
  const std::string file = folder / "rules.ttl";
  const std::string rule = prefixes + "<#a> a acl:Authorization ; acl:accessTo </arm> ; acl:agent <#anna> ; acl:mode acl:Read .\n";
  constexpr std::size_t most = 1024 * 1024;
  std::ofstream(file) << rule << std::string(most - rule.size(), '\n');
  CHECK(load_rules(file));
  std::ofstream(file, std::ios::app) << '\n';
  const Error large = load_rules(file).error();
  CHECK(large.code == Errc::invalid_option);
  CHECK(large.message == file + ": expected at most 1 MiB");
}

TEST_CASE("two policies may grant the same rights by other rules", "[security][R0.2]") {
  const Principal anna{"anna", {"reader"}};
  using Rules = std::vector<Rule>;
  const auto same = [&](const Rules& one, const Rules& other) {
    const auto a = Policy::create(one).value()->view(&anna), b = Policy::create(other).value()->view(&anna);
    CHECK(a->grants_the_same_as(*b) == b->grants_the_same_as(*a));
    return a->grants_the_same_as(*b);
  };
  const Who reader{Who::Kind::role, "reader"}, other{Who::Kind::role, "chief"};
  const Rules base = {{"/", Scope::tree, reader, Right::read}, {"/arm", Scope::tree, reader, Right::read | Right::write}};
  CHECK(same(base, base));
  CHECK(same(base, {{"/arm", Scope::tree, reader, Right::read | Right::write}, {"/", Scope::tree, {}, Right::read}}));
  CHECK(same(base, {base[0], base[1], {"/arm/j1", Scope::tree, reader, Right::read | Right::write}}));  // as the rule above
  CHECK(same(base, {base[0], base[1], {"/arm", Scope::tree, other, Right::invoke}}));                   // of others, at a path with rules
  CHECK_FALSE(same(base, {base[0], base[1], {"/x", Scope::tree, other, Right::read}}));                 // takes away what is given above
  CHECK_FALSE(same(base, {base[0]}));
  CHECK_FALSE(same(base, {base[0], {"/arm", Scope::here, reader, Right::read | Right::write}}));   // not below
  CHECK_FALSE(same(base, {base[0], {"/arm", Scope::below, reader, Right::read | Right::write}}));  // not itself
  CHECK_FALSE(same({}, base));
  CHECK(same({}, {{"/x", Scope::tree, other, Right::read}}));
  const View all(Right::read), by_rule = *Policy::create({{"/", Scope::tree, {}, Right::read}}).value()->view(&anna);
  CHECK(all.grants_the_same_as(by_rule));
  CHECK_FALSE(all.grants_the_same_as(View(Right::write)));
}
