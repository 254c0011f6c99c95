// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/type.hpp>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lrt/rdf/traits.hpp>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace unit = lrt::unit;

namespace {

/// A record of two numbers: only `value` has a unit of its own.
struct TwoNumbers {
  explicit TwoNumbers(bool takes_unit) {
    record.kind = Type::Kind::record;
    record.fields.push_back({"value", "#Reading/value", &number, Facets(unit::volt).above(0).below(5), false, takes_unit});
    record.fields.push_back({"count", "#Reading/count", &number, Facets().at_most(9), false, false});
  }
  TwoNumbers(const TwoNumbers&) = delete;
  TwoNumbers& operator=(const TwoNumbers&) = delete;

  Type number = traits<double>::type();
  Type record;
};

}  // namespace

TEST_CASE("numbers are integers and reals, and nothing that contains them", "[rdf]") {
  CHECK(traits<std::int8_t>::type().is_number());
  CHECK(traits<std::uint64_t>::type().is_number());
  CHECK(traits<float>::type().is_number());
  CHECK(traits<double>::type().is_number());
  CHECK_FALSE(traits<bool>::type().is_number());
  CHECK_FALSE(traits<std::string>::type().is_number());
  CHECK_FALSE(traits<std::chrono::milliseconds>::type().is_number());
  CHECK_FALSE(traits<std::optional<double>>::type().is_number());
  CHECK_FALSE(traits<std::vector<double>>::type().is_number());
  CHECK_FALSE(traits<std::map<std::string, double>>::type().is_number());
}

TEST_CASE("facets take the unit of others and nothing else", "[rdf]") {
  Facets facets = Facets(unit::metre).at_least(1);
  CHECK(facets.unit_of(Facets(unit::volt).below(2).length(3, 4).allow_non_finite()).unit() == unit::volt);
  CHECK(facets.min() == 1.0);
  CHECK_FALSE(facets.max());
  CHECK(facets.min_length() == 0);
  CHECK_FALSE(facets.allows_non_finite());
  CHECK(facets.unit_of(Facets()).unit().empty());  // also that there is none: merge() would keep it
}

TEST_CASE("facets without bounds keep everything else", "[rdf]") {
  Facets facets = Facets(unit::volt).above(1).below(2).length(3, 4).allow_non_finite();
  facets.without_bounds();
  CHECK_FALSE(facets.min());
  CHECK_FALSE(facets.max());
  CHECK(facets.unit() == unit::volt);
  CHECK(facets.min_length() == 3);
  CHECK(facets.max_length() == 4);
  CHECK(facets.allows_non_finite());
  CHECK(Facets().between(-1, 1).without_bounds().empty());
  const Facets others = Facets().above(7).below(8).merge(facets);  // bounds that were removed do not replace others
  CHECK(others.min() == 7.0);
  CHECK(others.min_exclusive());
  CHECK(others.max() == 8.0);
  CHECK(others.max_exclusive());
}

TEST_CASE("the unit of a record is at its node, unless one of its fields takes it", "[rdf]") {
  CHECK(node_unit(TwoNumbers(false).record, Facets(unit::metre)) == unit::metre);
  CHECK(node_unit(TwoNumbers(true).record, Facets(unit::metre)).empty());
  CHECK(node_unit(TwoNumbers(false).record, Facets()).empty());
  CHECK(node_unit(Type(), Facets(unit::metre)) == unit::metre);  // without fields
}

TEST_CASE("a field that takes the unit of its record keeps its own bounds", "[rdf]") {
  const TwoNumbers takes(true), keeps(false);
  const Facets record = Facets(unit::metre).between(-100, 100);
  const Facets value = field_facets(takes.record.fields[0], record);
  CHECK(value.unit() == unit::metre);
  CHECK(value.min() == 0.0);
  CHECK(value.min_exclusive());
  CHECK(value.max() == 5.0);
  CHECK(field_facets(takes.record.fields[0], Facets()).unit().empty());
  CHECK(takes.record.fields[0].facets.unit() == unit::volt);  // is not changed
  CHECK(field_facets(keeps.record.fields[0], record).unit() == unit::volt);
  CHECK(field_facets(takes.record.fields[1], record).unit().empty());
  CHECK_FALSE(field_facets(takes.record.fields[1], record).min());
  CHECK(field_facets(takes.record.fields[1], record).max() == 9.0);
}
