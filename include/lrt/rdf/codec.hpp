// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The RDF syntaxes of lrt.
enum class Syntax : unsigned char { turtle, n_triples, rdf_xml, json_ld, trig, n_quads };
/// The syntaxes that this build reads and writes, in the order in which they are offered. The CMake options LRT_REDLAND
/// and LRT_JSON_LD leave RDF/XML and JSON-LD out.
/// @par Threads  Any.
LRT_API const std::vector<Syntax>& available_syntaxes();

/// "text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json", "application/trig",
/// "application/n-quads".
/// @par Threads  Any.
LRT_API std::string_view media_type(Syntax syntax) noexcept;
/// The available syntax of a media type without parameters, in lower case; nullopt: none.
/// @par Threads  Any.
LRT_API std::optional<Syntax> syntax_of(std::string_view media_type) noexcept;

/// Pairs of prefix and namespace IRI, for writing Turtle, RDF/XML and JSON-LD.
using Prefixes = std::vector<std::pair<std::string, std::string>>;
/// The prefixes of the vocabularies that lrt uses: hybrit, vom, maths, spatial, ros, xhv, ldp, sh, dcterms, rdf, rdfs,
/// xsd, prov, ...
/// @par Threads  Any.
LRT_API const Prefixes& default_prefixes();

struct RegisteredContexts;

/// JSON-LD contexts of others, by IRI. A document that is read may refer to one of them, also in an array, in the context
/// of a term and by `@import`. lrt fetches no context: those that are neither here nor lrt's own are refused by name.
///
///     rdf::Contexts contexts;
///     contexts.add("https://www.w3.org/2022/wot/td/v1.1", text_of_the_file).value();
///
/// Copies share the texts.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Contexts {
 public:
  static constexpr std::size_t max_contexts = 100;       ///< in one object
  static constexpr std::size_t max_bytes = 1024 * 1024;  ///< of one text

  /// Registers a context, or replaces it. What its terms mean is judged when a document refers to it, because a context may
  /// depend on those before it.
  ///
  /// @param iri   by which documents refer to it, absolute. References in it are relative to this IRI.
  /// @param text  a document in JSON: an object with the member `\@context`. Its other members are ignored.
  /// @par Errors   expected_iri; expected_rdf with the place: JSON that is not valid, or has no `\@context`; limit_exceeded;
  ///               unsupported_syntax: a build without JSON-LD. Nothing has changed then.
  /// @par Threads  One thread at a time.
  Result<void> add(std::string_view iri, std::string_view text);
  bool empty() const noexcept { return kept_ == nullptr; }  ///< whether no context is registered

  /// @private  for readers
  const RegisteredContexts* kept() const noexcept { return kept_.get(); }

 private:
  std::shared_ptr<const RegisteredContexts> kept_;
};

/// Options and limits of read().
struct ReadOptions {
  std::string_view base;              ///< absolute IRI that relative ones are resolved against; may be empty for N-Triples
  std::size_t max_triples = 100'000;  ///< as written, repeated ones too; more: Errc::limit_exceeded
  /// Limit of the bytes of the IRIs and literals of all triples, written in full at each occurrence; more:
  /// Errc::limit_exceeded. Prefixes and bases abbreviate, so a document's memory and time grow with this number rather
  /// than with its own size. A reference that is resolved against a base of more than 256 bytes counts more, because it
  /// takes more time: in Turtle 16 times the base if that has no authority, in JSON-LD five times the base and the
  /// reference.
  std::size_t max_bytes = 64 * 1024 * 1024;
  /// JSON-LD: the IRI by which documents may refer to json_ld_context(*context_prefixes), besides json_ld_context_iri.
  /// A query in their reference is ignored.
  std::string_view context = {};
  const Prefixes* context_prefixes = nullptr;  ///< nullptr: default_prefixes()
  const Contexts* contexts = nullptr;          ///< JSON-LD: further contexts that documents may refer to; nullptr: none
};

