// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/bridge/units.hpp"

#include <algorithm>
#include <string>

#include <lrt/base/iri.hpp>

namespace lrt::ros2 {
namespace {

#define LRT_QUDT(name) \
  Iri { "http://qudt.org/vocab/unit/" name }
#define LRT_KIND(name) \
  Iri { "http://qudt.org/vocab/quantitykind/" name }

constexpr Unit units[] = {
    unit::radian,
    unit::degree,
    unit::radian_per_second,
    unit::degree_per_second,
    unit::metre,
    unit::millimetre,
    unit::metre_per_second,
    unit::second,
    unit::newton,
    unit::newton_metre,
    unit::kilogram,
    unit::degree_celsius,
    unit::volt,
    unit::ampere,
    unit::percent,
    unit::one,
    {LRT_QUDT("CentiM"), {}, "cm", vocab::quantitykind::Length},
    {LRT_QUDT("KiloM"), {}, "km", vocab::quantitykind::Length},
    {LRT_QUDT("M2"), {}, "m2", LRT_KIND("Area")},
    {LRT_QUDT("M3"), {}, "m3", LRT_KIND("Volume")},
    {LRT_QUDT("L"), {}, "L", LRT_KIND("Volume")},
    {LRT_QUDT("PER-M"), {}, "/m"},
    {LRT_QUDT("KiloM-PER-HR"), {}, "km/h", vocab::quantitykind::Velocity},
    {LRT_QUDT("M-PER-SEC2"), {}, "m/s2", LRT_KIND("Acceleration")},
    {LRT_QUDT("M-PER-SEC3"), {}, "m/s3"},
    {LRT_QUDT("RAD-PER-SEC2"), {}, "rad/s2", LRT_KIND("AngularAcceleration")},
    {LRT_QUDT("REV-PER-MIN"), {}, "{rev}/min", vocab::quantitykind::AngularVelocity},
    {LRT_QUDT("MilliSEC"), {}, "ms", vocab::quantitykind::Time},
    {LRT_QUDT("MicroSEC"), {}, "us", vocab::quantitykind::Time},
    {LRT_QUDT("NanoSEC"), {}, "ns", vocab::quantitykind::Time},
    {LRT_QUDT("MIN"), {}, "min", vocab::quantitykind::Time},
    {LRT_QUDT("HR"), {}, "h", vocab::quantitykind::Time},
    {LRT_QUDT("HZ"), {}, "Hz", vocab::quantitykind::Frequency},
    {LRT_QUDT("PER-SEC"), {}, "/s"},
    {LRT_QUDT("GM"), {}, "g", vocab::quantitykind::Mass},
    {LRT_QUDT("KiloGM-M2"), {}, "kg.m2", vocab::quantitykind::MomentOfInertia},
    {LRT_QUDT("K"), {}, "K", vocab::quantitykind::Temperature},
    {LRT_QUDT("MilliV"), {}, "mV", vocab::quantitykind::Voltage},
    {LRT_QUDT("MilliA"), {}, "mA", vocab::quantitykind::ElectricCurrent},
    {LRT_QUDT("A-HR"), {}, "A.h", LRT_KIND("ElectricCharge")},
    {LRT_QUDT("C"), {}, "C", LRT_KIND("ElectricCharge")},
    {LRT_QUDT("OHM"), {}, "Ohm", LRT_KIND("Resistance")},
    {LRT_QUDT("W"), {}, "W", LRT_KIND("Power")},
    {LRT_QUDT("J"), {}, "J", LRT_KIND("Energy")},
    {LRT_QUDT("W-HR"), {}, "W.h", LRT_KIND("Energy")},
    {LRT_QUDT("PA"), {}, "Pa", LRT_KIND("Pressure")},
    {LRT_QUDT("HectoPA"), {}, "hPa", LRT_KIND("Pressure")},
    {LRT_QUDT("BAR"), {}, "bar", LRT_KIND("Pressure")},
    {LRT_QUDT("T"), {}, "T", LRT_KIND("MagneticFluxDensity")},
    {LRT_QUDT("LUX"), {}, "lx", LRT_KIND("Illuminance")},
    {LRT_QUDT("DeciB"), {}, "dB"},
    {LRT_QUDT("BYTE"), {}, "By"},
    {LRT_QUDT("N-PER-M"), {}, "N/m"},
    {LRT_QUDT("N-SEC-PER-M"), {}, "N.s/m"},
    {LRT_QUDT("N-M-SEC-PER-RAD"), {}, "N.m.s/rad"},
    {LRT_QUDT("N-M-PER-RAD"), {}, "N.m/rad"},
};
#undef LRT_QUDT
#undef LRT_KIND

}  // namespace

std::optional<Unit> find_unit(std::string_view name) {
  const auto known =
      std::find_if(std::begin(units), std::end(units), [name](const Unit& u) { return !name.empty() && (u.ucum == name || u.qudt.text == name); });
  if (known != std::end(units)) return *known;
  if (name.find(':') == std::string_view::npos || !iri::is_absolute(name)) return std::nullopt;
  return rdf::detail::kept_unit(Unit{Iri(name), {}, {}});
}

}  // namespace lrt::ros2
