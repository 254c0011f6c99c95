// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/plain.hpp"

#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Robot {
  Robot() {
    bench.add(robot.arm());
    bench.add(robot.tool());
  }
  Answer get(const std::string& path, const std::string& accept) { return bench.ask("GET " + path + "\nAccept: " + accept); }
  Answer send(const std::string& method, const std::string& path, const std::string& type, const std::string& body, const std::string& fields = {}) {
    return bench.ask(method + " " + path + "\nContent-Type: " + type + "\n" + fields + "\n" + body);
  }
  Answer json(const std::string& name, const std::string& body) { return send("PUT", "/arm/" + name, "application/json", body); }
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("a property has its bare value in JSON, text and CBOR", "[engine][R1.2]") {
  Robot r;
  r.robot.angle_handle->publish(43.6);
  CHECK(r.get("/arm/angle", "application/json").body == "43.6");
  CHECK(r.get("/arm/angle", "text/plain").body == "43.6");
  CHECK(r.get("/arm/angle", "application/cbor").body == std::string("\xFB\x40\x45\xCC\xCC\xCC\xCC\xCC\xCD"));
  CHECK(r.get("/arm/angle", "application/json;profile=\"https://w3id.org/lrt/ns#withUnits\"").body == R"({"value":43.6,"unit":"deg"})");
  CHECK(r.get("/arm/speed", "application/json").body == "1.5");
  CHECK(r.get("/arm/count", "text/plain").body == "7");
  CHECK(r.get("/arm/name", "application/json").body == "\"arm 1\"");
  CHECK(r.get("/arm/name", "text/plain").body == "arm 1");
  CHECK(r.get("/arm/mode", "text/plain").body == "idle");
  CHECK(r.get("/arm/gains", "application/json").body == "[1,2.5]");
  CHECK(r.get("/arm/pose", "application/json").body == R"({"x":0,"y":0,"frame":"base"})");
  CHECK(r.get("/arm/silent", "application/json").body == "null");
  CHECK(r.get("/arm/silent", "text/plain").body.empty());
}

TEST_CASE("each plain format has its Content-Type and its own ETag, and is an alternate of the others", "[engine][json_ld][R0.11][R1.2]") {
  Robot r;
  std::set<std::string> tags;
  for (const char* type : {"text/turtle", "application/ld+json", "application/json", "text/plain", "application/cbor"}) {
    CAPTURE(type);
    const Answer a = r.get("/arm/count", type);
    CHECK(a.status == 200);
    CHECK(a.field("Content-Type") == (std::string(type) == "text/plain" ? "text/plain; charset=utf-8" : type));
    CHECK(tags.insert(a.tag()).second);
    CHECK(r.bench.ask("GET /arm/count\nAccept: " + std::string(type) + "\nIf-None-Match: " + a.tag()).status == 304);
    CHECK(a.links_to("http://localhost/arm/count?accept=" + std::string(type), "alternate"));
    CHECK(a.field("Link").find("?accept=" + std::string(type) + ">; rel=\"alternate\"; type=\"" + type + "\"") != std::string::npos);
  }
  r.robot.count = 8;
  CHECK_FALSE(r.get("/arm/count", "application/json").tag() == *tags.begin());
}

TEST_CASE("the parameter accept of a target does what Accept does", "[engine][json_ld][R0.17][R1.2]") {
  Robot r;
  CHECK(r.bench.get("/arm/count?accept=text/plain").body == "7");
  CHECK(r.bench.get("/arm/count?accept=text%2Fplain").body == "7");
  CHECK(r.bench.ask("GET /arm/count?accept=application/json\nAccept: text/turtle").field("Content-Type") == "application/json");
  CHECK(r.bench.get("/arm/count?accept=application/ld+json").field("Content-Type") == "application/ld+json");
  CHECK(r.bench.get("/arm/count?accept=image/png").status == 406);
  CHECK(r.bench.get("/arm/count?accept=").field("Content-Type") == "text/turtle");
  CHECK(r.bench.get("/arm?accept=text/html").field("Content-Type") == "text/html; charset=utf-8");
  CHECK(r.bench.ask("GET /arm/count?other=1&accept=text/plain;q=0.1,application/json;q=0.2\nAccept: text/turtle").body == "7");
}

