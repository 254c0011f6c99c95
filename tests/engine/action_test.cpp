// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <vector>

#include <lrt/shacl/validator.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/together.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Place {
  double x = 0, y = 0;
};

/// A number that only its traits refuse.
struct Odd {
  int value = 1;
};

/// A thing "arm" with one action "act", asynchronous, whose responders the test holds.
struct Acting {
  explicit Acting(ActionPolicy policy = ActionPolicy::queue(16), engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing thing{"arm"};
    thing
        .action("act",
                [this](Responder done) {
                  done.on_cancel([this] { ++cancels; });
                  open.push_back(std::move(done));
                })
        .policy(policy);
    bench.add(std::move(thing));
  }
  Answer post(const std::string& fields = {}) { return bench.ask("POST /arm/actions/act" + (fields.empty() ? "" : "\n" + fields)); }
  std::string status(const std::string& id) {
    const Answer a = bench.get("/arm/actions/act/" + id);
    if (a.status != 200) return std::to_string(a.status);
    const rdf::Graph graph = a.graph();
    const auto s = graph.object(rdf::iri("http://localhost/arm/actions/act/" + id), vocab::lrt_::status);
    return s ? std::string(s->text.substr(s->text.find('#') + 1)) : "none";
  }
  std::vector<Responder> open;
  int cancels = 0;
  Bench bench;
};

}  // namespace

template <>
struct lrt::rdf::traits<Place> : lrt::rdf::Record<Place> {
  static void describe(Record& r) {
    r.field("x", &Place::x).unit(unit::metre);
    r.field("y", &Place::y).unit(unit::metre);
  }
};
template <>
struct lrt::rdf::traits<Odd> {
  static const Type& type() { return traits<int>::type(); }
  static Value encode(const Odd& odd) { return traits<int>::encode(odd.value); }
  static Result<Odd> decode(const Value& value) {
    const Result<int> number = traits<int>::decode(value);
    if (!number) return Unexpected{number.error()};
    if (*number % 2 == 0) return unexpected(Errc::expected_value, "expected an odd number, found " + std::to_string(*number));
    return Odd{*number};
  }
};

TEST_CASE("a synchronous action without output responds 204 with the Location of its invocation", "[engine][R0.7][R0.8]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const Answer a = bench.turtle("POST", "/arm/actions/turn", number_body("43.6", "maths:Degree"));
  CHECK(a.status == 204);
  CHECK(a.body.empty());
  CHECK(a.field("Location") == "http://localhost/arm/actions/turn/i1");
  CHECK(robot.turned_to == 43.6);
  const Answer invocation = bench.get("/arm/actions/turn/i1");
  CHECK(missing(invocation,
                "<arm/actions/turn/i1> a lrt:Invocation , prov:Activity ; lrt:status lrt:succeeded ; lrt:progress \"1\"^^xsd:double ;"
                " prov:startedAtTime \"2026-11-21T10:38:39.000000Z\"^^xsd:dateTime ; prov:endedAtTime \"2026-11-21T10:38:39.000000Z\"^^xsd:dateTime ;"
                " rdfs:seeAlso <arm/actions/turn> ; lrt:input <arm/actions/turn/i1#input> . <arm/actions/turn/i1#input> vom:numericalValue"
                " \"43.6\"^^xsd:double ; vom:unit maths:Degree .") == "");
  CHECK(invocation.links_to("http://localhost/arm/actions/turn", "up"));
  CHECK(missing(bench.get("/arm/actions/turn"), "<arm/actions/turn> lrt:invocation <arm/actions/turn/i1> .") == "");
  CHECK(bench.get("/arm/actions/turn").links_to("http://localhost/arm/actions/turn/i1", "related"));
}

TEST_CASE("a synchronous action with output responds 200 with it", "[engine][rdf_xml][R0.7][R0.8]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const Answer a = bench.ask("POST /arm/actions/measure");
  CHECK(a.status == 200);
  CHECK(a.field("Location") == "http://localhost/arm/actions/measure/i1");
  CHECK(missing(a, "<arm/actions/measure/i1#result> vom:numericalValue \"2.5\"^^xsd:double ; qudt:hasUnit unit:M .") == "");
  CHECK(missing(bench.get("/arm/actions/measure/i1"), "<arm/actions/measure/i1> lrt:result <arm/actions/measure/i1#result> .") == "");
  CHECK(bench.ask("POST /arm/actions/measure\nAccept: application/rdf+xml").field("Content-Type") == "application/rdf+xml");
  CHECK(bench.ask("POST /arm/actions/measure\nPrefer: return=minimal").status == 204);
  // What has happened is not taken back for the want of a format.
  CHECK(bench.ask("POST /arm/actions/measure\nAccept: image/png").status == 200);
}

TEST_CASE("an action without input takes an empty body whatever its header fields say, or any RDF", "[engine][R0.5]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  CHECK(bench.ask("POST /arm/actions/home").status == 204);
  CHECK(bench.turtle("POST", "/arm/actions/home", "<> rdfs:label \"x\" .").status == 204);
  CHECK(robot.homed == 2);
  for (const char* field : {"Content-Type: application/json", "Content-Type: application/x-www-form-urlencoded", "Content-Type: image/png",
                            "Content-Type: ;", "Content-Type: text/turtle; charset=utf-16", "Content-Encoding: gzip", "Content-Range: bytes 0-1/2"}) {
    CAPTURE(field);
    CHECK(bench.ask(std::string("POST /arm/actions/home\n") + field).status == 204);
  }
  CHECK(robot.homed == 9);
  CHECK(bench.ask("POST /arm/actions/home\nContent-Type: application/xml\n\n<a/>").status == 415);
  CHECK(bench.ask("POST /arm/actions/home\nContent-Type: application/x-www-form-urlencoded\n\na=b").status == 415);
  CHECK(bench.ask("POST /arm/actions/home\nContent-Type: application/json\n\n]").status == 400);
  CHECK(bench.turtle("POST", "/arm/actions/home", "<> ] .").status == 400);
  CHECK(robot.homed == 9);
}

TEST_CASE("an optional input is absent if the body is empty, whatever its header fields say", "[engine][R0.5]") {
  Bench bench;
  std::optional<double> speed;
  int calls = 0;
  Thing thing{"arm"};
  thing.action("home", [&](std::optional<double> given) {
    speed = given;
    ++calls;
  });
  bench.add(std::move(thing));
  const auto home = [&](const std::string& rest) { return bench.ask("POST /arm/actions/home" + rest).status; };
  CHECK(home("\nContent-Type: application/json\n\n2.5") == 204);
  CHECK(speed == 2.5);
  for (const char* type : {"", "\nContent-Type: application/json", "\nContent-Type: application/x-www-form-urlencoded", "\nContent-Type: ;",
                           "\nContent-Type: text/turtle", "\nContent-Type: text/plain", "\nContent-Type: application/cbor"}) {
    CAPTURE(type);
    speed = 1;
    CHECK(home(type) == 204);
    CHECK_FALSE(speed);
  }
  CHECK(calls == 8);
  CHECK(home("\nContent-Type: application/x-www-form-urlencoded\n\na=b") == 415);
  CHECK(calls == 8);
}

