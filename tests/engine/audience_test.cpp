// SPDX-License-Identifier: Apache-2.0
#include "src/engine/audience.hpp"

#include <string>

#include <lrt/rdf/codec.hpp>

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
