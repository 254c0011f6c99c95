// SPDX-License-Identifier: Apache-2.0
// Messages as values of a server.
#include <lrt/ros2/message_type.hpp>

#include <cstddef>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/ros2/definitions.hpp>
#include <lrt/thing.hpp>

#include "src/ros2/types/names.hpp"
#include "src/ros2/types/shipped.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;
using namespace lrt::test;
using Value = rdf::Value;

namespace {

std::string json(Bench& bench, const std::string& path) { return bench.ask("GET " + path + "\nAccept: application/json").body; }
Answer put(Bench& bench, const std::string& path, const std::string& body) {
  return bench.ask("PUT " + path + "\nContent-Type: application/json\n\n" + body);
}

/// All names of shipped types.
std::vector<std::string> shipped_names() {
  std::vector<std::string> names;
  const std::string_view all = shipped_definitions();
  for (std::size_t at = 0; (at = all.find("=== ", at)) != std::string_view::npos; ++at) {
    const std::string_view name = all.substr(at + 4, all.find('\n', at) - at - 4);
    if (is_type_name(name)) names.emplace_back(name);
  }
  return names;
}

MessageOptions with_enumerators() {
  MessageOptions options;
  options.field = [](const Message& in, const Field& field, std::string_view, FieldOptions& says) {
    says.enumerators = MessageOptions::of_constants(in, field);
  };
  return options;
}

/// A writable property of a message, whose payload is kept.
struct ServedMessage {
  Bench bench;
  MessageType type;
  std::string payload;

  explicit ServedMessage(MessageType of) : type(std::move(of)), payload(type.initial()) {
    Thing thing{"robot"};
    thing.property("value", type.type(), [this] { return type.decode(payload); }).on_write([this](const Value& v) -> Result<void> {
      Result<std::string> made = type.encode(v);
      if (!made) return Unexpected{std::move(made).error()};
      payload = std::move(*made);
      return {};
    });
    bench.engine.add(std::move(thing)).value();
  }
};

MessageType type_of(std::string_view text, const MessageOptions& options = {}) {
  Definitions known;
  known.add_text("demo/msg/Thing", text).value();
  return MessageType::of(known.message("demo/msg/Thing").value(), options).value();
}

}  // namespace

TEST_CASE("each shipped message is a value of one server, in each representation", "[ros2]") {
  Definitions known;
  Bench bench;
  const MessageOptions options = with_enumerators();
  std::vector<std::unique_ptr<MessageType>> types;
  std::size_t count = 0;
  const auto serve = [&](const std::string& name) {
    CAPTURE(name);
    const auto message = known.message(name);
    REQUIRE(message);
    types.push_back(std::make_unique<MessageType>(MessageType::of(*message, options).value()));
    const MessageType& type = *types.back();
    Thing thing{"m" + std::to_string(count)};
    thing.property("value", type.type(), [&type] { return type.decode(type.initial()); }).on_write([](const Value&) {});
    const Result<void> added = bench.engine.add(std::move(thing));
    if (!added) FAIL(added.error().message);
    const std::string path = "/m" + std::to_string(count++) + "/value";
    const std::string value = json(bench, path);
    CHECK(bench.ask("GET " + path + "\nAccept: text/turtle").status == 200);
    CHECK(bench.ask("GET " + path + "\nAccept: application/cbor").status == 200);
    // What is read may be written, but for numbers without names.
    const Answer written = put(bench, path, value);
    if (value.find("\"other\"") == std::string::npos) CHECK(written.status == 204);
  };
  for (const std::string& name : shipped_names()) {
    if (name.find("/msg/") != std::string::npos) {
      if (known.message(name)) serve(name);
      continue;
    }
    const bool is_srv = name.find("/srv/") != std::string::npos;
    for (const char* part : is_srv ? std::vector<const char*>{"_Request", "_Response"} : std::vector<const char*>{"_Goal", "_Result", "_Feedback"})
      serve(name + part);
  }
  CHECK(count > 180);
}

