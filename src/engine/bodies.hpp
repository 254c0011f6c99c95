#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/plain.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

#include "src/engine/context.hpp"
#include "src/engine/description.hpp"
#include "src/engine/responses.hpp"

namespace lrt::engine {

/// Reads request bodies: bytes to a graph, the graph judged by the Blueprint, the graph to a value (SPEC 3.3).
class Bodies {
 public:
  struct Body {
    rdf::Graph graph;
    bool empty = true;
  };
  /// How a body is written, by its header fields.
  struct Format {
    std::optional<rdf::Syntax> syntax;  ///< of RDF
    std::optional<rdf::Plain> plain;    ///< of a value without RDF; neither: there is no body
    std::string charset;                ///< that Content-Type names
  };

  /// @param context_document  path of the JSON-LD context, which bodies may refer to
  Bodies(const EngineOptions& options, const EngineView& view, const Responses& responses, std::string context_document)
      : options_(options), view_(view), responses_(responses), context_document_(std::move(context_document)) {}

  /// Judges the header fields of a body: Content-Encoding, Content-Range and Content-Type. Needs no byte of it.
  /// @param type  of the value that the body may be without RDF; nullptr: none
  std::variant<Format, http::Response> format_of(const Context& context, const rdf::Type* type, bool is_empty) const;
  /// The body as a graph; the response if it is none.
  /// @param type, facets  of the value that a body may be without RDF; nullptr: none
  std::variant<Body, http::Response> read(const Context& context, const rdf::Type* type = nullptr, const rdf::Facets& facets = {}) const;
  /// The value in a body; the response if there is none.
  std::variant<rdf::Value, http::Response> read_value(const Context& context, const rdf::Type& type, const rdf::Facets& facets) const;
  /// The response if a node does not conform to the input shape of the requested resource.
  /// @param node  nullopt: the body has no such node, and <> without triples is judged
  /// @param type  of the value that the node carries; nullptr: it has no plain form
  std::optional<http::Response> nonconforming(const Context& context, const rdf::Graph& graph, std::optional<rdf::TermId> node,
                                              const rdf::Type* type = nullptr) const;

 private:
  bool takes_octets(const Context& context, const rdf::Type* type) const;
  std::string accepted_types(const Context& context, const rdf::Type* type) const;
  http::Response not_accepted(const Context& context, const rdf::Type* type, const std::string& detail) const;

  const EngineOptions& options_;
  const EngineView& view_;
  const Responses& responses_;
  const std::string context_document_;
};

/// Whether a Link field (RFC 8288 3) requests an LDP interaction model other than ldp:Resource and ldp:RDFSource (LDP 5.2.3.4).
bool requests_other_model(std::string_view field);

}  // namespace lrt::engine
