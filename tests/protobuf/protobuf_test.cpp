// SPDX-License-Identifier: Apache-2.0
#include <lrt/protobuf.hpp>

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/json_util.h>

#include <lrt/thing.hpp>

#include <nlohmann/json.hpp>

#include "old.pb.h"
#include "robot.pb.h"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
namespace pb = google::protobuf;
using lrt::protobuf::MessageType;

template <>
struct lrt::protobuf::OptionsOf<robot::Described> {
  static Options options() {
    Options o;
    o.field = [](const google::protobuf::FieldDescriptor& field, Field& says) {
      if (field.name() == "angle") says.facets.unit(unit::degree).between(-90, 90);
      if (field.name() == "speed") says.facets.unit(unit::degree_per_second).title("Speed", "en");
      says.left_out = field.name() == "secret";
    };
    return o;
  }
};
template <>
struct lrt::protobuf::OptionsOf<robot::Robot> {
  static Options options() {
    Options o;
    o.field = [](const google::protobuf::FieldDescriptor& field, Field& says) { says.as_json = field.full_name() == "robot.Node.children"; };
    return o;
  }
};

namespace {

std::string json(Bench& bench, const std::string& path) { return bench.ask("GET " + path + "\nAccept: application/json").body; }
Answer put(Bench& bench, const std::string& path, const std::string& body, const std::string& type = "application/json") {
  return bench.ask("PUT " + path + "\nContent-Type: " + type + "\n\n" + body);
}

/// The sentence with which a Thing that has the message as a Property is refused; empty: it is not.
template <class M>
std::string refusal() {
  Bench bench;
  Thing thing{"arm"};
  thing.property("value", [] { return M(); });
  const Result<void> added = bench.engine.add(std::move(thing));
  return added ? std::string() : added.error().message;
}

template <class M>
M from_text(const std::string& text) {
  M message;
  REQUIRE(pb::TextFormat::ParseFromString(text, &message));
  return message;
}

/// Fills messages at random, by reflection. Each field is set at times.
class Filler {
 public:
  explicit Filler(unsigned seed) : random_(seed) {}

