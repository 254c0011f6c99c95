// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/unit.hpp>

namespace lrt::client {
inline namespace v0 {

/// A number with the unit that was written after it.
struct Quantity {
  double number = 0;  ///< in that unit
  std::string unit;   ///< UCUM code, "rad"; empty: none was written
};

/// Reads "0.5rad", "30 deg", "-1.5e3 mm", "50%", "1.5". Decimals are those of xsd:double, without NaN and infinities.
/// The unit is a code of known_units() or one of the other names of its table: "turn", "rpm", "h", "kph", "C", "degC",
/// "\u00b0", "\u00b0C", "Nm", "N*m" ... or its name in QUDT: "DEG", "unit:DEG", the IRI. Case matters: "mm" is not "Mm".
/// @par Errors   expected_value: not a number, with the offset; or an unknown unit, with the list of units
/// @par Threads  Any.
LRT_API Result<Quantity> parse_quantity(std::string_view text);

/// Converts a number to another unit of the same kind of quantity: turn, rad, mrad and deg; rad/s, mrad/s, deg/s and rpm;
/// m, mm, cm, km, ft and in; m/s, mm/s, km/h; s, ms, us, min and h; N and kN; N.m and kN.m; kg, g; Cel, K and degF; V, mV;
/// A, mA; 1 and %; Hz and kHz; m/s2, mm/s2; rad/s2, deg/s2; N/m, N/mm; m3, L, mL; Pa, kPa, bar; W, kW; J, W.h. Of other kinds
/// it knows one unit: N.m.s/rad, N.m/rad, N.s/m, kg.m2, m2, kg/m3, L/min, A.h, Ohm.
///
/// If the ratio of the units is rational, the result is the decimal of at most 15 digits that converts back to the
/// number (0.29 is 29 %, 20 min are 0.3333333333333333 h), or the double nearest to the exact result. With rad it is
/// within 2 units in the last place. A unit converts to itself bit-identically.
/// @param number    number in the unit `from`
/// @param from, to  UCUM codes; both may also be the same unknown code
/// @par Errors   expected_value: a unit is unknown, or the units are of different kinds. The message names both, and the
///               units that would fit.
/// @par Threads  Any.
LRT_API Result<double> convert(double number, std::string_view from, std::string_view to);

/// Converts a text such as "30 deg" to a number in `unit`. A number without a unit is taken as it is.
/// @param text  number and unit, see parse_quantity()
/// @param unit  of the property or field; none: a written unit is an error
/// @par Errors   expected_value: as parse_quantity() and convert(); a unit that has no UCUM code accepts only numbers
///               without a unit
/// @par Threads  Any.
LRT_API Result<double> number_in(std::string_view text, const Unit& unit);

/// The UCUM codes that convert() knows, in the order of the kinds.
/// @par Threads  Any.
LRT_API const std::vector<std::string_view>& known_units();
/// The UCUM codes to which a unit can be converted; empty: the unit is unknown.
/// @par Threads  Any.
LRT_API std::vector<std::string_view> units_like(std::string_view unit);

/// The unit of lrt with these IRIs, with its code and its other IRI; otherwise a unit with only these IRIs, as views of
/// the arguments, and the code of a QUDT unit that convert() knows. Both may be empty.
/// @par Threads  Any.
LRT_API Unit find_unit(std::string_view vom, std::string_view qudt);
/// The UCUM code of a unit, "deg"; otherwise the last part of its IRI; otherwise empty.
/// @par Threads  Any.
LRT_API std::string unit_label(const Unit& unit);

}  // namespace v0
}  // namespace lrt::client