TEST_CASE("a client that accepts anything gets Turtle, and plain values are sent on request", "[engine][json_ld][R1.2]") {
  Robot r;
  for (const char* accept : {"*/*", "text/*", "text/turtle, application/json", "application/json;q=0.9, */*"})
    CHECK(r.get("/arm/count", accept).field("Content-Type") == "text/turtle");
  CHECK(r.get("/arm/count", "application/json, text/plain, */*;q=0.5").field("Content-Type") == "application/json");
  CHECK(r.get("/arm/count", "application/json;q=0.2, text/plain;q=0.3").field("Content-Type") == "text/plain; charset=utf-8");
  CHECK(r.get("/arm/count", "application/json;charset=utf-8").status == 200);
  CHECK(r.get("/arm", "text/plain").status == 406);  // links are no value
  CHECK(r.get("/arm", "text/plain").says("application/ld+json"));
}

TEST_CASE("a thing's state and an invocation are JSON objects", "[engine][R1.2]") {
  Robot r;
  Thing thing{"cell"};
  thing.property(
      "temperature", [] { return 21.5; }, unit::degree_celsius);
  thing.property("doors/left", [] { return true; });
  thing.property<double>("silent");
  thing.action("weigh", [](double) { return 2.5; }).produces(rdf::Facets{}.unit(unit::kilogram));
  r.bench.add(std::move(thing));
  CHECK(r.get("/cell/state", "application/json").body == R"({"temperature":21.5,"doors/left":true})");
  CHECK(r.get("/cell/state", "application/json;profile=\"https://w3id.org/lrt/ns#withUnits\"").body ==
        R"({"temperature":{"value":21.5,"unit":"Cel"},"doors/left":true})");
  const Answer done = r.send("POST", "/cell/actions/weigh", "application/json", "3");
  REQUIRE(done.status == 200);
  const std::string path = done.field("Location").substr(std::string("http://localhost").size());
  CHECK(r.get(path, "application/json").body ==
        R"({"status":"succeeded","progress":1,"created":"2026-11-21T10:38:39Z",)"
        R"("startedAtTime":"2026-11-21T10:38:39Z","endedAtTime":"2026-11-21T10:38:39Z","input":3,"result":2.5})");
}

TEST_CASE("PUT of a plain value does what PUT of its RDF does", "[engine][R0.5]") {
  Robot r;
  CHECK(r.json("angle", "43.6").status == 204);
  CHECK(r.robot.angle == 43.6);
  CHECK(r.json("angle", R"({"value":44.5,"unit":"deg"})").status == 204);
  CHECK(r.robot.angle == 44.5);
  CHECK(r.send("PUT", "/arm/angle", "text/plain", "-45\n").status == 204);
  CHECK(r.robot.angle == -45);
  CHECK(r.send("PUT", "/arm/angle", "text/plain;charset=UTF-8", " 12 ").status == 204);
  CHECK(r.send("PUT", "/arm/angle", "application/cbor", std::string("\xF9\x3C\x00", 3)).status == 204);
  CHECK(r.robot.angle == 1);
  CHECK(r.json("count", "-5").status == 204);
  CHECK(r.robot.count == -5);
  CHECK(r.json("name", "\"new\"").status == 204);
  CHECK(r.robot.name == "new");
  CHECK(r.send("PUT", "/arm/name", "text/plain", "two words\n").status == 204);
  CHECK(r.robot.name == "two words\n");
  CHECK(r.json("mode", "\"active\"").status == 204);
  CHECK(r.robot.mode == Mode::active);
  CHECK(r.json("gains", "[1, 2.5, 3e1]").status == 204);
  CHECK(r.robot.gains == std::vector<double>{1, 2.5, 30});
  CHECK(r.json("pose", R"({"x": 1, "y": {"value": 2.5, "unit": "m"}, "frame": "tool", "tolerance": 0.5})").status == 204);
  CHECK(r.robot.pose.y == 2.5);
  CHECK(r.robot.pose.tolerance == 0.5);
  CHECK(r.json("pose", R"({"x": 1, "y": 2, "frame": "tool"})").status == 204);
  CHECK_FALSE(r.robot.pose.tolerance);
}

