// SPDX-License-Identifier: Apache-2.0
#include "src/engine/overview.hpp"

#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) {
    bench.add(robot.arm());
    bench.add(robot.tool());
  }
  std::string json(const std::string& path, const std::string& fields = {}) {
    const Answer a = bench.ask("GET " + path + "\nAccept: application/json\n" + fields);
    CHECK(a.status == 200);
    CHECK(a.field("Content-Type") == "application/json");
    return a.body;
  }
  SampleRobot robot;
  Bench bench;
};

const std::string here = "http://localhost";
bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("the overview of the root links to the Things", "[engine][R0.4]") {
  Robot r;
  CHECK(r.json("/") == R"({"href":"http://localhost/","kind":"root","methods":["GET","HEAD","OPTIONS"],"title":"Robotic Things",)"
                       R"("structure":{"href":"http://localhost/ns/structure","kind":"structure","methods":["GET","HEAD","OPTIONS"]},)"
                       R"("all":{"href":"http://localhost/all","kind":"all","methods":["GET","HEAD","OPTIONS"]},"count":1,)"
                       R"("things":[{"href":"http://localhost/arm","kind":"thing","methods":["GET","HEAD","OPTIONS"],"title":"arm",)"
                       R"("types":["http://ros.org/#RevoluteJoint"]}]})");
}

TEST_CASE("the overview of a Thing links to what it has, with types, units, bounds and methods", "[engine][R0.9][R1.9][R1.10]") {
  Robot r;
  const std::string arm = r.json("/arm");
  CHECK(contains(arm, R"("parent":{"href":"http://localhost/","kind":"root",)"));
  CHECK(contains(arm, R"("state":{"href":"http://localhost/arm/state","kind":"state",)"));
  CHECK(contains(arm, R"("blueprint":{"href":"http://localhost)" + kind_of(r.bench, "/arm") + R"(","kind":"blueprint",)"));
  CHECK(contains(
      arm, R"("subscriptions":{"href":"http://localhost/arm/subscriptions","kind":"subscriptions","methods":["GET","HEAD","OPTIONS","POST"]})"));
  CHECK(contains(arm, R"("properties":{"angle":{"href":"http://localhost/arm/angle","kind":"property","methods":["GET","HEAD","OPTIONS","PUT"],)"
                      R"("schema":{"type":"number","minimum":-90,"maximum":90,"unit":"deg"}},"speed":{)"));
  CHECK(contains(arm, R"("mode":{"href":"http://localhost/arm/mode","kind":"property","methods":["GET","HEAD","OPTIONS","PUT"],)"
                      R"("schema":{"type":"string","enum":["idle","active"]}})"));
  CHECK(contains(arm, R"("actions":{"turn":{"href":"http://localhost/arm/actions/turn","kind":"action","methods":["GET","HEAD","OPTIONS","POST"],)"
                      R"("input":{"type":"number","minimum":0,"exclusiveMaximum":360,"unit":"deg"},"asynchronous":false})"));
  CHECK(contains(arm, R"("collections":{"waypoints":{"href":"http://localhost/arm/waypoints","kind":"collection",)"));
  CHECK(contains(arm, R"("things":[{"href":"http://localhost/arm/tool","kind":"thing","methods":["GET","HEAD","OPTIONS"],"title":"The tool"}]})"));
  CHECK(contains(r.json("/arm/tool"), R"("parent":{"href":"http://localhost/arm","kind":"thing",)"));
}

TEST_CASE("the overview of an action describes its input and output, and links to its invocations", "[engine][R1.10]") {
  Robot r;
  const std::string arm = r.json("/arm");
  CHECK(contains(r.json("/arm/actions/measure"), R"("output":{"type":"number","unit":"m"},"asynchronous":false)"));
  const std::string before = r.json("/arm/actions/grip");
  CHECK(contains(before, R"("asynchronous":true,"parent":{"href":"http://localhost/arm",)"));
  CHECK(contains(before, R"("policy":"parallel","invocations":[]})"));
  const Answer posted = r.bench.ask("POST /arm/actions/grip");
  CHECK(posted.status == 204);
  CHECK(contains(r.json("/arm/actions/grip"), "\"invocations\":[{\"href\":\"" + posted.field("Location") + "\",\"kind\":\"invocation\""));
  CHECK(r.json("/arm") == arm);  // what an action does is no change of the Thing
}

TEST_CASE("the overview of a collection has its members with their values, page by page", "[engine][R0.9]") {
  engine::EngineOptions options;
  options.max_page_members = 2;
  Robot r(options);
  for (const char* x : {"1", "2", "3"})
    CHECK(r.bench.ask(std::string("POST /arm/waypoints\nContent-Type: application/json\n\n{\"x\":") + x + ",\"y\":0,\"frame\":\"f\"}").status == 201);
  const std::string first = r.json("/arm/waypoints"), second = r.json("/arm/waypoints?page=2");
  CHECK(contains(first, R"("kind":"collection","methods":["GET","HEAD","OPTIONS","POST"])"));
  CHECK(contains(first, R"("schema":{"type":"object","properties":{"x":{"type":"number","unit":"m"},"y":{"type":"number","unit":"m"},)"
                        R"("frame":{"type":"string"},"tolerance":{"type":["number","null"],"minimum":0}},"required":["x","y","frame"],)"
                        R"("additionalProperties":false})"));
  CHECK(contains(first, R"("count":3,"members":[{"href":"http://localhost/arm/waypoints/)"));
  CHECK(contains(first, R"("value":{"x":1,"y":0,"frame":"f"}},{)"));
  CHECK(contains(first, R"("next":{"href":"http://localhost/arm/waypoints?page=2&accept=application/json"}})"));
  CHECK_FALSE(contains(first, "\"previous\""));
  CHECK_FALSE(contains(first, "\"x\":3"));
  CHECK(contains(second, R"("value":{"x":3,"y":0,"frame":"f"}}],"previous":{"href":"http://localhost/arm/waypoints?accept=application/json"}})"));
  CHECK_FALSE(contains(second, "\"next\""));
  CHECK(r.bench.get("/arm/waypoints?page=2&accept=application/json").body == second);
  const std::string minimal =
      r.json("/arm/waypoints", "Prefer: return=representation; include=\"http://www.w3.org/ns/ldp#PreferMinimalContainer\"\n");
  CHECK(contains(minimal, "\"count\":3}"));
}

TEST_CASE("the overviews of subscriptions show what they observe and their counters", "[engine][R1.8]") {
  Robot r;
  CHECK(contains(r.json("/arm/subscriptions"), R"("count":0,"members":[]})"));
  r.bench.open("/arm/angle?accept=application/json&queueLength=7");
  r.bench.pushes();
  const std::string all = r.json("/arm/subscriptions");
  CHECK(contains(all, R"("kind":"subscription","methods":["GET","HEAD","OPTIONS","DELETE"],"protocol":"websocket",)"
                      R"("observes":{"href":"http://localhost/arm/angle","kind":"property"}}]})"));
  const std::size_t at = all.find("\"members\":[{\"href\":\"") + 20;
  const std::string path = all.substr(at, all.find('"', at) - at).substr(here.size());
  const std::string one = r.json(path);
  CHECK(contains(one, R"("mediaType":"application/json")"));
  CHECK(contains(one, R"("queueLength":7,"delivered":1,"dropped":0,"suspended":false})"));
}

TEST_CASE("a blueprint in JSON lists the things that it describes", "[engine][R1.11]") {
  Robot r;
  const std::string text = r.json(kind_of(r.bench, "/arm"));
  CHECK(contains(text, R"("kind":"blueprint",)"));
  CHECK(contains(text, R"("things":[{"href":"http://localhost/arm","kind":"thing",)"));
}

TEST_CASE("an overview is a representation like the others: ETag, Vary, alternate links, HEAD, conditions", "[engine][R0.11][R1.2]") {
  Robot r;
  for (const char* path : {"/", "/arm", "/arm/actions/turn", "/arm/waypoints", "/arm/subscriptions", "/arm/blueprint"}) {
    CAPTURE(path);
    const std::string get = std::string("GET ") + path + "\nAccept: application/json";
    const Answer a = r.bench.ask(get);
    CHECK(a.status == 200);
    CHECK(a.field("Vary").find("Accept") == 0);
    CHECK(r.bench.ask(get).tag() == a.tag());
    CHECK(r.bench.ask(get + "\nIf-None-Match: " + a.tag()).status == 304);
    CHECK(r.bench.ask(std::string("HEAD ") + path + "\nAccept: application/json").tag() == a.tag());
    CHECK(r.bench.get(std::string(path) + "?accept=application/json").body == a.body);
    const Answer turtle = r.bench.get(path);
    CHECK(turtle.field("Content-Type") == "text/turtle");  // for clients that accept anything
    CHECK(turtle.tag() != a.tag());
    CHECK(turtle.links_to(here + path + "?accept=application/json", "alternate"));
  }
  const std::string tag = r.bench.ask("GET /arm/waypoints\nAccept: application/json").tag();
  const auto post = [&] {
    return r.bench.ask("POST /arm/waypoints\nContent-Type: application/json\nIf-Match: " + tag + "\n\n{\"x\":1,\"y\":0,\"frame\":\"f\"}").status;
  };
  CHECK(post() == 201);
  CHECK(post() == 412);  // there is a member more now
  CHECK(r.bench.ask("GET /ns/lrt\nAccept: application/json").status == 406);
}

TEST_CASE("a Thing and an action are watched in JSON", "[engine][R0.12][R0.17]") {
  Robot r;
  const engine::Channel thing = r.bench.open("/arm?accept=application/json"),
                        action = r.bench.open_stream("/arm/actions/grip?accept=application/json");
  CHECK(r.bench.messages(thing) == std::vector<std::string>{r.json("/arm")});
  r.bench.ask("POST /arm/actions/grip");
  const std::vector<std::string> events = r.bench.messages(action);
  REQUIRE_FALSE(events.empty());
  CHECK(contains(events.back(), "data: " + r.json("/arm/actions/grip") + "\n"));
  Thing more{"arm/hand"};
  more.title("The \"hand\"");
  r.bench.add(std::move(more));
  const std::vector<std::string> news = r.bench.messages(thing);
  REQUIRE_FALSE(news.empty());
  CHECK(contains(news.back(), R"({"href":"http://localhost/arm/hand","kind":"thing","methods":["GET","HEAD","OPTIONS"],"title":"The \"hand\""})"));
}

TEST_CASE("titles, domain types, frames and formats are in the overview", "[engine][R1.3]") {
  Bench bench;
  Thing thing{"cell"};
  auto image = thing.property<std::vector<double>>("image", unit::metre);
  image.octets().type(vocab::ros::Joint).title("Depth").frame(Object::resource("cell/camera")).representation("image/x-test", [](const auto&) {
    return Bytes{};
  });
  bench.add(std::move(thing));
  CHECK(contains(bench.get("/cell?accept=application/json").body,
                 R"("title":"Depth","types":["http://ros.org/#Joint"],"schema":{"type":"array","items":{"type":"number"},"unit":"m"},)"
                 R"("frame":"http://localhost/cell/camera","formats":["image/x-test","application/octet-stream"]})"));
}
