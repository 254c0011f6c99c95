// SPDX-License-Identifier: Apache-2.0
#include "src/engine/audience.hpp"

#include <string>

#include <lrt/rdf/codec.hpp>

#include "src/security/policy.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

/// What is visible of a graph in Turtle if IRIs that contain "hidden" are not.
rdf::Graph visible(const std::string& turtle) {
  const rdf::Graph all = rdf::read(turtle, rdf::Syntax::turtle, {}).value();
  return engine::visible_part(all, [](std::string_view iri) { return iri.find("hidden") == std::string_view::npos; });
}

}  // namespace

TEST_CASE("blank nodes are visible unless only what is hidden leads to them", "[engine][rights]") {
  CHECK(visible("<p:a> <p:b> [ <p:c> [ <p:d> 1 ] ] .").size() == 3);
  CHECK(visible("<p:hidden> <p:b> [ <p:c> [ <p:d> 1 ] ] .").empty());
  CHECK(visible("<p:a> <p:hidden> [ <p:c> [ <p:d> 1 ] ] .").empty());
  CHECK(visible("<p:hidden> <p:b> _:x . <p:a> <p:b> _:x . _:x <p:c> 1 .").size() == 2);
}

TEST_CASE("a cycle of blank nodes is visible if nothing hidden leads to it", "[engine][rights]") {
  CHECK(visible("_:a <p:b> _:b . _:b <p:b> _:a .").size() == 2);
  CHECK(visible("_:a <p:b> _:b . _:b <p:b> _:c . _:c <p:b> _:a . _:c <p:d> [ <p:e> 1 ] .").size() == 5);
  CHECK(visible("_:a <p:b> _:a .").size() == 1);
  CHECK(visible("_:a <p:b> _:b . _:b <p:b> _:a . <p:hidden> <p:b> _:a .").empty());
  CHECK(visible("_:a <p:b> _:b . _:b <p:b> _:a . <p:a> <p:hidden> _:b .").empty());
  CHECK(visible("_:a <p:b> _:b . _:b <p:b> _:a, _:c . _:c <p:b> _:d . _:d <p:b> _:c . <p:hidden> <p:b> _:c .").size() == 5);
  CHECK(visible("<p:hidden> <p:b> [ <p:b> _:a ] . _:a <p:b> _:b . _:b <p:b> _:a .").empty());
}

TEST_CASE("the words of users are visible, whatever they name", "[engine][rights]") {
  const rdf::Graph all =
      rdf::read("<p:hidden> <p:b> [ <p:c> <p:hidden> ] . <p:hidden> <p:d> [ <p:e> 1 ] . <p:a> <p:b> <p:hidden> .", rdf::Syntax::turtle, {}).value();
  REQUIRE(all.size() == 5);
  const auto is_shown = [](std::string_view iri) { return iri.find("hidden") == std::string_view::npos; };
  CHECK(engine::visible_part(all, is_shown).empty());
  CHECK(engine::visible_part(all, is_shown, {{0, 2}}).size() == 2);
  CHECK(engine::visible_part(all, is_shown, {{0, 2}, {4, 5}}).size() == 3);
  CHECK(engine::visible_part(all, is_shown, {{0, 5}}).size() == 5);
}

TEST_CASE("paths have the same rules around them if no rule names them or a path below", "[engine][rights]") {
  using security::Right, security::Rule, security::Scope, security::Who;
  const auto policy = security::Policy::create({{"/", Scope::tree, {}, Right::read},
                                                {"/arm", Scope::below, {}, Right::read},
                                                {"/arm/hand/finger", Scope::here, {}, Right::read},
                                                {"/leg", Scope::here, {}, Right::read}})
                          .value();
  CHECK(policy->around("/head") == "/");
  CHECK(policy->around("/arms") == "/");
  CHECK(policy->around("/arm") == std::nullopt);
  CHECK(policy->around("/arm/elbow") == "/arm");
  CHECK(policy->around("/arm/hand") == std::nullopt);
  CHECK(policy->around("/arm/hand/finger/nail") == "/arm");
  CHECK(policy->around("/leg") == std::nullopt);
  CHECK(policy->around("/leg/knee") == "/");
}