TEST_CASE("an input that the action does not take starts nothing", "[engine][R0.6]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const auto post = [&](const std::string& body) { return bench.turtle("POST", "/arm/actions/turn", body).status; };
  CHECK(post(number_body("360", "maths:Degree")) == 422);
  CHECK(post(number_body("-1", "maths:Degree")) == 422);
  CHECK(post(number_body("\"fast\"", "maths:Degree")) == 422);
  CHECK(post(number_body("1")) == 422);
  CHECK(post(number_body("1", "maths:Radian")) == 422);
  CHECK(post("") == 422);
  CHECK(bench.ask("POST /arm/actions/turn").status == 422);
  CHECK(post("<> ; .") == 400);
  CHECK(robot.turned_to == -1);
  CHECK_FALSE(bench.get("/arm/actions/turn").says("lrt:invocation"));
  CHECK(post(number_body("0", "maths:Degree")) == 204);
}

TEST_CASE("an action that throws fails its invocation: 500; one that is declined: 409", "[engine][R0.6]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  Thing thing{"other"};
  thing.action("int", [] { throw 7; });
  thing.action("async", [](Responder) { throw std::runtime_error("before it moved"); });
  bench.add(std::move(thing));
  const Answer failed = bench.ask("POST /arm/actions/fail");
  CHECK(failed.status == 500);
  CHECK(failed.says("the motor is hot"));
  CHECK(failed.links_to("http://localhost/arm/actions/fail/i1", "related"));
  CHECK(missing(bench.get("/arm/actions/fail/i1"), "<arm/actions/fail/i1> lrt:status lrt:failed ; lrt:error \"it threw: the motor is hot\" .") == "");
  const Answer declined = bench.ask("POST /arm/actions/refuse");
  CHECK(declined.status == 409);
  CHECK(declined.says("the brake is on"));
  CHECK(bench.ask("POST /other/actions/int").status == 500);
  CHECK(bench.ask("POST /other/actions/async").status == 500);
  CHECK(missing(bench.get("/other/actions/async/i4"), "<other/actions/async/i4> lrt:status lrt:failed ; lrt:error \"it threw: before it moved\" .") ==
        "");
}

TEST_CASE("an asynchronous action responds 204 when its lambda has returned, and its invocation has the status", "[engine][R0.7][R0.8]") {
  Acting a;
  const Bench::Sent sent = a.bench.send("POST /arm/actions/act");
  CHECK(missing(a.bench.send("GET /arm/actions/act/i1").answer, "<arm/actions/act/i1> lrt:status lrt:pending .") == "");
  CHECK_FALSE(a.bench.answer(sent));
  a.bench.run();
  const auto answer = a.bench.answer(sent);
  REQUIRE(answer);
  CHECK(answer->status == 204);
  CHECK(answer->field("Location") == "http://localhost/arm/actions/act/i1");
  CHECK(a.status("i1") == "running");
  a.bench.clock.advance(std::chrono::seconds(1));
  a.open[0].progress(0.25);
  CHECK(missing(a.bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:progress \"0.25\"^^xsd:double .") == "");
  a.open[0].progress(7);
  CHECK(missing(a.bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:progress \"1\"^^xsd:double .") == "");
  a.open[0].progress(std::nan(""));
  a.open[0].progress(-1);
  CHECK(missing(a.bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:progress \"0\"^^xsd:double .") == "");
  a.open[0].succeed();
  CHECK(missing(a.bench.get("/arm/actions/act/i1"),
                "<arm/actions/act/i1> lrt:status lrt:succeeded ; lrt:progress \"1\"^^xsd:double ; prov:startedAtTime"
                " \"2026-11-21T10:38:39.000000Z\"^^xsd:dateTime ; prov:endedAtTime \"2026-11-21T10:38:40.000000Z\"^^xsd:dateTime .") == "");
}

TEST_CASE("how an asynchronous action ends before its lambda returns is the response", "[engine][R0.6][R0.7]") {
  std::function<void(Responder)> start;
  std::optional<Responder> kept;
  Bench bench;
  Thing thing{"arm"};
  thing.action("act", [&](Responder done) { start(std::move(done)); });
  thing.action("measure", [](ResponderOf<double> done) { done.succeed(2.5); });
  bench.add(std::move(thing));
  const auto post = [&](std::function<void(Responder)> f, const std::string& fields = {}) {
    start = std::move(f);
    return bench.ask("POST /arm/actions/act" + fields);
  };
  Answer a = post([](Responder done) { done.fail(Error{Errc::refused, "the brake is on"}); });
  CHECK(a.status == 409);
  CHECK(a.says("the brake is on"));
  CHECK(a.links_to("http://localhost/arm/actions/act/i1", "related"));
  CHECK(missing(bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:status lrt:failed ; lrt:error \"the brake is on\" .") == "");
  CHECK(post([](Responder done) { done.fail("the motor is hot"); }).status == 500);
  CHECK(post([](const Responder&) { throw std::runtime_error("no current"); }).says("no current"));
  CHECK(post([](const Responder&) { throw 7; }).status == 500);
  CHECK(post([](const Responder&) { throw BadResult(Error{Errc::refused, "not now"}); }).status == 409);
  a = post([](const Responder&) {});
  CHECK(a.status == 500);
  CHECK(a.says("destroyed"));
  a = post([&](Responder done) {
    kept = std::move(done);
    throw std::runtime_error("after it was moved");
  });
  CHECK(a.status == 500);
  CHECK(a.says("after it was moved"));
  a = post([](Responder done) { done.succeed(); });
  CHECK(a.status == 204);
  CHECK(a.field("Location") == "http://localhost/arm/actions/act/i8");
  a = post([](Responder done) { std::thread([done] { done.fail(Error{Errc::refused, "on a thread of its own"}); }).join(); });
  CHECK(a.status == 409);
  // The same where the client prefers a representation: an error is none.
  CHECK(post([](Responder done) { done.fail(Error{Errc::refused, "the brake is on"}); }, "\nPrefer: return=representation").status == 409);
  a = post([&](Responder done) { kept = std::move(done); }, "\nPrefer: return=representation");
  CHECK(a.status == 200);
  CHECK(missing(a, "<arm/actions/act/i11> lrt:status lrt:running .") == "");
  kept->succeed();
  a = bench.ask("POST /arm/actions/measure");
  CHECK(a.status == 200);
  CHECK(a.says("2.5"));
  CHECK(a.field("Location") == "http://localhost/arm/actions/measure/i12");
  // A client that does not wait for it sees it in the invocation.
  CHECK(post([](Responder done) { done.fail("x"); }, "\nPrefer: respond-async").status == 202);
  CHECK(missing(bench.get("/arm/actions/act/i13"), "<arm/actions/act/i13> lrt:status lrt:failed .") == "");
}

