// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/units.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <system_error>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/rdf/representable.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

enum class Of : std::uint8_t {
  angle,
  angular_velocity,
  length,
  velocity,
  time,
  force,
  torque,
  mass,
  temperature,
  voltage,
  current,
  frequency,
  ratio,
  acceleration,
  angular_acceleration,
  rotational_damping,
  rotational_stiffness,
  damping,
  stiffness,
  inertia,
  area,
  volume,
  density,
  flow,
  pressure,
  power,
  energy,
  charge,
  resistance
};

/// A unit as (a x + b) / c of the base unit of its kind, for those with `per_two_pi` divided by 2 pi.
struct Scale {
  std::string_view code;                 ///< UCUM
  std::array<std::string_view, 5> also;  ///< further names; the first is shown to people instead of the code
  std::string_view qudt;                 ///< local name in QUDT
  Of of;
  std::int64_t a, b, c;
  bool per_two_pi = false;
};

constexpr Scale scales[] = {
    {"rad", {"rad", "radian", "radians"}, "RAD", Of::angle, 1, 0, 1, true},
    {"deg", {"deg", "\xC2\xB0", "degree", "degrees"}, "DEG", Of::angle, 1, 0, 360},
    {"circ", {"turn", "rev"}, "REV", Of::angle, 1, 0, 1},
    {"mrad", {}, "MilliRAD", Of::angle, 1, 0, 1000, true},
    {"rad/s", {}, "RAD-PER-SEC", Of::angular_velocity, 1, 0, 1, true},
    {"deg/s", {"deg/s", "\xC2\xB0/s"}, "DEG-PER-SEC", Of::angular_velocity, 1, 0, 360},
    {"mrad/s", {}, "MilliRAD-PER-SEC", Of::angular_velocity, 1, 0, 1000, true},
    {"circ/min", {"rpm", "rev/min", "{rev}/min", "RPM"}, "REV-PER-MIN", Of::angular_velocity, 1, 0, 60},
    {"m", {}, "M", Of::length, 1, 0, 1},
    {"mm", {}, "MilliM", Of::length, 1, 0, 1000},
    {"cm", {}, "CentiM", Of::length, 1, 0, 100},
    {"km", {}, "KiloM", Of::length, 1000, 0, 1},
    {"um", {"um", "\xC2\xB5m"}, "MicroM", Of::length, 1, 0, 1'000'000},
    {"[in_i]", {"in"}, "IN", Of::length, 254, 0, 10'000},
    {"[ft_i]", {"ft"}, "FT", Of::length, 3048, 0, 10'000},
    {"m/s", {}, "M-PER-SEC", Of::velocity, 1, 0, 1},
    {"mm/s", {}, "MilliM-PER-SEC", Of::velocity, 1, 0, 1000},
    {"km/h", {"km/h", "kph", "kmh"}, "KiloM-PER-HR", Of::velocity, 10, 0, 36},
    {"s", {}, "SEC", Of::time, 1, 0, 1},
    {"ms", {}, "MilliSEC", Of::time, 1, 0, 1000},
    {"us", {"us", "\xC2\xB5s"}, "MicroSEC", Of::time, 1, 0, 1'000'000},
    {"min", {}, "MIN", Of::time, 60, 0, 1},
    {"h", {}, "HR", Of::time, 3600, 0, 1},
    {"N", {}, "N", Of::force, 1, 0, 1},
    {"kN", {}, "KiloN", Of::force, 1000, 0, 1},
    {"N.m", {"N.m", "Nm", "N*m"}, "N-M", Of::torque, 1, 0, 1},
    {"kN.m", {"kN.m", "kNm"}, "KiloN-M", Of::torque, 1000, 0, 1},
    {"kg", {}, "KiloGM", Of::mass, 1, 0, 1},
    {"g", {}, "GM", Of::mass, 1, 0, 1000},
    {"Cel",
     {"Cel",
      "\xC2\xB0"
      "C",
      "degC", "C"},
     "DEG_C",
     Of::temperature,
     1,
     0,
     1},
    {"K", {}, "K", Of::temperature, 100, -27'315, 100},
    {"[degF]",
     {"degF",
      "\xC2\xB0"
      "F"},
     "DEG_F",
     Of::temperature,
     5,
     -160,
     9},
    {"V", {}, "V", Of::voltage, 1, 0, 1},
    {"mV", {}, "MilliV", Of::voltage, 1, 0, 1000},
    {"A", {}, "A", Of::current, 1, 0, 1},
    {"mA", {}, "MilliA", Of::current, 1, 0, 1000},
    {"Hz", {}, "HZ", Of::frequency, 1, 0, 1},
    {"kHz", {}, "KiloHZ", Of::frequency, 1000, 0, 1},
    {"1", {}, "UNITLESS", Of::ratio, 1, 0, 1},
    {"%", {}, "PERCENT", Of::ratio, 1, 0, 100},
    {"m/s2", {"m/s2", "m/s^2", "m/s\xC2\xB2"}, "M-PER-SEC2", Of::acceleration, 1, 0, 1},
    {"mm/s2", {"mm/s2", "mm/s^2"}, "MilliM-PER-SEC2", Of::acceleration, 1, 0, 1000},
    {"rad/s2", {"rad/s2", "rad/s^2", "rad/s\xC2\xB2"}, "RAD-PER-SEC2", Of::angular_acceleration, 1, 0, 1, true},
    {"deg/s2", {"deg/s2", "deg/s^2", "\xC2\xB0/s\xC2\xB2"}, "DEG-PER-SEC2", Of::angular_acceleration, 1, 0, 360},
    {"N.m.s/rad", {"N.m.s/rad", "Nms/rad"}, "N-M-SEC-PER-RAD", Of::rotational_damping, 1, 0, 1},
    {"N.m/rad", {"N.m/rad", "Nm/rad"}, "N-M-PER-RAD", Of::rotational_stiffness, 1, 0, 1},
    {"N.s/m", {"N.s/m", "Ns/m"}, "N-SEC-PER-M", Of::damping, 1, 0, 1},
    {"N/m", {}, "N-PER-M", Of::stiffness, 1, 0, 1},
    {"N/mm", {}, "N-PER-MilliM", Of::stiffness, 1000, 0, 1},
    {"kg.m2", {"kg.m2", "kg m2", "kgm2"}, "KiloGM-M2", Of::inertia, 1, 0, 1},
    {"m2", {"m2", "m^2", "m\xC2\xB2"}, "M2", Of::area, 1, 0, 1},
    {"m3", {"m3", "m^3", "m\xC2\xB3"}, "M3", Of::volume, 1, 0, 1},
    {"L", {"L", "l"}, "L", Of::volume, 1, 0, 1000},
    {"mL", {"mL", "ml"}, "MilliL", Of::volume, 1, 0, 1'000'000},
    {"kg/m3", {}, "KiloGM-PER-M3", Of::density, 1, 0, 1},
    {"L/min", {"L/min", "l/min"}, "L-PER-MIN", Of::flow, 1, 0, 1},
    {"Pa", {}, "PA", Of::pressure, 1, 0, 1},
    {"kPa", {}, "KiloPA", Of::pressure, 1000, 0, 1},
    {"bar", {}, "BAR", Of::pressure, 100'000, 0, 1},
    {"W", {}, "W", Of::power, 1, 0, 1},
    {"kW", {}, "KiloW", Of::power, 1000, 0, 1},
    {"J", {}, "J", Of::energy, 1, 0, 1},
    {"W.h", {"W.h", "Wh"}, "W-HR", Of::energy, 3600, 0, 1},
    {"A.h", {"A.h", "Ah"}, "A-HR", Of::charge, 3600, 0, 1},
    {"Ohm", {"Ohm", "\xCE\xA9"}, "OHM", Of::resistance, 1, 0, 1},
};

constexpr long double two_pi = 6.283185307179586476925286766559005768L;

std::string_view symbol_of(const Scale& s) noexcept { return s.also[0].empty() ? s.code : s.also[0]; }

constexpr std::string_view qudt_space = "http://qudt.org/vocab/unit/";

const Scale* find_qudt(std::string_view local_name) noexcept {
  for (const Scale& s : scales)
    if (s.qudt == local_name) return &s;
  return nullptr;
}

/// By its code, or another name, or as QUDT names it: "DEG", "unit:DEG", "http://qudt.org/vocab/unit/DEG".
const Scale* find_scale(std::string_view name) noexcept {
  if (name.empty()) return nullptr;
  for (const Scale& s : scales)
    if (s.code == name || std::find(s.also.begin(), s.also.end(), name) != s.also.end()) return &s;
  for (const std::string_view space : {qudt_space, std::string_view("unit:")})
    if (name.substr(0, space.size()) == space) return find_qudt(name.substr(space.size()));
  return name.size() > 1 ? find_qudt(name) : nullptr;  // a single letter of QUDT may be the prefix of another unit
}

const Scale* scale_of(const Unit& unit) noexcept {
  if (const Scale* s = find_scale(unit.ucum)) return s;
  return unit.qudt.text.substr(0, qudt_space.size()) == qudt_space ? find_qudt(unit.qudt.text.substr(qudt_space.size())) : nullptr;
}

/// The names of the units of a kind, or the first of all: "rad, deg, turn".
std::string names_of(std::optional<Of> kind) {
  constexpr std::size_t longest = 200;
  std::string text;
  for (const Scale& s : scales) {
    if (kind && s.of != *kind) continue;
    if (text.size() > longest) return text + ", ...";
    text.append(text.empty() ? "" : ", ").append(symbol_of(s));
  }
  return text;
}

Unexpected unknown(std::string_view unit, std::optional<Of> fitting = {}) {
  return unexpected(Errc::expected_value,
                    "unknown unit " + quoted(unit) + ", expected " + (fitting ? "one of " : "none or one of ") + names_of(fitting));
}

/// The difference between (a x + b) / c and y, times c.
double residual(double x, double a, double b, double c, double y) noexcept {
  const double p = x * a, p_rest = std::fma(x, a, -p);
  const double s = p + b, s_b = s - p, s_rest = (p - (s - s_b)) + (b - s_b);
  const double h = y * c, h_rest = std::fma(y, c, -h);
  return std::abs((s - h) + (s_rest + p_rest - h_rest));
}

/// The double nearest to (a x + b) / c.
double affine(double x, std::int64_t a, std::int64_t b, std::int64_t c) noexcept {
  const auto fa = static_cast<double>(a), fb = static_cast<double>(b), fc = static_cast<double>(c);
  const double first = static_cast<double>((static_cast<long double>(x) * fa + fb) / fc);
  double best = first, best_residual = residual(x, fa, fb, fc, first);
  if (!std::isfinite(best_residual)) return first;
  for (const double other : {std::nextafter(first, -HUGE_VAL), std::nextafter(first, HUGE_VAL)}) {
    const double r = residual(x, fa, fb, fc, other);
    if (r < best_residual) best = other, best_residual = r;
  }
  return best;
}

/// The decimal of at most 15 digits that is meant, if it converts back to x: 0.29 is 29 %, although the double 0.29 is a little less.
double as_meant(double x, std::int64_t a, std::int64_t b, std::int64_t c) noexcept {
  const double result = affine(x, a, b, c);
  const double size = std::max(std::abs(result), std::abs(static_cast<double>(b) / static_cast<double>(c)));
  if (!std::isfinite(result) || size == 0) return result;
  const int digits = 14 - static_cast<int>(std::floor(std::log10(size)));
  if (digits < 0 || digits > 300) return result;
  char text[700];
  const auto [end, error] = std::to_chars(text, text + sizeof text, result, std::chars_format::fixed, digits);
  if (error != std::errc()) return result;
  const auto decimal = rdf::lexical::parse_double(std::string_view(text, static_cast<std::size_t>(end - text)));
  // y = (a x + b) / c is x = (c y - b) / a.
  return decimal && affine(*decimal, c, -b, a) == x ? *decimal + 0.0 : result;
}

std::int64_t divisor(std::int64_t a, std::int64_t b) noexcept {
  while (b != 0) a = std::exchange(b, a % b);
  return a < 0 ? -a : a;
}

double convert(double number, const Scale& from, const Scale& to) noexcept {
  if (&from == &to) return number;
  if (from.per_two_pi != to.per_two_pi) {
    const long double ratio = static_cast<long double>(from.a * to.c) / static_cast<long double>(from.c * to.a);
    return static_cast<double>(from.per_two_pi ? number * ratio / two_pi : number * ratio * two_pi);
  }
  const std::int64_t a = to.c * from.a, b = to.c * from.b - to.b * from.c, c = to.a * from.c;
  const std::int64_t common = divisor(divisor(a, b), c);
  return as_meant(number, a / common, b / common, c / common);
}

/// The length of the number at the beginning of a text.
std::size_t number_length(std::string_view text) noexcept {
  std::size_t i = 0;
  const auto digits = [&] {
    const std::size_t first = i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    return i - first;
  };
  if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
  std::size_t count = digits();
  if (i < text.size() && text[i] == '.') ++i, count += digits();
  if (count == 0) return 0;
  const std::size_t mantissa = i;
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    ++i;
    if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
    if (digits() == 0) i = mantissa;
  }
  return i;
}

struct Split {
  double number;
  std::string_view unit;
};

Result<Split> split(std::string_view text) {
  const std::string_view body = lrt::detail::trim_space(text);
  const std::size_t length = number_length(body);
  const std::optional<double> number = length > 0 ? rdf::lexical::parse_double(body.substr(0, length)) : std::nullopt;
  if (!number) return unexpected(Error{Errc::expected_value, "expected a number, with or without a unit, found " + quoted(body), 0});
  if (!std::isfinite(*number)) return unexpected(Error{Errc::expected_value, "expected a finite number, found " + quoted(body), 0});
  if (rdf::lexical::is_rounded_away(body.substr(0, length), *number))
    return unexpected(Error{Errc::expected_value, "expected 0 or a number that a double can hold, found " + quoted(body), 0});
  return Split{*number, lrt::detail::trim_space(body.substr(length))};
}

}  // namespace

Result<Quantity> parse_quantity(std::string_view text) {
  const Result<Split> parts = split(text);
  if (!parts) return Unexpected{parts.error()};
  if (parts->unit.empty()) return Quantity{parts->number, {}};
  const Scale* scale = find_scale(parts->unit);
  if (!scale) return unknown(parts->unit);
  return Quantity{parts->number, std::string(scale->code)};
}

Result<double> convert(double number, std::string_view from, std::string_view to) {
  if (from == to) return number;
  const Scale *source = find_scale(from), *target = find_scale(to);
  if (!target) {
    if (source) return unknown(to, source->of);
    return unexpected(Errc::expected_value, "cannot convert " + quoted(from) + " to " + quoted(to) + ": both units are unknown");
  }
  if (!source) return unknown(from, target->of);
  if (source->of != target->of)
    return unexpected(Errc::expected_value, "cannot convert " + quoted(from) + " to " + quoted(to) + ", expected one of " + names_of(target->of));
  return convert(number, *source, *target);
}

Result<double> number_in(std::string_view text, const Unit& unit) {
  const Result<Split> parts = split(text);
  if (!parts) return Unexpected{parts.error()};
  if (parts->unit.empty() || (!unit.ucum.empty() && parts->unit == unit.ucum)) return parts->number;
  if (unit.empty()) return unexpected(Errc::expected_value, "expected a number without a unit, found the unit " + quoted(parts->unit));
  const Scale* target = scale_of(unit);
  if (!target)
    return unexpected(Errc::expected_value,
                      "cannot convert " + quoted(parts->unit) + " to " + quoted(unit_label(unit)) + ": write the number without a unit");
  return convert(parts->number, parts->unit, target->code);
}

const std::vector<std::string_view>& known_units() {
  static const Immortal<std::vector<std::string_view>> all([] {
    std::vector<std::string_view> codes;
    for (const Scale& s : scales) codes.push_back(s.code);
    return codes;
  }());
  return *all;
}

std::vector<std::string_view> units_like(std::string_view unit) {
  std::vector<std::string_view> codes;
  if (const Scale* scale = find_scale(unit))
    for (const Scale& s : scales)
      if (s.of == scale->of) codes.push_back(s.code);
  return codes;
}

Unit find_unit(std::string_view vom, std::string_view qudt) {
  constexpr Unit known[] = {unit::radian, unit::degree,       unit::radian_per_second, unit::degree_per_second,
                            unit::metre,  unit::millimetre,   unit::metre_per_second,  unit::second,
                            unit::newton, unit::newton_metre, unit::kilogram,          unit::degree_celsius,
                            unit::volt,   unit::ampere,       unit::percent,           unit::one};
  if (!vom.empty() || !qudt.empty())
    for (const Unit& u : known)
      if ((vom.empty() || u.vom.text == vom) && (qudt.empty() || u.qudt.text == qudt)) return u;
  Unit other;
  other.vom = Iri(vom);
  other.qudt = Iri(qudt);
  if (vom.empty())
    if (const Scale* scale = scale_of(other)) other.ucum = scale->code;
  return other;
}

std::string unit_label(const Unit& unit) {
  if (!unit.ucum.empty()) return std::string(unit.ucum);
  if (const Scale* scale = scale_of(unit)) return std::string(scale->code);
  const std::string_view iri = unit.qudt.empty() ? unit.vom.text : unit.qudt.text;
  const std::string_view last = iri.substr(iri.find_last_of("#/") + 1);
  return std::string(last.empty() ? iri : last);
}

}  // namespace v0
}  // namespace lrt::client
