// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/round_trip.hpp"

// Bytes -> JSON-LD -> graph -> JSON-LD, Turtle -> the same graph. The context is at http://example.org/c.

using lrt::Result;
using lrt::fuzz::broken;
using lrt::fuzz::round_trip;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/a/b";
  options.context = "http://example.org/c";
  options.max_triples = 300;
  options.max_bytes = 1 << 20;  // far below the default, which what is written must pass again
  const Result<Graph> graph = lrt::rdf::read(text, Syntax::json_ld, options);
  if (!graph) {
    const std::string& message = graph.error().message;
    if (message.empty() || message.size() > 1000) broken("an error without a word, or with too many", message);
    return 0;
  }
  round_trip(*graph, Syntax::json_ld);
  round_trip(*graph, Syntax::json_ld, options.context);
  round_trip(*graph, Syntax::turtle);
  return 0;
}
