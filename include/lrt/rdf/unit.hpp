// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/vocab.hpp>

namespace lrt {
inline namespace v0 {

/// A unit of measurement with its names in three vocabularies. It documents the meaning of a number; lrt never converts
/// numbers.
struct Unit {
  Iri qudt;               ///< object of qudt:hasUnit
  Iri vom;                ///< object of vom:unit; empty: the ARVIDA vocabulary does not have it
  std::string_view ucum;  ///< code for JSON, "deg"
  Iri quantity_kind{};    ///< object of qudt:hasQuantityKind; empty: the unit is used for several kinds of quantity

  /// Whether it has no name: unit::none.
  constexpr bool empty() const noexcept { return qudt.empty() && vom.empty(); }
  friend constexpr bool operator==(const Unit& a, const Unit& b) noexcept { return a.qudt == b.qudt && a.vom == b.vom; }
};

/// Units that robots often use. A program can define others: `constexpr lrt::Unit{iri_of_qudt, iri_of_vom, ucum_code}`.
namespace unit {
/// @{
/// The unit with the terms that are shown.
inline constexpr Unit none{};
inline constexpr Unit radian{vocab::unit_::RAD, vocab::maths::Radian, "rad", vocab::quantitykind::Angle};
inline constexpr Unit degree{vocab::unit_::DEG, vocab::maths::Degree, "deg", vocab::quantitykind::Angle};
inline constexpr Unit radian_per_second{vocab::unit_::RAD_PER_SEC, {}, "rad/s", vocab::quantitykind::AngularVelocity};
inline constexpr Unit degree_per_second{vocab::unit_::DEG_PER_SEC, {}, "deg/s", vocab::quantitykind::AngularVelocity};
inline constexpr Unit metre{vocab::unit_::M, {}, "m", vocab::quantitykind::Length};
inline constexpr Unit millimetre{vocab::unit_::MilliM, {}, "mm", vocab::quantitykind::Length};
inline constexpr Unit metre_per_second{vocab::unit_::M_PER_SEC, {}, "m/s", vocab::quantitykind::Velocity};
inline constexpr Unit second{vocab::unit_::SEC, {}, "s", vocab::quantitykind::Time};
inline constexpr Unit newton{vocab::unit_::N, {}, "N", vocab::quantitykind::Force};
inline constexpr Unit newton_metre{vocab::unit_::N_M, {}, "N.m", vocab::quantitykind::Torque};
inline constexpr Unit kilogram{vocab::unit_::KiloGM, {}, "kg", vocab::quantitykind::Mass};
inline constexpr Unit degree_celsius{vocab::unit_::DEG_C, {}, "Cel", vocab::quantitykind::Temperature};
inline constexpr Unit volt{vocab::unit_::V, {}, "V", vocab::quantitykind::Voltage};
inline constexpr Unit ampere{vocab::unit_::A, {}, "A", vocab::quantitykind::ElectricCurrent};
inline constexpr Unit percent{vocab::unit_::PERCENT, {}, "%"};
inline constexpr Unit one{vocab::unit_::UNITLESS, {}, "1"};
/// @}
}  // namespace unit

}  // namespace v0
}  // namespace lrt

namespace lrt::rdf {
inline namespace v0 {
namespace detail {

/// The one copy of a unit that the process keeps, with its texts. It is never destroyed.
/// @par Threads  Any. Locks and may allocate.
LRT_API const Unit& kept_unit(const Unit& unit);

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
