// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/validator.hpp>

#include <thread>

#include "tests/shacl/support.hpp"

namespace {

using lrt::Errc;
using lrt::rdf::Graph;
using lrt::rdf::iri;
using lrt::rdf::TermView;
using lrt::shacl::Report;
using lrt::shacl::Shapes;
using lrt::shacl::ValidateOptions;
using shacl_test::compile;
using shacl_test::ex;
using shacl_test::lines;
using shacl_test::parse;
namespace sh = lrt::vocab::sh;
using Lines = std::vector<std::string>;

Report judged(const Shapes& shapes, const Graph& data, const ValidateOptions& options = {}) {
  auto report = lrt::shacl::validate(shapes, data, options);
  if (!report) FAIL(report.error().message);
  return *std::move(report);
}

std::string chain(int n, const char* predicate) {
  std::string text;
  for (int i = 0; i < n; ++i) text += "ex:n" + std::to_string(i) + " " + predicate + " ex:n" + std::to_string(i + 1) + " .\n";
  return text;
}

}  // namespace

TEST_CASE("one focus node is validated against one shape without regard to targets", "[shacl]") {
  const Shapes shapes = compile("ex:S sh:targetNode ex:other ; sh:property [ sh:path ex:p ; sh:minCount 1 ] . ex:P sh:path ex:p ; sh:minCount 2 .");
  const Graph data = parse("ex:a ex:p 1 . ex:b ex:q 1 .");
  const auto check = [&](const char* focus, const char* shape) {
    const auto report = lrt::shacl::validate(shapes, data, iri(ex + focus), iri(ex + shape));
    REQUIRE(report);
    return lines(*report);
  };
  CHECK(check("a", "S").empty());
  CHECK(check("b", "S") == Lines{"ex:b ex:p - MinCount"});
  CHECK(check("a", "P") == Lines{"ex:a ex:p - MinCount"});
  CHECK(check("nowhere", "S") == Lines{"ex:nowhere ex:p - MinCount"});  // an empty body never conforms vacuously
  const auto unknown = lrt::shacl::validate(shapes, data, iri(ex + "a"), iri(ex + "T"));
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().code == Errc::expected_value);
}

TEST_CASE("a focus node that is in neither graph equals itself", "[shacl]") {
  const Shapes shapes =
      compile("ex:S sh:property [ sh:path [ sh:zeroOrMorePath ex:p ] ; sh:maxCount 1 ; sh:equals ex:q ] ; sh:nodeKind sh:Literal .");
  const auto report = lrt::shacl::validate(shapes, Graph(), iri("http://example.org/new"), iri(ex + "S"));
  REQUIRE(report);
  CHECK(lines(*report) ==
        Lines{"http://example.org/new - http://example.org/new NodeKind", "http://example.org/new ex:p* http://example.org/new Equals"});
}

TEST_CASE("validation against recursive shapes ends, and a node in progress conforms", "[shacl]") {
  const Shapes tree = compile(
      "ex:Tree sh:targetNode ex:n0 ; sh:property [ sh:path ex:child ; sh:node ex:Tree ] ; sh:property [ sh:path ex:name ; "
      "sh:maxCount 1 ] .");
  CHECK(lines(judged(tree, parse("ex:n0 ex:child ex:n1 . ex:n1 ex:child ex:n2 ; ex:name 1 ."))).empty());
  CHECK(lines(judged(tree, parse("ex:n0 ex:child ex:n1 . ex:n1 ex:child ex:n2 . ex:n2 ex:name 1, 2 ."))) == Lines{"ex:n0 ex:child ex:n1 Node"});
  CHECK(lines(judged(tree, parse("ex:n0 ex:child ex:n1, ex:n0 . ex:n1 ex:child ex:n0 ."))).empty());
  CHECK(lines(judged(compile("ex:S sh:targetNode ex:a ; sh:not ex:S ."), parse("ex:a ex:p 1 ."))) == Lines{"ex:a - ex:a Not"});
  CHECK(lines(judged(compile("ex:S sh:targetNode ex:a ; sh:node ex:S ; sh:or ( ex:S ex:T ) . ex:T sh:and ( ex:S ) ."), parse(""))).empty());
}

