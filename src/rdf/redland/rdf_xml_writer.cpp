// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/base/utf8.hpp"
#include "src/rdf/codecs.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/redland/redland.hpp"

// RDF/XML is written by Raptor. It does not detect terms that XML cannot represent, so they are checked first, and its output is read back.

namespace lrt::rdf {
inline namespace v0 {
namespace {

constexpr std::string_view rdf_namespace = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";  // Raptor declares it itself
constexpr std::size_t max_nested_blanks = 64;  // Raptor nests blank nodes by recursion, and searches them one by one
constexpr std::size_t max_nested_triples = 2000;
constexpr std::size_t max_compared_blanks = 200;  // with more, reading back compares the number of triples

/// XML 1.0 Char (production 2).
bool is_xml(std::string_view text) noexcept {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 && c != '\t' && c != '\n' && c != '\r') return false;
    if (c == 0xEF && text.size() - i > 2 && text[i + 1] == '\xBF' && (text[i + 2] == '\xBE' || text[i + 2] == '\xBF')) return false;
  }
  return true;
}

/// True if the IRI ends in a name that XML can use as an element: a letter or '_', then letters, digits, '-', '_', '.'.
/// ASCII only, as Raptor sees it.
bool has_local_name(std::string_view iri) noexcept {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  for (std::size_t i = iri.size(); i-- > 0;) {
    const char c = iri[i];
    if (letter(c)) return true;
    if (!(c >= '0' && c <= '9') && c != '-' && c != '.') return false;
  }
  return false;
}

std::string_view xml_fault_of(const TermView& term, bool predicate) noexcept {
  if (const std::string_view fault = fault_of(term); !fault.empty()) return fault;
  if (predicate && !has_local_name(term.text)) return "RDF/XML needs a predicate that ends in an XML name";
  if (term.is_literal() && !is_xml(term.text)) return "XML 1.0 lacks a character of it";
  return {};
}

/// The namespaces that occur, so that Raptor declares no others.
Prefixes used_prefixes(const Graph& graph, const Prefixes& prefixes) {
  const auto type = graph.find(vocab::rdf_::type);
  Prefixes used;
  for (const auto& [name, iri] : prefixes) {
    const auto begins = [&iri = iri](std::string_view text) { return text.substr(0, iri.size()) == iri; };
    const auto occurs = [&](const Triple& t) {
      return begins(graph.term(t.predicate).text) || (type && t.predicate == *type && begins(graph.term(t.object).text));
    };
    if (name.empty() || iri == rdf_namespace || !iri::is_absolute(iri) || !is_plain_label(name)) continue;
    if (std::any_of(graph.triples().begin(), graph.triples().end(), occurs)) used.emplace_back(name, iri);
  }
  return used;
}

}  // namespace

Result<std::string> write_rdf_xml(const Graph& graph, const Prefixes& prefixes) {
  std::vector<bool> judged(graph.term_count(), false);
  std::size_t blanks = 0;
  for (const Triple& t : graph.triples()) {
    for (const TermId id : {t.subject, t.predicate, t.object}) {
      const TermView term = graph.term(id);
      const bool predicate = id == t.predicate;
      if (judged[static_cast<std::uint32_t>(id)] && !predicate) continue;
      judged[static_cast<std::uint32_t>(id)] = true;
      blanks += term.is_blank();
      if (const std::string_view fault = xml_fault_of(term, predicate); !fault.empty()) return unwritable(term, fault);
    }
  }
  const Prefixes used = used_prefixes(graph, prefixes);
  const bool small = blanks <= max_nested_blanks && graph.size() <= max_nested_triples;
  for (const bool nested : {true, false}) {
    if (nested && !small) continue;
    Result<std::string> written = redland::serialize_rdf_xml(graph, used, nested);
    if (!written) continue;
    ReadOptions options;
    options.max_triples = graph.size();
    const Result<Graph> back = redland::parse_rdf_xml(*written, options);
    if (!back || back->size() != graph.size()) continue;
    if (blanks <= max_compared_blanks && !isomorphic(graph, *back)) continue;
    return written;
  }
  return unexpected(Errc::unsupported_syntax, "RDF/XML cannot carry this graph");
}

}  // namespace v0
}  // namespace lrt::rdf
