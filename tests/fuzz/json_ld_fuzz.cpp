// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/round_trip.hpp"

// Bytes -> JSON-LD -> graph -> JSON-LD, Turtle -> the same graph. The context is at http://example.org/c; http://example.org/r and /i are registered ones.
// The dataset of the same bytes is written as N-Quads and read again.

using lrt::Result;
using lrt::fuzz::broken;
using lrt::fuzz::round_trip;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;

namespace {

const lrt::rdf::Contexts& registered() {
  static const lrt::rdf::Contexts contexts = [] {
    lrt::rdf::Contexts made;
    made.add("http://example.org/i", R"({"@context": {"@vocab": "http://v/", "x": {"@id": "http://e/x", "@protected": true}}})").value();
    made.add("http://example.org/r",
             R"({"@context": [{"T": {"@id": "http://e/T", "@context": {"@import": "i", "y": {"@id": "http://e/y", "@context": "i"}}}},
                                        {"g": {"@id": "http://e/g", "@container": ["@graph", "@id"]}, "@propagate": false}]})")
        .value();
    return made;
  }();
  return contexts;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/a/b";
  options.context = "http://example.org/c";
  options.max_triples = 300;
  options.max_bytes = 1 << 20;  // far below the default, which what is written must pass again
  options.contexts = &registered();
  if (const Result<lrt::rdf::Dataset> dataset = lrt::rdf::read_dataset(text, Syntax::json_ld, options)) {
    const std::string quads = lrt::rdf::write(*dataset, Syntax::n_quads).value();
    const Result<lrt::rdf::Dataset> back = lrt::rdf::read_dataset(quads, Syntax::n_quads, {});
    if (!back || back->default_graph.size() != dataset->default_graph.size()) broken("a dataset that is not read again", quads);
  }
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
