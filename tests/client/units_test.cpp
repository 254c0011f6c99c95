// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/units.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/catch.hpp"

using lrt::client::convert;
using lrt::client::number_in;
using lrt::client::parse_quantity;
namespace unit = lrt::unit;

namespace {

std::string message_of(const lrt::Result<double>& result) { return result ? "converted" : result.error().message; }
bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a number and its unit are read with and without a space between them", "[client]") {
  struct {
    const char* text;
    double number;
    const char* unit;
  } const table[] = {{"0.5rad", 0.5, "rad"},
                     {"30 deg", 30, "deg"},
                     {"1.5", 1.5, ""},
                     {" -1.5e3 mm ", -1500, "mm"},
                     {"50%", 50, "%"},
                     {".5 m", 0.5, "m"},
                     {"+2turn", 2, "circ"},
                     {"1e3", 1000, ""},
                     {"2 N.m", 2, "N.m"},
                     {"2Nm", 2, "N.m"},
                     {"3 rpm", 3, "circ/min"},
                     {"20\xC2\xB0"
                      "C",
                      20, "Cel"},
                     {"90\xC2\xB0", 90, "deg"},
                     {"7 1", 7, "1"},
                     {"1 in", 1, "[in_i]"},
                     {"30 DEG", 30, "deg"},
                     {"1 unit:RAD-PER-SEC", 1, "rad/s"},
                     {"1 http://qudt.org/vocab/unit/KiloM-PER-HR", 1, "km/h"},
                     {"250 mrad", 250, "mrad"},
                     {"1 RPM", 1, "circ/min"},
                     {"2 degrees", 2, "deg"},
                     {"9.81 m/s^2", 9.81, "m/s2"}};
  for (const auto& row : table) {
    CAPTURE(row.text);
    const auto quantity = parse_quantity(row.text);
    REQUIRE(quantity);
    CHECK(quantity->number == row.number);
    CHECK(quantity->unit == row.unit);
  }
}

