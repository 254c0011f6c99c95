// SPDX-License-Identifier: Apache-2.0
// Makes a header of a robot, for generate_test.py:
//
//   generate_header URL|FILE NAMESPACE HEADER [GRAPH]    writes HEADER, and the documents that describe the robot as Turtle to GRAPH
//   generate_header --check URL|FILE HEADER              a line for each difference; exit status 1 if there is one

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include <lrt/client.hpp>
#include <lrt/codegen.hpp>
#include <lrt/rdf/codec.hpp>

namespace {

std::string contents(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

lrt::Result<lrt::rdf::Graph> documents(const std::string& from) {
  if (from.rfind("http", 0) != 0) {
    lrt::rdf::ReadOptions options;
    options.base = "http://robot.example/";
    options.max_triples = 2'000'000;
    return lrt::rdf::read(contents(from), lrt::rdf::Syntax::turtle, options);
  }
  lrt::Client client = lrt::Client::create().value();
  const auto robot = client.open(from);
  if (!robot) return lrt::unexpected(robot.error());
  std::vector<std::string> problems;
  auto graph = lrt::client::read_documents(client, *robot, problems);
  for (const std::string& p : problems) std::fprintf(stderr, "%s\n", p.c_str());
  return graph;
}

int failed(const lrt::Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), 2; }

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const bool checks = std::string_view(argv[1]) == "--check";
  const auto graph = documents(argv[checks ? 2 : 1]);
  if (!graph) return failed(graph.error());
  const auto robot = lrt::client::describe(*graph);
  if (!robot) return failed(robot.error());
  if (checks) {
    const auto differences = lrt::codegen::check(contents(argv[3]), *robot);
    if (!differences) return failed(differences.error());
    for (const std::string& d : *differences) std::printf("%s\n", d.c_str());
    return differences->empty() ? 0 : 1;
  }
  lrt::codegen::GenerateOptions options;
  options.name_space = argv[2];
  const auto made = lrt::codegen::generate(*robot, options);
  if (!made) return failed(made.error());
  for (const std::string& w : made->warnings) std::fprintf(stderr, "%s\n", w.c_str());
  std::ofstream(argv[3]) << made->header;
  if (argc > 4) std::ofstream(argv[4]) << lrt::rdf::write(*graph, lrt::rdf::Syntax::turtle).value();
}
