// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lrt/client.hpp>
#include <lrt/client/schema.hpp>

/// Values whose types are known only at run time: between graphs and the text of the command line.
namespace lrt::tool {

/// A value without RDF.
struct PlainValue {
  std::string json;                ///< printable, without loss
  std::string text;                ///< of a number or a text without quotes, which may have line feeds and tabs; else as `json`. Printable
  std::string unit;                ///< UCUM code, or the last part of its IRI; empty: none
  std::optional<double> number{};  ///< if it is one
  std::string unit_iri{};          ///< printable; empty: none

  bool is_null() const noexcept { return json == "null"; }
  /// The text in one line without tabs: these are shown as \x0a and \x09. For columns.
  std::string line() const;
  /// The same for people: numbers have up to six digits after the point, or six in all if they are less than one. "0.3", not "0.30000000000000004". Records
  /// are as readable() shows them.
  std::string for_people() const;
};

/// JSON as people read it, with the digits of PlainValue::for_people(): "lower: -2.147 rad, upper: 1.047 rad". As it is if it is no JSON.
std::string readable(std::string_view json);
/// The same in lines: a member in each, and what is long below its name.
std::string readable_lines(std::string_view json);

/// The value of a node. Without a schema, or if the value does not fit it, it is read from what the node says: a number by the predicates that numbers have,
/// else a record of its properties by their local names, without those that describe the resource.
PlainValue value_at(const rdf::Graph& graph, rdf::TermId node, const client::Schema* schema);

/// The number in another unit.
/// @par Errors  expected_value: it is no number, or the units are of different kinds
Result<PlainValue> converted(const PlainValue& value, const std::string& unit);

/// The schema of a shape; nullopt: there is none, or it cannot be used.
std::optional<client::Schema> schema_of(const Result<std::optional<client::Shape>>& shape);
/// The schema by which a value of a property is read, if it needs one: a number or text whose type the robot has declared is read without, and no
/// request is sent.
std::optional<client::Schema> schema_for_reading(const client::Property& property);

/// "a number in deg, from 0 to below 360"
std::string description_of(const client::Schema& schema);
/// "from 0 to below 360"; empty: no bounds
std::string bounds_of(const rdf::Type& type, const rdf::Facets& facets);
/// Whether an alternative of a variant has more than its name.
bool has_content(const rdf::Type& type);
/// "number", "text", "list of number", "idle | active", "{x, y}", "moveTo {x, y} | stop"
std::string name_of(const rdf::Type& type);

/// A body from the command line: its bytes and their media type.
struct Body {
  std::string bytes;
  std::string media_type;  ///< empty: a value as text, or JSON
};
/// "@FILE" and "-" are read (at most 64 MiB), and `media_type` is that of the suffix; all else is the body itself. "@@text" is the text "@text".
/// @par Errors  io_error, limit_exceeded
Result<Body> body_of(const std::string& argument, const std::string& media_type);

/// A graph with the node that stands for the value.
struct Input {
  rdf::Graph graph;
  rdf::TermId focus;
};
/// The JSON merge patch (RFC 7396) of words such as "position=30deg" and "limits.upper=2". A number may have a unit, which is
/// converted to that of its field. "null" clears what may be absent and restores a default.
/// @par Errors  expected_value: it is no record, or has no such field, or the value does not fit it
Result<client::Patch> patch_of(const std::vector<std::string>& changes, const std::optional<client::Schema>& schema);
/// Whether a word is the change of a part: "position=0.1".
bool is_change(std::string_view word) noexcept;
/// The required members that a value in JSON does not have, with what to write for a part of it, as a sentence; empty: it lacks none.
std::string lacks_members(const Body& body, const client::Schema& schema, const std::string& name);

/// Reads a body for a resource. A number may have a unit, which is converted to that of the schema. A variant may be JSON, or "TAG=VALUE", or "TAG" if that
/// has no content.
/// @param url  of the resource
/// @par Errors  expected_value and expected_rdf: with what was expected
Result<Input> input_of(const Body& body, const std::string& url, const std::optional<client::Schema>& schema);

}  // namespace lrt::tool