TEST_CASE("a client writes a message as JSON, and gets it back", "[ros2]") {
  MessageOptions options = with_enumerators();
  ServedMessage served(
      type_of("uint8 MODE_OFF=0\nuint8 MODE_SLOW=1\nuint8 MODE_FAST=2\nuint8 mode 1\nfloat64 speed\nstring<=3 name \"abc\"\nuint8[2] key [1, 2]\n"
              "builtin_interfaces/Duration life\nint16[<=2] list\nwstring wide\nuint64 large\nbool on true\n",
              options));
  Bench& bench = served.bench;
  const std::string all =
      R"({"mode":"FAST","speed":1.5,"name":"xy","key":"AQI=","life":"PT2.5S","list":[1,-2],"wide":"wä","large":18446744073709551615,"on":false})";
  const Answer first = put(bench, "/robot/value", all);
  INFO(first.body);
  REQUIRE(first.status == 204);
  CHECK(json(bench, "/robot/value") == all);
  // What has a default may be left out.
  REQUIRE(put(bench, "/robot/value", R"({"speed":2.5,"life":"PT0S","list":[],"wide":"","large":0})").status == 204);
  const std::string less = json(bench, "/robot/value");
  CHECK(less.find(R"("mode":"SLOW")") != std::string::npos);
  CHECK(less.find(R"("name":"abc","key":"AQI=")") != std::string::npos);
  CHECK(less.find(R"("on":true)") != std::string::npos);
  CHECK(put(bench, "/robot/value", "{}").status == 422);
  // Bounds, by the shape or by the wire.
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string body = all;
    body.replace(body.find(from), from.size(), to);
    return put(bench, "/robot/value", body).status;
  };
  CHECK(refused("\"FAST\"", "\"other\"") == 422);
  CHECK(refused("\"FAST\"", "\"NONE\"") == 422);
  CHECK(refused("\"xy\"", "\"abcd\"") == 422);
  CHECK(refused("\"xy\"", "\"äöü\"") == 409);  // three letters, six bytes
  CHECK(refused("AQI=", "AQ==") == 422);
  CHECK(refused("[1,-2]", "[1,2,3]") == 422);
  CHECK(refused("[1,-2]", "[40000]") == 422);
  CHECK(refused("PT2.5S", "P100000D") == 409);  // more seconds than 32 bits
}

TEST_CASE("broken payloads of each shipped message are refused, or are values of its type", "[ros2]") {
  Definitions known;
  std::mt19937 random(43);
  std::size_t values = 0, refused = 0;
  for (const std::string& name : shipped_names()) {
    const auto message = known.message(name);
    if (!message) continue;
    CAPTURE(name);
    const MessageType type = MessageType::of(*message, with_enumerators()).value();
    const std::string good = type.initial();
    REQUIRE(type.decode(good));
    const auto attempt = [&](const std::string& payload) {
      const Result<Value> value = type.decode(payload);
      if (value) CHECK(type.type().check(*value));
      ++(value ? values : refused);
    };
    for (int i = 0; i < 60; ++i) {
      std::string broken = good;
      const std::size_t at = random() % broken.size();
      switch (i % 4) {
        case 0: broken.resize(at); break;
        case 1: broken[at] = static_cast<char>(random()); break;
        case 2: broken.insert(at, 1 + random() % 40, static_cast<char>(random() % 3)); break;
        default:
          for (std::size_t n = 0; n < 4 && at + n < broken.size(); ++n) broken[at + n] = '\xff';  // a length
      }
      attempt(broken);
    }
  }
  CHECK(values > 1'000);
  CHECK(refused > 1'000);
}

TEST_CASE("a payload that is no value is answered with its fault", "[ros2]") {
  ServedMessage served(type_of("string text\n"));
  served.payload = "\0\1\0\0\5";
  const Answer answer = served.bench.ask("GET /robot/value\nAccept: application/json");
  CHECK(answer.status == 500);
}
