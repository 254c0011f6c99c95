// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/message_type.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>

#include <lrt/ros2/definitions.hpp>

#include "src/ros2/types/cdr.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using Value = rdf::Value;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

namespace {

/// The type of a text.
MessageType type_of(std::string_view text, const MessageOptions& options = {}, const CodecLimits& limits = {}) {
  Definitions known;
  known.add_text("demo/msg/Thing", text).value();
  return MessageType::of(known.message("demo/msg/Thing").value(), options, limits).value();
}
MessageType shipped(std::string_view type, const MessageOptions& options = {}) {
  return MessageType::of(Definitions().message(type).value(), options).value();
}
Error error_of(std::string_view text, const MessageOptions& options = {}, const CodecLimits& limits = {}) {
  Definitions known;
  known.add_text("demo/msg/Thing", text).value();
  return MessageType::of(known.message("demo/msg/Thing").value(), options, limits).error();
}
template <class... Members>
Value record(Members... members) {
  Value::Sequence sequence;
  (sequence.push_back(std::move(members)), ...);
  return Value(std::move(sequence));
}
Value integer(std::int64_t n) { return Value(n); }
Value text(std::string s) { return Value(std::move(s)); }
bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

// Fast CDR 1 is Debian 12's, and 2 is Debian 13's. A std::wstring of 1 has four bytes for each wchar_t. ROS 2 writes the same with 2, number by number.
#if FASTCDR_VERSION_MAJOR >= 2
constexpr auto cdr_version = eprosima::fastcdr::CdrVersion::DDS_CDR;
std::size_t length_of(const Cdr& cdr) { return cdr.get_serialized_data_length(); }
using Wide = std::vector<std::uint32_t>;
#else
constexpr auto cdr_version = Cdr::DDS_CDR;
std::size_t length_of(const Cdr& cdr) { return cdr.getSerializedDataLength(); }
using Wide = std::wstring;
#endif
Wide wide(std::initializer_list<std::uint32_t> units) {
  Wide made;
  for (const std::uint32_t unit : units) made.push_back(static_cast<Wide::value_type>(unit));
  return made;
}

/// What Fast CDR writes.
template <class Write>
std::string fast(Write write, Cdr::Endianness order = Cdr::LITTLE_ENDIANNESS) {
  std::string zeros(4'096, '\0');  // Fast CDR leaves padding as it is
  FastBuffer buffer(zeros.data(), zeros.size());
  Cdr cdr(buffer, order, cdr_version);
  cdr.serialize_encapsulation();
  write(cdr);
  return std::string(buffer.getBuffer(), length_of(cdr));
}

std::string payload(std::initializer_list<int> bytes, bool little = true) {
  std::string s{'\0', static_cast<char>(little ? 1 : 0), '\0', '\0'};
  for (int b : bytes) s += static_cast<char>(b);
  return s;
}
std::string fault(const MessageType& type, const std::string& bytes) {
  const Result<Value> made = type.decode(bytes);
  return made ? "decoded" : made.error().message;
}

}  // namespace

TEST_CASE("payloads are those of Fast CDR, in both byte orders", "[ros2]") {
  const MessageType type = type_of(
      "bool a\nint8 b\nint16 c\nuint8 d\nint32 e\nbyte f\nint64 g\nfloat32 h\nfloat64 i\nstring j\nuint8[] k\nfloat64[] l\nint16[3] m\nstring[] n\n"
      "wstring o\nuint64 p\n");
  const Value value =
      record(Value(true), integer(-2), integer(-300), integer(200), integer(-70'000), integer(255), integer(-1'099'511'627'776), Value(1.5),
             Value(-2.25), text("h\xc3\xa4llo"), text("AQID"), record(Value(1.0), Value(2.0)), record(integer(1), integer(-2), integer(3)),
             record(text(""), text("b")), text("w\xc3\xa4\xf0\x9f\xa4\x96"), Value(std::numeric_limits<std::uint64_t>::max()));
  for (const bool little : {true, false}) {
    const std::string theirs = fast(
        [](Cdr& cdr) {
          cdr << true << std::int8_t{-2} << std::int16_t{-300} << std::uint8_t{200} << std::int32_t{-70'000} << std::uint8_t{255}
              << std::int64_t{-1'099'511'627'776} << 1.5F << -2.25 << std::string("h\xc3\xa4llo") << std::vector<std::uint8_t>{1, 2, 3}
              << std::vector<double>{1, 2} << std::array<std::int16_t, 3>{1, -2, 3} << std::vector<std::string>{"", "b"}
              << wide({'w', 0xE4, 0xD83E, 0xDD16}) << std::numeric_limits<std::uint64_t>::max();
        },
        little ? Cdr::LITTLE_ENDIANNESS : Cdr::BIG_ENDIANNESS);
    CHECK(type.encode(value, little).value() == theirs);
    CHECK(rdf::same(type.decode(theirs).value(), value));
  }
  CHECK(type.type().check(value));
}

TEST_CASE("wide strings have four bytes for each UTF-16 code unit", "[ros2]") {
  const MessageType type = type_of("wstring<=3 a\nwstring[<=2] b\nint64 c\n");
  const auto wide = [](std::vector<std::uint32_t> units, std::vector<std::vector<std::uint32_t>> more) {
    return fast([&](Cdr& cdr) {
      cdr << units << static_cast<std::uint32_t>(more.size());  // a sequence of numbers of 32 bits has the same bytes
      for (const auto& m : more) cdr << m;
      cdr << std::int64_t{1};
    });
  };
  const std::string plain = wide({0x61, 0x20AC}, {{}, {0x1F916}});
  const Value value = type.decode(plain).value();
  CHECK(*value.sequence()->at(0).text() == "a\xe2\x82\xac");
  CHECK(*value.sequence()->at(1).sequence()->at(1).text() == "\xf0\x9f\xa4\x96");
  CHECK(type.encode(value).value() == wide({0x61, 0x20AC}, {{}, {0xD83E, 0xDD16}}));  // as ROS writes it: two units
  for (const char* edge :
       {"\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "\xed\x9f\xbf", "\xee\x80\x80", "\xef\xbf\xbf"}) {  // U+10000, U+10FFFF, U+D7FF, U+E000, U+FFFF
    const Value at = record(text(edge), record(), integer(0));
    CHECK(rdf::same(type.decode(type.encode(at).value()).value(), at));
  }
  // Surrogates alone, numbers that are no character, U+0000.
  for (const std::uint32_t unit : {0xD800U, 0xDFFFU, 0x110000U, 0xFFFFFFFFU, 0U}) {
    CHECK(*type.decode(wide({unit}, {})).value().sequence()->at(0).text() == "\xef\xbf\xbd");
    MessageOptions strict;
    strict.replace_invalid_text = false;
    CHECK(contains(fault(type_of("wstring<=3 a\nwstring[<=2] b\nint64 c\n", strict), wide({unit}, {})), "UTF-16"));
  }
  CHECK(*type.decode(wide({0xDD16, 0xD83E}, {})).value().sequence()->at(0).text() == "\xef\xbf\xbd\xef\xbf\xbd");
  CHECK(contains(fault(type, wide({1, 2, 3, 4}, {})), "at most 3"));
  CHECK(contains(fault(type, wide({1}, {{}, {}, {}})), "at most 2 members"));
  CHECK(type.encode(record(text("\xf0\x9f\xa4\x96"), record(), integer(0))));  // two units
  CHECK(type.encode(record(text("\xf0\x9f\xa4\x96\xf0\x9f\xa4\x96"), record(), integer(0))).error().code == Errc::out_of_range);
}

TEST_CASE("an empty message has one byte", "[ros2]") {
  const MessageType type = shipped("std_msgs/msg/Empty");
  CHECK(type.encode(record()).value() == payload({0}));
  CHECK(type.initial() == payload({0}));
  CHECK(type.decode(payload({0})).value().sequence()->empty());
  CHECK(type.decode(payload({0, 0, 0, 0})));
  CHECK_FALSE(type.decode(payload({})));
}

TEST_CASE("defaults of a definition are those of what is left out", "[ros2]") {
  MessageOptions options;
  options.field = [](const Message&, const Field& field, std::string_view, FieldOptions& says) {
    says.left_out = field.name == "a" || field.name == "c";
  };
  const std::string definition =
      "int32 a 7\nint32 b 8\nstring c \"x\"\nuint8[3] d [1, 2, 3]\nwstring[2] e [\"a\", \"b\"]\nfloat32[<=3] f [0.5]\nTime g\n";
  Definitions known;
  known.add_text("demo/msg/Time", "int32 sec 3\n").value();
  known.add_text("demo/msg/Thing", definition).value();
  const MessageType type = MessageType::of(known.message("demo/msg/Thing").value(), options).value();
  const std::string all = fast([](Cdr& cdr) {
    cdr << std::int32_t{7} << std::int32_t{8} << std::string("x") << std::array<std::uint8_t, 3>{1, 2, 3} << wide({'a'}) << wide({'b'})
        << std::vector<float>{0.5F} << std::int32_t{3};
  });
  CHECK(type.initial() == all);
  const Value value = type.decode(all).value();
  CHECK(value.sequence()->size() == 5);
  CHECK(*value.sequence()->at(1).text() == "AQID");
  CHECK(type.encode(value).value() == all);
  // A client may leave out a field with a default, and no other one.
  const rdf::Type& described = *type.type();
  CHECK(*described.fields.at(0).absent->integer() == 8);
  CHECK(*described.fields.at(1).absent->text() == "AQID");
  CHECK(described.fields.at(3).absent);
  CHECK_FALSE(described.fields.at(4).absent);
  CHECK(*described.fields.at(4).type->fields.at(0).absent->integer() == 3);
}

TEST_CASE("a default outside of the bounds of the host is none", "[ros2]") {
  MessageOptions options;
  options.field = [](const Message&, const Field&, std::string_view, FieldOptions& says) { says.facets.at_least(1); };
  CHECK_FALSE(type_of("int32 a 0\n", options).type()->fields.at(0).absent);
  CHECK(type_of("int32 a 1\n", options).type()->fields.at(0).absent);
}

TEST_CASE("times are instants and durations", "[ros2]") {
  const MessageType type = type_of("builtin_interfaces/Time a\nbuiltin_interfaces/Duration[] b\nstd_msgs/Header h\n");
  const std::string bytes = fast([](Cdr& cdr) {
    cdr << std::int32_t{-1} << std::uint32_t{999'999'999} << std::uint32_t{2} << std::int32_t{1} << std::uint32_t{5} << std::int32_t{-2}
        << std::uint32_t{0} << std::int32_t{1'700'000'000} << std::uint32_t{123} << std::string("base");
  });
  const Value value = type.decode(bytes).value();
  CHECK(*value.sequence()->at(0).integer() == -1);
  CHECK(*value.sequence()->at(1).sequence()->at(0).integer() == 1'000'000'005);
  CHECK(*value.sequence()->at(1).sequence()->at(1).integer() == -2'000'000'000);
  CHECK(type.encode(value).value() == bytes);
  CHECK(type.type()->fields[0].type->kind == rdf::Type::Kind::instant);
  CHECK(type.type()->fields[1].type->element->kind == rdf::Type::Kind::duration);
  const auto stamp = type.time(bytes, type.place("h.stamp").value());
  REQUIRE(stamp);
  CHECK(stamp->time_since_epoch() == std::chrono::nanoseconds(1'700'000'000'000'000'123));
  for (const std::int64_t t :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(), (std::int64_t{1} << 31U) * 1'000'000'000})
    CHECK(type.encode(record(integer(t), record(), record(integer(0), text("")))).error().code == Errc::out_of_range);
  MessageOptions bits;
  bits.times = false;
  CHECK(type_of("builtin_interfaces/Time a\n", bits).type()->fields[0].type->kind == rdf::Type::Kind::record);
  // A message of that name with another structure is none.
  Definitions known;
  known.add_text("builtin_interfaces/msg/Time", "int64 nanoseconds\n").value();
  CHECK(MessageType::of(known.message("builtin_interfaces/msg/Time").value()));
  known.add_text("demo/msg/Thing", "builtin_interfaces/Time a\n").value();
  CHECK(MessageType::of(known.message("demo/msg/Thing").value()).value().type()->fields[0].type->kind == rdf::Type::Kind::record);
}

TEST_CASE("constants name the numbers of a field where that is beyond doubt", "[ros2]") {
  const auto names = [](const char* type, const char* field) {
    const MessagePtr message = Definitions().message(type).value();
    for (const Field& f : message->fields)
      if (f.name == field) {
        std::string joined;
        for (const Enumerator& e : MessageOptions::of_constants(*message, f)) joined += e.name + "=" + std::to_string(e.number) + " ";
        return joined;
      }
    return std::string("no such field");
  };
  CHECK(names("diagnostic_msgs/msg/DiagnosticStatus", "level") == "OK=0 WARN=1 ERROR=2 STALE=3 ");
  CHECK(names("sensor_msgs/msg/BatteryState", "power_supply_status") == "UNKNOWN=0 CHARGING=1 DISCHARGING=2 NOT_CHARGING=3 FULL=4 ");
  CHECK(contains(names("sensor_msgs/msg/BatteryState", "power_supply_health"), "GOOD=1 "));
  CHECK(names("sensor_msgs/msg/NavSatStatus", "status") == "UNKNOWN=-2 NO_FIX=-1 FIX=0 SBAS_FIX=1 GBAS_FIX=2 ");
  CHECK(names("sensor_msgs/msg/NavSatStatus", "service").empty());  // bits
  CHECK(names("sensor_msgs/msg/PointField", "datatype") == "INT8=1 UINT8=2 INT16=3 UINT16=4 INT32=5 UINT32=6 FLOAT32=7 FLOAT64=8 ");
  CHECK(names("sensor_msgs/msg/PointField", "count").empty());
  CHECK(names("sensor_msgs/msg/Range", "radiation_type") == "ULTRASOUND=0 INFRARED=1 ");
  CHECK(contains(names("action_msgs/msg/GoalStatus", "status"), "ACCEPTED=1 EXECUTING=2 "));
  CHECK(contains(names("lifecycle_msgs/msg/State", "id"), "PRIMARY_STATE_ACTIVE=3 "));
  CHECK(names("shape_msgs/msg/SolidPrimitive", "type").find("BOX_X") == std::string::npos);
  CHECK(names("visualization_msgs/msg/Marker", "action").empty());  // constants of three fields
  CHECK(names("std_msgs/msg/Int32", "data").empty());
  const auto of = [](std::string_view definition, std::size_t field) {
    Definitions known;
    known.add_text("demo/msg/Thing", definition).value();
    const MessagePtr message = known.message("demo/msg/Thing").value();
    std::string joined;
    for (const Enumerator& e : MessageOptions::of_constants(*message, message->fields.at(field)))
      joined += e.name + "=" + std::to_string(e.number) + " ";
    return joined;
  };
  CHECK(of("uint8 A=0\nuint8 B=1\nuint8 C=2\nuint8 x\n", 0) == "A=0 B=1 C=2 ");
  CHECK(of("uint8 A=0\nuint8 B=1\nuint8 C=2\nuint8 D=4\nuint8 x\n", 0).empty());  // bits
  CHECK(of("uint8 A=1\nuint8 B=2\nuint8 x\n", 0).empty());                        // bits, perhaps
  CHECK(of("uint8 A=1\nuint8 B=2\nuint8 C=3\nuint8 x\n", 0) == "A=1 B=2 C=3 ");
  CHECK(of("uint8 A=1\nuint8 x\n", 0).empty());                        // one name is no choice
  CHECK(of("uint8 A=1\nuint8 B=1\nuint8 C=3\nuint8 x\n", 0).empty());  // two names of one number
  CHECK(of("uint8 A=0\nuint8 B=1\nuint8 x\nuint8 y\n", 0).empty());    // of which field?
  CHECK(of("uint8 A=0\nuint16 B=1\nuint8 x\n", 0).empty());            // of another type
  const char* const two = "int8 STATE_CODE_A=0\nint8 STATE_CODE_B=1\nint8 STATE_ON=5\nint8 STATE_OFF=6\nint8 state\nint8 state_code\n";
  CHECK(of(two, 0) == "ON=5 OFF=6 ");  // the longest name of a field counts
  CHECK(of(two, 1) == "A=0 B=1 ");
  CHECK(of("uint8 MODE_2D=0\nuint8 MODE_3D=1\nuint8 mode\n", 0) == "MODE_2D=0 MODE_3D=1 ");  // no name begins with a digit
}

TEST_CASE("an enumeration has a name for each number", "[ros2]") {
  MessageOptions options;
  options.field = [](const Message& in, const Field& field, std::string_view, FieldOptions& says) {
    says.enumerators = MessageOptions::of_constants(in, field);
  };
  const MessageType type = type_of("int8 MODE_OFF=-1\nint8 MODE_SLOW=1\nint8 MODE_FAST=2\nint8 mode -1\nint8[] modes\n", options);
  CHECK(*type.decode(payload({1, 0, 0, 0, 0, 0, 0, 0})).value().sequence()->at(0).text() == "SLOW");
  CHECK(*type.decode(payload({0xFF, 0, 0, 0, 0, 0, 0, 0})).value().sequence()->at(0).text() == "OFF");
  CHECK(*type.decode(payload({7, 0, 0, 0, 0, 0, 0, 0})).value().sequence()->at(0).text() == "other");
  CHECK(type.type().check(type.decode(payload({7, 0, 0, 0, 0, 0, 0, 0})).value()));
  CHECK(type.encode(record(text("FAST"), record())).value() == payload({2, 0, 0, 0, 0, 0, 0, 0}));
  CHECK(type.encode(record(text("other"), record())).error().code == Errc::expected_value);
  CHECK(*type.type()->fields[0].absent->text() == "OFF");
  options.field = [](const Message&, const Field&, std::string_view, FieldOptions& says) { says.enumerators = {{"other", 1}, {"B", 2}}; };
  const MessageType list = type_of("uint8[] modes\n", options);  // names, not bytes
  const Value value = list.decode(payload({3, 0, 0, 0, 1, 2, 9})).value();
  CHECK(*value.sequence()->at(0).sequence()->at(2).text() == "other_number");
  CHECK(list.type().check(value));
  CHECK(contains(error_of("float32 a\n", options).message, "only integers"));
  options.field = [](const Message&, const Field&, std::string_view, FieldOptions& says) { says.enumerators = {{"A", 1}, {"B", 300}}; };
  CHECK(contains(error_of("uint8 a\n", options).message, "cannot have the number"));
  options.field = [](const Message&, const Field&, std::string_view, FieldOptions& says) { says.enumerators = {{"A", 1}, {"B", 1}}; };
  CHECK(contains(error_of("uint8 a\n", options).message, "two enumerators"));
}

TEST_CASE("what the host says of a field is in the type", "[ros2]") {
  MessageOptions options;
  std::vector<std::string> paths;
  options.field = [&](const Message&, const Field& field, std::string_view path, FieldOptions& says) {
    paths.emplace_back(path);
    if (field.name == "x") says.facets.unit(unit::metre_per_second), says.name = "forward";
    if (field.name == "angular") says.read_only = true;
  };
  options.name = [](const Message&, std::string_view path) { return path.empty() ? "Drive" : "Drive." + std::string(path); };
  options.classes = [](const Message&, std::string_view path) {
    return path.empty() ? std::vector<Iri>{Iri("http://example.org/Drive")} : std::vector<Iri>();
  };
  const MessageType type = shipped("geometry_msgs/msg/Twist", options);
  CHECK(paths == std::vector<std::string>{"linear", "linear.x", "linear.y", "linear.z", "angular", "angular.x", "angular.y", "angular.z"});
  const rdf::Type& t = *type.type();
  CHECK(t.name == "Drive");
  CHECK(t.classes.at(0) == "http://example.org/Drive");
  CHECK(t.fields[1].read_only);
  CHECK(t.fields[0].type->fields[0].name == "forward");
  CHECK(t.fields[0].type->fields[0].facets.unit() == unit::metre_per_second);
  CHECK(t.fields[0].type->name == "Drive.linear");
}

TEST_CASE("bounds of bytes and texts are in the type", "[ros2]") {
  const rdf::Type& t = *type_of("uint8[16] a\nbyte[<=4] b\nstring<=5 c\nuint8[] d\nint8[2] e\nint8[<=2] f\n").type();
  CHECK(t.fields[0].facets.min_length() == 16);
  CHECK(t.fields[0].facets.max_length() == 16);
  CHECK(t.fields[1].facets.max_length() == 4);
  CHECK(t.fields[2].facets.max_length() == 5);
  CHECK(t.fields[3].type->is_bytes());
  CHECK(t.fields[4].type->shortest == 2);
  CHECK(t.fields[5].type->longest == 2);
}

TEST_CASE("a broken payload is refused with the place", "[ros2]") {
  const MessageType type = type_of("bool a\nstring b\nstd_msgs/String[] c\nint8[<=2] d\n");
  const std::string good = fast([](Cdr& cdr) {
    cdr << true << std::string("b") << std::uint32_t{2} << std::string("x") << std::string("y") << std::vector<std::int8_t>{1, 2};
  });
  REQUIRE(type.decode(good));
  for (std::size_t n = 0; n < good.size(); ++n) {
    CAPTURE(n);
    CHECK_FALSE(type.decode(good.substr(0, n)));
  }
  CHECK(type.decode(good + std::string(3, '\0')));  // padding
  CHECK(contains(fault(type, good + std::string(4, '\0')), "another version"));
  CHECK(contains(fault(type, payload({2, 0, 0, 0})), "\"a\": expected 0 or 1"));
  CHECK(contains(fault(type, payload({1, 0, 0, 0, 2, 0, 0, 0, 'b', 'c'})), "does not end with 0"));
  CHECK(contains(fault(type, payload({1, 0, 0, 0, 255, 255, 255, 255, 'b', 0})), "4294967295 bytes of a text"));
  CHECK(contains(fault(type, payload({1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 127, 0, 0, 0, 0})), "\"c\": the payload ends before"));
  std::string broken = good;
  broken[broken.size() - 2 - 4] = 3;  // the length of d
  CHECK(contains(fault(type, broken), "at most 2 members"));
  for (const int id : {2, 3, 6, 7, 8, 255}) {  // parameter lists, XCDR2
    std::string other = good;
    other[1] = static_cast<char>(id);
    CHECK(contains(fault(type, other), "encapsulation"));
  }
  CHECK(contains(fault(type, ""), "encapsulation"));
  const MessageType nested = type_of("std_msgs/Header[] h\n");
  CHECK(contains(fault(nested, payload({1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 'a', 'b'})), "\"h[0].frame_id\""));
}

TEST_CASE("texts that are not UTF-8 are repaired, or no value", "[ros2]") {
  const std::string bytes = payload({5, 0, 0, 0, 'a', 0xFF, 0, 'b', 0});
  const Value value = type_of("string a\n").decode(bytes).value();
  CHECK(*value.sequence()->at(0).text() ==
        "a\xef\xbf\xbd\xef\xbf\xbd"
        "b");
  CHECK(type_of("string a\n").type().check(value));
  MessageOptions strict;
  strict.replace_invalid_text = false;
  CHECK(contains(fault(type_of("string a\n", strict), bytes), "UTF-8"));
  CHECK(type_of("string a\n").decode(payload({0, 0, 0, 0})).value().sequence()->at(0).text()->empty());
}

TEST_CASE("a lying length needs no memory", "[ros2]") {
  // Each states 2^32 - 1 members; the payload is short.
  for (const char* definition : {"bool[] a\n", "float64[] a\n", "string[] a\n", "wstring[] a\n", "std_msgs/Empty[] a\n", "std_msgs/Header[] a\n",
                                 "uint8[] a\n", "wstring a\n", "string a\n", "builtin_interfaces/Time[] a\n"}) {
    CAPTURE(definition);
    CHECK_FALSE(type_of(definition).decode(payload({255, 255, 255, 255, 0, 0, 0, 0, 0, 0, 0, 0})));
  }
  CodecLimits limits;
  limits.max_values = 10;
  limits.max_bytes = 64;
  CHECK(type_of("bool[] a\n", {}, limits).decode(payload({10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})));
  CHECK(type_of("bool[] a\n", {}, limits).decode(payload({11, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})).error().code == Errc::limit_exceeded);
  CHECK(type_of("string a\n", {}, limits).decode(payload({1, 0, 0, 0, 0}) + std::string(100, ' ')).error().code == Errc::limit_exceeded);
  CHECK(type_of("string a\n", {}, limits).encode(record(text(std::string(64, 'x')))).error().code == Errc::limit_exceeded);
  CHECK(error_of("uint8[65] a\n", {}, limits).code == Errc::limit_exceeded);
  CHECK(error_of("float64[4294967295] a\n").code == Errc::limit_exceeded);
}

TEST_CASE("what is not of the type cannot be encoded", "[ros2]") {
  const MessageType type = type_of("bool a\nint8 b\nuint8 c\nuint64 d\nfloat32 e\nstring<=3 f\nuint8[2] g\nint16[<=2] h\n");
  const auto value = [] { return Value::Sequence{Value(true), integer(0), integer(0), integer(0), Value(0.0), text(""), text("AAA="), record()}; };
  REQUIRE(type.encode(Value(value())));
  const auto with = [&](std::size_t i, Value v) {
    Value::Sequence s = value();
    s[i] = std::move(v);
    const auto made = type.encode(Value(std::move(s)));
    return made ? "encoded" : made.error().message;
  };
  CHECK(contains(with(0, integer(1)), "\"a\": expected a boolean"));
  CHECK(contains(with(1, integer(128)), "from -128 to 127"));
  CHECK(contains(with(1, integer(-129)), "from -128 to 127"));
  CHECK(contains(with(2, integer(-1)), "from 0 to 255"));
  CHECK(contains(with(2, Value(std::numeric_limits<std::uint64_t>::max())), "at most 255"));
  CHECK(contains(with(3, integer(-1)), "from 0"));
  CHECK(with(3, Value(std::numeric_limits<std::uint64_t>::max())) == "encoded");
  CHECK(contains(with(4, Value(1e39)), "32 bits"));
  CHECK(with(4, Value(std::numeric_limits<double>::infinity())) == "encoded");
  CHECK(contains(with(5, text("\xc3\xa4\xc3\xa4")), "at most 3 bytes"));
  CHECK(contains(with(5, text(std::string("a\0", 2))), "U+0000"));
  CHECK(contains(with(6, text("AAAA")), "2 members"));
  CHECK(contains(with(6, text("A*A=")), "base64"));
  CHECK(contains(with(6, text("AAA")), "base64"));
  CHECK(contains(with(6, text("AA==AAA=")), "base64"));
  CHECK(contains(with(7, record(integer(1), integer(1), integer(1))), "at most 2"));
  CHECK(contains(with(7, record(integer(1), text("x"))), "\"h[1]\""));
  CHECK(contains(with(7, Value()), "expected a list"));
  CHECK_FALSE(type.encode(record()));
  CHECK_FALSE(type.encode(Value()));
}

TEST_CASE("numbers come back bit for bit", "[ros2]") {
  const MessageType singles = type_of("float32 a\n"), doubles = type_of("float64 a\n");
  for (const std::uint32_t bits : {0U, 0x80000000U, 1U, 0x7F7FFFFFU, 0x7F800000U, 0xFF800000U, 0x7FC00000U, 0x7F800001U, 0xFFABCDEFU}) {
    std::string bytes = payload({});
    for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>(bits >> (8 * i));
    CHECK(singles.encode(singles.decode(bytes).value()).value() == bytes);
  }
  for (const unsigned long long bits : {0x7FF0000000000001ULL, 0xFFF8000000000000ULL, 1ULL, 0x8000000000000000ULL}) {
    std::string bytes = payload({});
    for (unsigned i = 0; i < 8; ++i) bytes += static_cast<char>(bits >> (8 * i));
    CHECK(doubles.encode(doubles.decode(bytes).value()).value() == bytes);
  }
}

TEST_CASE("a place is found without decoding the rest", "[ros2]") {
  const MessageType image = shipped("sensor_msgs/msg/Image");
  for (const Cdr::Endianness order : {Cdr::LITTLE_ENDIANNESS, Cdr::BIG_ENDIANNESS}) {
    const std::string bytes = fast(
        [](Cdr& cdr) {
          cdr << std::int32_t{1} << std::uint32_t{2} << std::string("camera") << std::uint32_t{480} << std::uint32_t{640} << std::string("rgb8")
              << false << std::uint32_t{1920} << std::vector<std::uint8_t>{9, 8, 7};
        },
        order);
    CHECK(image.integer(bytes, image.place("height").value()) == 480);
    CHECK(image.number(bytes, image.place("width").value()) == 640.0);
    CHECK(image.text(bytes, image.place("encoding").value()) == "rgb8");
    CHECK(image.text(bytes, image.place("header.frame_id").value()) == "camera");
    CHECK(image.time(bytes, image.place("header.stamp").value())->time_since_epoch() == std::chrono::nanoseconds(1'000'000'002));
    const auto data = image.find(bytes, image.place("data").value());
    REQUIRE(data);
    CHECK(data->bytes == "\x09\x08\x07");
    CHECK(data->count == 3);
    CHECK(data->little_endian == (order == Cdr::LITTLE_ENDIANNESS));
    for (std::size_t n = 0; n < bytes.size(); ++n) CHECK_FALSE(image.find(std::string_view(bytes).substr(0, n), image.place("data").value()));
  }
  CHECK_FALSE(image.find("", image.place("data").value()));
  CHECK(image.place("header.nothing").error().code == Errc::unknown_path);
  CHECK(image.place("width.x").error().code == Errc::unknown_path);
  CHECK(image.place("").error().code == Errc::unknown_path);
  CHECK_FALSE(image.find(image.initial(), image.place("header").value()));
  CHECK_FALSE(image.time(image.initial(), image.place("width").value()));
  CHECK_FALSE(image.text(image.initial(), image.place("width").value()));
  const MessageType cloud = shipped("sensor_msgs/msg/PointCloud2");
  CHECK(cloud.place("fields.name").error().code == Errc::unknown_path);  // in a list
  const std::string initial = cloud.initial();
  CHECK(cloud.find(initial, cloud.place("data").value())->count == 0);
  CHECK(cloud.integer(initial, cloud.place("is_dense").value()) == 0);
  const MessageType odometry = shipped("nav_msgs/msg/Odometry");
  const auto covariance = odometry.find(odometry.initial(), odometry.place("pose.covariance").value());
  REQUIRE(covariance);
  CHECK(covariance->count == 36);
  CHECK(covariance->bytes.size() == 288);
  CHECK(odometry.number(odometry.initial(), odometry.place("pose.pose.orientation.w").value()) == 1.0);  // its default
}