  void fill(pb::Message& message, int depth = 0) {
    const pb::Descriptor& descriptor = *message.GetDescriptor();
    switch (descriptor.well_known_type()) {
      case pb::Descriptor::WELLKNOWNTYPE_TIMESTAMP: return time(message, 9'000'000'000, true);
      case pb::Descriptor::WELLKNOWNTYPE_DURATION: return time(message, 9'000'000'000, false);
      default: break;
    }
    for (int i = 0; i < descriptor.field_count(); ++i) {
      const pb::FieldDescriptor& field = *descriptor.field(i);
      if (field.is_required() || below(4) != 0) set(message, field, depth);
    }
  }
  std::int64_t below(std::int64_t n) { return std::uniform_int_distribution<std::int64_t>(0, n - 1)(random_); }

 private:
  void time(pb::Message& message, std::int64_t most, bool is_instant) {
    const std::int64_t seconds = below(2 * most) - most;
    std::int64_t nanos = below(3) == 0 ? 0 : below(1'000'000'000);
    if (!is_instant && seconds < 0) nanos = -nanos;
    message.GetReflection()->SetInt64(&message, message.GetDescriptor()->FindFieldByNumber(1), seconds);
    message.GetReflection()->SetInt32(&message, message.GetDescriptor()->FindFieldByNumber(2), static_cast<std::int32_t>(nanos));
  }
  template <class T>
  T integer() {
    switch (below(4)) {
      case 0: return std::numeric_limits<T>::max();
      case 1: return std::numeric_limits<T>::min();
      case 2: return 0;
      default: return static_cast<T>(random_());
    }
  }
  double real() {
    constexpr double some[] = {0.0, -0.0, 1.5, -1e-300, 1.7976931348623157e308, 0.1, 5e-324, 123456789.125};
    return below(2) == 0 ? some[below(8)] : std::uniform_real_distribution<double>(-1e6, 1e6)(random_);
  }
  std::string text(bool is_bytes) {
    static const char* const some[] = {"", "a", "caf\xC3\xA9", "\xF0\x9F\xA4\x96", "\"", "\\", "\n\t", "<>&'", "x y ", "{}", "null"};
    std::string out;
    for (std::int64_t i = below(4); i >= 0; --i) out += is_bytes ? std::string(1, static_cast<char>(below(256))) : std::string(some[below(11)]);
    return out;
  }

  void set(pb::Message& message, const pb::FieldDescriptor& field, int depth) {
    const pb::Reflection& r = *message.GetReflection();
    if (field.is_map()) {
      pb::Message* entry = nullptr;
      const auto add = [&](auto set_key) {
        entry = r.AddMessage(&message, &field);
        set_key(*entry->GetReflection(), entry, entry->GetDescriptor()->map_key());
        set(*entry, *entry->GetDescriptor()->map_value(), depth);
      };
      for (int i = 0; i < 2; ++i) {  // keys that differ: random ones might not
        switch (field.message_type()->map_key()->cpp_type()) {
          case pb::FieldDescriptor::CPPTYPE_BOOL: add([&](auto& er, auto* e, auto* key) { er.SetBool(e, key, i == 0); }); break;
          case pb::FieldDescriptor::CPPTYPE_INT32: add([&](auto& er, auto* e, auto* key) { er.SetInt32(e, key, i == 0 ? -7 : 8); }); break;
          case pb::FieldDescriptor::CPPTYPE_INT64:
            add([&](auto& er, auto* e, auto* key) { er.SetInt64(e, key, i == 0 ? -1 : integer<std::int64_t>() | 1 << 8); });
            break;
          case pb::FieldDescriptor::CPPTYPE_UINT32: add([&](auto& er, auto* e, auto* key) { er.SetUInt32(e, key, i == 0 ? 0 : 4294967295U); }); break;
          default: add([&](auto& er, auto* e, auto* key) { er.SetString(e, key, text(false) + std::to_string(i)); });
        }
      }
      return;
    }
    for (std::int64_t i = field.is_repeated() ? below(4) : 1; i > 0; --i) one(message, field, r, depth);
  }

  void one(pb::Message& m, const pb::FieldDescriptor& f, const pb::Reflection& r, int depth) {
    const bool adds = f.is_repeated();
    switch (f.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32:
        return adds ? r.AddInt32(&m, &f, integer<std::int32_t>()) : r.SetInt32(&m, &f, integer<std::int32_t>());
      case pb::FieldDescriptor::CPPTYPE_INT64:
        return adds ? r.AddInt64(&m, &f, integer<std::int64_t>()) : r.SetInt64(&m, &f, integer<std::int64_t>());
      case pb::FieldDescriptor::CPPTYPE_UINT32:
        return adds ? r.AddUInt32(&m, &f, integer<std::uint32_t>()) : r.SetUInt32(&m, &f, integer<std::uint32_t>());
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        return adds ? r.AddUInt64(&m, &f, integer<std::uint64_t>()) : r.SetUInt64(&m, &f, integer<std::uint64_t>());
      case pb::FieldDescriptor::CPPTYPE_DOUBLE: return adds ? r.AddDouble(&m, &f, real()) : r.SetDouble(&m, &f, real());
      case pb::FieldDescriptor::CPPTYPE_FLOAT: {
        const auto number = static_cast<float>(below(2'000'000)) / 7.0F - 1e5F;
        return adds ? r.AddFloat(&m, &f, number) : r.SetFloat(&m, &f, number);
      }
      case pb::FieldDescriptor::CPPTYPE_BOOL: return adds ? r.AddBool(&m, &f, below(2) == 0) : r.SetBool(&m, &f, below(2) == 0);
      case pb::FieldDescriptor::CPPTYPE_ENUM: {
        const pb::EnumValueDescriptor* const value = f.enum_type()->value(static_cast<int>(below(f.enum_type()->value_count())));
        return adds ? r.AddEnum(&m, &f, value) : r.SetEnum(&m, &f, value);
      }
      case pb::FieldDescriptor::CPPTYPE_STRING: {
        std::string given = text(f.type() == pb::FieldDescriptor::TYPE_BYTES);
        return adds ? r.AddString(&m, &f, std::move(given)) : r.SetString(&m, &f, std::move(given));
      }
      case pb::FieldDescriptor::CPPTYPE_MESSAGE: return fill(adds ? *r.AddMessage(&m, &f) : *r.MutableMessage(&m, &f), depth + 1);
    }
  }

  std::mt19937 random_;
};

/// A Property with any message, read and written by its descriptor.
struct MessageRobot {
  explicit MessageRobot(const pb::Message& prototype, const protobuf::Options& options = {})
      : type(MessageType::of(*prototype.GetDescriptor(), options).value()), now(prototype.New()), written(prototype.New()) {
    Thing thing{"arm"};
    thing.property("value", type.type(), [this] { return type.encode(*now); }).on_write([this](const rdf::Value& v) {
      return type.decode(v, *written);
    });
    bench.add(std::move(thing));
  }
  const MessageType type;
  std::unique_ptr<pb::Message> now, written;
  Bench bench;
};

/// What a client reads in each format and sends back is the same message.
void check_round_trips(const pb::Message& prototype, unsigned seed, int messages) {
  MessageRobot served(prototype);
  Filler filler(seed);
  for (int i = 0; i < messages; ++i) {
    served.now->Clear();
    if (i > 0 || !prototype.GetDescriptor()->FindFieldByName("p")) filler.fill(*served.now);  // the first is empty
    else filler.fill(*served.now);
    for (const char* format : {"application/json", "text/turtle", "application/cbor", "application/n-triples"}) {
      const Answer read = served.bench.ask(std::string("GET /arm/value\nAccept: ") + format);
      INFO(format << " of " << served.now->ShortDebugString() << "\n" << read.body);
      REQUIRE(read.status == 200);
      served.written->Clear();
      const Answer answer = put(served.bench, "/arm/value", read.body, format);
      INFO(answer.body);
      REQUIRE(answer.status == 204);
      INFO("written: " << served.written->ShortDebugString());
      REQUIRE(protobuf::detail::same(*served.now, *served.written));
    }
  }
}

/// Descriptors that come to the program as data.
class Pool {
 public:
  /// @param file  a FileDescriptorProto as text
  explicit Pool(const std::string& file) {
    pb::FileDescriptorProto described;
    REQUIRE(pb::TextFormat::ParseFromString(file, &described));
    REQUIRE(pool_.BuildFile(described));
  }
  const pb::Message& prototype(const std::string& name) {
    const pb::Descriptor* const descriptor = pool_.FindMessageTypeByName(name);
    REQUIRE(descriptor);
    return *factory_.GetPrototype(descriptor);
  }

 private:
  pb::DescriptorPool pool_;
  pb::DynamicMessageFactory factory_;
};

}  // namespace

TEST_CASE("a message that protoc made is a value without further code", "[protobuf][R0.3][R0.5]") {
  robot::Scalars now = from_text<robot::Scalars>(
      "a_bool: true an_int64: -9223372036854775808 a_uint64: 18446744073709551615 a_double: 0.1 a_string: \"caf\\303\\251\" some_bytes: "
      "\"\\377\\000\\001\" "
      "mode: MODE_FAULT maybe: 0 renamed: 2");
  robot::Scalars written;
  Thing thing{"arm"};
  thing.property("now", [&] { return now; }).on_write([&](const robot::Scalars& m) { written = m; });
  auto pushed = thing.property<robot::Point>("point");
  thing.property("points", [] { return std::vector<robot::Point>(2); });
  thing.action("echo", [](const robot::Move& move) { return move; });
  Bench bench;
  bench.add(std::move(thing));
  CHECK(json(bench, "/arm/now") ==
        "{\"aBool\":true,\"anInt32\":0,\"aSint32\":0,\"anSfixed32\":0,\"aUint32\":0,\"aFixed32\":0,\"anInt64\":-9223372036854775808,\"aSint64\":0,"
        "\"anSfixed64\":0,\"aUint64\":18446744073709551615,\"aFixed64\":0,\"aFloat\":0,\"aDouble\":0.1,\"aString\":\"caf\xC3\xA9\",\"someBytes\":\"/"
        "wAB\","
        "\"mode\":\"MODE_FAULT\",\"maybe\":0,\"otherName\":2}");
  const Answer turtle = bench.get("/arm/now");
  CHECK(turtle.says("\"/wAB\"^^xsd:base64Binary"));
  CHECK(turtle.says("robot.Scalars"));
  CHECK(bench.turtle("PUT", "/arm/now", turtle.body).status == 204);
  CHECK(protobuf::detail::same(now, written));
  pushed.publish(from_text<robot::Point>("x: 1.5"));
  CHECK(json(bench, "/arm/point") == "{\"x\":1.5,\"y\":0}");
  CHECK(json(bench, "/arm/points") == "[{\"x\":0,\"y\":0},{\"x\":0,\"y\":0}]");
  const Answer echoed =
      bench.ask("POST /arm/actions/echo\nContent-Type: application/json\nAccept: application/json\n\n{\"name\":\"a\",\"target\":{\"home\":{}}}");
  CHECK(echoed.body == "{\"name\":\"a\",\"target\":{\"home\":{}}}");
  CHECK(bench.get("/ns/vocabulary").says("robot.Scalars/otherName"));
}

TEST_CASE("random messages come back through the server as they were", "[protobuf][R0.5][R0.9]") {
  check_round_trips(robot::Scalars(), 1, 12);
  check_round_trips(robot::Nested(), 2, 12);
  check_round_trips(robot::Move(), 3, 25);
  check_round_trips(robot::WellKnown(), 4, 12);
  check_round_trips(robot::old::Gain(), 5, 12);
}

TEST_CASE("messages that are known at run time only come back as well", "[protobuf][R0.5]") {
  Pool pool(R"(name: "at_run_time.proto" package: "fc" syntax: "proto3"
enum_type { name: "Kind" value { name: "NONE" number: 0 } value { name: "PWM" number: 1 } }
message_type { name: "Output"
  field { name: "channel" number: 1 type: TYPE_UINT32 label: LABEL_OPTIONAL json_name: "channel" }
  field { name: "kind" number: 2 type: TYPE_ENUM type_name: ".fc.Kind" label: LABEL_OPTIONAL json_name: "kind" }
  field { name: "fraction" number: 3 type: TYPE_DOUBLE label: LABEL_OPTIONAL oneof_index: 0 json_name: "fraction" }
  field { name: "ticks" number: 4 type: TYPE_UINT64 label: LABEL_OPTIONAL oneof_index: 0 json_name: "ticks" }
  field { name: "names" number: 5 type: TYPE_MESSAGE type_name: ".fc.Output.NamesEntry" label: LABEL_REPEATED json_name: "names" }
  nested_type { name: "NamesEntry" options { map_entry: true }
    field { name: "key" number: 1 type: TYPE_INT32 label: LABEL_OPTIONAL json_name: "key" }
    field { name: "value" number: 2 type: TYPE_STRING label: LABEL_OPTIONAL json_name: "value" } }
  oneof_decl { name: "limit" } }
message_type { name: "Table"
  field { name: "outputs" number: 1 type: TYPE_MESSAGE type_name: ".fc.Output" label: LABEL_REPEATED json_name: "outputs" }
  field { name: "by_name" number: 2 type: TYPE_MESSAGE type_name: ".fc.Table.ByNameEntry" label: LABEL_REPEATED json_name: "byName" }
  nested_type { name: "ByNameEntry" options { map_entry: true }
    field { name: "key" number: 1 type: TYPE_STRING label: LABEL_OPTIONAL json_name: "key" }
    field { name: "value" number: 2 type: TYPE_MESSAGE type_name: ".fc.Output" label: LABEL_OPTIONAL json_name: "value" } }
  field { name: "raw" number: 3 type: TYPE_BYTES label: LABEL_OPTIONAL oneof_index: 0 proto3_optional: true json_name: "raw" }
  oneof_decl { name: "_raw" } }
)");
  check_round_trips(pool.prototype("fc.Table"), 6, 20);
  MessageRobot served(pool.prototype("fc.Table"));
  REQUIRE(pb::TextFormat::ParseFromString("outputs { channel: 3 kind: PWM ticks: 7 names { key: -2 value: \"two\" } }", served.now.get()));
  CHECK(json(served.bench, "/arm/value") ==
        "{\"outputs\":[{\"channel\":3,\"kind\":\"PWM\",\"limit\":{\"ticks\":7},\"names\":{\"-2\":\"two\"}}],\"byName\":{}}");
}

TEST_CASE("a oneof has exactly one of its fields, or is absent unless the host requires it", "[protobuf][R0.6]") {
  for (const bool required : {false, true}) {
    protobuf::Options options;
    options.oneof_is_required = [&](const pb::OneofDescriptor&) { return required; };
    MessageRobot served(robot::Move(), options);
    const auto status = [&](const std::string& target) { return put(served.bench, "/arm/value", "{\"name\":\"a\"" + target + "}").status; };
    CHECK(status("") == (required ? 422 : 204));
    CHECK(status(",\"target\":{\"place\":\"dock\"}") == 204);
    CHECK(dynamic_cast<const robot::Move&>(*served.written).place() == "dock");
    CHECK(status(",\"target\":{\"home\":{}}") == 204);
    CHECK(dynamic_cast<const robot::Move&>(*served.written).has_home());
    CHECK(status(",\"target\":{}") == 422);
    const Answer two = put(served.bench, "/arm/value", "{\"name\":\"a\",\"target\":{\"place\":\"dock\",\"angle\":1}}");
    CHECK(two.status == 422);
    CHECK(two.says("place"));
    CHECK(two.says("angle"));
    CHECK(served.bench.get("/arm/value").status == (required ? 500 : 200));
  }
}

TEST_CASE("a message that contains itself is refused with the place, and ends as JSON", "[protobuf][R0.6]") {
  CHECK(refusal<robot::Node>().find("message \"robot.Node\" contains itself, by \"robot.Node.children\"") != std::string::npos);
  CHECK(MessageType::of(*robot::Node::descriptor()).error().code == Errc::invalid_option);
  robot::Robot now = from_text<robot::Robot>("tree { name: \"a\" children { name: \"b\" children { name: \"c\" } } }");
  robot::Robot written;
  Thing thing{"arm"};
  thing.property("tree", [&] { return now; }).on_write([&](const robot::Robot& m) { written = m; });
  Bench bench;
  bench.add(std::move(thing));
  const std::string body = json(bench, "/arm/tree");
  CHECK(body == R"({"tree":{"name":"a","children":["{\"name\":\"b\",\"children\":[{\"name\":\"c\"}]}"]}})");
  CHECK(put(bench, "/arm/tree", body).status == 204);
  CHECK(protobuf::detail::same(now, written));
  const Answer bad = put(bench, "/arm/tree", R"({"tree":{"name":"a","children":["{\"nme\":\"b\"}"]}})");
  CHECK(bad.status == 422);
  CHECK(bad.says("tree/children/0"));
  // 10,000 levels
  std::string deep;
  for (int i = 0; i < 10000; ++i) deep += "{\\\"children\\\":[";
  CHECK(put(bench, "/arm/tree", "{\"tree\":{\"name\":\"a\",\"children\":[\"" + deep + "\"]}}").status == 422);
}

