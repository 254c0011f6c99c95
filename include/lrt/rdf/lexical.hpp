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

}  // namespace lrt::rdf::lexical