/// Reads a document. A byte order mark of UTF-8 may stand before it. Every syntax refuses invalid UTF-8, surrogate
/// escapes, illegal and relative IRIs, language tags of more than 255 bytes, literals of rdf:langString without a
/// language, and Turtle brackets nested more than 1000 deep. A literal may contain U+0000 (RDF 1.1), but not in
/// RDF/XML; it is then not a valid xsd:string. Blank nodes are called b0, b1, ... in order of appearance.
///
/// One graph is read. A document in TriG, N-Quads or JSON-LD that has a named graph is refused with unsupported_syntax:
/// read_dataset() reads it.
///
/// Turtle, TriG, N-Triples and N-Quads are read in one pass, without recursion. Redland reads RDF/XML. RDF/XML may be in UTF-16, and in US-ASCII or ISO-8859-1 if it says so, and may have entities
/// that it declares itself; entities from elsewhere, parameter entities and default values of attributes are refused.
///
/// Fixed limits keep the time close to proportional to the size of the document. Beyond them: Errc::limit_exceeded.
///
///  - one IRI, resolved: 8 KiB, also a prefix, a namespace name or a base;
///  - Turtle and TriG: 1000 prefix and base directives;
///  - RDF/XML: elements 256 deep, 256 attributes on one, 1000 namespace declarations, 32 dot segments in one xml:base,
///    elements three times max_triples (those in XML literals make no triples), 1000 declarations of entities, 32
///    entities in each other, and a document of 128 KiB and ten times its size when they are written out;
///  - JSON-LD: objects and arrays 256 deep, JSON values 16 times max_triples and 1000, 4000 terms in all its contexts,
///    32 contexts in one array or in each other, 16 contexts that refer to each other by IRI. Limits of what a host
///    registers: rdf::Contexts.
///
/// JSON-LD 1.1 is read directly, with contexts of terms and of types, `@propagate`, `@protected`, `@import`, `@nest`,
/// `@included` and all containers. A context is an object in the document, lrt's own by its IRI, or one of
/// ReadOptions::contexts; lrt fetches none. `@direction` is judged and dropped, because RDF has no place for it
/// (rdfDirection null). Refused with unsupported_syntax: other contexts by IRI, blank nodes as predicates and as
/// `@vocab`, and graphs whose name is a blank node, as most of those in a `@graph` container are. Refused with
/// expected_rdf: an object that has a member twice, and IRIs that stay relative. `@json` becomes rdf:JSON in the canonical form of RFC 8785. Numbers become xsd:integer and xsd:double in canonical form, as
/// JSON-LD says, but exactly: integers below 10^21 keep all digits, doubles the 17th if the value needs it.
///
/// @par Errors   expected_rdf and limit_exceeded with line, column and offset (RDF/XML: the line, where known; JSON-LD:
///               the position of invalid JSON, else the member's JSON Pointer); unsupported_syntax for unsupported
///               JSON-LD features and for a syntax that is not available; expected_iri for a base that is not an
///               absolute IRI.
/// @par Threads  Any. RDF/XML: each call uses a Redland world of its own from a pool, which keeps as many as calls have
///               run at once.
/// @par Time     Turtle: 1.3 us for 4 triples, 2 us for 12, 10 ms for 1 MiB of properties. N-Triples: 2 ms for 1 MiB.
/// @par Implements  R1.2, RDF 1.1 Turtle, N-Triples, RDF/XML, JSON-LD 1.1
LRT_API Result<Graph> read(std::string_view text, Syntax syntax, const ReadOptions& options);

/// Writes a graph. Deterministic: the same triples in the same order give the same bytes. IRIs are written absolute or
/// with a prefix, never relative. Only used prefixes are declared.
///
/// In TriG and N-Quads the graph is the default graph, written as in Turtle and N-Triples.
///
/// JSON-LD is compacted with the terms of json_ld_context(). A literal becomes a JSON number only if every reader gets
/// the same literal back.
///
/// @param context  JSON-LD: the IRI of json_ld_context(prefixes), which the document refers to. If it is empty, or if
///                 an IRI has a prefix as its scheme, the used terms of the context are written into the document.
///
/// @par Errors   unsupported_syntax: the syntax is not available, or it cannot express the graph (RDF/XML: a predicate
///               without a local name, a character that XML 1.0 does not have), or a term is not valid RDF (a relative
///               IRI, invalid UTF-8)
/// @par Threads  Any. RDF/XML: as read().
/// @par Time     Turtle, N-Triples, JSON-LD: 3 us for 12 triples; JSON-LD with its context inside: 8. RDF/XML: 150, and
///               it is read back.
LRT_API Result<std::string> write(const Graph& graph, Syntax syntax, const Prefixes& prefixes = default_prefixes(), std::string_view context = {});

/// The graphs of one document. A blank node belongs to one graph: equal labels in two graphs are two nodes, also where a
/// document that is read has one node in several graphs.
struct Dataset {
  Graph default_graph;                               ///< the graph without a name
  std::vector<std::pair<std::string, Graph>> named;  ///< IRI and graph of each named graph
};
/// Reads a document with its named graphs, as read() does with one graph. All limits count for all its graphs together.
/// The named graphs come in the order in which they appear, also empty ones (N-Quads has none). Other syntaxes than TriG,
/// N-Quads and JSON-LD have a default graph only.
/// @par Errors   as read(); unsupported_syntax: a graph whose name is a blank node
/// @par Threads  Any.
/// @par Implements  RDF 1.1 TriG, RDF 1.1 N-Quads, JSON-LD 1.1
LRT_API Result<Dataset> read_dataset(std::string_view text, Syntax syntax, const ReadOptions& options);
/// Whether lrt writes named graphs in this syntax: TriG and N-Quads.
constexpr bool has_named_graphs(Syntax syntax) noexcept { return syntax == Syntax::trig || syntax == Syntax::n_quads; }
/// Writes a dataset in TriG or N-Quads.
/// @par Errors   as write() of a graph; unsupported_syntax: the syntax has no named graphs
/// @par Threads  Any.
LRT_API Result<std::string> write(const Dataset& dataset, Syntax syntax, const Prefixes& prefixes = default_prefixes());

/// The JSON-LD context of lrt, as a document of type application/ld+json. It contains the prefixes, `id` and `type`,
/// and the local names of terms of hybrit, lrt, vom and other vocabularies. Links, times and units are typed, so that
/// their values are strings. A prefix with the name of a term is left out. Empty in a build without JSON-LD.
/// @par Threads  Any.
LRT_API std::string json_ld_context(const Prefixes& prefixes = default_prefixes());

/// Denotes json_ld_context() in documents that are not made for one server. lrt never fetches it.
inline constexpr std::string_view json_ld_context_iri = "https://w3id.org/lrt/context.jsonld";

}  // namespace v0
}  // namespace lrt::rdf
