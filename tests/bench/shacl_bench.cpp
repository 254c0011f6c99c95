// SPDX-License-Identifier: Apache-2.0
// CPU times of lrt::shacl.   shacl_bench [largest number of focus nodes, default 100000]

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "tests/bench/cpu.hpp"

namespace {

using lrt::rdf::Graph;
using lrt::rdf::Syntax;
using lrt::shacl::Shapes;

const std::string prefixes =
    "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . @prefix ex: "
    "<http://example.org/ns#> .\n"
    "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> "
    ".\n";
const std::string target = "http://example.org/baxter/right_s1/actions/rotate";

// Figures 5a and 5b of the paper, corrected.
const std::string rotate_shape =
    prefixes +
    "<#input> a sh:NodeShape ;\n"
    "  sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:float ; sh:minInclusive 0 ; "
    "sh:maxExclusive 360 ] ;\n"
    "  sh:property [ sh:path vom:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:hasValue maths:Degree ] .\n";
const std::string rotate_body =
    "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
    "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .\n@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> "
    ".\n"
    "<>\n  rdf:type maths:Scalar ;\n  vom:numericalValue \"43.6\"^^xsd:float ;\n  vom:unit maths:Degree .\n";

// Ten constraints on three properties of each joint.
const std::string joint_shape = prefixes +
                                "ex:JointShape a sh:NodeShape ; sh:targetClass ex:Joint ;\n"
                                "  sh:property [ sh:path ex:name ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ; "
                                "sh:pattern \"^joint_[0-9]+$\" ] ;\n"
                                "  sh:property [ sh:path ex:angle ; sh:minCount 1 ; sh:datatype xsd:double ; sh:minInclusive "
                                "-3.2 ; sh:maxInclusive 3.2 ] ;\n"
                                "  sh:property [ sh:path ex:next ; sh:maxCount 1 ; sh:class ex:Joint ] .\n";

Graph read(const std::string& text) {
  lrt::rdf::ReadOptions options;
  options.base = target;
  auto graph = lrt::rdf::read(text, Syntax::turtle, options);
  if (!graph) std::fprintf(stderr, "%s\n", graph.error().message.c_str()), std::exit(1);
  return *std::move(graph);
}

Shapes compile(const std::string& text) {
  auto shapes = Shapes::compile(read(text));
  if (!shapes) std::fprintf(stderr, "%s\n", shapes.error().message.c_str()), std::exit(1);
  return *std::move(shapes);
}

Graph joints(std::size_t n) {
  Graph graph;
  const auto ex = [](const std::string& name) { return "http://example.org/ns#" + name; };
  const std::string joint_class = ex("Joint"), name = ex("name"), angle = ex("angle"), next = ex("next");
  for (std::size_t i = 0; i < n; ++i) {
    const std::string self = ex("j" + std::to_string(i)), after = ex("j" + std::to_string((i + 1) % n));
    const std::string label = "joint_" + std::to_string(i), value = std::to_string(static_cast<double>(i % 628) / 100 - 3.13);
    graph.add(lrt::rdf::iri(self), lrt::vocab::rdf_::type, lrt::rdf::iri(joint_class));
    graph.add(lrt::rdf::iri(self), lrt::rdf::iri(name), lrt::rdf::literal(label));
    graph.add(lrt::rdf::iri(self), lrt::rdf::iri(angle), lrt::rdf::literal(value, lrt::vocab::xsd::double_));
    graph.add(lrt::rdf::iri(self), lrt::rdf::iri(next), lrt::rdf::iri(after));
  }
  return graph;
}

template <class F>
double microseconds(std::size_t repeats, F&& f) {
  std::vector<double> times;
  for (int round = 0; round < 7; ++round) {
    const double start = bench::cpu_microseconds(0);
    for (std::size_t i = 0; i < repeats; ++i) f();
    times.push_back((bench::cpu_microseconds(0) - start) / static_cast<double>(repeats));
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void require(bool conforms) {
  if (!conforms) std::fprintf(stderr, "the data should conform\n"), std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t largest = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100'000;
  const Shapes rotate = compile(rotate_shape);
  const std::string shape_iri = target + "#input";
  const auto focus = lrt::rdf::iri(target), shape = lrt::rdf::iri(shape_iri);
  const Graph body = read(rotate_body);
  const auto judge = [&](const Graph& graph) { require(lrt::shacl::validate(rotate, graph, focus, shape)->conforms()); };
  std::printf("Figure 5b: parse             %8.2f us\n", microseconds(3000, [&] { (void)read(rotate_body); }));
  std::printf("Figure 5b: parse + validate  %8.2f us   (target 6)\n", microseconds(3000, [&] { judge(read(rotate_body)); }));
  std::printf("Figure 5b: validate          %8.2f us\n", microseconds(30000, [&] { judge(body); }));
  std::printf("Figure 5a: compile           %8.2f us\n", microseconds(1000, [&] { (void)Shapes::compile(rotate.graph()); }));

  const Shapes shapes = compile(joint_shape);
  for (std::size_t n = 100; n <= largest; n *= 10) {
    const Graph graph = joints(n);
    const double us = microseconds(std::max<std::size_t>(1, 20'000 / n), [&] { require(lrt::shacl::validate(shapes, graph)->conforms()); });
    std::printf("%7zu focus nodes, 10 constraints each: %10.0f us, %.2f us a node\n", n, us, us / static_cast<double>(n));
  }
}
