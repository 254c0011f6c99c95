#include <lrt/rdf/codec.hpp>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

// Bytes -> read -> write in every syntax -> read -> the same graph. The first byte chooses the syntax: 'n' N-Triples, 'x'
// RDF/XML, anything else Turtle; it is part of the text unless it is one of the two.

namespace {

using lrt::Result;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;

[[noreturn]] void broken(const char* what, const std::string& text) {
  std::fprintf(stderr, "%s:\n%s\n", what, text.c_str());
  std::abort();
}

std::size_t count_blanks(const Graph& graph) {
  std::size_t n = 0;
  for (std::uint32_t i = 0; i < graph.term_count(); ++i) n += graph.term(lrt::rdf::TermId{i}).is_blank();
  return n;
}

}  // namespace

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
  const std::size_t blanks = count_blanks(*graph);
  for (const Syntax as : lrt::rdf::all_syntaxes) {
    const Result<std::string> written = lrt::rdf::write(*graph, as);
    if (!written) {
      if (as != Syntax::rdf_xml) broken("not written", written.error().message);
      continue;
    }
    if (*written != *lrt::rdf::write(*graph, as)) broken("written differently the second time", *written);
    lrt::rdf::ReadOptions back_options;
    const Result<Graph> back = lrt::rdf::read(*written, as, back_options);
    if (!back) broken(back.error().message.c_str(), *written);
    if (back->size() != graph->size()) broken("another number of triples", *written);
    if (blanks <= 50 && !lrt::rdf::isomorphic(*graph, *back)) broken("another graph", *written);
  }
  return 0;
}
