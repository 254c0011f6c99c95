// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/comparison.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "src/exchange/http_authentication.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::mirror {
namespace {

using rdf::TermId;
using rdf::TermView;
using rdf::Triple;
using Colour = std::uint64_t;

/// FNV-1a: the same in each process, because fingerprints are kept in files.
Colour colour_of(std::string_view text) noexcept {
  Colour colour = 0xCBF29CE484222325U;
  for (const char c : text) colour = (colour ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return colour;
}

Colour mix(Colour a, Colour b) noexcept { return rdf::fold_multiply(a ^ 0xA0761D6478BD642FU, b ^ 0xE7037ED1A0B428DBU); }

std::string hex_of(Colour colour) {
  constexpr unsigned bits = 64, bits_of_digit = 4;
  std::string text;
  for (unsigned shift = bits; shift > 0; shift -= bits_of_digit) text += "0123456789abcdef"[colour >> (shift - bits_of_digit) & 0xFU];
  return text;
}

Result<std::string> digest_of(std::vector<std::string>& lines) {
  std::sort(lines.begin(), lines.end());
  std::string all;
  for (const std::string& line : lines) all.append(line).append("\n");
  return exchange::hex_digest(exchange::HashAlgorithm::sha256, all);
}

std::size_t kinds_of(std::vector<Colour> colours) {
  std::sort(colours.begin(), colours.end());
  return static_cast<std::size_t>(std::unique(colours.begin(), colours.end()) - colours.begin());
}

/// The texts of all terms. Blank nodes are named by what is around them: each round takes the colours of their neighbours into their own, until that
/// distinguishes no more of them.
std::vector<std::string> names_of(const rdf::Graph& graph, bool with_literals) {
  constexpr unsigned max_rounds = 32;
  std::vector<std::string> names(graph.term_count());
  std::vector<Colour> colours(graph.term_count());
  std::vector<std::size_t> blanks;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const TermView term = graph.term(TermId{static_cast<std::uint32_t>(i)});
    if (term.is_blank()) blanks.push_back(i);
    else names[i] = term.is_literal() && !with_literals ? "\"\"" : rdf::to_string(term);
    colours[i] = colour_of(names[i]);
  }
  if (blanks.empty()) return names;
  std::vector<const Triple*> edges;
  for (const Triple& t : graph.triples())
    if (graph.term(t.subject).is_blank() || graph.term(t.object).is_blank()) edges.push_back(&t);
  std::size_t kinds = 0;
  for (unsigned round = 0; round < max_rounds; ++round) {
    std::vector<Colour> next = colours;
    for (const Triple* const t : edges) {
      const auto subject = static_cast<std::size_t>(t->subject), object = static_cast<std::size_t>(t->object);
      const Colour whole = mix(mix(colours[subject], colours[static_cast<std::size_t>(t->predicate)]), colours[object]);
      next[subject] += mix(whole, 1);
      next[object] += mix(whole, 2);
    }
    std::vector<Colour> now;
    for (const std::size_t blank : blanks) now.push_back(colours[blank] = mix(next[blank], colours[blank]));
    if (const std::size_t more = kinds_of(std::move(now)); std::exchange(kinds, more) == more) break;
  }
  for (const std::size_t blank : blanks) names[blank] = "_:" + hex_of(colours[blank]);
  return names;
}

Result<std::string> digest_of(const rdf::Graph& graph, bool with_literals) {
  const std::vector<std::string> names = names_of(graph, with_literals);
  std::vector<std::string> lines;
  lines.reserve(graph.size());
  for (const Triple& t : graph.triples())
    lines.push_back(names[static_cast<std::size_t>(t.subject)] + " " + names[static_cast<std::size_t>(t.predicate)] + " " +
                    names[static_cast<std::size_t>(t.object)]);
  return digest_of(lines);
}

/// The digest of a text that is not RDF that lrt reads.
Result<std::string> digest_of_lines(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  Result<std::string> digest = digest_of(lines);
  if (digest) *digest += "-lines";
  return digest;
}

}  // namespace

Result<std::string> fingerprint(const rdf::Graph& graph) { return digest_of(graph, true); }

Result<std::string> outline_of(const rdf::Graph& graph) { return digest_of(graph, false); }

Result<Echo> echo_of(std::string_view text, std::string_view media_type, const std::string& base) {
  Echo echo;
  rdf::ReadOptions options;
  options.base = base;
  options.max_triples = 1'000'000;
  constexpr std::size_t max_bytes = std::size_t{512} * 1024 * 1024;
  options.max_bytes = max_bytes;
  // N-Triples was once sent as text/plain, and some stores still do.
  const auto syntax = media_type == "text/plain" ? std::optional(rdf::Syntax::n_triples) : rdf::syntax_of(media_type);
  if (syntax) {
    if (Result<rdf::Graph> graph = rdf::read(text, *syntax, options)) echo.graph = *std::move(graph);
  }
  Result<std::string> digest = echo.graph ? fingerprint(*echo.graph) : digest_of_lines(text);
  if (!digest) return unexpected(std::move(digest).error());
  echo.fingerprint = *std::move(digest);
  return echo;
}

}  // namespace lrt::mirror
