// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

/// Lexical forms of XML Schema datatypes (XSD 1.1 part 2) and their values. White space is not collapsed: in RDF a
/// lexical form with surrounding white space is ill-typed.
///
/// @par Threads  Any: all functions.
/// @par Time     Linear in the text. Only functions that return a std::string allocate.
namespace lrt::rdf::lexical {
inline namespace v0 {

LRT_API bool is_integer(std::string_view text) noexcept;  ///< [+-]?[0-9]+
LRT_API bool is_decimal(std::string_view text) noexcept;  ///< [+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)
LRT_API bool is_double(std::string_view text) noexcept;   ///< also of xsd:float: decimal, exponent, INF, NaN

/// The nearest double of a decimal, float or double lexical form. Overflow gives infinity, as in XSD. nullopt: the text
/// is not such a form.
LRT_API std::optional<double> parse_double(std::string_view text) noexcept;
/// @{
/// The value of an integer. nullopt: the text is not an integer, or out of the range of int64 or uint64.
LRT_API std::optional<std::int64_t> parse_int64(std::string_view text) noexcept;
LRT_API std::optional<std::uint64_t> parse_uint64(std::string_view text) noexcept;
/// @}
LRT_API std::optional<bool> parse_boolean(std::string_view text) noexcept;  ///< true, false, 1, 0

/// An xsd:dayTimeDuration, or an xsd:duration without years and months. Decimals after the ninth are ignored. nullopt:
/// the text is not such a form, or out of the range of int64 nanoseconds.
LRT_API std::optional<std::chrono::nanoseconds> parse_duration(std::string_view text) noexcept;
/// An xsd:dateTime with a time zone, since 1970-01-01T00:00:00Z. nullopt: not such a form, no zone, or out of the range
/// of int64 nanoseconds.
LRT_API std::optional<std::chrono::nanoseconds> parse_instant(std::string_view text) noexcept;

/// @{
/// The shortest form that reads back bit-identically: "43.6", "1e+06", "NaN", "INF", "-INF".
LRT_API std::string format(double value);
LRT_API std::string format(float value);
/// @}
LRT_API std::string format(std::chrono::nanoseconds duration);  ///< canonical xsd:dayTimeDuration, "PT1.5S"
/// xsd:dateTime in UTC with as many decimals as needed.
LRT_API std::string format_instant(std::chrono::nanoseconds since_epoch);

/// The datatypes with a known lexical space: those of RDF 1.1 Concepts 5.1, and rdf:langString, rdf:HTML,
/// rdf:XMLLiteral.
enum class Datatype : std::uint8_t {
  unknown,
  string,
  boolean,
  decimal,
  integer,
  double_,
  float_,
  long_,
  int_,
  short_,
  byte_,
  unsigned_long,
  unsigned_int,
  unsigned_short,
  unsigned_byte,
  non_negative_integer,
  positive_integer,
  non_positive_integer,
  negative_integer,
  date_time,
  date_time_stamp,
  date,
  time,
  g_year,
  g_year_month,
  g_month,
  g_month_day,
  g_day,
  duration,
  day_time_duration,
  year_month_duration,
  hex_binary,
  base64_binary,
  any_uri,
  language,
  normalized_string,
  token,
  nmtoken,
  name,
  ncname,
  lang_string,
  html,
  xml_literal,
};

/// The datatype with this IRI; Datatype::unknown: another one.
LRT_API Datatype datatype_of(std::string_view iri) noexcept;
/// Whether the datatype is xsd:integer or derived from it.
constexpr bool is_integer_type(Datatype d) noexcept { return d == Datatype::integer || (d >= Datatype::long_ && d <= Datatype::negative_integer); }

/// Whether the text is in the lexical space of the datatype, including the ranges of integer types and the calendar.
/// True for every text of an unknown datatype and of xsd:anyURI, rdf:langString, rdf:HTML and rdf:XMLLiteral, and for
/// every text of xsd:string without U+0000.
LRT_API bool is_well_formed(std::string_view text, Datatype datatype) noexcept;

/// Compares two decimals of any length exactly: negative for a < b, 0 for a = b, positive for a > b. @pre is_decimal()
/// of both
LRT_API int compare_decimal(std::string_view a, std::string_view b) noexcept;

/// The nearest float of a lexical form, rounded once.
LRT_API std::optional<float> parse_float(std::string_view text) noexcept;

/// A point on the time line of XSD 1.1: xsd:dateTime, dateTimeStamp, date, time, gYear, gYearMonth.
struct Moment {
  std::int64_t seconds = 0;   ///< from 1970-01-01T00:00:00; without a zone it is taken as UTC
  std::string_view fraction;  ///< decimals of the second without trailing zeros; a view into the text
  bool zoned = false;         ///< the text has a time zone
};
/// Parses a moment. nullopt: another datatype, not well-formed, or a year of more than nine digits.
LRT_API std::optional<Moment> parse_moment(std::string_view text, Datatype datatype) noexcept;

/// An xsd:duration, dayTimeDuration or yearMonthDuration. Months and seconds have the same sign.
struct Duration {
  /// @{
  /// Whole months, and whole seconds.
  std::int64_t months = 0, seconds = 0;
  /// @}
  std::string_view fraction;  ///< decimals of the second without trailing zeros; a view into the text
  bool negative = false;      ///< also if only the fraction is not 0
};
/// Parses a duration. nullopt: not well-formed, or out of the range of int64.
LRT_API std::optional<Duration> parse_full_duration(std::string_view text, Datatype datatype) noexcept;

}  // namespace v0
}  // namespace lrt::rdf::lexical
