// SPDX-License-Identifier: Apache-2.0
#include "src/engine/pending_saves.hpp"

#include <chrono>
#include <string>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string callback = "\nUpgrade: callback\nCallback: http://127.0.0.1:9/receiver";

engine::EngineOptions saving() {
  engine::EngineOptions options;
  options.callbacks.allow = {"127.0.0.0/8"};
  options.save_timeout = std::chrono::seconds(10);
  return options;
}

struct Arm {
  explicit Arm(engine::EngineOptions options = saving()) : bench(std::move(options)) { bench.add(robot.arm()); }
  /// As the server: takes the text, and says what became of it.
  std::string save(bool written = true) {
    auto saved = bench.take_saved();
    if (!saved) return "(nothing)";
    bench.engine.saved(saved->revision, written);
    return saved->text;
  }
  std::size_t count() { return bench.get("/arm/subscriptions").linked("related").size(); }
  bool has_posts() {
    (void)bench.pushes();
    return !bench.take_callbacks().empty();
  }
  std::string make() {
    const Bench::Sent sent = bench.send("GET /arm/angle" + callback);
    save();
    return bench.answer(sent).value().field("Location").substr(16);  // without http://localhost
  }

  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("the 201 of a callback and its first notification wait until it is saved", "[engine][saves][R0.13]") {
  Arm arm;
  const std::string body =
      "<> a hybrit:WebCallback ; hybrit:onResource <../arm/angle> ; hybrit:callbackURL "
      "\"http://127.0.0.1:9/receiver\"^^xsd:anyURI .";
  for (const std::string& request : {"GET /arm/angle" + callback, "GET /arm" + callback, Bench::turtle_request("POST", "/arm/subscriptions", body)}) {
    INFO(request);
    const Bench::Sent sent = arm.bench.send(request);
    arm.bench.run();
    REQUIRE(sent.ticket);
    CHECK_FALSE(arm.bench.answer(sent));
    CHECK_FALSE(arm.has_posts());
    CHECK(arm.save().find("127.0.0.1:9/receiver") != std::string::npos);
    const auto answer = arm.bench.answer(sent);
    REQUIRE(answer);
    CHECK(answer->status == 201);
    CHECK(arm.bench.get(answer->field("Location").substr(16)).status == 200);
    CHECK(arm.has_posts());
    CHECK(arm.save() == "(nothing)");
  }
}

TEST_CASE("a callback whose body is judged on another thread waits twice, and gets one response", "[engine][saves]") {
  engine::EngineOptions options = saving();
  options.body_jobs = true;
  Arm arm(std::move(options));
  const std::string body = "#" + std::string(5000, 'x') +
                           "\n<> a hybrit:WebCallback ; hybrit:onResource <../arm/angle> ; hybrit:callbackURL "
                           "\"http://127.0.0.1:9/receiver\"^^xsd:anyURI .";
  for (const bool written : {true, false}) {
    const Bench::Sent sent = arm.bench.send(Bench::turtle_request("POST", "/arm/subscriptions", body));
    auto jobs = arm.bench.take_body_jobs();
    REQUIRE(jobs.size() == 1);
    CHECK(arm.save() == "(nothing)");
    jobs[0].run();
    CHECK_FALSE(arm.bench.answer(sent));
    arm.save(written);
    CHECK(arm.bench.answer(sent).value().status == (written ? 201 : 503));
    arm.save();
    CHECK(arm.count() == 1);
  }
}

TEST_CASE("a callback of a property that is read first waits twice, and gets one response", "[engine][saves]") {
  Arm arm;
  Thing thing{"pulled"};
  thing.property("value", [] { return 1.0; });
  arm.bench.add(std::move(thing));
  const Bench::Sent sent = arm.bench.send("GET /pulled/value" + callback);
  REQUIRE(sent.ticket);
  arm.bench.run();
  CHECK_FALSE(arm.bench.answer(sent));
  arm.save();
  CHECK(arm.bench.answer(sent).value().status == 201);
}

TEST_CASE("a callback that cannot be saved is 503 and does not exist afterwards", "[engine][saves]") {
  Arm arm;
  const Bench::Sent sent = arm.bench.send("GET /arm/angle" + callback);
  arm.save(false);
  const auto answer = arm.bench.answer(sent);
  REQUIRE(answer);
  CHECK(answer->status == 503);
  CHECK_FALSE(answer->field("Retry-After").empty());
  CHECK(answer->field("Content-Type").find("application/problem+json") == 0);
  CHECK(arm.count() == 0);
  CHECK_FALSE(arm.has_posts());
  CHECK(arm.save().find("receiver") == std::string::npos);  // nor is it left in the file
}

TEST_CASE("the 204 of a cancellation waits until the file is without it; if that fails the callback continues", "[engine][saves]") {
  Arm arm;
  const std::string path = arm.make();
  (void)arm.has_posts();
  const Bench::Sent failing = arm.bench.send("DELETE " + path);
  CHECK_FALSE(arm.bench.answer(failing));
  CHECK(arm.save(false).find("receiver") == std::string::npos);
  CHECK(arm.bench.answer(failing).value().status == 503);
  CHECK(arm.bench.get(path).status == 200);
  CHECK(arm.save().find("receiver") != std::string::npos);

  const Bench::Sent first = arm.bench.send("DELETE " + path), second = arm.bench.send("DELETE " + path);
  CHECK_FALSE(arm.bench.answer(first));
  CHECK(arm.save().find("receiver") == std::string::npos);
  CHECK(arm.bench.answer(first).value().status == 204);
  CHECK(arm.bench.answer(second).value().status == 204);
  CHECK(arm.bench.get(path).status == 404);
  CHECK(arm.save() == "(nothing)");  // it has gone from the file already
}

TEST_CASE("a cancellation that is saved counts, also if another one failed before", "[engine][saves]") {
  Arm arm;
  const std::string path = arm.make();
  const Bench::Sent first = arm.bench.send("DELETE " + path);
  const auto without_first = arm.bench.take_saved();
  const Bench::Sent second = arm.bench.send("DELETE " + path);
  arm.bench.engine.saved(without_first.value().revision, false);
  CHECK(arm.bench.answer(first).value().status == 503);
  CHECK(arm.save().find("receiver") == std::string::npos);
  CHECK(arm.bench.answer(second).value().status == 204);
  CHECK(arm.bench.get(path).status == 404);
}

TEST_CASE("requests that come together are saved together", "[engine][saves]") {
  Arm arm;
  std::vector<Bench::Sent> sent;
  for (int i = 0; i < 50; ++i) sent.push_back(arm.bench.send("GET /arm/angle" + callback));
  arm.save();
  for (const Bench::Sent& one : sent) CHECK(arm.bench.answer(one).value().status == 201);
  CHECK(arm.count() == 50);
}

TEST_CASE("a later text does not confirm what it does not have", "[engine][saves]") {
  Arm arm;
  const Bench::Sent first = arm.bench.send("GET /arm/angle" + callback);
  const auto text = arm.bench.take_saved();
  const Bench::Sent second = arm.bench.send("GET /arm/angle" + callback);
  arm.bench.engine.saved(text.value().revision, true);
  CHECK(arm.bench.answer(first).value().status == 201);
  CHECK_FALSE(arm.bench.answer(second));
  arm.save();
  CHECK(arm.bench.answer(second).value().status == 201);
}

TEST_CASE("a disk that does not respond is 503 after save_timeout, and what waited is taken back", "[engine][saves]") {
  Arm arm;
  const std::string path = arm.make();
  const Bench::Sent made = arm.bench.send("GET /arm/angle" + callback), cancelled = arm.bench.send("DELETE " + path);
  const auto late = arm.bench.take_saved();
  arm.bench.clock.advance(std::chrono::seconds(11));
  CHECK(arm.bench.answer(made).value().status == 503);
  CHECK(arm.bench.answer(cancelled).value().status == 503);
  CHECK(arm.count() == 1);
  CHECK(arm.bench.get(path).status == 200);
  arm.bench.engine.saved(late.value().revision, true);  // the disk goes on: nothing comes back
  arm.bench.collect();
  CHECK(arm.count() == 1);
  const std::string text = arm.save();
  CHECK(text.find("receiver") == text.rfind("receiver"));
}

TEST_CASE("a server that stops takes back what is not saved", "[engine][saves]") {
  Arm arm;
  const std::string path = arm.make();
  const Bench::Sent made = arm.bench.send("GET /arm/angle" + callback), cancelled = arm.bench.send("DELETE " + path);
  arm.bench.engine.stop();
  CHECK(arm.bench.answer(made).value().status == 503);
  CHECK(arm.bench.answer(cancelled).value().status == 503);
  const std::string text = arm.save();
  CHECK(text.find(path.substr(path.rfind('/') + 1)) != std::string::npos);
  CHECK(text.find("receiver") == text.rfind("receiver"));
}

TEST_CASE("a client that left and a Thing that is removed meanwhile do no harm", "[engine][saves]") {
  Arm arm;
  const std::string path = arm.make();
  const Bench::Sent left = arm.bench.send("GET /arm/angle" + callback);
  arm.bench.engine.abandon(*left.ticket);
  const Bench::Sent made = arm.bench.send("GET /arm/angle" + callback), cancelled = arm.bench.send("DELETE " + path);
  REQUIRE(arm.bench.engine.remove("arm"));
  CHECK(arm.save().find("receiver") == std::string::npos);
  CHECK(arm.bench.answer(made));
  CHECK(arm.bench.answer(cancelled).value().status == 204);
}

TEST_CASE("as many requests wait for the disk as may wait; further ones are 503 and change nothing", "[engine][saves]") {
  engine::EngineOptions options = saving();
  options.max_waiting_requests = 3;
  Arm arm(std::move(options));
  std::vector<Bench::Sent> sent;
  for (int i = 0; i < 3; ++i) sent.push_back(arm.bench.send("GET /arm/angle" + callback));
  arm.bench.engine.abandon(*sent[0].ticket);  // a client that leaves makes no place: its change is still being saved
  CHECK(arm.bench.send("GET /arm/angle" + callback).answer.status == 503);
  CHECK(arm.count() == 3);
  arm.save();
  CHECK(arm.bench.answer(sent[1]).value().status == 201);
  CHECK(arm.bench.send("GET /arm/angle" + callback).ticket);
}

TEST_CASE("requests that wait for the disk take no place of others", "[engine][saves]") {
  engine::EngineOptions options = saving();
  options.max_waiting_requests = 3;
  Arm arm(std::move(options));
  Thing thing{"stopping"};
  int stops = 0;
  thing.action("stop", [&] { ++stops; }).dispatch(Dispatch::io_thread);
  arm.bench.add(std::move(thing));
  const std::string path = arm.make();
  std::vector<Bench::Sent> sent;
  for (int i = 0; i < 4; ++i) sent.push_back(arm.bench.send("DELETE " + path));
  CHECK(sent.back().answer.status == 503);
  CHECK(arm.bench.ask("POST /stopping/actions/stop").status < 300);
  CHECK(stops == 1);
  arm.save();
  for (int i = 0; i < 3; ++i) CHECK(arm.bench.answer(sent[static_cast<std::size_t>(i)]).value().status == 204);
}

TEST_CASE("without a file nothing waits", "[engine][saves]") {
  engine::EngineOptions options = saving();
  options.save_timeout.reset();
  Arm arm(std::move(options));
  const Answer made = arm.bench.send("GET /arm/angle" + callback).answer;
  CHECK(made.status == 201);
  CHECK(arm.bench.send("DELETE " + made.field("Location").substr(16)).answer.status == 204);
  CHECK(arm.count() == 0);
}
