// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using std::chrono::milliseconds;

namespace {

struct Arm {
  explicit Arm(engine::EngineOptions options = {}) : bench(std::move(options)) { bench.add(robot.arm()); }
  void publish(double v) {
    robot.angle_handle->publish(v);
    bench.look();
  }
  /// What arrived on a channel, as an EventSource dispatches it.
  std::vector<Event> events(Channel channel) {
    EventParser parser;
    for (const std::string& message : bench.messages(channel)) parser.read(message);
    return parser.take();
  }
  std::string get(const std::string& path, const std::string& fields = {}) { return bench.ask("GET " + path + "\n" + fields).body; }
  std::size_t subscriptions() { return bench.get("/arm/subscriptions").linked("related").size(); }
  SampleRobot robot;
  Bench bench;
};

std::size_t closes(const std::vector<std::pair<Channel, engine::Push>>& pushes, Channel channel) {
  return static_cast<std::size_t>(
      std::count_if(pushes.begin(), pushes.end(), [&](const auto& p) { return p.first == channel && p.second.close != 0; }));
}

}  // namespace

TEST_CASE("an event stream begins with what GET responds, and goes on with each change", "[engine][event stream][R0.12]") {
  Arm arm;
  const Bench::Sent opened = arm.bench.stream("/arm/angle");
  REQUIRE(opened.channel);
  CHECK(opened.answer.status == 200);
  CHECK(opened.answer.field("Content-Type") == "text/event-stream");
  CHECK(opened.answer.field("Cache-Control") == "no-store");
  CHECK(opened.answer.field("Vary") == "Accept");
  CHECK(opened.answer.field("Location") == "http://localhost/arm/subscriptions/i1");
  CHECK(opened.answer.links_to("http://www.w3.org/ns/ldp#Resource", "type"));
  const Answer got = arm.bench.get("/arm/angle");
  CHECK(arm.events(*opened.channel) == std::vector<Event>{{got.tag(), got.body}});
  CHECK(arm.events(*opened.channel).empty());
  arm.publish(20);
  const Answer later = arm.bench.get("/arm/angle");
  CHECK(arm.events(*opened.channel) == std::vector<Event>{{later.tag(), later.body}});
  arm.publish(20);  // SPEC 3.8: bit-identical
  CHECK(arm.events(*opened.channel).empty());
}

TEST_CASE("every observable resource has event streams", "[engine][event stream][R0.12]") {
  Arm arm;
  const std::string invocation = arm.bench.ask("POST /arm/actions/grip\nPrefer: respond-async").field("Location").substr(16);
  for (const std::string& path :
       {std::string("/arm/angle"), std::string("/arm/speed"), std::string("/arm"), std::string("/arm/actions/turn"), invocation}) {
    CAPTURE(path);
    const Channel channel = arm.bench.open_stream(path);
    const auto events = arm.events(channel);
    REQUIRE(events.size() == 1);
    CHECK(events[0].data == arm.get(path));
  }
  Bench bench;
  Thing tool = arm.robot.tool();
  bench.add(std::move(tool));
  EventParser parser;
  for (const std::string& message : bench.messages(bench.open_stream("/arm/tool/state"))) parser.read(message);
  CHECK(parser.take().at(0).data == bench.get("/arm/tool/state").body);
}

TEST_CASE("what cannot be observed has no event stream", "[engine][event stream][R0.6]") {
  Arm arm;
  for (const char* path : {"/", "/ns/lrt", "/arm/blueprint", "/arm/subscriptions", "/arm/waypoints"}) {
    CAPTURE(path);
    CHECK(arm.bench.stream(path).answer.status == 406);
  }
  CHECK(arm.bench.stream("/arm/nothing").answer.status == 404);
  CHECK(arm.subscriptions() == 0);
}

