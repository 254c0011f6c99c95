// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/round_trip.hpp"

// Bytes -> read -> write in every syntax -> read -> the same graph. The first byte chooses the syntax: 'n' N-Triples, 'x'
// RDF/XML, anything else Turtle; it is part of the text unless it is one of the two.

using lrt::Result;
using lrt::fuzz::broken;
using lrt::fuzz::round_trip;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text(reinterpret_cast<const char*>(data), size);
  Syntax syntax = Syntax::turtle;
  if (!text.empty() && (text[0] == 'n' || text[0] == 'x')) {
    syntax = text[0] == 'n' ? Syntax::n_triples : Syntax::rdf_xml;
    text.remove_prefix(1);
  }
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/a/b";
  options.max_triples = 300;
  options.max_bytes = 1 << 20;  // far below the default, which what is written must pass again
  const Result<Graph> graph = lrt::rdf::read(text, syntax, options);
  if (!graph) {
    if (graph.error().message.empty()) broken("an error without a word", std::string(text));
    return 0;
  }
  for (const Syntax as : lrt::rdf::available_syntaxes()) round_trip(*graph, as);
  return 0;
}