TEST_CASE("PUT may echo what GET gave, in every plain format", "[engine][R0.5]") {
  Robot r;
  r.robot.pose.tolerance = 0.25;
  for (const char* path : {"/arm/angle", "/arm/count", "/arm/name", "/arm/mode", "/arm/pose", "/arm/gains"})
    for (const char* type :
         {"application/json", "application/json;profile=\"https://w3id.org/lrt/ns#withUnits\"", "text/plain", "application/cbor"}) {
      CAPTURE(path, type);
      const Answer before = r.get(path, type);
      CHECK(r.send("PUT", path, type, before.body, "If-Match: " + before.tag() + "\n").status == 204);
      CHECK(r.get(path, type).body == before.body);
      CHECK(r.send("PUT", path, type, before.body, "If-Match: \"another\"\n").status == 412);
    }
}

TEST_CASE("a plain value is judged by the same shape, and changes nothing when it does not conform", "[engine][R0.6]") {
  Robot r;
  for (const char* body : {"91", "-90.5", "\"fast\"", "true", "null", "[1]", "1e999", "\"NaN\""}) {
    CAPTURE(body);
    CHECK(r.json("angle", body).status == (std::string(body) == "1e999" ? 400 : 422));
  }
  CHECK(r.robot.angle == 10);
  const Answer report = r.send("PUT", "/arm/angle", "application/json", "91", "Accept: text/turtle\n");
  CHECK(report.status == 422);
  CHECK(missing(report, "[] a sh:ValidationReport ; sh:conforms false .") == "");
  CHECK(report.links_to("http://localhost" + bounds_of(r.bench, "/arm"), std::string(vocab::ldp::constrainedBy.text)));
  CHECK(r.send("PUT", "/arm/angle", "application/json", "91", "Accept: application/json\n").says("90"));
  CHECK(r.send("PUT", "/arm/angle", "text/plain", "fast").status == 422);
  for (const char* body : {"1.5", "2147483648", "7e-1", "1e-400", "7.00000000000000000001"}) CHECK(r.json("count", body).status == 422);
  CHECK(r.json("mode", "\"asleep\"").status == 422);
  CHECK(r.json("pose", R"({"x": 1, "frame": "tool"})").status == 422);
  CHECK(r.robot.count == 7);
  CHECK(r.robot.pose.frame == "base");
}

