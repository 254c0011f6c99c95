// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/dynamic_type.hpp>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;
using rdf::DynamicType;
using rdf::Value;
using Sequence = Value::Sequence;

namespace {

std::string refusal(const Result<DynamicType>& made) { return made ? std::string("none") : made.error().message; }
std::string fault(const DynamicType& type, const Value& value) {
  const Result<void> checked = type.check(value);
  return checked ? std::string() : checked.error().message;
}

}  // namespace

TEST_CASE("a type that is made at run time is what it was made of", "[rdf][R1.5]") {
  CHECK_FALSE(DynamicType());
  CHECK(DynamicType().check(Value(1.0)).error().code == Errc::expected_value);
  const DynamicType real = DynamicType::of<double>(), text = DynamicType::of<std::string>();
  CHECK(real->kind == rdf::Type::Kind::real);
  const DynamicType mode = DynamicType::enumeration({"slow", "fast"}).value();
  const DynamicType gains =
      DynamicType::record("pid.Gains",
                          {{"p", real, Facets(unit::metre).between(0, 10)}, {"mode", mode}, {vocab::maths::x, DynamicType::optional(text).value()}})
          .value();
  REQUIRE(gains->fields.size() == 3);
  CHECK(gains->name == "pid.Gains");
  CHECK(gains->classes == std::vector<std::string>{"#pid.Gains"});
  CHECK(gains->fields[0].predicate == "#pid.Gains/p");
  CHECK(gains->fields[0].facets.max() == 10.0);
  CHECK(gains->fields[2].name == "x");
  CHECK(gains->fields[2].predicate == vocab::maths::x.text);
  // Without terms of its own it needs no name.
  const DynamicType point = DynamicType::record("", {{vocab::maths::x, real}}, {vocab::maths::Vector3D}).value();
  CHECK(point->name.empty());
}

TEST_CASE("equal types are one object, so that making them again needs no memory", "[rdf]") {
  const auto make = [](double top) {
    return DynamicType::record("Same", {{"a", DynamicType::of<double>(), Facets().at_most(top)},
                                        {"b", DynamicType::list(DynamicType::enumeration({"x", "y"}).value(), 1, 3).value()}})
        .value();
  };
  CHECK(make(1) == make(1));
  CHECK(&*make(1) == &*make(1));
  CHECK(make(1) != make(2));
  CHECK(DynamicType::base64() == DynamicType::base64());
  const auto titled = [](const char* title, const char* language) {
    return DynamicType::record("Titled", {{"a", DynamicType::of<double>(), Facets().title(title, language).description("A text.")}}).value();
  };
  CHECK(titled("Width", "en") == titled("Width", "en"));
  CHECK(titled("Width", "en") != titled("Width", "de"));
  CHECK(titled("Width", "en") != titled("Height", "en"));
  CHECK(titled("Width", "en") != DynamicType::record("Titled", {{"a", DynamicType::of<double>()}}).value());
}

TEST_CASE("what is no type is refused with a reason", "[rdf][R0.6]") {
  const DynamicType real = DynamicType::of<double>();
  const auto record = [&](std::vector<rdf::DynamicField> fields, const char* name = "R") {
    return refusal(DynamicType::record(name, std::move(fields)));
  };
  CHECK(record({{"a", real}, {"a", real}}) == "record \"R\": two fields have the name \"a\"");
  CHECK(record({{vocab::maths::x, real}, {Iri("http://arvida.example/other#x"), real}}) == "record \"R\": two fields have the name \"x\"");
  CHECK(record({{"", real}}) == "record \"R\": expected UTF-8 without NUL as name of each field");
  CHECK(record({{"\xFF", real}}) == "record \"R\": expected UTF-8 without NUL as name of each field");
  CHECK(record({{"a", {}}}) == "record \"R\", field \"a\": it has no type");
  CHECK(record({{"a", real, Facets().between(2, 1)}}) == "record \"R\", field \"a\": no value is within the bounds");
  CHECK(record({{"a", real, Facets().at_least(std::nan(""))}}) == "record \"R\", field \"a\": no value is within the bounds");
  CHECK(record({{"a", real, Facets(Unit{Iri("metre"), {}, {}, {}})}}) ==
        "record \"R\", field \"a\": expected an absolute IRI as unit, found \"metre\"");
  CHECK(record({{Iri("no IRI"), real}}).find("expected an absolute IRI as term") != std::string::npos);
  CHECK(record({{"a", real}}, "no name").find("expected letters, digits, '-', '_' and '.' as name") != std::string::npos);
  CHECK(record({{"a", real}}, "") == "record \"\": it needs a name, because it has terms of its own");
  CHECK(refusal(DynamicType::record("R", {{"a", real}}, {Iri("no class")})).find("expected an absolute IRI as class") != std::string::npos);
  CHECK(refusal(DynamicType::enumeration({})) == "an enumeration has no names");
  CHECK(refusal(DynamicType::enumeration({"a", "a"})) == "an enumeration has the name \"a\" twice");
  CHECK(refusal(DynamicType::enumeration({""})) == "expected UTF-8 without NUL as name in an enumeration");
  CHECK(refusal(DynamicType::list({})) == "a list: its members have no type");
  CHECK(refusal(DynamicType::list(DynamicType::optional(real).value())) == "a list: its members cannot be optional");
  CHECK(refusal(DynamicType::map(DynamicType::optional(real).value())) == "a map: its members cannot be optional");
  CHECK(refusal(DynamicType::optional(DynamicType::optional(real).value())) == "an optional value: its members cannot be optional");
  CHECK(refusal(DynamicType::list(real, 3, 2)) == "a list: expected a minimum length of at most the maximum length");
}