TEST_CASE("a validation beyond the limits gives no report", "[shacl]") {
  const Shapes tree = compile("ex:Tree sh:targetNode ex:n0 ; sh:property [ sh:path ex:child ; sh:node ex:Tree ] .");
  ValidateOptions options;
  options.max_depth = 20;
  CHECK(lrt::shacl::validate(tree, parse(chain(9, "ex:child")), options));
  const auto deep = lrt::shacl::validate(tree, parse(chain(10, "ex:child")), options);
  REQUIRE_FALSE(deep);
  CHECK(deep.error().code == Errc::limit_exceeded);
  CHECK(deep.error().message == "the validation was not complete within max_depth = 20");

  const Shapes star = compile("ex:S sh:targetNode ex:n0 ; sh:property [ sh:path [ sh:zeroOrMorePath ex:p ] ; sh:minCount 1 ] .");
  options = {};
  options.max_path_nodes = 50;
  CHECK(lrt::shacl::validate(star, parse(chain(50, "ex:p")), options));
  const auto far = lrt::shacl::validate(star, parse(chain(51, "ex:p")), options);
  REQUIRE_FALSE(far);
  CHECK(far.error().message.find("max_path_nodes") != std::string::npos);

  options = {};
  options.max_steps = 100;
  const auto long_ = lrt::shacl::validate(star, parse(chain(200, "ex:p")), options);
  REQUIRE_FALSE(long_);
  CHECK(long_.error().message.find("max_steps") != std::string::npos);
}

TEST_CASE("shapes that double the work at each level are stopped", "[shacl]") {
  std::string text = "ex:S0 sh:targetNode ex:a .\n";
  for (int i = 0; i < 60; ++i)
    text += "ex:S" + std::to_string(i) + " sh:and ( ex:S" + std::to_string(i + 1) + " ex:S" + std::to_string(i + 1) + " ) .\n";
  text += "ex:S60 sh:nodeKind sh:IRI .";
  ValidateOptions options;
  options.max_steps = 100'000;
  const auto report = lrt::shacl::validate(compile(text), parse("ex:a ex:p 1 ."), options);
  REQUIRE_FALSE(report);
  CHECK(report.error().code == Errc::limit_exceeded);
}

TEST_CASE("an incomplete report says so", "[shacl]") {
  const Shapes shapes = compile("ex:S sh:targetSubjectsOf ex:p ; sh:class ex:C .");
  ValidateOptions options;
  options.max_results = 5;
  CHECK(judged(shapes, parse(chain(5, "ex:p")), options).complete());
  const Report report = judged(shapes, parse(chain(6, "ex:p")), options);
  CHECK_FALSE(report.complete());
  CHECK_FALSE(report.conforms());
  CHECK(report.results().size() == 5);
  const TermView comment = lrt::vocab::rdfs::comment;
  CHECK_FALSE(report.to_graph().match(nullptr, &comment, nullptr).empty());
  options.max_results = 0;
  CHECK_FALSE(judged(shapes, parse(chain(1, "ex:p")), options).complete());
}

TEST_CASE("a hostile pattern is given up soon, which is a violation with a message", "[shacl]") {
  const Shapes shapes = compile("ex:S sh:targetObjectsOf ex:p ; sh:pattern \"^(a+)+$\" .");
  const Report report = judged(shapes, parse("ex:a ex:p \"" + std::string(5000, 'a') + "!\" ."));
  REQUIRE(report.results().size() == 1);
  CHECK(std::string(report.results()[0].messages[0].view().text).find("stopped at its limit of work") != std::string::npos);
  CHECK(judged(shapes, parse("ex:a ex:p \"" + std::string(5000, 'a') + "\" .")).conforms());
  CHECK(judged(compile("ex:S sh:targetObjectsOf ex:p ; sh:pattern \"^(a|b)*$\" ."), parse("ex:a ex:p \"" + std::string(3000, 'b') + "\" ."))
            .conforms());

  std::string many;
  for (int i = 0; i < 2000; ++i) many += "ex:a ex:p \"" + std::string(40, 'a') + "!" + std::to_string(i) + "\" .\n";
  ValidateOptions options;
  CHECK(judged(shapes, parse(many), options).results().size() == options.max_results);  // the searches share their bound of work
  options.max_steps = 100'000;
  const auto stopped = lrt::shacl::validate(shapes, parse(many), options);
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().code == Errc::limit_exceeded);
}