TEST_CASE("what is no JSON, not of the type or in another unit is refused with its place", "[engine][json_ld][rdf_xml][R0.6]") {
  Robot r;
  const auto refused = [&](const std::string& name, const std::string& body, int status, const std::string& says) {
    const Answer a = r.json(name, body);
    CAPTURE(name, body, a.body);
    CHECK(a.status == status);
    CHECK(a.says(says));
  };
  refused("angle", "", 400, "JSON");
  refused("angle", "43.6 x", 400, "line 1");
  refused("angle", std::string("43.6\0x", 6), 400, "U+0000");
  refused("angle", R"({"value":1,"unit":"rad"})", 422, "deg");
  refused("count", R"({"value":1,"unit":"rad"})", 422, "unit");
  refused("pose", R"({"x":1,"y":2,"frame":"a","speed":3})", 422, "speed");
  refused("pose", R"({"x":1,"x":2,"y":2,"frame":"a"})", 400, "second");
  refused("gains", "[1,{\"a\":2}]", 422, "/1");
  const Answer unknown = r.send("PUT", "/arm/angle", "text/plain;charset=windows-1252", "1");
  CHECK(unknown.status == 415);
  CHECK(unknown.says("utf-8, us-ascii, iso-8859-1"));
  CHECK(unknown.says("windows-1252"));
  CHECK(unknown.has("Accept"));
  CHECK(r.send("PUT", "/arm/angle", "application/cbor", "\x81").status == 400);
  CHECK(r.send("PUT", "/arm/angle", "application/octet-stream", std::string(8, '\0')).status == 415);
  const Answer a = r.send("PUT", "/arm/angle", "application/xml", "1");
  CHECK(a.status == 415);
  CHECK(a.field("Accept") ==
        "text/turtle, application/n-triples, application/rdf+xml, application/ld+json, application/trig, application/n-quads, application/json, "
        "text/plain, application/cbor");
  CHECK(r.robot.angle == 10);
  std::string many = "[0";
  for (int i = 0; i < 10'001; ++i) many += ",0";
  CHECK(r.json("gains", many + "]").status == 413);
}

TEST_CASE("textual bodies are read in the encodings that clients declare", "[engine][json_ld][rdf_xml][R0.6]") {
  Robot r;
  const std::string value = "http://www.w3.org/1999/02/22-rdf-syntax-ns#value", name = "gr\xFC\xDF";  // in ISO-8859-1
  const auto put = [&](const std::string& type, const std::string& body) {
    r.robot.name = "before";
    return r.send("PUT", "/arm/name", type, body).status;
  };
  const auto rdf_xml = [&](const std::string& declaration) {
    return declaration + "<rdf:RDF xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#'><rdf:Description rdf:about=''><rdf:value>" + name +
           "</rdf:value></rdf:Description></rdf:RDF>";
  };
  const std::string subject = "<http://localhost/arm/name> ";
  for (const auto& [type, body] :
       std::vector<std::pair<std::string, std::string>>{{"text/turtle", "<> <" + value + "> \"" + name + "\" ."},
                                                        {"application/n-triples", subject + "<" + value + "> \"" + name + "\" ."},
                                                        {"application/rdf+xml", rdf_xml("")},
                                                        {"application/ld+json", R"({"@id": "", ")" + value + "\": \"" + name + "\"}"},
                                                        {"application/json", "\"" + name + "\""},
                                                        {"text/plain", name}}) {
    CAPTURE(type, body);
    for (const char* charset : {"iso-8859-1", "ISO-8859-1", "\"Latin1\""}) {
      CHECK(put(type + "; charset=" + charset, body) == 204);
      CHECK(r.robot.name == "gr\xC3\xBC\xC3\x9F");
    }
    CHECK(put(type + ";charset=us-ascii", body) == 400);
    CHECK(put(type, body) == 400);
    CHECK(r.robot.name == "before");
    CHECK(put(type + ";charset=utf-16", body) == 415);
  }
  // XML may declare its encoding itself. The parameter has precedence (RFC 7303 3).
  const std::string declared = rdf_xml("<?xml version='1.0' encoding='ISO-8859-1'?>");
  for (const char* type : {"application/rdf+xml", "application/rdf+xml; charset=iso-8859-1"}) {
    CHECK(put(type, declared) == 204);
    CHECK(r.robot.name == "gr\xC3\xBC\xC3\x9F");
  }
  CHECK(put("application/rdf+xml; charset=us-ascii", declared) == 400);
  CHECK(put("application/rdf+xml; charset=utf-8", declared) == 400);
  CHECK(put("application/json; charset=US-ASCII", "\"grey\"") == 204);
  CHECK(r.robot.name == "grey");
  CHECK(put("application/rdf+xml; charset=us-ascii",
            "<?xml version='1.0' encoding='iso-8859-1'?><rdf:RDF xmlns:rdf="
            "'http://www.w3.org/1999/02/22-rdf-syntax-ns#'><rdf:Description rdf:about=''><rdf:value>x</rdf:value></rdf:Description></rdf:RDF>") ==
        204);
  // CBOR is no text: the parameter means nothing.
  CHECK(put("application/cbor; charset=iso-8859-1", "\x63\xE2\x82\xAC") == 204);
  CHECK(r.robot.name == "\xE2\x82\xAC");
}

