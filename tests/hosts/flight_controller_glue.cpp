// SPDX-License-Identifier: Apache-2.0
#include <lrt/thing.hpp>

#include "tests/hosts/flight_controller.hpp"
#include "tests/hosts/glue.hpp"

namespace {

constexpr lrt::Unit microsecond{lrt::Iri{"http://qudt.org/vocab/unit/MicroSEC"}, {}, "us"};

lrt::Unit unit_of(const std::string& text) {
  if (text == "deg/s") return lrt::unit::degree_per_second;
  if (text == "V") return lrt::unit::volt;
  if (text == "s") return lrt::unit::second;
  if (text == "us") return microsecond;
  if (text == "norm") return lrt::unit::one;
  return lrt::unit::none;
}

template <class T>
auto expose(lrt::Thing& thing, flight::Parameters& values, const flight::Parameter& p) {
  return thing
      .property(
          p.name, [&values, name = p.name] { return static_cast<T>(values.get(name)); }, unit_of(p.unit))
      .description(p.text, "en")
      .on_write([&values, name = p.name](T value) -> lrt::Result<void> {
        if (const std::string why = values.set(name, double(value)); !why.empty()) return lrt::refused(why);
        return {};
      });
}

}  // namespace

lrt::Thing parameters_thing(flight::Parameters& values) {
  lrt::Thing thing{"parameters"};
  for (const flight::Parameter& p : flight::table()) switch (p.kind) {
      case flight::Kind::flag: expose<bool>(thing, values, p); break;
      case flight::Kind::integer: expose<std::int32_t>(thing, values, p).between(p.min, p.max); break;
      case flight::Kind::real: expose<double>(thing, values, p).between(p.min, p.max); break;
    }
  return thing;
}