TEST_CASE("what is no value is an error with its place, and no document", "[protobuf][R0.6]") {
  robot::Nested now;
  Thing thing{"arm"};
  thing.property("value", [&] { return now; });
  thing.property("list", [&] { return std::vector<robot::Nested>{now}; });
  thing.action("get", [&] { return now; });
  Bench bench;
  bench.add(std::move(thing));
  const auto check = [&](const std::string& says) {
    const Answer answer = bench.get("/arm/value");
    INFO(answer.body);
    CHECK(answer.status == 500);
    CHECK(answer.says(says));
    CHECK(bench.get("/arm/list").status == 500);
    CHECK(bench.turtle("POST", "/arm/actions/get", "").status == 500);
    now.Clear();
    CHECK(bench.get("/arm/value").status == 200);
  };
  now.add_texts("good");
  now.add_texts("caf\xE9");
  check("texts/1");
  now.mutable_scalars()->set_a_string(std::string("a\0b", 3));
  check("scalars/aString");
  (*now.mutable_gains())["caf\xE9"] = 1;
  check("gains");
  now.mutable_scalars()->set_mode(static_cast<robot::Mode>(99));
  check("found the number 99");
  now.add_modes(static_cast<robot::Mode>(98));
  check("modes/0");
}

TEST_CASE("keys of maps and bytes are read exactly, or refused", "[protobuf][R0.6]") {
  MessageRobot served{robot::Nested()};
  const std::string rest = "\"points\":[],\"packed\":[],\"unpacked\":[],\"texts\":[],\"modes\":[]";
  const auto sent = [&](const std::string& places, const std::string& answers, const std::string& ids, const std::string& blobs) {
    return put(served.bench, "/arm/value",
               "{" + rest + ",\"blobs\":[" + blobs + "],\"gains\":{},\"places\":{" + places + "},\"answers\":{" + answers + "},\"modesById\":{" +
                   ids + "}}");
  };
  const auto& written = [&]() -> const robot::Nested& { return dynamic_cast<const robot::Nested&>(*served.written); };
  CHECK(sent("\"-9223372036854775808\":{\"x\":1,\"y\":2}", "\"true\":\"yes\"", "\"4294967295\":\"MODE_WAITING\"", "\"\",\"AA==\",\"AAE=\",\"AAEC\"")
            .status == 204);
  CHECK(written().places().at(std::numeric_limits<std::int64_t>::min()).y() == 2);
  CHECK(written().answers().at(true) == "yes");
  CHECK(written().modes_by_id().at(4294967295U) == robot::MODE_HOLDING);
  CHECK(written().blobs(1) == std::string(1, '\0'));
  CHECK(written().blobs(3) == std::string("\0\1\2", 3));
  for (const char* key : {"", "01", "+1", " 1", "1 ", "1.0", "0x1", "-0", "9223372036854775808", "one", "1\\u0000"}) {
    const Answer answer = sent(std::string("\"") + key + "\":{\"x\":1,\"y\":2}", "", "", "");
    INFO(key << ": " << answer.body);
    CHECK((answer.status == 422 || answer.status == 400));
  }
  for (const char* key : {"True", "1", ""}) CHECK(sent("", std::string("\"") + key + "\":\"\"", "", "").status == 422);
  for (const char* key : {"-1", "4294967296"}) CHECK(sent("", "", std::string("\"") + key + "\":\"MODE_IDLE\"", "").status == 422);
  for (const char* text : {"A", "AA", "AA=", "AAA", "A===", "AB==", "AAB=", "AA==AA==", "AAE-", "=", "====", "AA=A", "\xC3\xA9"})
    CHECK(sent("", "", "", std::string("\"") + text + "\"").status == 422);
}