TEST_CASE("?accept= chooses the media type inside of an event stream; it must be text", "[engine][json_ld][event stream][R0.17]") {
  Arm arm;
  for (const char* type : {"application/json", "text/turtle", "text/plain", "text/csv", "application/ld+json", "application/n-triples"}) {
    CAPTURE(type);
    const std::string path = std::string("/arm/angle?accept=") + type;
    const Bench::Sent opened = arm.bench.stream(path);
    const Answer got = arm.bench.get(path);
    if (got.status != 200) {
      CHECK(opened.answer.status == got.status);
      continue;
    }
    REQUIRE(opened.channel);
    CHECK(arm.events(*opened.channel) == std::vector<Event>{{got.tag(), got.body}});
  }
  const std::size_t before = arm.subscriptions();
  for (const char* type : {"application/cbor", "image/png", "text/html", "application/octet-stream"}) {
    CAPTURE(type);
    const Bench::Sent refused = arm.bench.stream(std::string("/arm/angle?accept=") + type);
    CHECK_FALSE(refused.channel);
    CHECK(refused.answer.status == 406);
    CHECK(refused.answer.says("text/turtle"));
  }
  CHECK(arm.subscriptions() == before);
}

TEST_CASE("an event has a line of data for each line of the body", "[engine][event stream]") {
  Bench bench;
  Thing thing{"arm"};
  std::string text;
  thing.property("text", [&] { return text; });
  bench.add(std::move(thing));
  const auto data = [&] {
    const Channel channel = bench.open_stream("/arm/text?accept=text/plain");
    EventParser parser;
    for (const std::string& message : bench.messages(channel)) parser.read(message);
    const auto events = parser.take();
    REQUIRE(events.size() == 1);
    return events[0].data;
  };
  for (const char* exact : {"one", "one\ntwo", "one\n", "\n", "\n\none", "", " one", ": one", "data: one", "id: 1\ndata: two\n\n"}) {
    text = exact;
    CAPTURE(text);
    CHECK(data() == text);
  }
  // Event streams have one kind of line end.
  text = "one\rtwo\r\nthree\r";
  CHECK(data() == "one\ntwo\nthree\n");
  text = "one\r\rdata: forged\r\r";
  CHECK(data() == "one\n\ndata: forged\n\n");
}

TEST_CASE("a client that has the present representation already gets the next one", "[engine][event stream]") {
  Arm arm;
  const std::string path = "/arm/angle?accept=application/json";
  const std::string tag = arm.bench.get(path).tag();
  const Channel channel = arm.bench.open_stream(path, "Last-Event-ID: " + tag + "\n");
  const Channel queue = arm.bench.open_stream(path + "&queueLength=5", "Last-Event-ID: " + tag + "\n");
  CHECK(arm.bench.pushes().empty());
  arm.publish(20);
  const std::string now = arm.get(path);
  const auto pushes = arm.bench.pushes();
  REQUIRE(pushes.size() == 2);
  CHECK(pushes[0].second.message->find("data: " + now) != std::string::npos);
  CHECK(*pushes[0].second.message == *pushes[1].second.message);
  CHECK((pushes[0].first == channel || pushes[0].first == queue));
  // Of another representation than the present one.
  CHECK(arm.events(arm.bench.open_stream(path, "Last-Event-ID: " + tag + "\n")).size() == 1);
  CHECK(arm.events(arm.bench.open_stream("/arm/angle", "Last-Event-ID: " + tag + "\n")).size() == 1);
  CHECK(arm.events(arm.bench.open_stream(path, "Last-Event-ID: nonsense\n")).size() == 1);
}

TEST_CASE("an event stream is a subscription: listed, described, cancelled", "[engine][event stream][R1.8]") {
  Arm arm;
  const Channel channel = arm.bench.open_stream("/arm/angle?accept=application/json&queueLength=7&minimumInterval=0.5");
  CHECK(arm.subscriptions() == 1);
  const Answer described = arm.bench.get("/arm/subscriptions/i1");
  CHECK(missing(described,
                "<http://localhost/arm/subscriptions/i1> a lrt:EventStream ; hybrit:onResource <http://localhost/arm/angle> ; "
                "hybrit:mediaType \"application/json\" ; lrt:queueLength 7 .") == "");
  CHECK(arm.bench.stream("/arm/angle?queueLength=-1").answer.status == 400);
  CHECK(arm.bench.stream("/arm/angle?minimumInterval=x").answer.status == 400);
  (void)arm.bench.pushes();
  SECTION("DELETE ends the stream") {
    CHECK(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 204);
    CHECK(arm.subscriptions() == 0);
    arm.publish(33);
    const auto pushes = arm.bench.pushes();
    REQUIRE(pushes.size() == 1);
    CHECK(pushes[0].first == channel);
    CHECK(pushes[0].second.close == 1000);
  }
  SECTION("the end of the connection ends the subscription") {
    arm.bench.engine.closed(channel);
    CHECK(arm.subscriptions() == 0);
    CHECK(arm.bench.pushes().empty());
  }
  SECTION("a Thing that is removed ends its streams") {
    arm.bench.engine.remove("arm").value();
    CHECK(closes(arm.bench.pushes(), channel) == 1);
  }
}

