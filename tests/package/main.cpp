// SPDX-License-Identifier: Apache-2.0
// A host of lrt, as small as it gets. Its argument is the version that it expects.
#include <cstdio>
#include <cstring>

#include <lrt/rdf/graph.hpp>
#include <lrt/version.hpp>

int main(int argc, char** argv) {
  if (argc != 2 || std::strcmp(argv[1], LRT_VERSION) != 0) {
    std::fprintf(stderr, "lrt is %s\n", LRT_VERSION);
    return 1;
  }
  using lrt::rdf::iri;
  lrt::rdf::Graph graph;
  graph.add(iri("http://example.org/arm"), iri("http://example.org/has"), iri("http://example.org/joint"));
  return graph.size() == 1 ? 0 : 1;
}
