#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

/// Lexical forms of XML Schema datatypes (XSD 1.1 part 2), as the values they stand for. White space is not collapsed: in RDF a
/// lexical form with a blank around it is ill-typed.
namespace lrt::rdf::lexical {

bool is_integer(std::string_view text) noexcept;  ///< [+-]?[0-9]+
bool is_decimal(std::string_view text) noexcept;  ///< [+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)
bool is_double(std::string_view text) noexcept;   ///< also of xsd:float: decimal, exponent, INF, NaN

/// The nearest double of a decimal, float or double lexical form; overflow gives infinity as XSD says. nullopt: not one.
std::optional<double> parse_double(std::string_view text) noexcept;
/// nullopt: no integer, or not within int64/uint64.
std::optional<std::int64_t> parse_int64(std::string_view text) noexcept;
std::optional<std::uint64_t> parse_uint64(std::string_view text) noexcept;
std::optional<bool> parse_boolean(std::string_view text) noexcept;  ///< true, false, 1, 0

/// xsd:dayTimeDuration, or an xsd:duration without years and months. nullopt: not one, or beyond int64 nanoseconds; digits after the
/// ninth decimal are cut.
std::optional<std::chrono::nanoseconds> parse_duration(std::string_view text) noexcept;
/// xsd:dateTime with a time zone. nullopt: not one, without zone, or beyond int64 nanoseconds from 1970.
std::optional<std::chrono::nanoseconds> parse_instant(std::string_view text) noexcept;

/// Shortest forms that read back to the same bits: "43.6", "1e+06", "NaN", "INF", "-INF".
std::string format(double value);
std::string format(float value);
std::string format(std::chrono::nanoseconds duration);  ///< canonical xsd:dayTimeDuration, "PT1.5S"
/// xsd:dateTime in UTC with as many decimals as needed.
std::string format_instant(std::chrono::nanoseconds since_epoch);

/// The datatypes whose lexical space is known here: those RDF 1.1 Concepts 5.1 names, and rdf:langString, rdf:HTML, rdf:XMLLiteral.
enum class Datatype : std::uint8_t {
  unknown,
  string, boolean, decimal, integer, double_, float_,
  long_, int_, short_, byte_, unsigned_long, unsigned_int, unsigned_short, unsigned_byte,
  non_negative_integer, positive_integer, non_positive_integer, negative_integer,
  date_time, date_time_stamp, date, time, g_year, g_year_month, g_month, g_month_day, g_day,
  duration, day_time_duration, year_month_duration,
  hex_binary, base64_binary, any_uri, language, normalized_string, token, nmtoken, name, ncname,
  lang_string, html, xml_literal,
};

Datatype datatype_of(std::string_view iri) noexcept;
constexpr bool is_integer_type(Datatype d) noexcept {
  return d == Datatype::integer || (d >= Datatype::long_ && d <= Datatype::negative_integer);
}

/// Whether the text is in the lexical space of the datatype, ranges of the integer types and the calendar included. Of an unknown
/// datatype every text is; so is every text of xsd:anyURI, rdf:langString, rdf:HTML and rdf:XMLLiteral, and of
/// xsd:string every text without U+0000.
bool is_well_formed(std::string_view text, Datatype datatype) noexcept;

/// Exact order of two decimals of any length: negative, 0 or positive as a < b, a = b, a > b. @pre is_decimal() of both
int compare_decimal(std::string_view a, std::string_view b) noexcept;

/// The nearest float of a lexical form, in one rounding.
std::optional<float> parse_float(std::string_view text) noexcept;

/// A point on the time line of XSD 1.1: xsd:dateTime, dateTimeStamp, date, time, gYear, gYearMonth.
struct Moment {
  std::int64_t seconds = 0;   ///< from 1970-01-01T00:00:00, in UTC if zoned, else as if it were
  std::string_view fraction;  ///< decimals of the second without trailing zeros; a view into the text
  bool zoned = false;
};
/// nullopt: no such datatype, not well formed, or a year of more than nine digits.
std::optional<Moment> parse_moment(std::string_view text, Datatype datatype) noexcept;

/// An xsd:duration, dayTimeDuration or yearMonthDuration: months and seconds have the same sign.
struct Duration {
  std::int64_t months = 0, seconds = 0;
  std::string_view fraction;  ///< decimals of the second without trailing zeros; a view into the text
  bool negative = false;      ///< also where only the fraction is not 0
};
/// nullopt: not well formed, or beyond int64.
std::optional<Duration> parse_full_duration(std::string_view text, Datatype datatype) noexcept;

}  // namespace lrt::rdf::lexical