TEST_CASE("messages contain what was expected and what was found, or the shape's own message", "[shacl]") {
  const auto message = [](const char* shapes, const char* data) {
    const Report report = judged(compile(shapes), parse(data));
    REQUIRE(report.results().size() == 1);
    std::string all;
    for (const auto& m : report.results()[0].messages)
      all += std::string(m.view().text) + (m.view().language.empty() ? "" : "@" + std::string(m.view().language)) + ";";
    return all;
  };
  CHECK(message("ex:S sh:targetObjectsOf ex:p ; sh:datatype xsd:double .", "ex:a ex:p \"fast\" .") == "expected a number, found \"fast\";");
  CHECK(message("ex:S sh:targetObjectsOf ex:p ; sh:datatype xsd:double .", "ex:a ex:p \"fast\"^^xsd:double .") ==
        "expected a number, found \"fast\";");
  CHECK(message("ex:S sh:targetObjectsOf ex:p ; sh:maxExclusive 360 .", "ex:a ex:p 360.0 .") == "expected less than 360, found 360.0;");
  CHECK(message("ex:S sh:targetNode ex:a ; sh:property [ sh:path ex:q ; sh:minCount 1 ] .", "ex:a ex:p 1 .") ==
        "expected at least 1 value, found none;");
  CHECK(message("ex:S sh:targetObjectsOf ex:p ; sh:or ( [ sh:datatype xsd:float ] [ sh:datatype xsd:double ] ) .", "ex:a ex:p 1 .") ==
        "expected one of xsd:float, xsd:double, found 1;");
  CHECK(message("ex:S sh:targetObjectsOf ex:p ; sh:in ( maths:Degree ) .", "ex:a ex:p maths:Radian .") ==
        "expected maths:Degree, found maths:Radian;");
  CHECK(message("ex:S sh:targetObjectsOf ex:p ; sh:class ex:C ; sh:message \"too fast\"@en, \"zu schnell\"@de .", "ex:a ex:p 1 .") ==
        "too fast@en;zu schnell@de;");
  // Long text is cut at a character, so that the report can be written.
  std::string euro;
  for (int i = 0; i < 50; ++i) euro += "€";
  const Report report = judged(compile("ex:S sh:targetObjectsOf ex:p ; sh:maxLength 3 ."), parse("ex:a ex:p \"" + euro + "\" ."));
  CHECK(lrt::rdf::write(report.to_graph(), lrt::rdf::Syntax::turtle));
}

TEST_CASE("the report is a graph as in SHACL 3.6", "[shacl]") {
  const Shapes shapes = compile(
      "ex:S sh:targetNode ex:a ; sh:property [ sh:path ( ex:p [ sh:zeroOrMorePath [ sh:inversePath ex:q ] ] ) ; sh:class ex:C "
      "; sh:severity sh:Warning ; sh:message \"m\" ] .");
  const Graph expected = parse(
      "[] a sh:ValidationReport ; sh:conforms false ; sh:result [ a sh:ValidationResult ; sh:focusNode ex:a ; sh:value ex:b ; "
      "sh:sourceShape [] ; "
      "sh:resultPath ( ex:p [ sh:zeroOrMorePath [ sh:inversePath ex:q ] ] ) ; sh:sourceConstraintComponent "
      "sh:ClassConstraintComponent ; "
      "sh:resultSeverity sh:Warning ; sh:resultMessage \"m\" ] .");
  CHECK(lrt::rdf::isomorphic(judged(shapes, parse("ex:a ex:p ex:b .")).to_graph(), expected));
  CHECK(lrt::rdf::isomorphic(judged(shapes, parse("ex:c ex:p ex:b .")).to_graph(), parse("[] a sh:ValidationReport ; sh:conforms true .")));
}

