// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/dynamic_type.hpp>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <lrt/thing.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using rdf::DynamicType;
using rdf::Value;
using Sequence = Value::Sequence;

namespace {

/// The likeness of a flight controller: names, kinds and bounds that only the program's own table knows.
struct Parameter {
  std::string name;
  char kind = 'f';  // 'f', 'i', 'b', 'e'
  double low = 0, high = 0;
  Value value{};
};
std::vector<Parameter> table_of(std::size_t count) {
  std::vector<Parameter> table;
  for (std::size_t i = 0; i < count; ++i) {
    Parameter p;
    p.name = "P" + std::to_string(i);
    p.kind = "fibe"[i % 4];
    p.high = static_cast<double>(i + 1);
    p.value = p.kind == 'f' ? Value(0.5) : p.kind == 'i' ? Value(std::int64_t{1}) : p.kind == 'b' ? Value(false) : Value(std::string("off"));
    table.push_back(std::move(p));
  }
  return table;
}
DynamicType type_of(const Parameter& p) {
  switch (p.kind) {
    case 'f': return DynamicType::of<double>();
    case 'i': return DynamicType::of<std::int32_t>();
    case 'b': return DynamicType::of<bool>();
    default: return DynamicType::enumeration({"off", "on"}).value();
  }
}

std::string json(Bench& bench, const std::string& path) { return bench.ask("GET " + path + "\nAccept: application/json").body; }
Answer put(Bench& bench, const std::string& path, const std::string& body) {
  return bench.ask("PUT " + path + "\nContent-Type: application/json\n\n" + body);
}

}  // namespace

TEST_CASE("a table of 333 parameters that is known at run time only is one loop", "[engine][R0.3][R0.5]") {
  std::vector<Parameter> table = table_of(333);
  Thing controller{"fc"};
  for (Parameter& p : table) {
    auto property = controller.property("parameters/" + p.name, type_of(p), [&p] { return p.value; });
    property.on_write([&p](const Value& v) { p.value = v; });
    if (p.kind == 'f' || p.kind == 'i') property.between(p.low, p.high);
  }
  Bench bench;
  bench.add(std::move(controller));
  CHECK(json(bench, "/fc/parameters/P0") == "0.5");
  CHECK(json(bench, "/fc/parameters/P331") == "\"off\"");
  CHECK(put(bench, "/fc/parameters/P4", "4.5").status == 204);
  CHECK(*table[4].value.real() == 4.5);
  CHECK(put(bench, "/fc/parameters/P4", "5.5").status == 422);  // beyond its bound
  CHECK(put(bench, "/fc/parameters/P5", "6").status == 204);
  CHECK(put(bench, "/fc/parameters/P5", "6.5").status == 422);
  CHECK(put(bench, "/fc/parameters/P6", "true").status == 204);
  CHECK(put(bench, "/fc/parameters/P7", "\"on\"").status == 204);
  CHECK(put(bench, "/fc/parameters/P7", "\"maybe\"").status == 422);
  CHECK(*table[7].value.text() == "on");
}

TEST_CASE("the same table is one record, read and written as a whole", "[engine][R0.3][R0.5]") {
  std::vector<Parameter> table = table_of(20);
  std::vector<rdf::DynamicField> fields;
  for (const Parameter& p : table) fields.push_back({p.name, type_of(p), p.kind == 'f' ? Facets(unit::metre).between(p.low, p.high) : Facets()});
  const DynamicType type = DynamicType::record("Parameters", std::move(fields)).value();
  const auto read = [&] {
    Sequence values;
    for (const Parameter& p : table) values.push_back(p.value);
    return Value(std::move(values));
  };
  Thing controller{"fc"};
  controller.property("parameters", type, read).on_write([&](const Value& v) {
    for (std::size_t i = 0; i < table.size(); ++i) table[i].value = (*v.sequence())[i];
  });
  Bench bench;
  bench.add(std::move(controller));
  std::string body = json(bench, "/fc/parameters");
  CHECK(body.substr(0, 39) == "{\"P0\":0.5,\"P1\":1,\"P2\":false,\"P3\":\"off\",");
  body.replace(body.find("\"off\""), 5, "\"on\"");
  CHECK(put(bench, "/fc/parameters", body).status == 204);
  CHECK(*table[3].value.text() == "on");
  const Answer turtle = bench.get("/fc/parameters");
  CHECK(turtle.status == 200);
  CHECK(turtle.says("Parameters/P3"));
  CHECK(bench.turtle("PUT", "/fc/parameters", turtle.body).status == 204);
  CHECK(bench.get("/ns/vocabulary").says("Parameters/P19"));
  CHECK(put(bench, "/fc/parameters", "{\"P0\":0.5}").status == 422);
}

