// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/resource.hpp"

namespace lrt::engine {
inline namespace v0 {

struct EngineOptions;
class Bases;

/// The state of the engine that descriptions read, besides the resource.
struct EngineView {
  const EngineOptions& options;
  const Registry& registry;
  const Bases& bases;
  bool makes_callbacks;  ///< some receiver may be called

  /// The namespace of the server's own terms (Options::vocabulary).
  std::string vocabulary(const std::string& base) const;
};

/// Adds triples about one subject, in the order in which they are to be read.
class About {
 public:
  About(rdf::Graph& graph, rdf::TermId subject) : graph_(graph), subject_(subject) {}
  About(rdf::Graph& graph, const std::string& iri) : About(graph, graph.intern(rdf::iri(iri))) {}

  About& a(Iri type) { return add(vocab::rdf_::type, rdf::TermView(type)); }
  About& a(const std::vector<std::string>& types) {
    for (const std::string& type : types) a(Iri(std::string_view(type)));
    return *this;
  }
  About& add(Iri predicate, const rdf::TermView& object) {
    graph_.add(subject_, graph_.intern(predicate), graph_.intern(object));
    return *this;
  }
  About& add(Iri predicate, rdf::TermId object) {
    graph_.add(subject_, graph_.intern(predicate), object);
    return *this;
  }
  About& link(Iri predicate, const std::string& iri) { return add(predicate, rdf::iri(iri)); }
  /// Adds no triple for the clock's epoch.
  About& when(Iri predicate, std::chrono::system_clock::time_point time) {
    return time == decltype(time){} ? *this : add(predicate, rdf::literal(to_xsd_date_time(time), vocab::xsd::dateTime));
  }
  /// A text in each of its languages.
  About& texts(Iri predicate, const rdf::Texts& texts);
  /// The user's own triples (R1.12).
  About& statements(const std::vector<Statement>& statements, const std::string& base);

  rdf::TermId subject() const noexcept { return subject_; }
  rdf::Graph& graph() const noexcept { return graph_; }

 private:
  rdf::Graph& graph_;
  rdf::TermId subject_;
};

rdf::TermId object_term(rdf::Graph& graph, const Object& object, const std::string& base);

/// The types of a linked resource.
void describe_types_of(const Resource& linked, const Description& d);

/// The class of a number, or the classes of a record.
void describe_value_types(About& about, const rdf::Type& type, const std::string& vocabulary);

/// A unit in each vocabulary that has it.
void describe_unit(About& about, const Unit& unit);

/// The predicate of the frame that values refer to: that of ARVIDA for poses, else lrt:frame.
Iri frame_predicate(const rdf::Type& type) noexcept;

/// A time as a number of seconds, for RDF and JSON: "0.2".
std::string seconds(std::chrono::milliseconds time);

/// The request that writes to a resource or adds a member to it, with the shape of its body (HTTP Vocabulary in RDF 1.0; R1.7).
/// @param body_classes  of the focus node of a body; the empty class is none
void describe_binding(About& about, const Description& d, const Resource& resource, Iri method, const std::vector<std::string>& body_classes);

/// Unit and datatype of the values of a type, known without a value. A record has only a unit, because the datatypes of its fields may differ.
struct Quantity {
  Unit unit;               ///< of a list: of its elements
  Iri datatype;            ///< empty for records and maps
  Iri datatype_predicate;  ///< lrt:elementType for lists, else lrt:datatype
};
Quantity quantity_of(const rdf::Type& type, const rdf::Facets& facets);

/// Datatype, unit and kind of quantity.
void describe_quantity(About& about, const rdf::Type& type, const rdf::Facets& facets);

}  // namespace v0
}  // namespace lrt::engine