TEST_CASE("what is no number with a known unit is an error that says what is expected", "[client]") {
  for (const char* text : {"", "fast", "rad", "e3", ".", "-", "1e400", "NaN", "INF", "--1", "+"}) {
    CAPTURE(text);
    const auto quantity = parse_quantity(text);
    REQUIRE(!quantity);
    CHECK(quantity.error().code == lrt::Errc::expected_value);
    CHECK(contains(quantity.error().message, "expected a"));
  }
  for (const char* text : {"1 parsec", "1 Mm", "1mm m", "1 Rad", "1 M", "0x10", "1,5"}) {
    CAPTURE(text);
    const auto quantity = parse_quantity(text);
    REQUIRE(!quantity);
    CHECK(contains(quantity.error().message, "unknown unit"));
    CHECK(contains(quantity.error().message, "rad, deg, turn"));
  }
  CHECK(parse_quantity("1 " + std::string(100'000, 'x')).error().message.size() < 400);
  CHECK(!contains(parse_quantity("1 a\nb").error().message, "\n"));
}

TEST_CASE("conversions by a rational ratio give the nearest double", "[client]") {
  struct {
    double number;
    const char *from, *to;
    double expected;
  } const table[] = {
      {30, "min", "h", 0.5},      {1, "[in_i]", "mm", 25.4},  {12, "in", "ft", 1},     {1, "ft", "m", 0.3048},  {180, "deg", "turn", 0.5},
      {60, "rpm", "deg/s", 360},  {0.1, "m", "mm", 100},      {0.1, "cm", "mm", 1},    {36, "km/h", "m/s", 10}, {0.3, "s", "ms", 300},
      {1, "kg", "g", 1000},       {0.7, "g", "kg", 0.0007},   {0, "Cel", "K", 273.15}, {20, "Cel", "degF", 68}, {-40, "degF", "Cel", -40},
      {273.15, "K", "Cel", 0},    {32, "degF", "K", 273.15},  {5, "%", "1", 0.05},     {0.29, "1", "%", 29},    {230, "V", "mV", 230'000},
      {3.3, "mA", "A", 0.0033},   {2.5, "kN", "N", 2500},     {1.1, "km", "m", 1100},  {0.07, "kHz", "Hz", 70}, {1, "N.m", "kN.m", 0.001},
      {250, "mrad", "rad", 0.25}, {0.25, "RAD", "mrad", 250}, {1, "W.h", "J", 3600},   {1, "bar", "kPa", 100},  {2, "L", "m3", 0.002}};
  for (const auto& row : table) {
    CAPTURE(row.number, row.from, row.to);
    const auto result = convert(row.number, row.from, row.to);
    REQUIRE(result);
    CHECK(*result == row.expected);
  }

  for (int i = 1; i < 20'000; ++i) {
    const double in_mm = *convert(i, "ft", "mm");
    REQUIRE(in_mm == static_cast<double>(i) * 3048 / 10);  // the product is exact, so is one rounding
    REQUIRE(*convert(in_mm, "mm", "mm") == in_mm);
  }
}

TEST_CASE("radians convert within two units in the last place and back", "[client]") {
  const double pi = std::acos(-1.0), step = std::numeric_limits<double>::epsilon();
  CHECK(std::abs(*convert(180, "deg", "rad") - pi) <= 2 * step * pi);
  CHECK(*convert(pi, "rad", "deg") == 180);
  CHECK(std::abs(*convert(1, "turn", "rad") - 2 * pi) <= 4 * step * pi);
  for (double v = -1000; v < 1000; v += 0.37) {
    const double back = *convert(*convert(v, "deg/s", "rad/s"), "rad/s", "deg/s");
    REQUIRE(std::abs(back - v) <= 2 * step * std::abs(v));
  }
}

TEST_CASE("a unit converts to itself bit-identically, also an unknown one", "[client]") {
  CHECK(*convert(0.1, "deg", "deg") == 0.1);
  CHECK(std::signbit(*convert(-0.0, "K", "K")));
  CHECK(*convert(0.1, "furlong", "furlong") == 0.1);
  const double largest = std::numeric_limits<double>::max();
  CHECK(*convert(largest, "m", "m") == largest);
  CHECK(std::isinf(*convert(largest, "m", "mm")));
}

TEST_CASE("units of different kinds are an error with both and with what would fit", "[client]") {
  const std::string message = message_of(convert(1, "mm", "deg"));
  CHECK(contains(message, "\"mm\""));
  CHECK(contains(message, "\"deg\""));
  CHECK(contains(message, "rad, deg, turn"));
  CHECK(contains(message_of(convert(1, "parsec", "m")), "m, mm, cm, km, um, in, ft"));
  CHECK(contains(message_of(convert(1, "m", "parsec")), "unknown"));
}

TEST_CASE("a number that a person wrote is converted to the declared unit", "[client]") {
  CHECK(*number_in("0.5", unit::degree) == 0.5);
  CHECK(*number_in("180deg", unit::degree) == 180);
  CHECK(*number_in("1.5 km", unit::metre) == 1500);
  CHECK(*number_in("50 %", unit::one) == 0.5);
  CHECK(*number_in("7", unit::none) == 7);
  CHECK(contains(message_of(number_in("7 m", unit::none)), "without a unit"));
  CHECK(contains(message_of(number_in("7 m", unit::second)), "\"m\""));
  // A unit of another vocabulary is known by its QUDT IRI; else only plain numbers are accepted.
  const lrt::Unit inch = lrt::client::find_unit({}, "http://qudt.org/vocab/unit/IN");
  CHECK(*number_in("25.4 mm", inch) == 1);
  const lrt::Unit smoot = lrt::client::find_unit({}, "http://example.org/units#Smoot");
  CHECK(*number_in("2", smoot) == 2);
  CHECK(contains(message_of(number_in("2 m", smoot)), "\"Smoot\""));
}

TEST_CASE("units are found by the IRIs of both vocabularies", "[client]") {
  CHECK(lrt::client::find_unit(lrt::vocab::maths::Degree.text, {}) == unit::degree);
  CHECK(lrt::client::find_unit({}, lrt::vocab::unit_::DEG.text) == unit::degree);
  CHECK(lrt::client::find_unit(lrt::vocab::maths::Degree.text, lrt::vocab::unit_::DEG.text).ucum == "deg");
  const lrt::Unit contradiction = lrt::client::find_unit(lrt::vocab::maths::Degree.text, lrt::vocab::unit_::RAD.text);
  CHECK(contradiction.ucum.empty());
  CHECK(lrt::client::find_unit({}, {}).empty());
  CHECK(lrt::client::unit_label(unit::newton_metre) == "N.m");
  CHECK(lrt::client::unit_label(unit::none).empty());
  // A unit that lrt has no constant for: the code that a server of lrt states, too.
  const lrt::Unit damping = lrt::client::find_unit({}, "http://qudt.org/vocab/unit/N-M-SEC-PER-RAD");
  CHECK(damping.ucum == "N.m.s/rad");
  CHECK(lrt::client::unit_label(damping) == "N.m.s/rad");
  CHECK(*lrt::client::number_in("2 N.m.s/rad", damping) == 2);
  CHECK(lrt::client::units_like("deg").size() == 4);
  CHECK(lrt::client::units_like("smoot").empty());
}

TEST_CASE("each known unit is named once, and is read, converted and found by its code", "[client]") {
  const std::vector<std::string_view>& all = lrt::client::known_units();
  CHECK(std::set<std::string_view>(all.begin(), all.end()).size() == all.size());
  for (const std::string_view wanted : {"rad", "deg", "m", "mm", "s", "N", "N.m", "kg", "Cel", "V", "A", "%", "1", "Hz"}) {
    CAPTURE(wanted);
    CHECK(std::find(all.begin(), all.end(), wanted) != all.end());
  }
  for (const std::string_view name : {"turn", "rpm", "degC", ""}) CHECK(std::find(all.begin(), all.end(), name) == all.end());  // names, not codes
  for (const std::string_view code : all) {
    CAPTURE(code);
    const auto quantity = parse_quantity("2 " + std::string(code));
    REQUIRE(quantity);
    CHECK(quantity->unit == code);
    const std::vector<std::string_view> alike = lrt::client::units_like(code);
    CHECK(std::search(all.begin(), all.end(), alike.begin(), alike.end()) != all.end());  // those of a kind are beside each other
    for (const std::string_view other : alike) CHECK(convert(2, code, other));
    CHECK(std::count(alike.begin(), alike.end(), code) == 1);
  }
  CHECK(&lrt::client::known_units() == &all);
}