TEST_CASE("a value of the host that is not of its type is an error with its place, and no document", "[engine][R0.6]") {
  engine::EngineOptions options;
  std::vector<std::string> log;
  options.log = [&](LogLevel level, std::string_view text) { log.push_back((level == LogLevel::error ? "error: " : "") + std::string(text)); };
  Bench bench(std::move(options));
  const DynamicType type = DynamicType::record("Two", {{"a", DynamicType::of<double>()}, {"b", DynamicType::of<std::string>()}}).value();
  const auto made = [](Value a, std::string b) { return Value(Sequence{std::move(a), Value(std::move(b))}); };
  Value now = made(Value(1.5), "x");
  Thing thing{"arm"};
  thing.property("pulled", type, [&] { return now; });
  auto pushed = thing.property("pushed", type);
  thing.property("failing", type, []() -> Result<Value> { return unexpected(Errc::failed, "no answer of the bus"); });
  thing.action("next", {}, type, [&] { return now; });
  thing.action("later", {}, type, [&](const ResponderOf<Value>& done) { done.succeed(now); });
  bench.add(std::move(thing));
  CHECK(json(bench, "/arm/pulled") == "{\"a\":1.5,\"b\":\"x\"}");
  pushed.publish(now);
  CHECK(json(bench, "/arm/pushed") == "{\"a\":1.5,\"b\":\"x\"}");
  CHECK(bench.turtle("POST", "/arm/actions/next", "").status == 200);
  CHECK(bench.turtle("POST", "/arm/actions/later", "").status == 200);
  CHECK(bench.get("/arm/failing").status == 500);

  for (const Value& bad : {made(Value(true), "x"), made(Value(1.5), "caf\xE9"), Value(1.5), Value(Sequence{}), Value(std::string("x"))}) {
    now = bad;
    const Answer answer = bench.get("/arm/pulled");
    CHECK(answer.status == 500);
    CHECK(answer.says("the value is not of its type: "));
    CHECK(bench.turtle("POST", "/arm/actions/next", "").status == 500);
    CHECK(bench.turtle("POST", "/arm/actions/later", "").status == 500);
    pushed.publish(bad);
    CHECK(bench.get("/arm/pushed").status == 500);
    CHECK_FALSE(bench.get("/arm/pushed").says("Two/a"));
  }
  CHECK(std::count(
            log.begin(), log.end(),
            "error: property \"/arm/pushed\" has no value: the value is not of its type: \"a\": expected a floating-point number, found a boolean") ==
        1);
  now = made(Value(2.5), "y");
  pushed.publish(now);
  CHECK(json(bench, "/arm/pushed") == "{\"a\":2.5,\"b\":\"y\"}");
  CHECK(bench.get("/arm/pulled").status == 200);
}

