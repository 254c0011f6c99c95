#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::rdf {

/// The RDF syntaxes that have a codec.
enum class Syntax : unsigned char { turtle, n_triples, rdf_xml };
inline constexpr std::array<Syntax, 3> all_syntaxes = {Syntax::turtle, Syntax::n_triples, Syntax::rdf_xml};

/// "text/turtle", "application/n-triples", "application/rdf+xml".
std::string_view media_type(Syntax syntax) noexcept;
/// The syntax of a media type without parameters, in lower case.
std::optional<Syntax> syntax_of(std::string_view media_type) noexcept;

/// Prefix and namespace IRI, for writing Turtle and RDF/XML.
using Prefixes = std::vector<std::pair<std::string, std::string>>;
/// The table of vocabularies that lrt speaks: hybrit, vom, maths, spatial, ros, xhv, ldp, sh, dcterms, rdf, rdfs, xsd, prov, ...
const Prefixes& default_prefixes();

struct ReadOptions {
  std::string_view base;                  ///< absolute IRI that relative ones are resolved against; may be empty for N-Triples
  std::size_t max_triples = 100'000;      ///< as written, repeated ones too; more: Errc::limit_exceeded
  /// Of the IRIs and literals of all triples, written out, each time they occur; more: Errc::limit_exceeded. What a document
  /// needs in memory and time grows with this rather than with its own size: prefixes and bases are shorthand.
  /// What is resolved against a Turtle base of more than 256 bytes counts five times or more, for it takes so much longer.
  std::size_t max_bytes = 64 * 1024 * 1024;
};

/// Reads a document. What Raptor lets pass at the edges (U+0000, surrogate escapes, illegal IRIs, invalid UTF-8) is refused, and so
/// are brackets nested more than 1000 deep, language tags of more than 255 bytes, and RDF/XML with a document type declaration.
/// Blank nodes are called b0, b1, ... in order of appearance.
///
/// Fixed limits keep the time of a document close to proportional to its size. More than these is Errc::limit_exceeded:
///
///  - one IRI, resolved: 8 KiB, also a prefix, a namespace name or a base;
///  - Turtle: 1000 prefix and base directives;
///  - RDF/XML: elements 256 deep, 256 attributes on one, 1000 namespace declarations, 32 dot segments in one xml:base, and
///    elements three times max_triples (those in XML literals make no triples).
///
/// @par Errors   expected_rdf and limit_exceeded with line, column and offset (RDF/XML: the line, where known); expected_iri for
///               a base that is no absolute IRI.
/// @par Threads  Any. Each call borrows a Redland world; there are as many as calls have run at once, and they are kept.
/// @par Implements  R1.2, RDF 1.1 Turtle, N-Triples, RDF/XML
Result<Graph> read(std::string_view text, Syntax syntax, const ReadOptions& options);

/// Writes a graph. Deterministic: the same triples in the same order give the same bytes. IRIs are written absolute or with a
/// prefix, never relative. Only prefixes that occur are declared.
///
/// @par Errors   unsupported_syntax when the syntax cannot carry the graph (RDF/XML and a predicate without a local name, or a
///               character that XML 1.0 lacks), and when a term is no RDF: a relative IRI, invalid UTF-8.
/// @par Time     Turtle, N-Triples: 3 us for 12 triples. RDF/XML: fifty times that, and it is read back to be sure of it.
Result<std::string> write(const Graph& graph, Syntax syntax, const Prefixes& prefixes = default_prefixes());

}  // namespace lrt::rdf
