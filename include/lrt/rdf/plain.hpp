#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {

/// How a value is written without RDF around it (SPEC 3.9).
///
///   json             43.6   [0.1, 0.2]   {"x": 1, "mode": "fast"}
///   json_with_units  {"value": 43.6, "unit": "deg"} in place of each number, list or record that has a unit; else as json
///   text             43.6   fast   true; lists and records as json
///   cbor             RFC 8949, of the same shape as json
///   octets           the numbers of a number, a list, or a list of lists one after the other (of a matrix row by row), least significant
///                    byte first
///
/// In JSON and CBOR a record is an object of its fields by name, a duration the text of an xsd:dayTimeDuration, an instant that of an
/// xsd:dateTime, what is absent is left out, in a list too, and as the whole null; in text it is the empty one, so that an optional text
/// cannot be empty there. JSON has no NaN and no infinity: they are the texts "NaN", "INF", "-INF", as in XML Schema. Two fields of one
/// name are told apart by prefixes, "maths:x", or by their IRIs. A record with a field called "value" has no place for its own unit.
enum class Plain : unsigned char { json, json_with_units, text, cbor, octets };
inline constexpr std::array<Plain, 4> all_plain = {Plain::json, Plain::json_with_units, Plain::text, Plain::cbor};  ///< without octets

/// "application/json", `application/json;profile="https://w3id.org/lrt/ns#withUnits"`, "text/plain", "application/cbor",
/// "application/octet-stream".
std::string_view media_type(Plain format) noexcept;
/// The format in which a body of that type is read; units may be said in JSON and CBOR always, so parameters do not matter.
std::optional<Plain> plain_of(const MediaType& type) noexcept;

/// The layout of Plain::octets.
struct Octets {
  Iri datatype;                    ///< xsd:double: IEEE 754 binary64; xsd:float: binary32; xsd:long, unsignedByte ...: two's complement
  std::size_t bytes = 0;           ///< of one number: 1, 2, 4 or 8
  std::vector<std::size_t> shape;  ///< lengths of the lists, outermost first; a number has none

  std::size_t size() const noexcept;  ///< of all octets
};
/// Of the values of a type; a length is 0 where it is free. nullopt: they are no numbers.
std::optional<Octets> octets_of(const Type& type);
/// Of this value, with its lengths; below an empty list, where nothing shows them, with those of the type.
/// @pre `value` is of that type, or null
/// @par Errors  unsupported_syntax: they are no numbers, or lists of unlike lengths side by side, or null
Result<Octets> octets_of(const Type& type, const Value& value);
/// Whether octets are read as a value of the type. They do not say their shape, so no more than one length may be free.
bool reads_octets(const Type& type);

/// Writes a value. Deterministic. A text that is no UTF-8 is shown with U+FFFD.
///
/// @pre `value` is of that type, or null
/// @par Errors  unsupported_syntax: octets where octets_of() has none
/// @par Time    A number 0.1 us, an array of 7 in JSON 0.5, as octets 0.1. A million doubles as octets: 8 ms.
Result<std::string> write_plain(const Type& type, const Facets& facets, const Value& value, Plain format);

/// Reads a value and adds to `graph` at `focus` the triples that write_value() would have added, so that the same shape judges it: what
/// does not fit the type is added as what it is (a text where a number is expected), what is missing or null is left out. A number is of
/// the type's datatype, digit by digit; where the type asks for an integer, one with a fraction or an exponent is of xsd:double, one that it cannot hold of xsd:integer.
///
/// A number without a unit is in the declared one. {"value": ..., "unit": "deg"} says it by its UCUM code, or by the IRI where it has no
/// code: in place of any number, of a list or record that has a unit, and of the whole; "unit" may be missing.
///
/// Of a text the body is the value, byte for byte; of other scalars in text white space around it is dropped. Lists and records in text
/// are JSON.
///
/// @par Errors  expected_rdf: no JSON, no CBOR, invalid UTF-8, U+0000, two members of one name, octets of another length: with the place.
///              In CBOR also tags, byte strings, undefined. expected_value: a member that the record does not have, an object or null where
///              none can be, a unit that is not the declared one: with the JSON Pointer, what was found and what is there. limit_exceeded:
///              nested more than 64 deep, or more than `max_values` values. unsupported_syntax: octets, and reads_octets() says no.
///              After an error the graph is to be thrown away.
/// @par Time    Linear in the body. A number with a unit 0.8 us in JSON, 0.5 in text; nearly all of it is the graph.
Result<void> read_plain(std::string_view body, Plain format, const Type& type, const Facets& facets, std::string_view names_base,
                        std::size_t max_values, Graph& graph, TermId focus);

}  // namespace lrt::rdf
