// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Arm {
  Arm(bool websocket, bool callback, std::vector<std::string> receivers) : bench(allowing(std::move(receivers))) {
    bench.add(robot.arm());
    bench.add(robot.tool());
    bench.engine.listens_on("127.0.0.1", 80, false, {}, {websocket, callback});
  }
  static engine::EngineOptions allowing(std::vector<std::string> receivers) {
    engine::EngineOptions options;
    options.callbacks.allow = std::move(receivers);
    return options;
  }
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("what can be watched says so by Upgrade, as far as transport and options go", "[engine][R0.12][R0.13][RFC 9110 7.8]") {
  const std::vector<std::string> receivers = {"127.0.0.1"};
  Arm all(true, true, receivers);
  const std::string invocation = all.bench.ask("POST /arm/actions/home").field("Location").substr(16);
  for (const std::string& path :
       {std::string("/arm"), std::string("/arm/tool/state"), std::string("/arm/angle"), std::string("/arm/actions/home"), invocation})
    for (const char* method : {"GET ", "HEAD ", "OPTIONS "}) {
      CAPTURE(method, path);
      CHECK(all.bench.ask(method + path).field("Upgrade") == "websocket, callback");
    }
  const std::string tag = all.bench.get("/arm/angle").tag();
  CHECK(all.bench.ask("GET /arm/angle\nIf-None-Match: " + tag).field("Upgrade") == "websocket, callback");
  for (const char* path : {"/", "/arm/blueprint", "/arm/subscriptions", "/arm/all", "/arm/waypoints", "/ns/lrt", "/nowhere"}) {
    CAPTURE(path);
    CHECK_FALSE(all.bench.get(path).has("Upgrade"));
    // RFC 9110 7.8: a server may ignore the field.
    CHECK(all.bench.ask(std::string("GET ") + path + "\nUpgrade: callback\nCallback: http://127.0.0.1:9/").status ==
          (path == std::string("/nowhere") ? 404 : 200));
  }
  CHECK(Arm(true, false, receivers).bench.get("/arm/angle").field("Upgrade") == "websocket");
  CHECK(Arm(false, true, receivers).bench.get("/arm/angle").field("Upgrade") == "callback");
  CHECK(Arm(true, true, {}).bench.get("/arm/angle").field("Upgrade") == "websocket");
  CHECK_FALSE(Arm(false, true, {}).bench.get("/arm/angle").has("Upgrade"));
}

TEST_CASE("a resource that can be watched names its container and the URL of a WebSocket", "[engine][R1.7][R1.8]") {
  Arm arm(true, true, {});
  const std::string invocation = arm.bench.ask("POST /arm/actions/home").field("Location");
  for (const std::string& path : {std::string("arm/angle"), std::string("arm/actions/home"), invocation.substr(17)}) {
    CAPTURE(path);
    CHECK(missing(arm.bench.get("/" + path), "<" + path + "> hybrit:subscriptions <arm/subscriptions> ; hybrit:websocketUrl \"ws://localhost/" +
                                                 path + "\"^^xsd:anyURI .") == "");
  }
  CHECK(missing(arm.bench.get("/arm"), "<arm> hybrit:subscriptions <arm/subscriptions> ; hybrit:websocketUrl \"ws://localhost/arm\"^^xsd:anyURI .") ==
        "");
  CHECK_FALSE(arm.bench.get("/arm/blueprint").says("websocketUrl"));
  CHECK_FALSE(Arm(false, true, {}).bench.get("/arm/angle").says("websocketUrl"));
  // The state has the values of all properties, and the controls of none.
  CHECK(arm.bench.get("/arm/tool/state").says("numericalValue"));
  CHECK_FALSE(missing(arm.bench.get("/arm/tool/state"), "<arm/tool/weight> hybrit:websocketUrl [] .").empty());
  arm.bench.engine.listens_on("127.0.0.1", 443, true, {}, {true, true});
  RequestText request("GET /arm/angle");
  request.get().secure = true;
  const Answer secure = arm.bench.sent(arm.bench.engine.handle(request.get(), arm.bench.clock.now())).answer;
  CHECK(secure.says("\"wss://localhost/arm/angle\""));
}

TEST_CASE("a host's own HTTP server offers no WebSocket", "[engine][R0.12]") {
  Arm arm(true, true, {"127.0.0.1"});
  RequestText request("GET /arm/angle\nHost: localhost:9000");
  request.get().local_port = 9000;
  request.get().mount = "/robot";
  const Answer answer = arm.bench.sent(arm.bench.engine.handle(request.get(), arm.bench.clock.now())).answer;
  CHECK(answer.status == 200);
  CHECK(answer.field("Upgrade") == "callback");
  CHECK_FALSE(answer.says("websocketUrl"));
  CHECK(arm.bench.get("/arm/angle").says("websocketUrl"));
}

TEST_CASE("what takes new members says how", "[engine][R1.7][R1.10]") {
  Arm arm(true, true, {}), calls(true, true, {"127.0.0.1"});
  CHECK(missing(arm.bench.get("/arm/waypoints"),
                with_kind("<arm/waypoints> hybrit:binding [ a http-core:Request ; http-core:mthd http-methods:POST ;"
                          " http-core:requestURI <arm/waypoints> ; http-core:body [ a maths:Vector3D ; dcterms:conformsTo <KIND#waypoints> ] ] .",
                          kind_of(arm.bench, "/arm"))) == "");
  const std::string container = with_kind(
      "<arm/subscriptions> hybrit:binding [ a http-core:Request ; http-core:mthd http-methods:POST ;"
      " http-core:body [ a hybrit:Subscription , hybrit:WebCallback ; dcterms:conformsTo <KIND#subscriptions> ] ] .",
      kind_of(calls.bench, "/arm"));
  CHECK(missing(arm.bench.get("/arm/subscriptions"), container) != "");  // it makes no callbacks
  CHECK(missing(calls.bench.get("/arm/subscriptions"), container) == "");
}

TEST_CASE("what can be written says how: a binding with the shape of its body", "[engine][R1.10]") {
  Arm arm(false, true, {});
  const std::string kind = bounds_of(arm.bench, "/arm");
  CHECK(missing(arm.bench.get("/arm/angle"),
                with_kind("<arm/angle> hybrit:binding [ a http-core:Request ; http-core:mthd http-methods:PUT ;"
                          " http-core:requestURI <arm/angle> ; http-core:body [ a maths:Scalar ; dcterms:conformsTo <KIND#angle> ] ] .",
                          kind)) == "");
  CHECK(missing(arm.bench.get(kind), with_kind("<KIND#angle> a sh:NodeShape .", kind)) == "");
  CHECK_FALSE(arm.bench.get("/arm/speed").says("hybrit:binding"));
  // What GET gives can still be sent back.
  const Answer read = arm.bench.get("/arm/angle");
  CHECK(arm.bench.ask("PUT /arm/angle\nContent-Type: text/turtle\nIf-Match: " + read.tag() + "\n\n" + read.body).status == 204);
}

TEST_CASE("an invocation states its action, as the action states it", "[engine][R1.7][paper 5.4]") {
  Arm arm(false, true, {});
  const std::string location = arm.bench.ask("POST /arm/actions/home").field("Location");
  CHECK(missing(arm.bench.get(location.substr(16)), "<" + location + "> lrt:invocationOf <arm/actions/home> .") == "");
  CHECK(missing(arm.bench.get("/arm/actions/home"), "<arm/actions/home> lrt:invocation <" + location + "> .") == "");
}