TEST_CASE("an event stream has queues and intervals as a WebSocket has", "[engine][event stream][delivery]") {
  Arm arm;
  const Channel queue = arm.bench.open_stream("/arm/angle?accept=application/json&queueLength=3");
  const Channel latest = arm.bench.open_stream("/arm/angle?accept=application/json");
  const Channel slow = arm.bench.open_stream("/arm/angle?accept=application/json&minimumInterval=1");
  (void)arm.bench.pushes();
  std::vector<std::string> expected;
  for (int i = 1; i <= 5; ++i) {
    arm.publish(i);
    while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}
    if (i > 2) expected.push_back(arm.get("/arm/angle?accept=application/json"));
  }
  const auto all = [&](Channel channel) {
    EventParser parser;
    while (const auto push = arm.bench.engine.next_push(channel, arm.bench.clock.now())) parser.read(*push->message);
    std::vector<std::string> data;
    for (const Event& event : parser.take()) data.push_back(event.data);
    return data;
  };
  CHECK(all(queue) == expected);
  CHECK(all(latest) == std::vector<std::string>{expected.back()});
  CHECK(all(slow).empty());
  arm.bench.clock.advance(std::chrono::seconds(1));
  CHECK(arm.events(slow).size() == 1);
}

TEST_CASE("an event stream of a pulled property begins after the read, and shows its trouble", "[engine][event stream][R0.6]") {
  Arm arm;
  const Bench::Sent sent = arm.bench.stream("/arm/speed");
  CHECK(sent.ticket);
  CHECK_FALSE(sent.channel);
  CHECK(arm.subscriptions() == 0);
  arm.robot.speed = 2.5F;
  arm.bench.run();
  CHECK(arm.bench.answer(sent)->status == 200);
  CHECK(arm.subscriptions() == 1);
  const Channel channel = arm.bench.open_stream("/arm/speed?accept=application/json");
  CHECK(arm.events(channel).at(0).data == "2.5");
  const Bench::Sent broken = arm.bench.stream("/arm/broken");
  arm.bench.run();
  CHECK(arm.bench.answer(broken)->status == 500);
  const Bench::Sent late = arm.bench.stream("/arm/speed");
  arm.bench.clock.advance(std::chrono::seconds(3));
  CHECK(arm.bench.answer(late)->status == 503);
}

TEST_CASE("event streams count among the subscriptions that the limit allows", "[engine][event stream][limits]") {
  engine::EngineOptions options;
  options.subscriptions.max_subscriptions = 2;
  Arm arm(options);
  const Channel first = arm.bench.open_stream("/arm/angle");
  (void)arm.bench.open("/arm/angle");
  const Bench::Sent refused = arm.bench.stream("/arm/angle");
  CHECK_FALSE(refused.channel);
  CHECK(refused.answer.status == 503);
  CHECK(refused.answer.has("Retry-After"));
  arm.bench.engine.closed(first);
  CHECK(arm.bench.stream("/arm/angle").channel);
}

