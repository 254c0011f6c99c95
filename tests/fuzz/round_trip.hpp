// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the fuzzers of RDF share: a graph that was read survives being written and read again.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include <lrt/rdf/codec.hpp>

namespace lrt::fuzz {

[[noreturn]] inline void broken(const char* what, const std::string& text) {
  std::fprintf(stderr, "%s:\n%s\n", what, text.c_str());
  std::abort();
}

/// @param context  of JSON-LD; empty: inlined
inline void round_trip(const rdf::Graph& graph, rdf::Syntax syntax, std::string_view context = {}) {
  const Result<std::string> written = rdf::write(graph, syntax, rdf::default_prefixes(), context);
  if (!written) {
    if (syntax != rdf::Syntax::rdf_xml) broken("not written", written.error().message);
    return;
  }
  if (*written != *rdf::write(graph, syntax, rdf::default_prefixes(), context)) broken("written differently the second time", *written);
  rdf::ReadOptions options;
  options.context = context;
  const Result<rdf::Graph> back = rdf::read(*written, syntax, options);
  if (!back) broken(back.error().message.c_str(), *written);
  if (back->size() != graph.size()) broken("another number of triples", *written);
  std::size_t blanks = 0;
  for (std::uint32_t i = 0; i < graph.term_count(); ++i) blanks += graph.term(rdf::TermId{i}).is_blank();
  if (blanks <= 50 && !rdf::isomorphic(graph, *back)) broken("another graph", *written);
}

}  // namespace lrt::fuzz
