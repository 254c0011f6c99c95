// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/sample_robot.hpp"

// Graphs for other implementations to read, and what they made of them.
//
//   json_ld_exchange write DIR SUITES   puts each graph into DIR as N.nt, N.ttl, N.jsonld, and N.ref.jsonld that refers to context.jsonld
//   json_ld_exchange read DIR           reads each N.*.back.jsonld and says which is another graph than N.nt
//   json_ld_exchange datasets DIR       reads each N.in.jsonld as a dataset and puts it into N.out.nq, or why it was refused into N.out.error;
//                                       the lines of DIR/contexts.txt are IRIs and files of contexts
//
// The graphs: those of the W3C suites in SUITES, every resource of the sample robot, and some that are hard to write.

namespace {

namespace fs = std::filesystem;
using namespace lrt;
using rdf::Graph;
using rdf::Syntax;

constexpr const char* context = "http://localhost/ns/context.jsonld";

std::string slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}
void put(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

/// Beyond what suites and robots have.
constexpr const char* odd[] = {
    "<http://e/s> <http://e/p> _:a . _:a <http://e/p> _:b . _:b <http://e/p> _:a .",
    "<http://e/s> a \"no class\", _:x, [ a _:x ], <http://e/C> .",
    "<http://e/s> <http://e/p> ( 1 ( 2 ( ) ) [ <http://e/q> ( true ) ] \"a\"@en ) .",
    "_:l <http://www.w3.org/1999/02/22-rdf-syntax-ns#first> 1 . <http://e/s> <http://e/p> _:l .",
    "_:l <http://www.w3.org/1999/02/22-rdf-syntax-ns#first> 1, 2 ; <http://www.w3.org/1999/02/22-rdf-syntax-ns#rest> () . <http://e/s> <http://e/p> "
    "_:l .",
    "_:l <http://www.w3.org/1999/02/22-rdf-syntax-ns#first> 1 ; <http://www.w3.org/1999/02/22-rdf-syntax-ns#rest> _:l .",
    "() <http://e/p> () .",
    "<http://e/s> <http://e/p> 1, -5, 005, +5, 9007199254740991, 9007199254740993, 1e400, \"INF\"^^<http://www.w3.org/2001/XMLSchema#double> .",
    "<http://e/s> <http://e/p> 4.36E1, 43.6e0, 1.0E0, 1.0E-1, 1.0E21, 3.0000000000000004E-1, 5.0E-324, 4.940656458412465E-324, -1.5E-7 .",
    "<http://e/s> <http://e/p> true, \"1\"^^<http://www.w3.org/2001/XMLSchema#boolean>, 1.50, \"x\"^^<http://e/t>, "
    "\"a\\u0001\\u2028\\U0001F916\\\"\\\\\" .",
    "<ros:thing> <ros:p> <sh:path> ; <vom:x> 1 ; a <lrt:C> . <http://e/s> <http://ros.org/#rotation> <ros:thing> ; <http://www.w3.org/ns/shacl#path> "
    "5 .",
    "<id:x> <type:y> <state:z> . <urn:a:b> <urn:c> <mailto:a@b> .",
    "<http://e/s> <https://w3id.org/lrt/ns#status> <https://w3id.org/lrt/ns#running>, <http://e/other>, <http://ros.org/#x>, \"running\" ;"
    " <https://w3id.org/lrt/ns#progress> 1, 0.5, \"0.5\"^^<http://www.w3.org/2001/XMLSchema#double>, \"half\", true, 1.0E0 ;"
    " <http://purl.org/dc/terms/modified> \"yesterday\", \"2020-01-01T00:00:00Z\"^^<http://www.w3.org/2001/XMLSchema#dateTime> ;"
    " <http://vocab.arvida.de/2015/06/vom/vocab#unit> \"deg\", 5, ( <http://e/x> \"y\" ), [ <http://e/q> 1 ], _:two . _:two <http://e/p> _:two .",
    "<http://e/a/../b> <http://e/./p> <http://e/c?x=1#y> . <HTTP://E/s> <http://e/p> <file:///x> .",
    "[] a <http://e/C> .",
    "",
};

std::vector<Graph> all_graphs(const fs::path& suites) {
  std::vector<Graph> graphs;
  const auto add = [&](const Result<Graph>& graph) {
    if (graph) graphs.push_back(*graph);
  };
  for (const char* text : odd) add(rdf::read(text, Syntax::turtle, {"http://e/"}));
  Graph deep;
  for (int i = 0; i < 100; ++i) deep.add(rdf::blank("n" + std::to_string(i)), rdf::iri("http://e/p"), rdf::blank("n" + std::to_string(i + 1)));
  graphs.push_back(deep);

  test::SampleRobot robot;
  test::Bench bench;
  bench.add(robot.arm());
  for (const char* path : {"/", "/ns/lrt", "/arm", "/arm/state", "/arm/blueprint", "/arm/subscriptions", "/arm/angle", "/arm/count", "/arm/pose",
                           "/arm/gains", "/arm/mode", "/arm/actions/turn", "/arm/actions/grip", "/arm/waypoints", "/arm/tool", "/arm/tool/state"}) {
    const test::Answer answer = bench.get(path);
    if (answer.status == 200) graphs.push_back(answer.graph());
  }
  std::vector<fs::path> files;
  for (const char* folder : {"rdf-turtle", "rdf-n-triples"})
    if (fs::is_directory(suites / folder))
      for (const auto& entry : fs::recursive_directory_iterator(suites / folder))
        if (entry.path().extension() == ".ttl" || entry.path().extension() == ".nt") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files)
    add(rdf::read(slurp(file), file.extension() == ".nt" ? Syntax::n_triples : Syntax::turtle,
                  {"http://www.w3.org/suite/" + file.filename().string()}));
  return graphs;
}

