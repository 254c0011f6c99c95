// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/plain_schema.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lrt/rdf/traits.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

enum class Gear { forward, reverse };

struct Motion {
  double speed = 0;
  std::optional<Gear> gear;
  std::array<float, 3> axis{};
};

template <class T>
std::string schema(const Facets& facets = {}) {
  return rdf::write_schema(rdf::traits<T>::type(), facets);
}

}  // namespace

template <>
struct lrt::rdf::traits<Gear> : lrt::rdf::Enumeration<Gear> {
  static void describe(Enumeration<Gear>& e) { e.name(Gear::forward, "forward").name(Gear::reverse, "reverse"); }
};

template <>
struct lrt::rdf::traits<Motion> : lrt::rdf::Record<Motion> {
  static void describe(Record<Motion>& r) {
    r.field("speed", &Motion::speed).unit(unit::metre).between(0, 1.5);
    r.field("gear", &Motion::gear);
    r.field("axis", &Motion::axis);
  }
};

TEST_CASE("a type is described as a JSON Schema", "[rdf]") {
  CHECK(schema<bool>() == R"({"type":"boolean"})");
  CHECK(schema<std::string>() == R"({"type":"string"})");
  CHECK(schema<std::string>(Facets{}.length(1, 8)) == R"({"type":"string","minLength":1,"maxLength":8})");
  CHECK(schema<double>() == R"({"type":"number"})");
  CHECK(schema<float>(Facets{unit::degree}.at_least(0).below(360)) == R"({"type":"number","minimum":0,"exclusiveMaximum":360,"unit":"deg"})");
  CHECK(schema<double>(Facets{}.above(-0.5)) == R"({"type":"number","exclusiveMinimum":-0.5})");
  CHECK(schema<double>(Facets{}.at_most(std::numeric_limits<double>::infinity())) == R"({"type":"number"})");
  CHECK(schema<std::uint8_t>() == R"({"type":"integer","minimum":0,"maximum":255})");
  CHECK(schema<std::uint8_t>(Facets{}.between(-5, 1e6)) == R"({"type":"integer","minimum":0,"maximum":255})");
  CHECK(schema<std::int64_t>() == R"({"type":"integer"})");
  CHECK(schema<std::uint64_t>(Facets{}.at_most(9)) == R"({"type":"integer","minimum":0,"maximum":9})");
  CHECK(schema<std::chrono::milliseconds>() == R"({"type":"string","format":"duration"})");
  CHECK(schema<std::chrono::system_clock::time_point>() == R"({"type":"string","format":"date-time"})");
  CHECK(schema<Gear>() == R"({"type":"string","enum":["forward","reverse"]})");
}

TEST_CASE("lists, records and optional values are described with their parts", "[rdf]") {
  CHECK(schema<std::array<double, 3>>(Facets{unit::radian}) ==
        R"({"type":"array","items":{"type":"number"},"minItems":3,"maxItems":3,"unit":"rad"})");
  CHECK(schema<std::vector<std::int64_t>>(Facets{}.at_least(1)) == R"({"type":"array","items":{"type":"integer","minimum":1}})");
  CHECK(schema<std::map<std::string, double>>(Facets{unit::metre}) == R"({"type":"object","additionalProperties":{"type":"number","unit":"m"}})");
  CHECK(schema<std::optional<double>>(Facets{unit::metre}) == R"({"type":["number","null"],"unit":"m"})");
  CHECK(schema<Motion>() == R"({"type":"object","properties":{"speed":{"type":"number","minimum":0,"maximum":1.5,"unit":"m"},)"
                            R"("gear":{"type":["string","null"],"enum":["forward","reverse",null]},)"
                            R"("axis":{"type":"array","items":{"type":"number"},"minItems":3,"maxItems":3}},)"
                            R"("required":["speed","axis"],"additionalProperties":false})");
}
