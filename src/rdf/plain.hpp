// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/rdf/value_codec.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The formats of a value alone, without RDF (SPEC 3.9).
///
///   json             43.6   [0.1, 0.2]   {"x": 1, "mode": "fast"}
///   json_with_units  as json, with {"value": 43.6, "unit": "deg"} for each number, list or record that has a unit
///   text             43.6   fast   true; lists, records and maps as json
///   cbor             RFC 8949, structured as json
///   octets           the numbers of a number, a list or a list of lists in order (a matrix row by row), least significant byte first
///
/// In JSON and CBOR:
/// - A record is an object with its fields by name. Two fields with the same name get prefixes ("maths:x") or their
///   IRIs as names.
/// - A map is an object with its members by name, in the order of the names. Its values state their units one by one.
/// - Bytes are a text in base64, in CBOR a byte string, which no other type accepts.
/// - A duration is the text of an xsd:dayTimeDuration, an instant the text of an xsd:dateTime.
/// - An absent value is left out of its record or list; as a whole value it is null.
/// - NaN and infinities are the texts "NaN", "INF", "-INF" in JSON, as in XML Schema.
/// - A record with a field "value" cannot have a unit of its own.
///
/// In text an absent value is the empty text, so an optional text cannot be empty.
enum class Plain : unsigned char { json, json_with_units, text, cbor, octets };
inline constexpr std::array<Plain, 4> all_plain = {Plain::json, Plain::json_with_units, Plain::text, Plain::cbor};  ///< without octets

/// "application/json", `application/json;profile="https://w3id.org/lrt/ns#withUnits"`, "text/plain",
/// "application/cbor", "application/octet-stream".
/// @par Threads  Any.
std::string_view media_type(Plain format) noexcept;
/// The format for reading a body of a media type. Parameters are ignored: JSON and CBOR bodies may always contain
/// units.
/// @par Threads  Any.
LRT_INTERNAL_API std::optional<Plain> plain_of(const MediaType& type) noexcept;

/// The layout of Plain::octets.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Octets {
  Iri datatype;                    ///< xsd:double: IEEE 754 binary64; xsd:float: binary32; xsd:long, unsignedByte ...: two's complement
  std::size_t bytes = 0;           ///< of one number: 1, 2, 4 or 8
  std::vector<std::size_t> shape;  ///< lengths of the lists, outermost first; empty: a number

  std::size_t size() const noexcept;  ///< of all octets
};
/// The layout of all values of a type; a free length is 0. nullopt: the type does not consist of numbers.
/// @par Threads  Any.
/// @par Time     Linear in the depth of the type.
std::optional<Octets> octets_of(const Type& type);
/// The layout of a value. The lengths below an empty list are those of the type.
/// @pre `value` is of that type, or null
/// @par Errors   unsupported_syntax: the value does not consist of numbers, has lists of different lengths side by side,
///               or is null
/// @par Threads  Any.
/// @par Time     Linear in the value.
Result<Octets> octets_of(const Type& type, const Value& value);
/// Whether a value of the type can be read from octets: at most one length may be free, because octets do not contain
/// their shape.
/// @par Threads  Any.
/// @par Time     Linear in the depth of the type.
bool reads_octets(const Type& type);

/// Writes a value. Deterministic. Invalid UTF-8 in a text is replaced by U+FFFD.
///
/// @pre `value` is of that type, or null
/// @par Errors   unsupported_syntax: octets, and octets_of() fails
/// @par Threads  Any.
/// @par Time     A number 0.1 us, an array of 7 in JSON 0.5, as octets 0.1. A million doubles as octets: 8 ms.
LRT_INTERNAL_API Result<std::string> write_plain(const Type& type, const Facets& facets, const Value& value, Plain format);

/// Reads a value and adds to `graph` at `focus` the triples that write_value() would add, so the same shape validates
/// it. A value of the wrong type is added unchanged (a text where a number is expected). A missing or null value is
/// left out. A number gets the type's datatype and keeps its digits. If the type is an integer, a number with a
/// fraction or an exponent becomes an xsd:double, and a number out of range an xsd:integer.
///
/// A number without a unit has the declared unit. {"value": ..., "unit": "deg"} states the unit by its UCUM code, or by
/// its IRI if it has no code. This form is accepted for any number, for a list or record with a unit, and for the whole
/// value. "unit" is optional.
///
/// Format text: a text is the body, byte for byte. White space around other scalars is ignored. Lists, records and maps
/// are JSON.
///
/// @param mismatch  receives, with the error expected_value, the JSON Pointer of the refused member and the message
/// @par Errors   After an error the graph must be discarded. expected_rdf, with the position: invalid JSON, CBOR or
///               UTF-8; U+0000; two members with the same name; octets of a wrong length; in CBOR also tags
///               and undefined. expected_value, with the JSON Pointer, what was found and what was expected: an
///               unknown member of a record, an object or null that the type does not allow, a unit other than the
///               declared one. limit_exceeded: nested more than 64 deep, or more than `max_values` values.
///               unsupported_syntax: octets, and reads_octets() is false.
/// @par Threads  Any, one at a time for each graph.
/// @par Time     Linear in the body. A number with a unit: 0.8 us in JSON, 0.5 us in text, mostly for the graph.
LRT_INTERNAL_API Result<void> read_plain(std::string_view body, Plain format, const Type& type, const Facets& facets, std::string_view vocabulary,
                                         std::size_t max_values, Graph& graph, TermId focus, Mismatch* mismatch = nullptr);

}  // namespace v0
}  // namespace lrt::rdf
