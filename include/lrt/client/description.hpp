// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/schema.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/words.hpp>

namespace lrt {
inline namespace v0 {
class Client;
}  // namespace v0
}  // namespace lrt

namespace lrt::client {
inline namespace v0 {

class Robot;

/// Limits of what describe() reads. Beyond them: Errc::limit_exceeded, with the limit.
struct DescribeOptions {
  SchemaOptions schema;                 ///< of each shape
  std::size_t max_things = 10'000;      ///< of the robot
  std::size_t max_members = 1'000;      ///< properties and actions of one Thing, and predicates of one member
  std::size_t max_schemas = 5'000;      ///< different shapes
  std::size_t max_warnings = 1'000;     ///< further ones are left out
  std::size_t max_documents = 20'000;   ///< read from a robot
  std::size_t max_triples = 2'000'000;  ///< of all these documents together
};

/// A Property of a Thing, as its robot describes it.
struct PropertyDescription {
  std::string iri;                      ///< its IRI
  std::string name;                     ///< the part of its IRI after that of the Thing, "rotation"
  std::string title;                    ///< of words.titles the one without a language, else the English, else the first; or rdfs:label; or empty
  std::vector<std::string> predicates;  ///< predicates by which the Thing links to it, without hybrit:property; sorted
  bool writable = false;                ///< it has a binding with PUT
  std::optional<Schema> schema;         ///< of its value, usable; nullopt: no shape describes it
  rdf::Words words{};                   ///< words_of() it
};

/// An Action of a Thing, as its robot describes it.
struct ActionDescription {
  std::string iri;                      ///< its IRI
  std::string name;                     ///< as that of a Property, without "actions/"
  std::string title;                    ///< as that of a Property
  std::vector<std::string> predicates;  ///< predicates by which the Thing links to it, without hybrit:action; sorted
  bool asynchronous = false;            ///< hybrit:AsynchronousAction
  bool stop = false;                    ///< lrt:StopAction
  bool has_input = false;               ///< it consumes something, or its document is missing
  /// @{
  /// Usable; nullopt: none, or no shape describes it.
  std::optional<Schema> input, output;
  /// @}
  rdf::Words words{};  ///< words_of() it
};

/// A Thing, as its robot describes it.
struct ThingDescription {
  std::string iri;                              ///< its IRI
  std::string title;                            ///< as that of a Property
  std::vector<std::string> classes;             ///< without hybrit:RoboticThing and classes that are Blueprints; sorted
  std::string kind;                             ///< IRI of the Blueprint that it shares with Things of its kind; empty: none
  std::vector<PropertyDescription> properties;  ///< in the order of their IRIs
  std::vector<ActionDescription> actions;       ///< in the order of their IRIs
  /// Name of the kind for people: rdfs:label of its Blueprint, else sh:name, else the last part of its target class; empty:
  /// none.
  std::string kind_name;
  rdf::Words words{};  ///< words_of() it
};

/// A shape of a file that describes no Thing.
struct ShapeDescription {
  std::string iri;   ///< its IRI
  std::string name;  ///< rdfs:label, else sh:name, else the last part of its target class, else of its IRI
  Schema schema;     ///< usable
};

/// A robot, as its documents describe it.
struct Description {
  std::vector<ThingDescription> things;  ///< in the order of their IRIs
  std::vector<ShapeDescription> shapes;  ///< in the order of their IRIs; only if there are no Things
  std::vector<std::string> warnings;     ///< sentences: missing documents, and constraints that no type can express
};

/// Describes the Things of a graph that contains their documents and those of their Properties, Actions and Blueprints.
/// The graph is from one file, or merged by merge_document() from what a client has read. A missing document is a
/// warning.
///
/// The shape of a Property's value is, in this order: one that targets it, the one to which its binding says that its
/// body conforms, and the one that a Blueprint of its Thing has for its predicate. A Blueprint that belongs to one Thing
/// (its IRI is below that of the Thing), then one that refers to another by sh:node, comes before that of the kind. If there is none, the Property's own description is
/// used: lrt:datatype (or qudt:dataType), lrt:elementType and unit, or the datatype of its rdf:value.
///
/// If a Blueprint says that a value may be absent (sh:or), the type is that of the present one.
///
/// In a graph without Things, the node shapes with IRIs are described.
///
/// A shape that is ill-formed or beyond the limits of a Schema is a warning.
///
/// @par Errors   limit_exceeded: DescribeOptions
/// @par Threads  Any.
/// @par Time     Linear in the graph for a robot's own shapes.
LRT_API Result<Description> describe(const rdf::Graph& graph, const DescribeOptions& options = {});

/// Describes a live robot: reads the documents of its Things, Properties, Actions and Blueprints, and of shapes to
/// which these refer. Only documents with the origin of one of its Things are read. A document that cannot be read is a
/// warning.
/// @par Errors   limit_exceeded: DescribeOptions
/// @par Threads  Any.
/// @par Time     Blocks: one exchange after the other for the documents that are not read yet, each within the times of
///               client::Limits.
LRT_API Result<Description> describe(lrt::Client& client, const Robot& robot, const DescribeOptions& options = {});
/// The documents that describe() reads, as one graph. Written to a file, the graph describes the robot without a
/// connection.
/// @param problems  receives a sentence for each document that cannot be read, at most DescribeOptions::max_warnings
/// @par Errors   limit_exceeded: DescribeOptions
/// @par Threads  Any.
/// @par Time     As describe() of a live robot.
LRT_API Result<rdf::Graph> read_documents(lrt::Client& client, const Robot& robot, std::vector<std::string>& problems,
                                          const DescribeOptions& options = {});

/// The words of a resource: dcterms:title and dcterms:description, in all languages. Of several texts in one language the
/// first in byte order is taken; texts of more than `max_text` bytes are left out.
/// @par Threads  Any.
LRT_API rdf::Words words_of(const rdf::Graph& graph, rdf::TermId resource, std::size_t max_text = 10'000);

/// Adds the triples of another document. Its blank nodes get labels that `to` does not have.
/// @par Threads  Any.
/// @par Time     Linear in `document`.
LRT_API void merge_document(rdf::Graph& to, const rdf::Graph& document);

}  // namespace v0
}  // namespace lrt::client
