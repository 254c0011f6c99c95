// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/representation.hpp>

#include <optional>
#include <string>
#include <string_view>

#include <lrt/rdf/codec.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

/// The node that a document is about; empty: none.
std::string focus(std::string_view turtle, std::string_view url = "http://robot/arm") {
  const rdf::Graph graph = rdf::read(turtle, rdf::Syntax::turtle, {}).value();
  const std::optional<rdf::TermId> found = client::find_focus(graph, url);
  return found ? rdf::to_string(graph.term(*found)) : std::string();
}
const std::string arm = "<http://robot/arm> <urn:p> 1 . ", part = "<http://robot/arm#part> <urn:p> 1 . ", other = "<http://robot/leg> <urn:p> 1 . ";

}  // namespace

TEST_CASE("a representation is about its URL, if that is a subject", "[client]") {
  CHECK(focus(other + part + arm) == "<http://robot/arm>");
  CHECK(focus(part + arm, "http://robot/arm#part") == "<http://robot/arm#part>");
  CHECK(focus(other + arm + "<http://robot/leg> <urn:q> <http://robot/arm> .") == "<http://robot/arm>");  // also if others refer to it
}

TEST_CASE("a representation without its URL is about the only IRI that differs in the fragment", "[client]") {
  CHECK(focus(other + part) == "<http://robot/arm#part>");
  CHECK(focus(other + arm, "http://robot/arm#part") == "<http://robot/arm>");
  CHECK(focus(part, "http://robot/arm#other") == "<http://robot/arm#part>");
  CHECK(focus(other + part + "<http://robot/leg> <urn:q> <http://robot/arm#part> , <http://robot/arm> .") == "<http://robot/arm#part>");
  CHECK(focus(other + part + "<http://robot/arm2> <urn:p> 1 .") == "<http://robot/arm#part>");
  CHECK(focus(part + "<http://robot/arm?x=1#part> <urn:p> 1 .") == "<http://robot/arm#part>");
}

TEST_CASE("otherwise a representation is about the only subject that is not an object", "[client]") {
  CHECK(focus(other) == "<http://robot/leg>");
  CHECK(focus(other + "<http://robot/leg> <urn:q> [ <urn:p> [ <urn:p> 1 ] ] .") == "<http://robot/leg>");
  CHECK(focus("_:root <urn:p> [ <urn:p> 1 ] .").substr(0, 2) == "_:");
  // Two IRIs differ in the fragment, and one of them refers to the other.
  CHECK(focus(part + "<http://robot/arm#whole> <urn:part> <http://robot/arm#part> .") == "<http://robot/arm#whole>");
}

TEST_CASE("a representation with no such node, or with several, is about none", "[client]") {
  CHECK(focus("").empty());
  CHECK(focus(other + "<http://robot/head> <urn:p> 1 .").empty());
  CHECK(focus(part + "<http://robot/arm#tip> <urn:p> 1 .").empty());
  CHECK(focus("<http://robot/leg> <urn:p> <http://robot/head> . <http://robot/head> <urn:p> <http://robot/leg> .").empty());  // a cycle
  CHECK(focus("<http://robot/leg> <urn:p> <http://robot/leg> .").empty());
  CHECK(client::find_focus(rdf::Graph(), "") == std::nullopt);
}