TEST_CASE("an input that only its type refuses is 422, also of an asynchronous action", "[engine][R0.6]") {
  Bench bench;
  int starts = 0;
  Thing thing{"arm"};
  thing.action("sync", [&](Odd) { ++starts; });
  thing.action("async", [&](Odd, Responder done) {
    ++starts;
    done.succeed();
  });
  bench.add(std::move(thing));
  for (const char* action : {"sync", "async"}) {
    CAPTURE(action);
    const Answer a = bench.ask(std::string("POST /arm/actions/") + action + "\nContent-Type: application/json\n\n4");
    CHECK(a.status == 422);
    CHECK(a.says("expected an odd number"));
  }
  CHECK(starts == 0);
  CHECK(bench.ask("POST /arm/actions/async\nContent-Type: application/json\n\n3").status == 204);
  CHECK(starts == 1);
}

TEST_CASE("a command that waits in the queue is 202, because the robot has not seen it", "[engine][R0.7][R0.8]") {
  Acting a;
  CHECK(a.post().status == 204);
  const Bench::Sent queued = a.bench.send("POST /arm/actions/act");
  REQUIRE_FALSE(queued.ticket);
  CHECK(queued.answer.status == 202);
  CHECK(queued.answer.field("Location") == "http://localhost/arm/actions/act/i2");
  CHECK_FALSE(queued.answer.has("Preference-Applied"));
  CHECK(a.status("i2") == "pending");
  a.open[0].succeed();
  a.bench.run();
  CHECK(a.status("i2") == "running");
}

TEST_CASE("a command that is cancelled before it begins is 409, and never begins", "[engine][R0.5][R0.6]") {
  Acting a(ActionPolicy::preempt());
  const Bench::Sent deleted = a.bench.send("POST /arm/actions/act");
  CHECK(a.bench.send("DELETE /arm/actions/act/i1").answer.status == 204);
  CHECK(a.bench.answer(deleted)->status == 409);
  const Bench::Sent preempted = a.bench.send("POST /arm/actions/act");
  const Bench::Sent last = a.bench.send("POST /arm/actions/act");
  CHECK(a.bench.answer(preempted)->status == 409);
  a.bench.run();
  CHECK(a.bench.answer(last)->status == 204);
  CHECK(a.open.size() == 1);
}

TEST_CASE("a command whose Thing is removed before it begins is 404", "[engine][R0.6]") {
  Acting a;
  const Bench::Sent sent = a.bench.send("POST /arm/actions/act");
  a.bench.engine.remove("arm").value();
  a.bench.run();
  CHECK(a.bench.answer(sent)->status == 404);
  CHECK(a.open.empty());
}

TEST_CASE("an asynchronous action that fails says why", "[engine][R0.6]") {
  Acting a;
  a.post();
  a.open[0].fail("it slipped");
  CHECK(missing(a.bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:status lrt:failed ; lrt:error \"it slipped\" .") == "");
  a.open.clear();
  CHECK(a.status("i1") == "failed");
}

TEST_CASE("dropping a Responder ends the invocation as failed: 500 for a waiting client", "[engine][R0.6]") {
  Acting a;
  const auto waiting = a.bench.send("POST /arm/actions/act\nPrefer: wait=10");
  a.bench.run();
  a.open.clear();
  const auto answer = a.bench.answer(waiting);
  REQUIRE(answer);
  CHECK(answer->status == 500);
  CHECK(answer->says("destroyed"));
  CHECK(a.status("i1") == "failed");

  Bench bench;
  Thing thing{"arm"};
  thing.action("act", [](Responder) {});  // dropped at once
  bench.add(std::move(thing));
  CHECK(bench.ask("POST /arm/actions/act\nPrefer: wait=10").status == 500);
}

TEST_CASE("assigning over a Responder drops the old one", "[engine][R0.6]") {
  Acting a(ActionPolicy::parallel(2));
  a.post();
  a.post();
  a.open[0] = std::move(a.open[1]);
  CHECK(a.status("i1") == "failed");
  CHECK(a.status("i2") == "running");
  a.open[0].succeed();
  CHECK(a.status("i2") == "succeeded");
}

TEST_CASE("an action that throws after it has moved its Responder fails, and the Responder has no say any more", "[engine][R0.6]") {
  Bench bench;
  std::optional<Responder> kept;
  Thing thing{"arm"};
  thing.action("act", [&](Responder done) {
    kept = std::move(done);
    throw std::runtime_error("too late");
  });
  bench.add(std::move(thing));
  CHECK(bench.ask("POST /arm/actions/act\nPrefer: wait=10").status == 500);
  CHECK(missing(bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:status lrt:failed ; lrt:error \"it threw: too late\" .") == "");
  kept->succeed();
  CHECK(missing(bench.get("/arm/actions/act/i1"), "<arm/actions/act/i1> lrt:status lrt:failed .") == "");
}

TEST_CASE("a Responder works from any thread, and outlives its engine", "[engine][R0.8]") {
  std::optional<Responder> late;
  {
    Acting a(ActionPolicy::parallel(3));
    const auto waiting = a.bench.send("POST /arm/actions/act\nPrefer: wait=10");
    a.post();
    a.bench.run();
    std::thread other([&] {
      a.open[0].progress(0.5);
      a.open[0].succeed();
    });
    other.join();
    CHECK(a.bench.answer(waiting)->status == 204);
    late = std::move(a.open[1]);
  }
  CHECK_FALSE(late->cancelled());
  late->progress(0.5);
  std::thread other([&] { late->succeed(); });
  other.join();
}

TEST_CASE("Prefer: respond-async makes a synchronous action respond 202 at once", "[engine][R0.6][R0.7]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const auto sent = bench.send("POST /arm/actions/home\nPrefer: respond-async");
  REQUIRE_FALSE(sent.ticket);
  CHECK(sent.answer.status == 202);
  CHECK(sent.answer.field("Preference-Applied") == "respond-async");
  CHECK(sent.answer.field("Location") == "http://localhost/arm/actions/home/i1");
  CHECK(robot.homed == 0);
  bench.run();
  CHECK(robot.homed == 1);
  CHECK(missing(bench.get("/arm/actions/home/i1"), "<arm/actions/home/i1> lrt:status lrt:succeeded .") == "");
}