TEST_CASE("actions and collections take plain values, and respond with them where that is preferred", "[engine][R0.5][R0.8]") {
  Robot r;
  CHECK(r.send("POST", "/arm/actions/turn", "application/json", "90").status == 204);
  CHECK(r.robot.turned_to == 90);
  CHECK(r.send("POST", "/arm/actions/turn", "text/plain", "45").status == 204);
  CHECK(r.send("POST", "/arm/actions/turn", "application/json", R"({"value":360,"unit":"deg"})").status == 422);
  CHECK(r.robot.turned_to == 45);
  for (const char* body : {"{}", "null"}) CHECK(r.send("POST", "/arm/actions/home", "application/json", body).status == 204);
  CHECK(r.send("POST", "/arm/actions/home", "application/json", R"({"fast":true})").status == 422);
  CHECK(r.robot.homed == 2);
  const Answer measured = r.bench.ask("POST /arm/actions/measure\nAccept: application/json");
  CHECK(measured.status == 200);
  CHECK(measured.field("Content-Type") == "application/json");
  CHECK(measured.body == "2.5");
  CHECK(r.bench.ask("POST /arm/actions/measure\nAccept: image/png").field("Content-Type") == "text/turtle");

  const Answer made = r.send("POST", "/arm/waypoints", "application/json", R"({"x":1,"y":2,"frame":"base"})",
                             "Accept: application/json\nPrefer: return=representation\n");
  CHECK(made.status == 201);
  CHECK(made.body == R"({"x":1,"y":2,"frame":"base"})");
  CHECK(r.get(made.field("Location").substr(16), "application/json").body == made.body);
  CHECK(r.bench.ask("OPTIONS /arm/actions/turn").field("Accept-Post").find("application/json") != std::string::npos);
  CHECK(r.bench.ask("OPTIONS /arm/subscriptions").field("Accept-Post").find("application/json") == std::string::npos);
}

TEST_CASE("a user's own shape judges plain values literally", "[engine][R1.11]") {
  Bench bench;
  double value = 1;
  Thing thing{"arm"};
  thing.property("level", [&] { return value; }).on_write([&](double v) { value = v; });
  thing.shapes(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> ."
      "<#level> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:in ( 1e0 2e0 4e0 ) ] .");
  bench.add(std::move(thing));
  CHECK(bench.ask("PUT /arm/level\nContent-Type: application/json\n\n4").status == 422);  // "4" is another term than "4e0"
  CHECK(bench.ask("PUT /arm/level\nContent-Type: application/json\n\n4e0").status == 204);
  CHECK(value == 4);
}

TEST_CASE("plain values are pushed: JSON as text, CBOR as binary messages", "[engine][R0.12][R0.17]") {
  Robot r;
  const auto json = r.bench.open("/arm/angle?accept=application/json"), cbor = r.bench.open("/arm/angle", "Accept: application/cbor\n");
  std::map<engine::Channel, engine::Push> first;
  for (auto& [channel, push] : r.bench.pushes()) first[channel] = push;
  CHECK(*first.at(json).message == "10");
  CHECK(first.at(json).text);
  CHECK_FALSE(first.at(cbor).text);
  r.robot.angle_handle->publish(43.6);
  r.bench.look();
  CHECK(r.bench.messages(json) == std::vector<std::string>{"43.6"});
  CHECK(missing(r.bench.get("/arm/subscriptions/i2"), "[] hybrit:mediaType \"application/cbor\" .") == "");
}