TEST_CASE("a field that is made at run time may have a value for clients that leave it out", "[rdf][R0.6]") {
  const DynamicType real = DynamicType::of<double>(), mode = DynamicType::enumeration({"slow", "fast"}).value();
  const auto field = [](const char* name, DynamicType type, Value absent, Facets facets = {}, bool read_only = false) {
    rdf::DynamicField made{name, type, facets, read_only};
    made.absent = std::make_shared<const Value>(std::move(absent));
    return made;
  };
  const auto record = [](rdf::DynamicField f) { return DynamicType::record("R", {std::move(f)}); };
  const DynamicType one = record(field("a", real, Value(1.0))).value();
  CHECK(*one->fields[0].absent->real() == 1.0);
  CHECK(one == record(field("a", real, Value(1.0))).value());
  CHECK(one != record(field("a", real, Value(2.0))).value());
  CHECK(one != DynamicType::record("R", {{"a", real}}).value());
  CHECK(record(field("m", mode, Value(std::string("fast")))));
  CHECK(refusal(record(field("m", mode, Value(std::string("off"))))).find("expected one of the names") != std::string::npos);
  CHECK(refusal(record(field("a", real, Value(1.0), Facets().at_least(2)))).find("outside of the bounds") != std::string::npos);
  CHECK(refusal(record(field("a", real, Value(1.0), {}, true))).find("cannot have a value if it is left out") != std::string::npos);
  CHECK(refusal(record(field("a", DynamicType::optional(real).value(), Value(1.0)))).find("cannot have a value") != std::string::npos);
  CHECK(refusal(DynamicType::variant("V", {field("a", real, Value(1.0))})).find("cannot have a value") != std::string::npos);
}

TEST_CASE("a variant that is made at run time has exactly one alternative", "[rdf][R0.6]") {
  const DynamicType nothing = DynamicType::record("Nothing", {}).value();
  const DynamicType move =
      DynamicType::variant("Move", {{"to", DynamicType::of<double>()}, {"home", nothing}, {"note", DynamicType::of<std::string>()}}).value();
  CHECK(move->kind == rdf::Type::Kind::variant);
  CHECK(move->fields[1].predicate == "#Move/home");
  const auto made = [](Value to, Value home, Value note) { return Value(Sequence{std::move(to), std::move(home), std::move(note)}); };
  CHECK(fault(move, made(Value(1.5), {}, {})) == "");
  CHECK(fault(move, made({}, Value(Sequence{}), {})) == "");
  CHECK(fault(move, made({}, {}, {})).find("expected exactly one of to, home, note") != std::string::npos);
  CHECK(fault(move, made(Value(1.5), {}, Value(std::string("x")))).find("found to and note") != std::string::npos);
  CHECK(fault(move, made({}, {}, Value(1.5))) == "\"note\": expected a text, found a floating-point number");
  CHECK(fault(move, Value(1.5)).find("one for each alternative") != std::string::npos);
  CHECK(refusal(DynamicType::variant("Move", {})) == "variant \"Move\": it has no alternatives");
  CHECK(refusal(DynamicType::variant("Move", {{"to", DynamicType::optional(nothing).value()}})) ==
        "variant \"Move\", alternative \"to\": it cannot be optional");
}

TEST_CASE("a type is neither deep nor large without end", "[rdf][R0.6]") {
  DynamicType type = DynamicType::of<double>();
  std::string said;
  int deep = 0;
  for (; deep < 100 && said.empty(); ++deep) {
    const Result<DynamicType> next = DynamicType::list(type);
    if (next) type = *next;
    else said = next.error().message;
  }
  CHECK(said == "a list: its types are nested more than 32 deep");
  CHECK(deep == 32);
  // Each record has the last one twice: 2^n values.
  type = DynamicType::of<double>();
  said.clear();
  for (int i = 0; i < 31 && said.empty(); ++i) {
    const Result<DynamicType> next = DynamicType::record("D" + std::to_string(i), {{"a", type}, {"b", type}});
    if (next) type = *next;
    else said = next.error().message;
  }
  CHECK(said.find("expected at most 20000 fields and members in all") != std::string::npos);
}

