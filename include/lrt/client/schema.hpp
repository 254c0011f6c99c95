// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/rdf/value_codec.hpp>

namespace lrt::client {
inline namespace v0 {

/// Limits of reading the shapes of a server. Beyond them: Errc::limit_exceeded, with the limit.
///
/// Units that facets name are stored until the process ends: of units that lrt does not know, the first 4,096 are
/// stored, and a further one is a warning.
struct SchemaOptions {
  std::size_t max_shapes = 10'000;  ///< shapes that are visited; a shape counts once for each reference to it
  std::size_t max_fields = 1'000;   ///< of one record
  std::size_t max_names = 1'000;    ///< of one sh:in
  std::size_t max_depth = 24;       ///< nesting of records and lists, of sh:node and of sh:and
  std::size_t max_text = 8'192;     ///< bytes of one IRI or literal that is stored
  std::size_t max_warnings = 100;   ///< further ones are counted in the last warning
  /// A field has its sh:name without a language and without white space as its name, if it has one: a server of lrt has the same name in its JSON.
  bool stated_names = false;
};

/// The description of a value by a published shape, as an rdf::Type and rdf::Facets. With them a program reads, writes
/// and converts values whose type is known only at run time, like values of C++ types. A Schema owns all that type and
/// facets refer to.
///
/// These shapes are supported, whoever made them:
///
/// | shape of a node | type |
/// |---|---|
/// | vom:numericalValue, with or without a unit | number |
/// | rdf:value alone | the scalar or list that it has |
/// | other properties | record; its unit by vom:unit, qudt:hasUnit or qudt:unit with sh:hasValue or sh:in |
/// | vom:quantityValue alone | record whose fields are at that node |
///
/// | constraints of a value | type |
/// |---|---|
/// | sh:datatype | boolean, integer, real, duration (xsd:dayTimeDuration), instant (xsd:dateTime), text of any other datatype |
/// | sh:or of datatypes | the widest number of them, the duration, or the first |
/// | sh:in of texts | enumeration |
/// | the path ([sh:zeroOrMorePath rdf:rest] rdf:first) | list; of nodes with schema:name and schema:value: map |
/// | properties | number with a unit, or record |
/// | sh:xone of shapes that require one predicate each | variant; optional, if one of them is that there is none of these predicates |
/// | sh:minCount 0 or none | optional |
///
/// sh:node and sh:and are followed. Bounds and lengths become facets. A field has the last part of its predicate as its
/// name, or the sh:name that encodes to it. Two fields may have equal names: JSON tells them apart by prefixes. All
/// classes and predicates are absolute IRIs, so the vocabulary that the functions of rdf take does not matter.
///
/// A constraint that a type cannot express is a warning: one sentence with the path and the constraint. The shape may
/// then refuse a value that the type accepts, so validate the value (shacl::validate with shape()).
///
/// @par Threads  Any: immutable. Copies share their data.
class LRT_API Schema {
 public:
  /// Reads a shape.
  /// @param shapes  the shapes graph
  /// @param shape   a node shape of `shapes`; a property shape is read as the description of its values, as focus nodes
  /// @par Errors  expected_value: an ill-formed shape, or no such shape, with the triple. limit_exceeded:
  ///              SchemaOptions.
  /// @par Time    Linear in the shapes that are visited. Allocates.
  static Result<Schema> read(const rdf::Graph& shapes, const rdf::TermView& shape, const SchemaOptions& options = {});

  /// Whether there is a type. False: the shape contains nothing that a type can express, and the last warning says so.
  bool usable() const noexcept;
  /// The structure of the value. @pre usable()
  const rdf::Type& type() const noexcept;
  const rdf::Facets& facets() const noexcept;                 ///< unit and bounds of the value
  const std::vector<std::string>& warnings() const noexcept;  ///< constraints that the type cannot express
  /// The shape. A blank node has its label of the shapes graph.
  rdf::TermView shape() const noexcept;
  /// Its rdfs:label, else its sh:name; empty: it has neither.
  const std::string& name() const noexcept;

  /// Reads the value of a focus node, as rdf::read_value(). qudt:unit is read as qudt:hasUnit.
  /// @pre usable()
  /// @par Errors  those of rdf::read_value()
  Result<rdf::Value> read_value(const rdf::Graph& graph, rdf::TermId focus, std::vector<rdf::Mismatch>* mismatches = nullptr) const;
  /// Adds the triples of a value, as rdf::write_value(), and what else the shape requires: its classes, and qudt:unit.
  /// @pre usable(), `value` is of type()
  void write_value(rdf::Graph& graph, rdf::TermId focus, const rdf::Value& value) const;
  /// Adds the triples of a value without RDF, and what else the shape requires. The body is what a PUT of this media
  /// type may have.
  /// @param media_type  application/json, text/plain, application/cbor or application/octet-stream; parameters are
  ///                    ignored
  /// @pre usable()
  /// @par Errors  After an error the graph must be discarded. unsupported_syntax: another media type, or octets for a
  ///              type that is not made of numbers. expected_rdf, with the position: the body is not of this media
  ///              type. expected_value: the value is not of type(), with its JSON Pointer. limit_exceeded: nested more
  ///              than 64 deep, or more than `max_values` values
  Result<void> write_plain_value(rdf::Graph& graph, rdf::TermId focus, std::string_view body, const MediaType& media_type,
                                 std::size_t max_values = 100'000) const;

 private:
  struct Data;
  explicit Schema(std::shared_ptr<const Data> data) noexcept : data_(std::move(data)) {}
  void complete(rdf::Graph& graph, rdf::TermId focus, std::size_t first_triple) const;
  friend class SchemaReader;
  std::shared_ptr<const Data> data_;
};

}  // namespace v0
}  // namespace lrt::client
