#include <lrt/rdf/codec.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

// Bytes -> JSON-LD -> graph -> JSON-LD, Turtle -> the same graph. The context is at http://example.org/c.

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
  const std::size_t blanks = count_blanks(*graph);
  lrt::rdf::ReadOptions back_options;
  back_options.context = options.context;
  const auto check = [&](Syntax as, std::string_view context) {
    const Result<std::string> written = lrt::rdf::write(*graph, as, lrt::rdf::default_prefixes(), context);
    if (!written) broken("not written", written.error().message);
    if (*written != *lrt::rdf::write(*graph, as, lrt::rdf::default_prefixes(), context)) broken("written differently the second time", *written);
    const Result<Graph> back = lrt::rdf::read(*written, as, back_options);
    if (!back) broken(back.error().message.c_str(), *written);
    if (back->size() != graph->size()) broken("another number of triples", *written);
    if (blanks <= 50 && !lrt::rdf::isomorphic(*graph, *back)) broken("another graph", *written);
  };
  check(Syntax::json_ld, {});
  check(Syntax::json_ld, options.context);
  const auto is_ordinal = [&](const lrt::rdf::Triple& t) {  // Raptor takes rdf:_x for one, and refuses it
    return graph->term(t.predicate).text.find("http://www.w3.org/1999/02/22-rdf-syntax-ns#_") == 0;
  };
  if (std::none_of(graph->triples().begin(), graph->triples().end(), is_ordinal)) check(Syntax::turtle, {});
  return 0;
}