int write(const fs::path& dir, const fs::path& suites) {
  put(dir / "context.jsonld", rdf::json_ld_context());
  std::size_t n = 0;
  for (const Graph& graph : all_graphs(suites)) {
    const std::string name = std::to_string(n++);
    const auto as = [&](const char* extension, Syntax syntax, std::string_view by = {}) {
      put(dir / (name + extension), rdf::write(graph, syntax, rdf::default_prefixes(), by).value());
    };
    as(".nt", Syntax::n_triples);
    as(".ttl", Syntax::turtle);
    as(".jsonld", Syntax::json_ld);
    as(".ref.jsonld", Syntax::json_ld, context);
  }
  std::cout << n << " graphs\n";
  return 0;
}

/// The graph with a blank node for the last cell of each list. The JSON-LD 1.1 API makes a list of the cells from the last one up to the first that is an
/// IRI (Serialize RDF as JSON-LD Algorithm): the last one loses its name.
Graph without_last_names(const Graph& graph) {
  Graph other;
  const auto rest = graph.find(vocab::rdf_::rest), nil = graph.find(vocab::rdf_::nil);
  const auto copy = [&](rdf::TermId id) {
    const bool is_last = rest && nil && graph.contains(id, *rest, *nil);
    return other.intern(is_last ? rdf::blank("last" + std::to_string(static_cast<std::uint32_t>(id))) : graph.term(id));
  };
  for (const rdf::Triple& t : graph.triples()) {
    const rdf::TermId s = copy(t.subject), p = copy(t.predicate), o = copy(t.object);
    other.add(s, p, o);
  }
  return other;
}

int read(const fs::path& dir) {
  std::size_t good = 0, bad = 0;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(dir))
    if (entry.path().extension() == ".jsonld" && entry.path().filename() != "context.jsonld") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    const Graph expected = rdf::read(slurp(dir / (name.substr(0, name.find('.')) + ".nt")), Syntax::n_triples, {}).value();
    rdf::ReadOptions options;
    options.base = "http://localhost/somewhere";
    options.context = context;
    const Result<Graph> found = rdf::read(slurp(file), Syntax::json_ld, options);
    if (found && (rdf::isomorphic(*found, expected) || rdf::isomorphic(without_last_names(*found), without_last_names(expected)))) {
      ++good;
      continue;
    }
    ++bad;
    std::cout << name << ": " << (found ? "another graph" : found.error().message) << "\n";
  }
  std::cout << good << " documents read as the same graph, " << bad << " not\n";
  return bad == 0 && good > 0 ? 0 : 1;
}

int datasets(const fs::path& dir) {
  rdf::Contexts contexts;
  std::istringstream lines(slurp(dir / "contexts.txt"));
  for (std::string iri, file; lines >> iri >> file;) contexts.add(iri, slurp(dir / file)).value();
  rdf::ReadOptions options;
  options.base = "http://localhost/doc";
  options.contexts = &contexts;
  std::size_t read = 0, refused = 0;
  for (const auto& entry : fs::directory_iterator(dir)) {
    const std::string name = entry.path().filename().string();
    const std::size_t end = name.find(".in.jsonld");
    if (end == std::string::npos) continue;
    const Result<rdf::Dataset> dataset = rdf::read_dataset(slurp(entry.path()), Syntax::json_ld, options);
    ++(dataset ? read : refused);
    const std::string out = name.substr(0, end) + ".out.";
    if (dataset) put(dir / (out + "nq"), rdf::write(*dataset, Syntax::n_quads).value());
    else put(dir / (out + "error"), dataset.error().message);
  }
  std::cout << read << " documents read, " << refused << " refused\n";
  return read > 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 2 ? argv[1] : "";
  if (what == "write" && argc == 4) return write(argv[2], argv[3]);
  if (what == "read") return read(argv[2]);
  if (what == "datasets") return datasets(argv[2]);
  std::cerr << "usage: json_ld_exchange write DIR SUITES | read DIR | datasets DIR\n";
  return 2;
}
