// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/comparison.hpp"

#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "src/mirror/mark.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using mirror::echo_of;
using mirror::fingerprint;
using mirror::Mark;
using mirror::mark_of;
using mirror::outline_of;

namespace {

rdf::Graph graph_of(const std::string& turtle) {
  rdf::ReadOptions options;
  options.base = "http://robot.example/";
  return rdf::read(turtle, rdf::Syntax::turtle, options).value();
}

std::string print(const std::string& turtle) { return fingerprint(graph_of(turtle)).value(); }

}  // namespace

TEST_CASE("a fingerprint depends neither on the order of triples nor on the labels of blank nodes", "[mirror]") {
  const std::string print_of_arm = print("<arm> <urn:has> _:x, _:y . _:x <urn:is> 1 . _:y <urn:is> 2 ; <urn:next> _:x .");
  CHECK(print_of_arm == print("_:one <urn:is> 1 . _:two <urn:next> _:one ; <urn:is> 2 . <arm> <urn:has> _:two, _:one ."));
  CHECK(print_of_arm.size() == 64);
  CHECK(print("") == print("# nothing"));
  // The same in each process: it is kept in files.
  CHECK(print("<http://robot.example/arm> <urn:is> <urn:x> .") == print("<arm> <urn:is> <urn:x> ."));
}

TEST_CASE("different graphs have different fingerprints", "[mirror]") {
  const std::vector<std::string> all = {
      "",
      "<arm> <urn:is> 1 .",
      "<arm> <urn:is> 2 .",
      "<arm> <urn:is> 1.0 .",
      "<arm> <urn:is> '1' .",
      "<arm> <urn:is> '1'@en .",
      "<arm> <urn:is> _:x .",
      "_:x <urn:is> <arm> .",
      "<arm> <urn:is> _:x . _:x <urn:is> 1 .",
      "<arm> <urn:is> _:x . _:x <urn:is> 2 .",
      "<arm> <urn:is> _:x, _:y .",
      "<arm> <urn:is> _:x, _:y . _:x <urn:next> _:y .",
      "<arm> <urn:is> _:x, _:y . _:x <urn:next> _:x .",
      "<arm> <urn:list> (1 2 3) .",
      "<arm> <urn:list> (1 3 2) .",
      "<arm> <urn:list> (1 2 3 4 5 6 7 8 9 10) .",
      "<arm> <urn:list> (1 2 3 4 5 6 7 8 10 9) .",
  };
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      INFO(all[i] << " and " << all[j]);
      CHECK(print(all[i]) != print(all[j]));
    }
}

TEST_CASE("an outline is that of a store that writes the values of literals in its own form, and of no other graph", "[mirror]") {
  const auto outline = [](const std::string& turtle) { return outline_of(graph_of(turtle)).value(); };
  const std::string of_arm = outline("<arm> <urn:is> '0'^^<http://www.w3.org/2001/XMLSchema#double> ; <urn:has> [ <urn:is> 'x' ] .");
  CHECK(of_arm == outline("<arm> <urn:has> [ <urn:is> 'x' ] ; <urn:is> 0.0 ."));
  CHECK(of_arm != outline("<arm> <urn:has> [ <urn:is> 'x' ] ."));
  CHECK(of_arm != outline("<arm> <urn:has> [ <urn:is> <urn:x> ] ; <urn:is> 0.0 ."));
}

TEST_CASE("what a store gives back is compared as a graph, and what is not RDF by its lines", "[mirror]") {
  const std::string base = "http://store.example/?graph=x", turtle = "<http://robot.example/arm> <urn:is> <urn:x>, <urn:y> .";
  const std::string expected = print(turtle);
  CHECK(echo_of(turtle, "text/turtle", base).value().fingerprint == expected);
  CHECK(echo_of("<http://robot.example/arm> <urn:is> <urn:y> .\n<http://robot.example/arm>\t<urn:is>\t<urn:x> .\n", "application/n-triples", base)
            .value()
            .fingerprint == expected);
  CHECK(echo_of("<http://robot.example/arm> <urn:is> <urn:y>, <urn:x> .", "text/turtle", base).value().graph.has_value());
  for (const auto& [text, type] :
       std::vector<std::pair<std::string, std::string>>{{"<html>\n", "text/html"}, {"<a", "text/turtle"}, {"", "text/html"}, {"", ""}}) {
    INFO(type << ": " << text);
    const mirror::Echo echo = echo_of(text, type, base).value();
    CHECK_FALSE(echo.graph.has_value());
    CHECK_FALSE(echo.fingerprint.empty());
    CHECK(echo.fingerprint != expected);
  }
  CHECK(echo_of("b\na\n", "text/html", base).value().fingerprint == echo_of("a\nb", "text/html", base).value().fingerprint);
  CHECK(echo_of("a\nb\n", "text/html", base).value().fingerprint != echo_of("a\nc\n", "text/html", base).value().fingerprint);
}

TEST_CASE("a mark lists graphs of the robot's origin and a time, and believes nothing else of a store", "[mirror]") {
  const std::string robot = "http://robot.example/", name = "http://robot.example/#mirror";
  Mark mark;
  mark.graphs = {"http://robot.example/arm", "http://robot.example/base"};
  mark.since = "2026-11-29T04:28:42Z";
  const Mark same = mark_of(mark.graph(robot, name), robot, name, 10);
  CHECK(same.graphs == mark.graphs);
  CHECK(same.since == mark.since);
  CHECK(mark_of(mark.graph(robot, name), robot, name, 1).graphs.size() == 1);
  CHECK(fingerprint(mark.graph(robot, name)).value() == fingerprint(same.graph(robot, name)).value());
  const Mark strange = mark_of(graph_of("<#mirror> <http://purl.org/dc/terms/hasPart> <http://elsewhere.example/arm>, <#mirror>, _:x, 'x', <arm> . "
                                        "<> <https://w3id.org/lrt/ns#unreachableSince> 'once upon a time' ."),
                               robot, name, 10);
  CHECK(strange.graphs == std::vector<std::string>{"http://robot.example/arm"});
  CHECK(strange.since.empty());
}
