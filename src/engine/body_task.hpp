// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <lrt/http/message.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/shacl/report.hpp>
#include <lrt/shacl/shapes.hpp>

#include "src/engine/body_errors.hpp"
#include "src/rdf/plain.hpp"

namespace lrt::model {
inline namespace v0 {
class GraphState;
class Saving;
}  // namespace v0
}  // namespace lrt::model

namespace lrt::engine {

struct DatasetChange;

inline namespace v0 {

class ValuePatch;

/// A body that was accepted.
struct Body {
  rdf::Graph graph;                                 ///< empty for a value without RDF that is not validated by a shape
  std::optional<rdf::TermId> node{};                ///< that was judged
  rdf::Value value{};                               ///< null: the resource takes a graph, or the value is optional and missing
  std::shared_ptr<model::GraphState> made_graph{};  ///< of a World, that the request has made
  std::shared_ptr<DatasetChange> dataset{};         ///< of several graphs of a World; nullptr: the body has none
  std::shared_ptr<const ValuePatch> patch{};        ///< of a value; nullptr: the body has none
  std::shared_ptr<model::Saving> saving{};          ///< of the graph that was changed; nullptr: nothing to wait for
};

/// Why a body is refused.
struct BodyFault {
  int status;  ///< of the response
  std::string detail{};
  std::vector<BodyError> errors{};        ///< its parts; empty: there are none
  std::optional<shacl::Report> report{};  ///< the shape refused it
  std::string_view type{};                ///< problem type, a constant; empty: none of its own
  http::Denial denial = http::Denial::none;
};

using JudgedBody = std::variant<Body, BodyFault>;

/// The limits that all validations of bodies share.
struct BodyLimits {
  std::size_t max_triples;
  std::size_t max_text_bytes;
  std::size_t max_list_members;
  rdf::Prefixes prefixes;  ///< of the JSON-LD context of the server
  rdf::Contexts contexts;  ///< of others
};

/// How the focus node of a body is found.
struct FocusRule {
  /// @return the candidate nodes; more than two need not be returned
  std::vector<rdf::TermId> (*find)(const rdf::Graph& graph, const std::string& here);
  std::string_view what;  ///< "subscription"
  /// An error that is found before validation by the shape; empty: none.
  std::string_view (*refuse)(const rdf::Graph& graph, rdf::TermId node) = nullptr;
};

/// A request body with all that its validation needs: bytes to a graph, validation by the Blueprint, graph to value (SPEC 3.3). It shares
/// no mutable state with the engine, so any thread may validate it.
struct BodyTask {
  std::string_view text;
  std::optional<rdf::Syntax> syntax{};  ///< nullopt: `format`
  std::optional<rdf::Plain> format{};   ///< nullopt with `syntax` nullopt: the body is empty, and has no type
  std::string charset{};                ///< parameter of the media type; empty: UTF-8
  std::string here{};                   ///< IRI of the resource; the base, and <>
  std::string vocabulary{}, context{};  ///< IRIs of the server's terms, and of its JSON-LD context
  std::shared_ptr<const BodyLimits> limits{};
  const rdf::Type* type = nullptr;  ///< of the value; nullptr: a graph is requested
  rdf::Facets facets{};
  std::shared_ptr<const void> owner{};    ///< of the type
  std::optional<shacl::Shapes> shapes{};  ///< nullopt: the graph is neither validated nor read
  std::string shape{};                    ///< IRI of the input shape
  bool completes = false;                 ///< the rules of completion hold; a shape of the user is taken literally
  const FocusRule* focus = nullptr;       ///< nullptr: the node that carries the value
  bool is_verbatim = false;               ///< the triples are kept: none is added for older vocabularies

  JudgedBody judge() const;
  /// The same of a graph, as if it was read from a body in RDF.
  /// @pre no text, format or syntax
  JudgedBody judge(rdf::Graph graph) const;
  /// Reads all graphs of a body in RDF: only Body::dataset is set.
  JudgedBody read_dataset() const;
};

}  // namespace v0
}  // namespace lrt::engine
