// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/message.hpp"

#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::mqtt;

namespace {

const std::chrono::system_clock::time_point noon{std::chrono::seconds(1'700'000'000)};
const engine::Meaning angle{"http://qudt.org/vocab/unit/RAD", "http://www.w3.org/2001/XMLSchema#double", "http://robot/base"};

OutMessage said(const std::string& body, const Publication& how, const Said& what) {
  OutMessage message;
  say(message, std::make_shared<const std::string>(body), how, what);
  return message;
}

}  // namespace

TEST_CASE("a value is sent with its sequence, time, unit, datatype and frame", "[mqtt][meaning]") {
  const OutMessage message = said("1.5", Publication(), {7, noon, angle});
  CHECK(*message.payload == "1.5");
  CHECK(message.content_type == "application/json");
  CHECK(message.is_utf8);
  const UserProperties expected = {
      {"seq", "7"}, {"time", "2023-11-14T22:13:20.000000Z"}, {"unit", angle.unit}, {"datatype", angle.datatype}, {"frame", angle.frame}};
  CHECK(message.user == expected);
}

TEST_CASE("what is not known of a value is not said", "[mqtt][meaning]") {
  const engine::Meaning none;
  const UserProperties expected = {{"seq", "1"}};
  CHECK(said("true", Publication(), {1, {}, none}).user == expected);
  Publication json;
  json.form = Form::with_meaning;
  CHECK(*said("true", json, {1, {}, none}).payload == R"({"value":true,"seq":1})");
}

TEST_CASE("clients of MQTT 3.1.1 get the same in JSON on request", "[mqtt][meaning]") {
  Publication json;
  json.form = Form::with_meaning;
  const OutMessage message = said(R"({"x":1})", json, {7, noon, angle});
  CHECK(*message.payload == R"({"value":{"x":1},"seq":7,"time":"2023-11-14T22:13:20.000000Z","unit":"http://qudt.org/vocab/unit/RAD",)"
                            R"("datatype":"http://www.w3.org/2001/XMLSchema#double","frame":"http://robot/base"})");
  CHECK(message.user == UserProperties{{"seq", "7"}});
  const engine::Meaning quoted{"a\"b", {}, {}};
  CHECK(*said("1", json, {1, {}, quoted}).payload == R"({"value":1,"seq":1,"unit":"a\"b"})");
}

TEST_CASE("only texts are said to be texts", "[mqtt][meaning]") {
  for (const char* const text : {"application/json", "application/ld+json", "text/turtle", "text/plain; charset=utf-8", "application/rdf+xml",
                                 "application/n-triples", "application/trig", "application/json; profile=x"})
    CHECK(is_utf8(text));
  for (const char* const bytes : {"application/cbor", "application/octet-stream", "image/jpeg", "text/plain; charset=iso-8859-1", "", "json"})
    CHECK_FALSE(is_utf8(bytes));
  CHECK(is_json("application/ld+json; profile=x"));
  CHECK_FALSE(is_json("application/cbor"));
}

TEST_CASE("the size of a message counts its topic and properties", "[mqtt][newest]") {
  OutMessage message = said("1", Publication(), {1, noon, angle});
  const std::size_t before = wire_bytes(message);
  CHECK(before > 150);
  message.topic = std::string(100, 't');
  CHECK(wire_bytes(message) == before + 100);
}

TEST_CASE("a number of the defaults takes as many bytes as docs/mqtt.md calculates with", "[mqtt][defaults]") {
  const engine::Meaning meaning{angle.unit, angle.datatype, {}};
  const OutMessage message = said("-1.5707963267948966", default_publications().front(), {1'234, noon, meaning});
  CHECK(wire_bytes(message) > 180);
  CHECK(wire_bytes(message) < 200);
}