TEST_CASE("times are exact, or no values", "[protobuf][R0.6]") {
  MessageRobot served{robot::WellKnown()};
  auto& now = dynamic_cast<robot::WellKnown&>(*served.now);
  const auto status = [&] { return served.bench.get("/arm/value").status; };
  now.mutable_at()->set_seconds(-1);
  now.mutable_at()->set_nanos(999'999'999);
  CHECK(json(served.bench, "/arm/value").find("\"at\":\"1969-12-31T23:59:59.999999999Z\"") != std::string::npos);
  now.mutable_took()->set_seconds(-1);
  now.mutable_took()->set_nanos(-500'000'000);
  CHECK(json(served.bench, "/arm/value").find("\"took\":\"-PT1.5S\"") != std::string::npos);
  const std::pair<std::int64_t, std::int32_t> bad_instants[] = {
      {253'402'300'799, 0}, {-62'135'596'800, 0}, {0, -1}, {0, 1'000'000'000}, {9'223'372'036, 1}, {std::numeric_limits<std::int64_t>::min(), 0}};
  for (const auto& [seconds, nanos] : bad_instants) {
    now.Clear();
    now.mutable_at()->set_seconds(seconds);
    now.mutable_at()->set_nanos(nanos);
    CHECK(status() == 500);
  }
  const std::pair<std::int64_t, std::int32_t> bad_durations[] = {
      {315'576'000'000, 0}, {1, -1}, {-1, 1}, {0, 1'000'000'000}, {-9'223'372'036, -1}, {std::numeric_limits<std::int64_t>::max(), 0}};
  for (const auto& [seconds, nanos] : bad_durations) {
    now.Clear();
    now.mutable_took()->set_seconds(seconds);
    now.mutable_took()->set_nanos(nanos);
    CHECK(status() == 500);
  }
}

TEST_CASE("what proto2 requires is there, and what it makes optional may be absent", "[protobuf][R0.6]") {
  MessageRobot served{robot::old::Gain()};
  CHECK(served.bench.get("/arm/value").says("a required field is not set"));
  REQUIRE(pb::TextFormat::ParseFromString("p: 1 Limit { lower: -1 } Limit { lower: 2 upper: 3 }", served.now.get()));
  CHECK(json(served.bench, "/arm/value") == "{\"p\":1,\"limit\":[{\"lower\":-1},{\"lower\":2,\"upper\":3}]}");
  CHECK(put(served.bench, "/arm/value", "{\"p\":2,\"level\":\"LOW\",\"limit\":[]}").status == 204);
  CHECK(dynamic_cast<const robot::old::Gain&>(*served.written).level() == robot::old::LOW);
  CHECK_FALSE(dynamic_cast<const robot::old::Gain&>(*served.written).has_i());
  CHECK(put(served.bench, "/arm/value", "{\"limit\":[]}").status == 422);
  CHECK(put(served.bench, "/arm/value", "{\"p\":2,\"limit\":[{}]}").status == 422);
  CHECK(put(served.bench, "/arm/value", "{\"p\":2,\"level\":\"MEDIUM\",\"limit\":[]}").status == 422);
}

TEST_CASE("the host says units, bounds and what is left out", "[protobuf][R1.5]") {
  robot::Described now = from_text<robot::Described>("angle: 45 secret: \"hidden\"");
  robot::Described written;
  Thing thing{"arm"};
  thing.property("now", [&] { return now; }).on_write([&](const robot::Described& m) { written = m; });
  Bench bench;
  bench.add(std::move(thing));
  CHECK(json(bench, "/arm/now").find("hidden") == std::string::npos);
  CHECK(bench.get("/arm/now").says("unit:DEG"));
  CHECK(put(bench, "/arm/now", "{\"angle\":90,\"speed\":1}").status == 204);
  CHECK(written.angle() == 90);
  CHECK(put(bench, "/arm/now", "{\"angle\":91,\"speed\":1}").status == 422);
  CHECK(bench.get("/ns/vocabulary").says("\"Speed\"@en"));
}

TEST_CASE("two fields with one name in JSON are refused", "[protobuf][R0.6]") {
  CHECK(refusal<robot::old::Twice>().find("record \"robot.old.Twice\": two fields have the name \"same\"") != std::string::npos);
}

TEST_CASE("messages without a form of their own are texts with their JSON", "[protobuf]") {
  MessageRobot served{robot::Free()};
  REQUIRE(
      pb::util::JsonStringToMessage(
          R"({"structure":{"a":[1,"x",null]},"value":2.5,"list":[true],"any":{"@type":"type.googleapis.com/robot.Point","x":1}})", served.now.get())
          .ok());
  const std::string body = json(served.bench, "/arm/value");
  CHECK(body ==
        R"({"structure":"{\"a\":[1,\"x\",null]}","value":"2.5","list":"[true]","any":"{\"@type\":\"type.googleapis.com/robot.Point\",\"x\":1}"})");
  CHECK(put(served.bench, "/arm/value", body).status == 204);
  CHECK(protobuf::detail::same(*served.now, *served.written));
  CHECK(put(served.bench, "/arm/value", R"({"any":"{\"@type\":\"type.googleapis.com/no.Such\"}"})").status == 422);
  CHECK(put(served.bench, "/arm/value", R"({"structure":"no JSON"})").status == 422);
}

namespace {

/// Whether JSON of lrt and of protobuf say the same. They differ in: 64-bit integers, which protobuf writes as texts; the unit of durations; digits
/// of a second; a oneof, whose field protobuf has in the message itself.
bool agree(const pb::Descriptor* message, const nlohmann::json& ours, const nlohmann::json& theirs);
bool agree_value(const pb::FieldDescriptor& field, const nlohmann::json& ours, const nlohmann::json& theirs) {
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_INT64: return theirs.is_string() && std::to_string(ours.get<std::int64_t>()) == theirs.get<std::string>();
    case pb::FieldDescriptor::CPPTYPE_UINT64: return theirs.is_string() && std::to_string(ours.get<std::uint64_t>()) == theirs.get<std::string>();
    case pb::FieldDescriptor::CPPTYPE_FLOAT: return ours.get<float>() == theirs.get<float>();
    case pb::FieldDescriptor::CPPTYPE_DOUBLE: return ours.get<double>() == theirs.get<double>();
    case pb::FieldDescriptor::CPPTYPE_MESSAGE: {
      const pb::Descriptor& type = *field.message_type();
      switch (type.well_known_type()) {
        case pb::Descriptor::WELLKNOWNTYPE_TIMESTAMP:
        case pb::Descriptor::WELLKNOWNTYPE_DURATION: return ours.is_string() && theirs.is_string();
        case pb::Descriptor::WELLKNOWNTYPE_UNSPECIFIED: return agree(&type, ours, theirs);
        default: return agree_value(*type.FindFieldByName("value"), ours, theirs);
      }
    }
    default: return ours == theirs;
  }
}
bool agree(const pb::Descriptor* message, const nlohmann::json& ours, const nlohmann::json& theirs) {
  std::size_t met = 0;
  for (int i = 0; i < message->field_count(); ++i) {
    const pb::FieldDescriptor& field = *message->field(i);
    const std::string& name = field.json_name();
    const pb::OneofDescriptor* const oneof = field.real_containing_oneof();
    const nlohmann::json none = nlohmann::json::object();
    const nlohmann::json& in = oneof ? (ours.contains(oneof->name()) ? ours[oneof->name()] : none) : ours;
    if (in.contains(name) != theirs.contains(name)) return false;
    if (!in.contains(name)) continue;
    ++met;
    const nlohmann::json &a = in[name], &b = theirs[name];
    if (field.is_map()) {
      if (a.size() != b.size()) return false;
      for (const auto& [key, value] : a.items())
        if (!b.contains(key) || !agree_value(*field.message_type()->map_value(), value, b[key])) return false;
    } else if (field.is_repeated()) {
      if (a.size() != b.size()) return false;
      for (std::size_t n = 0; n < a.size(); ++n)
        if (!agree_value(field, a[n], b[n])) return false;
    } else if (!agree_value(field, a, b)) {
      return false;
    }
  }
  return met == theirs.size();
}

}  // namespace

TEST_CASE("JSON says what protobuf's own JSON says", "[protobuf]") {
  const robot::Scalars scalars;
  const robot::Nested nested;
  const robot::Move move;
  const robot::WellKnown well_known;
  unsigned seed = 10;
  for (const pb::Message* prototype : {static_cast<const pb::Message*>(&scalars), static_cast<const pb::Message*>(&nested),
                                       static_cast<const pb::Message*>(&move), static_cast<const pb::Message*>(&well_known)}) {
    MessageRobot served(*prototype);
    Filler filler(seed++);
    for (int i = 0; i < 10; ++i) {
      served.now->Clear();
      filler.fill(*served.now);
      std::string theirs;
      pb::util::JsonPrintOptions options;
      options.always_print_primitive_fields = true;
      REQUIRE(pb::util::MessageToJsonString(*served.now, &theirs, options).ok());
      const std::string ours = json(served.bench, "/arm/value");
      INFO(ours << "\n" << theirs);
      CHECK(agree(prototype->GetDescriptor(), nlohmann::json::parse(ours), nlohmann::json::parse(theirs)));
    }
  }
}