TEST_CASE("actions and collections take types that are made at run time", "[engine][R0.5][R0.8]") {
  const DynamicType pose =
      DynamicType::record("Pose", {{"x", DynamicType::of<double>()}, {"name", DynamicType::optional(DynamicType::of<std::string>()).value()}})
          .value();
  Value last;
  std::map<std::string, Value> members;
  Thing thing{"arm"};
  thing.action("move", pose, {}, [&](const Value& in) { last = in; });
  thing.action("echo", pose, pose, [](Value in) -> Result<Value> { return in; });
  thing.action("wait", pose, {}, [&](Value in, const Responder& done) {
    last = std::move(in);
    done.succeed();
  });
  thing.collection("poses", pose).on_create([&](const std::string& id, const Value& v) { members[id] = v; }).on_remove([&](const std::string& id) {
    members.erase(id);
  });
  Bench bench;
  bench.add(std::move(thing));
  const auto post = [&](const std::string& path, const std::string& body) {
    return bench.ask("POST " + path + "\nContent-Type: application/json\nAccept: application/json\n\n" + body);
  };
  CHECK(post("/arm/actions/move", "{\"x\":2}").status == 204);
  CHECK(*(*last.sequence())[0].real() == 2);
  CHECK((*last.sequence())[1].is_null());
  CHECK(post("/arm/actions/echo", "{\"x\":2.5,\"name\":\"here\"}").body == "{\"x\":2.5,\"name\":\"here\"}");
  CHECK(post("/arm/actions/wait", "{\"x\":3}").status == 204);
  CHECK(*(*last.sequence())[0].real() == 3);
  CHECK(post("/arm/actions/move", "{}").status == 422);
  CHECK(post("/arm/actions/move", "{\"x\":\"far\"}").status == 422);
  const Answer made = post("/arm/poses", "{\"x\":4}");
  CHECK(made.status == 201);
  REQUIRE(members.size() == 1);
  CHECK(*(*members.begin()->second.sequence())[0].real() == 4);
}

TEST_CASE("a callable that does not fit its types is refused when the Thing is added", "[engine][R0.6]") {
  const DynamicType real = DynamicType::of<double>();
  const auto said = [](auto describe) {
    Bench bench;
    Thing thing{"arm"};
    describe(thing);
    const Result<void> added = bench.engine.add(std::move(thing));
    return added ? std::string("nothing") : added.error().message;
  };
  CHECK(said([&](Thing& t) { t.action("a", real, {}, [] {}); }).find("the callable does not take the input") != std::string::npos);
  CHECK(said([&](Thing& t) { t.action("a", {}, {}, [](const Value&) {}); }).find("no type of it is given") != std::string::npos);
  CHECK(said([&](Thing& t) { t.action("a", {}, real, [] {}); }).find("the callable gives no output") != std::string::npos);
  CHECK(said([&](Thing& t) { t.action("a", {}, {}, [] { return Value(1.0); }); }).find("no type of it is given") != std::string::npos);
  CHECK(said([&](Thing& t) { t.property("p", DynamicType(), [] { return Value(1.0); }); }) ==
        "\"arm/p\": there is no type; an empty rdf::DynamicType is none");
  CHECK(said([&](Thing& t) { t.property("p", DynamicType()); }).find("there is no type") != std::string::npos);
  CHECK(said([&](Thing& t) { t.collection("p", DynamicType()); }).find("there is no type") != std::string::npos);
  CHECK(said([&](Thing& t) {
          auto p = t.property("p", real, [] { return Value(1.0); });
          t.action("a", [] {}).effect(p, Value(true));
        }).find("effect(\"/arm/p\"): expected a floating-point number, found a boolean") != std::string::npos);
  CHECK(said([&](Thing& t) {
          auto p = t.property("p", real, [] { return Value(1.0); });
          t.action("a", [] {}).effect(p, Value(2.0));
        }) == "nothing");
}

TEST_CASE("a type outlives the Things that use it", "[engine]") {
  Bench bench;
  for (int i = 0; i < 3; ++i) {
    const DynamicType type = DynamicType::record("Kept", {{"a", DynamicType::of<double>()}}).value();
    const std::string name = "t" + std::to_string(i);
    Thing thing{name};
    thing.property("p", type, [] { return Value(Sequence{Value(1.0)}); });
    bench.add(std::move(thing));
    if (i > 0) CHECK(bench.engine.remove("t" + std::to_string(i - 1)));
    CHECK(bench.get("/ns/vocabulary").says("Kept/a"));
  }
  CHECK(bench.get("/t2/p").status == 200);
}