TEST_CASE("blank nodes of data and of shapes stay apart in a report", "[shacl]") {
  Graph shapes_graph, data;
  const auto blank = [](const char* label) { return lrt::rdf::blank(label); };
  shapes_graph.add(blank("b0"), sh::targetSubjectsOf, iri(ex + "p"));
  shapes_graph.add(blank("b0"), sh::class_, iri(ex + "C"));
  shapes_graph.add(blank("b0"), sh::equals, iri(ex + "p"));
  data.add(blank("b0"), iri(ex + "p"), blank("b1"));
  data.add(blank("b1"), iri(ex + "p"), blank("b2"));
  const auto shapes = Shapes::compile(shapes_graph);
  REQUIRE(shapes);
  const Report report = judged(*shapes, data);
  REQUIRE(report.results().size() == 6);
  const Graph graph = report.to_graph();
  const TermView source = sh::sourceShape;
  std::vector<std::string> labels;
  for (const auto& t : graph.match(nullptr, &source, nullptr)) labels.emplace_back(graph.term(t.object).text);
  REQUIRE(labels.size() == 6);
  for (const std::string& l : labels) {
    CHECK(l == labels[0]);
    CHECK((l != "b0" && l != "b1" && l != "b2"));
  }
  CHECK(graph.subjects(sh::focusNode, blank("b0")).size() == 3);
  CHECK(graph.subjects(sh::value, blank("b2")).size() == 1);
}

TEST_CASE("sh:node and sh:and report the nested results as details", "[shacl]") {
  const Shapes shapes = compile(
      "ex:S sh:targetNode ex:a ; sh:property [ sh:path ex:pose ; sh:node [ sh:property [ sh:path ex:x ; sh:minCount 1 ] ; "
      "sh:node [ sh:class ex:Pose ] ] ] .");
  const Graph data = parse("ex:a ex:pose ex:p .");
  Report report = judged(shapes, data);
  REQUIRE(report.results().size() == 1);
  REQUIRE(report.results()[0].details.size() == 2);
  Lines details;
  for (const auto& d : report.results()[0].details) details.push_back(shacl_test::line(d));
  std::sort(details.begin(), details.end());
  CHECK(details == Lines{"ex:p - ex:p Node", "ex:p ex:x - MinCount"});
  const TermView detail = sh::detail;
  const Graph graph = report.to_graph();
  std::size_t n = 0;
  for (const auto& t : graph.match(nullptr, &detail, nullptr))
    n += graph.contains(graph.term(t.object), lrt::vocab::rdf_::type, sh::ValidationResult);
  CHECK(n == 3);
  CHECK(report.to_text().find("\n  <http://example.org/ns#p> <http://example.org/ns#x>: expected at least 1 value, found none "
                              "[sh:MinCountConstraintComponent]\n") != std::string::npos);
  ValidateOptions options;
  options.details = false;
  report = judged(shapes, data, options);
  CHECK(report.results()[0].details.empty());
}

TEST_CASE("a report outlives shapes and data", "[shacl]") {
  std::optional<Report> report;
  {
    const Shapes shapes = compile("ex:S sh:targetNode ex:a ; sh:property [ sh:path ( ex:p ex:q ) ; sh:minCount 1 ] .");
    report = judged(shapes, parse("ex:a ex:p ex:b ."));
  }
  CHECK(lines(*report) == Lines{"ex:a ex:p/ex:q - MinCount"});
  CHECK(report->to_graph().size() > 5);
}

TEST_CASE("threads share shapes and data", "[shacl]") {
  const Shapes shapes = compile("ex:S sh:targetSubjectsOf ex:p ; sh:property [ sh:path ex:p ; sh:pattern \"^x\" ; sh:class ex:C ] .");
  const Graph data = parse(chain(50, "ex:p"));
  const Lines expected = lines(judged(shapes, data));
  std::vector<std::thread> threads;
  std::vector<int> right(4, 0);
  for (std::size_t i = 0; i < right.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int n = 0; n < 20; ++n) {
        const auto report = lrt::shacl::validate(shapes, data);
        right[i] += report && lines(*report) == expected;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  for (const int n : right) CHECK(n == 20);
}

TEST_CASE("a graph that holds both data and shapes validates itself", "[shacl]") {
  const Graph graph = parse("ex:S a sh:NodeShape ; sh:targetSubjectsOf sh:property ; sh:property [ sh:path sh:property ; sh:nodeKind sh:IRI ] .");
  const auto shapes = Shapes::compile(graph);
  REQUIRE(shapes);
  CHECK(lines(judged(*shapes, graph)) == Lines{"ex:S sh:property _: NodeKind"});
}