TEST_CASE("a value is checked against its type, and the place is said", "[rdf][R0.6]") {
  const DynamicType mode = DynamicType::enumeration({"slow", "fast"}).value();
  const DynamicType limits =
      DynamicType::record("Limits", {{"low", DynamicType::of<std::int8_t>()}, {"high", DynamicType::of<std::uint64_t>()}}).value();
  const DynamicType drive = DynamicType::record("Drive", {{"mode", mode},
                                                          {"limits", DynamicType::list(limits, 0, 2).value()},
                                                          {"gains", DynamicType::map(DynamicType::of<float>()).value()},
                                                          {"note", DynamicType::optional(DynamicType::of<std::string>()).value()},
                                                          {"at", DynamicType::of<std::chrono::nanoseconds>()}})
                                .value();
  const auto limit = [](std::int64_t low, std::uint64_t high) { return Value(Sequence{Value(low), Value(high)}); };
  const auto gain = [](std::string name, Value value) { return Value(Sequence{Value(std::move(name)), std::move(value)}); };
  const auto made = [&](Value m, Sequence limits_of, Sequence gains, Value note) {
    return Value(Sequence{std::move(m), Value(std::move(limits_of)), Value(std::move(gains)), std::move(note), Value(std::int64_t{5})});
  };
  const Value slow(std::string("slow"));
  CHECK(fault(drive, made(slow, {limit(-128, std::numeric_limits<std::uint64_t>::max())}, {gain("a", Value(1.0)), gain("b", Value(2.0))}, {})) == "");
  CHECK(fault(drive, made(Value(std::string("off")), {}, {}, {})) == "\"mode\": expected one of the names, found \"off\"");
  CHECK(fault(drive, made(Value(true), {}, {}, {})) == "\"mode\": expected one of the names, found a boolean");
  CHECK(fault(drive, made({}, {}, {}, {})) == "\"mode\": expected one of the names, found no value");
  CHECK(fault(drive, made(slow, {limit(0, 1), limit(128, 1)}, {}, {})) == "\"limits/1/low\": expected an integer from -128 to 127, found 128");
  CHECK(fault(drive, made(slow, {limit(0, 1), Value(Sequence{Value(std::int64_t{0}), Value(std::int64_t{-1})})}, {}, {})) ==
        "\"limits/1/high\": expected an integer from 0 to 18446744073709551615, found -1");
  CHECK(fault(drive, made(slow, {limit(0, 1), limit(0, 1), limit(0, 1)}, {}, {})) ==
        "\"limits\": expected a list of another length, found 3 members");
  CHECK(fault(drive, made(slow, {Value(1.0)}, {}, {})) ==
        "\"limits/0\": expected a sequence of 2, one for each field, found a floating-point number");
  CHECK(fault(drive, made(slow, {}, {gain("a", Value(1e300))}, {})) == "\"gains/a\": expected a number that a float can hold");
  CHECK(fault(drive, made(slow, {}, {gain("a", Value(std::int64_t{1}))}, {})) == "\"gains/a\": expected a floating-point number, found 1");
  CHECK(fault(drive, made(slow, {}, {gain("b", Value(1.0)), gain("a", Value(1.0))}, {})) ==
        "\"gains\": expected each name once, in the order of their bytes; found \"a\" after \"b\"");
  CHECK(fault(drive, made(slow, {}, {gain("a", Value(1.0)), gain("a", Value(1.0))}, {})).find("each name once") != std::string::npos);
  CHECK(fault(drive, made(slow, {}, {gain("\xC3", Value(1.0))}, {})) == "\"gains\": expected names in UTF-8 without U+0000");
  CHECK(fault(drive, made(slow, {}, {Value(1.0)}, {})) == "\"gains\": expected pairs of a name and a value, found a floating-point number");
  CHECK(fault(drive, made(slow, {}, {}, Value(std::string("caf\xE9")))) == "\"note\": expected a text in UTF-8 without U+0000");
  CHECK(fault(drive, made(slow, {}, {}, Value(std::string(1, '\0')))) == "\"note\": expected a text in UTF-8 without U+0000");
  CHECK(fault(drive, Value()) == "expected a sequence of 5, one for each field, found no value");
  CHECK(fault(DynamicType::of<double>(), Value(std::nan(""))) == "");  // what the robot measures may be non-finite
}