TEST_CASE("Prefer: wait= waits for the end, or responds 202 when the time is over", "[engine][R0.6][R0.7]") {
  Acting a(ActionPolicy::parallel(2));
  const auto first = a.bench.send("POST /arm/actions/act\nPrefer: wait=5");
  const auto second = a.bench.send("POST /arm/actions/act\nPrefer: respond-async, wait=5");
  a.bench.run();
  CHECK_FALSE(a.bench.answer(first));
  a.open[0].succeed();
  CHECK(a.bench.answer(first)->status == 204);
  CHECK(a.bench.answer(first)->field("Preference-Applied") == "wait=5");
  a.bench.clock.advance(std::chrono::milliseconds(4999));
  CHECK_FALSE(a.bench.answer(second));
  a.bench.clock.advance(std::chrono::milliseconds(1));
  REQUIRE(a.bench.answer(second));
  CHECK(a.bench.answer(second)->status == 202);
  CHECK(a.bench.answer(second)->field("Location") == "http://localhost/arm/actions/act/i2");
  CHECK(a.status("i2") == "running");
  CHECK(a.post("Prefer: wait=0").status == 202);
}

TEST_CASE("Prefer: return=representation gives the invocation", "[engine][R0.7][R0.8]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const Answer sync = bench.ask("POST /arm/actions/measure\nPrefer: return=representation");
  CHECK(sync.status == 200);
  CHECK(sync.field("Preference-Applied") == "return=representation");
  CHECK(sync.field("Content-Location") == "http://localhost/arm/actions/measure/i1");
  CHECK(sync.field("Location") == "http://localhost/arm/actions/measure/i1");
  const Answer get = bench.get("/arm/actions/measure/i1");
  CHECK(sync.body == get.body);
  CHECK(sync.tag() == get.tag());
  const Answer async = bench.ask("POST /arm/actions/grip\nPrefer: return=representation");
  CHECK(async.status == 200);
  CHECK(missing(async, "<arm/actions/grip/i2> lrt:status lrt:running .") == "");
}

TEST_CASE("policy preempt: a newer invocation cancels the older one", "[engine][R0.8]") {
  Acting a(ActionPolicy::preempt());
  const auto first = a.bench.send("POST /arm/actions/act\nPrefer: wait=10");
  a.bench.run();
  CHECK(a.post().status == 204);
  CHECK(a.bench.answer(first)->status == 409);
  CHECK(a.status("i1") == "cancelled");
  CHECK(a.status("i2") == "running");
  CHECK(a.cancels == 1);
  CHECK(a.open[0].cancelled());
  CHECK_FALSE(a.open[1].cancelled());
  a.open[0].succeed();  // no effect
  CHECK(a.status("i1") == "cancelled");
  CHECK(a.status("i2") == "running");
  // One that has not begun never begins.
  (void)a.bench.send("POST /arm/actions/act");
  (void)a.bench.send("POST /arm/actions/act");
  a.bench.run();
  CHECK(a.status("i3") == "cancelled");
  CHECK(a.status("i4") == "running");
  CHECK(a.open.size() == 3);
  // An input that is refused cancels nothing.
  CHECK(a.bench.turtle("POST", "/arm/actions/act", "] .").status == 400);
  CHECK(a.status("i4") == "running");
}

TEST_CASE("policy queue: one after the other, and 429 when the queue is full", "[engine][R0.6][R0.8]") {
  Acting a(ActionPolicy::queue(2));
  a.post();
  a.post();
  a.post();
  CHECK(a.open.size() == 1);
  CHECK(a.status("i1") == "running");
  CHECK(a.status("i2") == "pending");
  const Answer full = a.post();
  CHECK(full.status == 429);
  CHECK(full.has("Retry-After"));
  a.open[0].succeed();
  a.bench.run();
  CHECK(a.open.size() == 2);
  CHECK(a.status("i2") == "running");
  CHECK(a.bench.ask("DELETE /arm/actions/act/i3").status == 204);  // waits in the queue
  CHECK(a.status("i3") == "cancelled");
  a.open[1].fail("x");
  a.bench.run();
  CHECK(a.open.size() == 2);
  CHECK(a.post().status == 204);
  CHECK(a.open.size() == 3);
}

TEST_CASE("policy reject: 409 while one is under way", "[engine][R0.6]") {
  Acting a(ActionPolicy::reject());
  CHECK(a.post().status == 204);
  CHECK(a.post().status == 409);
  a.open[0].succeed();
  CHECK(a.post().status == 204);
  CHECK(a.open.size() == 2);
}

TEST_CASE("policy parallel: as many as it says at once, then 429", "[engine][R0.6]") {
  Acting a(ActionPolicy::parallel(2));
  CHECK(a.post().status == 204);
  CHECK(a.post().status == 204);
  CHECK(a.post().status == 429);
  CHECK(a.open.size() == 2);
  a.open[1].succeed();
  CHECK(a.post().status == 204);
}

TEST_CASE("DELETE cancels a pending or running invocation, which stays, and removes a finished one", "[engine][R0.5][R0.6]") {
  Acting a;
  SECTION("running") {
    a.post();
    a.open[0].progress(0.5);
    const Answer deleted = a.bench.ask("DELETE /arm/actions/act/i1");
    CHECK(deleted.status == 204);
    CHECK(a.cancels == 1);
    CHECK(a.open[0].cancelled());
    CHECK(missing(a.bench.get("/arm/actions/act/i1"),
                  "<arm/actions/act/i1> lrt:status lrt:cancelled ; lrt:progress \"0.5\"^^xsd:double ;"
                  " prov:endedAtTime [] .") == "");
  }
  SECTION("pending") {
    (void)a.bench.send("POST /arm/actions/act");
    CHECK(a.bench.send("DELETE /arm/actions/act/i1").answer.status == 204);
    a.bench.run();
    CHECK(a.open.empty());  // never begun
  }
  CHECK(a.status("i1") == "cancelled");
  CHECK(a.bench.ask("DELETE /arm/actions/act/i1").status == 204);
  CHECK(a.bench.get("/arm/actions/act/i1").status == 404);
  CHECK(a.bench.ask("DELETE /arm/actions/act/i1").status == 404);
  CHECK(a.post().status == 204);  // the way is free
  CHECK(a.status("i2") == "running");
}

TEST_CASE("on_cancel on an invocation that was cancelled already runs at once", "[engine][R0.5]") {
  Bench bench;
  std::optional<Responder> kept;
  Thing thing{"arm"};
  thing.action("act", [&](Responder done) { kept = std::move(done); });
  bench.add(std::move(thing));
  bench.ask("POST /arm/actions/act");
  bench.ask("DELETE /arm/actions/act/i1");
  int calls = 0;
  kept->on_cancel([&] { ++calls; });
  CHECK(calls == 1);
}

TEST_CASE("a hook that throws does no harm", "[engine][R0.6]") {
  Bench bench;
  std::optional<Responder> kept;
  Thing thing{"arm"};
  thing.action("act", [&](Responder done) {
    done.on_cancel([] { throw 1; });
    kept = std::move(done);
  });
  bench.add(std::move(thing));
  bench.ask("POST /arm/actions/act");
  CHECK(bench.ask("DELETE /arm/actions/act/i1").status == 204);
  CHECK(bench.get("/arm/actions/act/i1").status == 200);
}