TEST_CASE("pages elsewhere get no event stream unless allowed_origins names them (SPEC 3.16)", "[engine][event stream][security]") {
  engine::EngineOptions options;
  options.allowed_origins = {"https://dashboard.example"};
  for (const bool named : {false, true}) {
    Arm arm(named ? options : engine::EngineOptions{});
    const auto from = [&](const std::string& origin, const std::string& accept = "text/event-stream") {
      return arm.bench.stream("/arm/angle", "Origin: " + origin + "\n", accept).answer.status;
    };
    CHECK(from("http://localhost") == 200);
    CHECK(from("https://dashboard.example") == (named ? 200 : 403));
    for (const char* accept :
         {"text/event-stream", "TEXT/event-stream", "Text/Event-Stream", "text/event-stream;q=0.5", "text/turtle;q=0.1, text/event-stream"}) {
      CAPTURE(accept);
      CHECK(from("http://evil.example", accept) == 403);
    }
    RequestText two("GET /arm/angle\nAccept: text/turtle;q=0.1\nAccept: text/event-stream\nOrigin: http://evil.example");
    two.get().can_stream = true;
    CHECK(arm.bench.sent(arm.bench.engine.handle(two.get(), arm.bench.clock.now())).answer.status == 403);
    CHECK(arm.bench.ask("GET /arm/angle\nOrigin: http://evil.example").status == 200);  // whose page cannot read it
  }
}

TEST_CASE("an event stream is what the client prefers, and what the transport can send", "[engine][event stream][R0.17]") {
  Arm arm;
  CHECK(arm.bench.stream("/arm/angle", {}, "text/event-stream, text/turtle;q=0.9").channel);
  CHECK_FALSE(arm.bench.stream("/arm/angle", {}, "text/turtle, text/event-stream;q=0.9").channel);
  CHECK_FALSE(arm.bench.stream("/arm/angle", {}, "*/*").channel);
  CHECK_FALSE(arm.bench.stream("/arm/angle", {}, "text/*").channel);
  CHECK(arm.bench.ask("GET /arm/angle\nAccept: text/event-stream").status == 406);  // a transport without them
  CHECK(arm.bench.ask("GET /arm/angle\nAccept: text/event-stream, text/turtle;q=0.1").status == 200);
}

TEST_CASE("HEAD of an event stream is its header section and makes no subscription", "[engine][event stream][R0.11]") {
  Arm arm;
  const auto head = [&](const std::string& path) {
    RequestText request("HEAD " + path + "\nAccept: text/event-stream");
    request.get().can_stream = true;
    return arm.bench.sent(arm.bench.engine.handle(request.get(), arm.bench.clock.now()));
  };
  const Bench::Sent sent = head("/arm/angle");
  CHECK(sent.answer.status == 200);
  CHECK(sent.answer.field("Content-Type") == "text/event-stream");
  CHECK_FALSE(sent.answer.has("Location"));
  CHECK(arm.subscriptions() == 0);
  REQUIRE(sent.channel);
  CHECK(arm.bench.engine.next_push(*sent.channel, arm.bench.clock.now())->close != 0);
  arm.bench.engine.closed(*sent.channel);
  CHECK(head("/arm/angle?accept=application/cbor").answer.status == 406);
}

TEST_CASE("the last event of an invocation is its final state", "[engine][event stream][R0.12]") {
  Arm arm;
  const std::string path = arm.bench.ask("POST /arm/actions/grip\nPrefer: respond-async").field("Location").substr(16);
  arm.bench.run();
  const Channel channel = arm.bench.open_stream(path);
  (void)arm.bench.pushes();
  arm.robot.grips.back().succeed();
  CHECK(arm.events(channel).back().data == arm.get(path));
  arm.bench.ask("DELETE " + path);
  CHECK(closes(arm.bench.pushes(), channel) == 1);
}

TEST_CASE("subscribers to the same event share its bytes", "[engine][event stream][delivery]") {
  Arm arm;
  (void)arm.bench.open_stream("/arm/angle");
  (void)arm.bench.open_stream("/arm/angle");
  const auto pushes = arm.bench.pushes();
  REQUIRE(pushes.size() == 2);
  CHECK(pushes[0].second.message == pushes[1].second.message);
  CHECK(pushes[0].second.text);
}

TEST_CASE("a server that stops gives no event stream", "[engine][event stream][R0.6]") {
  Arm arm;
  arm.bench.engine.stop();
  CHECK(arm.bench.stream("/arm/angle").answer.status == 503);
}