TEST_CASE("an action invoked 10,000 times keeps the newest finished invocations only", "[engine][R0.8]") {
  engine::EngineOptions options;
  options.max_finished_invocations = 32;
  Bench bench(options);
  int calls = 0;
  Thing thing{"arm"};
  thing.action("act", [&] { ++calls; });
  bench.add(std::move(thing));
  for (int i = 0; i < 10'000; ++i) REQUIRE(bench.ask("POST /arm/actions/act").status == 204);
  CHECK(calls == 10'000);
  CHECK(bench.get("/arm/actions/act").graph().objects(rdf::iri("http://localhost/arm/actions/act"), vocab::lrt_::invocation).size() == 32);
  CHECK(bench.get("/arm/actions/act/i10000").status == 200);
  CHECK(bench.get("/arm/actions/act/i9969").status == 200);
  CHECK(bench.get("/arm/actions/act/i9968").status == 404);
  CHECK(bench.get("/arm/actions/act/i1").status == 404);
}

TEST_CASE("no finished invocation at all may be kept", "[engine][R0.8]") {
  engine::EngineOptions options;
  options.max_finished_invocations = 0;
  Acting a(ActionPolicy::preempt(), options);
  a.post();
  a.post();
  CHECK(a.status("i1") == "404");
  CHECK(a.bench.ask("DELETE /arm/actions/act/i2").status == 204);
  CHECK(a.status("i2") == "404");
  CHECK(a.bench.get("/arm/actions/act").status == 200);
}

TEST_CASE("a client that leaves does not stop its invocation", "[engine][R0.8]") {
  Acting a;
  const auto sent = a.bench.send("POST /arm/actions/act\nPrefer: wait=100");
  a.bench.run();
  a.bench.engine.abandon(*sent.ticket);
  a.open[0].succeed();
  a.bench.collect();
  CHECK(a.status("i1") == "succeeded");
}

namespace {

/// A thing "arm" with an action "grip" that the robot offers or not.
struct Gripping {
  explicit Gripping(engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing thing{"arm"};
    grip = thing.action("grip", [this](Responder done) { open.push_back(std::move(done)); }).predicate(Iri{"http://example.org/grips"});
    thing.action("home", [] {});
    bench.add(std::move(thing));
  }
  int post() { return bench.ask("POST /arm/actions/grip").status; }
  Action grip;
  std::vector<Responder> open;
  Bench bench;
};

}  // namespace

TEST_CASE("an action that is not available is neither linked nor invoked, and says why", "[engine][R1.10]") {
  Gripping robot;
  Bench& bench = robot.bench;
  const std::string before = bench.get("/arm").field("ETag");
  const std::string action_before = bench.get("/arm/actions/grip").field("ETag");
  CHECK(missing(bench.get("/arm"), "<arm> hybrit:action <arm/actions/grip> ; <http://example.org/grips> <arm/actions/grip> .") == "");
  robot.grip.available(false, "the gripper is empty");

  const Answer refused = bench.ask("POST /arm/actions/grip");
  CHECK(refused.status == 409);
  CHECK(refused.body.find("action \\\"/arm/actions/grip\\\" is not available now: the gripper is empty") != std::string::npos);
  CHECK(bench.ask("POST /arm/actions/grip\nContent-Type: application/json\n\n]").status == 409);  // judged before the body
  CHECK(bench.ask("POST /arm/actions/grip\nPrefer: respond-async").status == 409);
  CHECK(robot.open.empty());

  const std::string iri = "http://localhost/arm/actions/grip";
  for (const char* path : {"/arm", "/arm/state"}) {
    CAPTURE(path);
    const Answer a = bench.get(path);
    CHECK(a.body.find("grip") == std::string::npos);
    CHECK_FALSE(a.links_to(iri, "related"));
    CHECK(bench.ask(std::string("OPTIONS ") + path).field("Link").find("grip") == std::string::npos);
  }
  CHECK(bench.get("/arm").field("ETag") != before);
  CHECK(bench.get("/arm").links_to("http://localhost/arm/actions/home", "related"));
  CHECK(bench.ask("GET /arm\nAccept: application/json").body.find("grip") == std::string::npos);

  const Answer action = bench.get("/arm/actions/grip");
  CHECK(action.status == 200);
  CHECK(action.field("ETag") != action_before);
  CHECK(missing(action, "<arm/actions/grip> a hybrit:Action ; lrt:unavailable \"the gripper is empty\" .") == "");
  CHECK(bench.ask("GET /arm/actions/grip\nAccept: application/json").body.find(R"("unavailable":"the gripper is empty")") != std::string::npos);

  robot.grip.available(true);
  CHECK(bench.get("/arm").field("ETag") == before);
  CHECK(bench.get("/arm/actions/grip").field("ETag") == action_before);
  CHECK(robot.post() == 204);
  CHECK(robot.open.size() == 1);
}

TEST_CASE("observers of a thing, its state and the action get the new representation when its availability changes", "[engine][R0.12]") {
  Gripping robot;
  Bench& bench = robot.bench;
  const char* const path = GENERATE("/arm", "/arm/state", "/arm/actions/grip");
  CAPTURE(path);
  const engine::Channel channel = bench.open(path);
  bench.messages(channel);
  for (int i = 0; i < 100; ++i) {  // the scanner sleeps
    bench.look();
    CHECK(bench.messages(channel).empty());
  }
  robot.grip.available(false, "the gripper is empty");
  bench.look();
  std::vector<std::string> messages = bench.messages(channel);
  REQUIRE(messages.size() == 1);
  CHECK(messages[0] == bench.get(path).body);
  CHECK((messages[0].find("hybrit:action <http://localhost/arm/actions/grip>") == std::string::npos));
  robot.grip.available(false, "the gripper is empty");
  bench.look();
  CHECK(bench.messages(channel).empty());
  robot.grip.available(false, "the gripper is closed");
  bench.look();
  CHECK(bench.messages(channel).size() == (std::string_view(path) == "/arm/actions/grip" ? 1 : 0));
  robot.grip.available(true);
  bench.look();
  messages = bench.messages(channel);
  REQUIRE(messages.size() == 1);
  CHECK(messages[0].find("unavailable") == std::string::npos);
  CHECK(messages[0] == bench.get(path).body);
}

TEST_CASE("a change of availability wakes a sleeping engine once, and only if something is observed", "[engine][R0.12]") {
  struct Counter final : Waker {
    void wake() noexcept override { ++calls; }
    int calls = 0;
  };
  Gripping robot;
  const auto waker = std::make_shared<Counter>();
  robot.bench.engine.set_waker(waker);
  robot.grip.available(false, "the gripper is empty");
  robot.grip.available(true);
  CHECK(waker->calls == 0);
  const engine::Channel channel = robot.bench.open("/arm");
  for (int i = 0; i < 100; ++i) {
    robot.bench.look();
    robot.bench.messages(channel);
  }
  CHECK_FALSE(robot.bench.engine.next_deadline());
  waker->calls = 0;
  robot.grip.available(false, "the gripper is empty");
  robot.grip.available(true);
  robot.grip.available(false, "the gripper is empty");
  CHECK(waker->calls == 1);
  CHECK(robot.bench.messages(channel).size() == 1);
}

TEST_CASE("an action that becomes unavailable continues what runs and fails what waits", "[engine][R0.6]") {
  Gripping robot;
  Bench& bench = robot.bench;
  REQUIRE(robot.post() == 204);
  REQUIRE(robot.post() == 202);  // in the queue
  const Bench::Sent waiting = bench.send("POST /arm/actions/grip\nPrefer: wait=10");
  robot.grip.available(false, "the gripper is empty");
  REQUIRE(robot.open.size() == 1);
  robot.open[0].progress(0.5);
  CHECK(missing(bench.get("/arm/actions/grip/i1"), "<arm/actions/grip/i1> lrt:status lrt:running ; lrt:progress \"0.5\"^^xsd:double .") == "");
  robot.open[0].succeed();
  bench.run();
  CHECK(missing(bench.get("/arm/actions/grip/i1"), "<arm/actions/grip/i1> lrt:status lrt:succeeded .") == "");
  const Answer queued = bench.get("/arm/actions/grip/i2");
  CHECK(missing(queued, "<arm/actions/grip/i2> lrt:status lrt:failed ; lrt:error \"not available now: the gripper is empty\" .") == "");
  CHECK(queued.body.find("startedAtTime") == std::string::npos);
  CHECK(bench.answer(waiting)->status == 409);
  CHECK(robot.open.size() == 1);
}

TEST_CASE("an action that becomes unavailable before its lambda is called does not call it", "[engine][R0.6]") {
  Gripping robot;
  const Bench::Sent sent = robot.bench.send("POST /arm/actions/grip");
  REQUIRE_FALSE(robot.bench.answer(sent));
  robot.grip.available(false, "the gripper is empty");
  robot.bench.run();
  CHECK(robot.open.empty());
  const auto answer = robot.bench.answer(sent);
  REQUIRE(answer);
  CHECK(answer->status == 409);
  CHECK(answer->body.find("the gripper is empty") != std::string::npos);
}

TEST_CASE("an action may be unavailable from its registration, and after its thing is gone nothing happens", "[engine]") {
  Bench bench;
  Thing thing{"arm"};
  Action grip = thing.action("grip", [] {}).available(false, "home first");
  bench.add(std::move(thing));
  CHECK(bench.get("/arm").body.find("grip") == std::string::npos);
  CHECK(bench.ask("POST /arm/actions/grip").status == 409);
  bench.engine.remove("arm").value();
  grip.available(true);
  CHECK(bench.get("/").status == 200);
}

TEST_CASE("available() may be called from any thread while clients read and invoke", "[engine]") {
  Gripping robot;
  std::atomic<bool> stop{false};
  std::vector<std::thread> threads;
  for (const bool yes : {true, false})
    threads.emplace_back([&stop, yes, grip = robot.grip]() mutable {
      while (!stop) grip.available(yes, "the gripper is empty");
    });
  const engine::Channel channel = robot.bench.open("/arm");
  for (int i = 0; i < 200; ++i) {
    robot.bench.get("/arm");
    const int status = robot.post();
    CHECK((status == 204 || status == 202 || status == 409 || status == 429));
    robot.bench.look();
    robot.bench.messages(channel);
  }
  stop = true;
  for (std::thread& t : threads) t.join();
  robot.grip.available(true);
  CHECK(robot.bench.get("/arm").body.find("grip") != std::string::npos);
}

TEST_CASE("an action states its effect on properties as shapes that they conform to afterwards", "[engine][R1.10]") {
  Bench bench;
  Thing thing{"arm"};
  double position = 1;
  std::string mode = "open";
  const auto angle = thing.property(
      "angle", [&] { return position; }, unit::radian);
  const auto state = thing.property("mode", [&] { return mode; });
  thing.action("turn", [&](double to) { position = to; }).effect(angle, from_input).effect(state);
  thing.action("close", [&] { mode = "closed"; })
      .effect(state, "closed")
      .effect(angle, 0)
      .effect_turtle("<#effect> <http://example.org/leaves> <../mode> .");
  thing.action("hand", [] {}).effect("hand/grip");
  bench.add(std::move(thing));
  CHECK(missing(bench.get("/arm/actions/turn"),
                with_kind("<arm/actions/turn> hybrit:produces <arm/actions/turn#effect-1> , <arm/actions/turn#effect-2> ; hybrit:consumes _:input ."
                          "<arm/actions/turn#effect-1> a sh:NodeShape ; sosa:forProperty <arm/angle> ; sh:node <KIND#angle> ; lrt:valueFrom _:input ."
                          "<arm/actions/turn#effect-2> sosa:forProperty <arm/mode> ; sh:node <KIND#mode> .",
                          kind_of(bench, "/arm"))) == "");
  const Answer closing = bench.get("/arm/actions/close");
  CHECK(missing(
            closing,
            "<arm/actions/close> hybrit:produces <arm/actions/close#effect> . <arm/actions/close#effect> <http://example.org/leaves> <arm/mode> .") ==
        "");
  // Nothing of it is a claim about the present: no validator of all graphs finds a violation.
  CHECK_FALSE(closing.says("sh:target"));

  const auto conforms = [&](const std::string& property, const std::string& effect) {
    const auto compiled = shacl::Shapes::compile(together(bench.get("/arm/blueprint").graph(), closing.graph())).value();
    const rdf::Graph data = bench.get("/arm/" + property).graph();
    return shacl::validate(compiled, data, rdf::iri("http://localhost/arm/" + property), rdf::iri("http://localhost/arm/actions/close#" + effect))
        .value()
        .conforms();
  };
  CHECK_FALSE(conforms("mode", "effect-1"));
  CHECK_FALSE(conforms("angle", "effect-2"));
  mode = "closed";
  position = 0;
  CHECK(conforms("mode", "effect-1"));
  CHECK(conforms("angle", "effect-2"));

  // A property that is not there yet is linked nevertheless.
  CHECK(missing(bench.get("/arm/actions/hand"), "<arm/actions/hand#effect-1> sosa:forProperty <hand/grip> .") == "");
  CHECK_FALSE(bench.get("/arm/actions/hand").says("sh:node "));
  Thing hand{"hand"};
  hand.property("grip", [] { return 1.0; });
  bench.add(std::move(hand));
  CHECK(missing(bench.get("/arm/actions/hand"), with_kind("<arm/actions/hand#effect-1> sh:node <KIND#grip> .", kind_of(bench, "/hand"))) == "");
}

TEST_CASE("an effect says how near the property comes to the input, and which fields are meant", "[engine][R1.10]") {
  Bench bench;
  Thing thing{"base"};
  Place place{0, 0};
  double heading = 0;
  const auto pose = thing.property("place", [&] { return place; });
  const auto angle = thing.property(
      "heading", [&] { return heading; }, unit::radian);
  thing.action("drive", [](const Place&) {})
      .effect(pose, from_input.field("x", "y").within(0.25))
      .effect(pose, from_input.field("y", "x"))
      .effect(angle, from_input.field("y").modulo(2).within(0.5))
      .effect("base/other", from_input.field("x"));
  bench.add(std::move(thing));
  const std::string vocabulary = "http://localhost/ns/vocabulary#Place/";
  CHECK(missing(bench.get("/base/actions/drive"),
                "<base/actions/drive> hybrit:consumes _:input ."
                "<base/actions/drive#effect-1> sosa:forProperty <base/place> ; sh:property <base/actions/drive#effect-1.1> ."
                "<base/actions/drive#effect-1.1> sh:path <" +
                    vocabulary + "y> ; lrt:valueFrom _:input ; lrt:inputField <" + vocabulary +
                    "x> ; lrt:tolerance <base/actions/drive#effect-1.1.tolerance> ."
                    "<base/actions/drive#effect-1.1.tolerance> a maths:Scalar ; vom:numericalValue \"0.25\"^^xsd:double ; qudt:hasUnit unit:M ."
                    "<base/actions/drive#effect-2> sosa:forProperty <base/heading> ; lrt:valueFrom _:input ; lrt:inputField <" +
                    vocabulary +
                    "y> ; lrt:period <base/actions/drive#effect-2.period> ; lrt:tolerance <base/actions/drive#effect-2.tolerance> ."
                    "<base/actions/drive#effect-2.period> vom:numericalValue \"2\"^^xsd:double ; qudt:hasUnit unit:RAD ."
                    "<base/actions/drive#effect-3> sosa:forProperty <base/other> ; lrt:valueFrom _:input ."
                    "<base/actions/drive#effect-1> sh:property <base/actions/drive#effect-1.2> ."
                    "<base/actions/drive#effect-1.2> sh:path <" +
                    vocabulary + "x> ; lrt:valueFrom _:input ; lrt:inputField <" + vocabulary + "y> .") == "");
  CHECK_FALSE(bench.get("/base/actions/drive").says("effect-3.tolerance"));
  CHECK(bench.ask("GET /base/actions/drive\nAccept: application/json")
            .says("\"effects\":[{\"property\":\"http://localhost/base/place\",\"field\":\"y\",\"valueFrom\":\"input\",\"inputField\":\"x\","
                  "\"tolerance\":0.25},{\"property\":\"http://localhost/base/place\",\"field\":\"x\",\"valueFrom\":\"input\",\"inputField\":\"y\"},"
                  "{\"property\":\"http://localhost/base/heading\",\"valueFrom\":\"input\",\"inputField\":\"y\",\"tolerance\":0.5,\"period\":2}]"));
}

TEST_CASE("an effect that cannot be true is refused when the thing is added", "[engine][R1.10]") {
  Bench bench;
  const auto said = [&](auto describe) {
    Thing thing{"base"};
    double heading = 0;
    const auto angle = thing.property("heading", [heading] { return heading; });
    const auto place = thing.property("place", [] { return Place{}; });
    const auto name = thing.property("name", [] { return std::string(); });
    Action turn = thing.action("turn", [](double) {});
    Action drive = thing.action("drive", [](const Place&) {});
    Action call = thing.action("call", [](const std::string&) {});
    describe(turn, drive, call, angle, place, name);
    const Result<void> added = bench.engine.add(std::move(thing));
    if (added) return std::string(bench.engine.remove("base") ? "" : "not removed");
    CHECK(added.error().code == Errc::invalid_option);
    return added.error().message;
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  CHECK(said([](auto& turn, auto& drive, auto& call, auto& angle, auto& place, auto& name) {
          turn.effect(angle, from_input.within(0)).effect(place, from_input.field("", "x"));
          drive.effect(place, from_input).effect(angle, from_input.field("x"));
          call.effect(name, from_input).effect(angle);
        }) == "");
  CHECK(has(said([](auto& turn, auto&, auto&, auto&, auto& place, auto&) { turn.effect(place, from_input); }), "different types"));
  CHECK(has(said([](auto&, auto&, auto& call, auto& angle, auto&, auto&) { call.effect(angle, from_input); }), "different types"));
  CHECK(has(said([](auto&, auto& drive, auto&, auto& angle, auto&, auto&) { drive.effect(angle, from_input.field("z")); }), "no field \"z\""));
  CHECK(has(said([](auto& turn, auto&, auto&, auto&, auto& place, auto&) { turn.effect(place, from_input.field("", "z")); }), "no field \"z\""));
  CHECK(has(said([](auto& turn, auto&, auto&, auto& angle, auto&, auto&) { turn.effect(angle, from_input.within(-1)); }), "at least 0"));
  CHECK(has(said([](auto& turn, auto&, auto&, auto& angle, auto&, auto&) { turn.effect(angle, from_input.modulo(NAN)); }), "at least 0"));
  CHECK(has(said([](auto&, auto&, auto& call, auto&, auto&, auto& name) { call.effect(name, from_input.within(1)); }), "needs numbers"));
  CHECK(has(said([](auto&, auto& drive, auto&, auto& angle, auto&, auto&) {
              drive.effect(angle, from_input.field("x")).effect(angle, from_input.field("y"));
            }),
            "two effects"));
  CHECK(has(said([](auto&, auto& drive, auto&, auto&, auto&, auto&) { drive.consumes("z", Facets().at_least(0)); }), "a record with this field"));
  CHECK(has(said([](auto& turn, auto&, auto&, auto&, auto&, auto&) { turn.consumes("x", Facets().at_least(0)); }), "a record with this field"));
}

TEST_CASE("the bounds of a field of the input may be known at run time only", "[engine][R0.6]") {
  Bench bench;
  const auto mover = [](const char* path, double reach) {
    Thing thing{path};
    thing.action("drive", [](const Place&) {}).consumes("x", Facets().between(-reach, reach));
    thing.action("drag", [](const Place&) {});
    return thing;
  };
  bench.add(mover("near", 1));
  bench.add(mover("far", 100));
  bench.add(mover("other", 100));
  const auto status = [&](const char* path, const char* x) {
    return bench.ask(std::string("POST /") + path + "\nContent-Type: application/json\n\n{\"x\":" + x + ",\"y\":0}").status;
  };
  CHECK(status("near/actions/drive", "1") == 204);
  CHECK(status("near/actions/drive", "1.5") == 422);
  CHECK(status("near/actions/drag", "1.5") == 204);  // the record itself has no bounds
  CHECK(status("far/actions/drive", "100") == 204);
  CHECK(status("far/actions/drive", "-101") == 422);
  CHECK(kind_of(bench, "/far") == kind_of(bench, "/other"));
  CHECK(kind_of(bench, "/far") != kind_of(bench, "/near"));
  CHECK(bench.engine.remove("near"));
  CHECK(bench.get("/ns/vocabulary").says("Place"));
}

TEST_CASE("the effect of a record is stated for each of its fields", "[engine][R1.10]") {
  Bench bench;
  Thing thing{"arm"};
  std::vector<std::array<double, 2>> path = {{1, 2}};
  const auto points = thing.property("path", [&] { return path; });
  thing.action("reset", [&] { path = {{0, 0}, {3, 4}}; }).effect(points, {{0, 0}, {3, 4}});
  bench.add(std::move(thing));
  const auto conforms = [&] {
    const auto compiled = shacl::Shapes::compile(together(bench.get("/arm/blueprint").graph(), bench.get("/arm/actions/reset").graph())).value();
    const rdf::Graph data = bench.get("/arm/path").graph();
    return shacl::validate(compiled, data, rdf::iri("http://localhost/arm/path"), rdf::iri("http://localhost/arm/actions/reset#effect-1"))
        .value()
        .conforms();
  };
  CHECK_FALSE(conforms());
  CHECK(bench.ask("POST /arm/actions/reset").status == 204);
  CHECK(conforms());
}

TEST_CASE("an effect, header field or part that cannot be published is an error of add()", "[engine]") {
  const auto error = [](auto describe) {
    Bench bench;
    Thing thing{"arm"};
    Action turn = thing.action("turn", [](double) {}), home = thing.action("home", [] {});
    const auto angle = thing.property("angle", [] { return 1.0; });
    describe(turn, home, angle);
    const Result<void> added = bench.engine.add(std::move(thing));
    return added ? std::string("none") : std::string(to_string(added.error().code)) + " " + added.error().message;
  };
  CHECK(error([](auto&, auto&, auto&) {}) == "none");
  CHECK(error([](auto&, auto& home, auto& angle) { home.effect(angle, from_input); }) ==
        "invalid_option action \"arm/actions/home\": effect(\"/arm/angle\", lrt::from_input): expected an action with an input, found none; use "
        "effect(property, value) or effect(property)");
  CHECK(error([](auto& turn, auto&, auto&) { turn.effect("arm//angle"); }).find("expected_iri action \"arm/actions/turn\": path \"arm//angle\"") ==
        0);
  CHECK(error([](auto& turn, auto&, auto&) { turn.composed_of("/"); }).find("expected_iri") == 0);
  CHECK(error([](auto& turn, auto&, auto&) { turn.effect_turtle("<#effect> a ."); }).find("expected_rdf action \"arm/actions/turn\", its effect") ==
        0);
  CHECK(error([](auto& turn, auto&, auto&) { turn.effect_turtle("<> a <http://example.org/x> ."); }) ==
        "expected_rdf action \"arm/actions/turn\", its effect: it does not describe <#effect>");
  CHECK(error([](auto& turn, auto&, auto&) { turn.header("X Y", "1"); }) ==
        "expected_http action \"arm/actions/turn\": expected a header field, found \"X Y: 1\"");
  CHECK(error([](auto& turn, auto&, auto&) { turn.header("X", "1\r\nY: 2"); }).find("expected_http") == 0);
  CHECK(error([](auto& turn, auto&, auto&) { turn.header("", "1"); }).find("expected_http") == 0);
}

TEST_CASE("a binding has the header fields of the request, which works", "[engine][R1.10]") {
  Bench bench;
  Thing thing{"arm"};
  thing.action("turn", [](double) {}).header("Prefer", "respond-async").header("ACCEPT", "application/json");
  thing.action("home", [] {}).header("Cache-Control", "no-cache");
  bench.add(std::move(thing));
  const auto fields = [&](const std::string& action) {
    const rdf::Graph graph = bench.get(action).graph();
    const auto binding = graph.object(rdf::iri("http://localhost" + action), vocab::hybrit::binding).value();
    std::string all;
    auto cell = graph.object(binding, vocab::http_core::headers).value();
    while (cell.text != vocab::rdf_::nil.text) {
      const auto header = graph.object(cell, vocab::rdf_::first).value();
      const std::string_view name = graph.object(header, vocab::http_core::fieldName).value().text;
      const Iri wanted = name == "Content-Type"    ? vocab::http_core::EntityHeader
                         : name == "Cache-Control" ? vocab::http_core::GeneralHeader
                                                   : vocab::http_core::RequestHeader;
      CHECK(graph.object(header, vocab::rdf_::type).value().text == wanted.text);
      all += std::string(graph.object(header, vocab::http_core::fieldName).value().text) + ": " +
             std::string(graph.object(header, vocab::http_core::fieldValue).value().text) + "\n";
      cell = graph.object(cell, vocab::rdf_::rest).value();
    }
    return all;
  };
  CHECK(fields("/arm/actions/home") == "Accept: text/turtle\nCache-Control: no-cache\n");
  const std::string turn = fields("/arm/actions/turn");
  CHECK(turn == "Content-Type: text/turtle\nPrefer: respond-async\nACCEPT: application/json\n");
  CHECK(bench.ask("POST /arm/actions/turn\n" + turn + "\n<> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 1 .").status == 202);
  CHECK(bench.ask("GET /arm/actions/turn\nAccept: application/json").says(R"("headers":{"Prefer":"respond-async","ACCEPT":"application/json"})"));
}

TEST_CASE("an action links to the actions that it is composed of, also where those have moved aside", "[engine][R1.10]") {
  Bench bench;
  Thing thing{"arm"}, joint{"arm/j1"};
  Action turn = joint.action("turn", [] {});
  thing.action("move", [] {}).composed_of(turn).composed_of("arm/j2/actions/turn");
  bench.add(std::move(thing));
  CHECK(missing(bench.get("/arm/actions/move"), "<arm/actions/move> dcterms:hasPart <arm/j1/actions/turn> , <arm/j2/actions/turn> .") == "");
  bench.add(std::move(joint));
  CHECK(missing(bench.get("/arm/actions/move"), "<arm/j1/actions/turn> a hybrit:Action .") == "");
  CHECK(bench.ask("GET /arm/actions/move\nAccept: application/json")
            .says(R"("parts":[{"href":"http://localhost/arm/j1/actions/turn","kind":"action")"));
  bench.add(Thing("arm/j1/actions/turn"));
  CHECK(missing(bench.get("/arm/actions/move"), "<arm/actions/move> dcterms:hasPart <arm/j1/actions-lrt/turn> .") == "");
}
