// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <atomic>
#include <thread>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// A thing whose every lambda counts its calls.
struct Counting {
  explicit Counting(engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing thing{"arm"};
    thing.property("p", [this] { return ++reads; }).on_write([this](int) { ++writes; });
    pushed = thing.property<int>("pushed");
    thing.action("sync", [this] { ++commands; });
    thing.action("async", [this](Responder done) {
      ++commands;
      done.succeed();
    });
    thing.collection<int>("c").on_create([this](int) { ++creates; }).on_remove([this](const std::string&) { ++removes; });
    bench.add(std::move(thing));
    pushed->publish(1);
  }
  int reads = 0, writes = 0, commands = 0, creates = 0, removes = 0;
  std::optional<PushedProperty<int>> pushed;
  Bench bench;
};

}  // namespace

TEST_CASE("resources without a lambda are served though the host never polls", "[engine][R0.5]") {
  Counting c;
  for (const char* path : {"/", "/arm", "/arm/blueprint", "/arm/subscriptions", "/arm/pushed", "/arm/actions/sync", "/arm/c"}) {
    CAPTURE(path);
    const auto sent = c.bench.send(std::string("GET ") + path);
    CHECK_FALSE(sent.ticket);
    CHECK(sent.answer.status == 200);
  }
  CHECK_FALSE(c.bench.send("POST /arm/actions/async\nPrefer: respond-async").ticket);
  CHECK(c.bench.take_jobs().size() == 1);
}

TEST_CASE("a host that does not poll: 503 with Retry-After after host_time, and nothing is carried out later", "[engine][R0.6][judged_at_once]") {
  engine::EngineOptions options;
  options.host_timeout = milliseconds(1500);
  options.retry_after = seconds(7);
  Counting c(options);
  REQUIRE(c.bench.turtle("POST", "/arm/c", "<> vom:numericalValue 1 .").status == 201);
  c.creates = 0;
  std::vector<Bench::Sent> sent;
  sent.push_back(c.bench.send("GET /arm/p"));
  sent.push_back(c.bench.send("GET /arm/state"));
  sent.push_back(c.bench.send(Bench::turtle_request("PUT", "/arm/p", number_body("1"))));
  sent.push_back(c.bench.send(Bench::turtle_request("PUT", "/arm/p", number_body("1"))));
  sent.push_back(c.bench.send("POST /arm/actions/sync"));
  sent.push_back(c.bench.send("POST /arm/actions/sync"));  // in the queue
  sent.push_back(c.bench.send("POST /arm/actions/async"));
  sent.push_back(c.bench.send(Bench::turtle_request("POST", "/arm/c", "<> vom:numericalValue 1 .")));
  sent.push_back(c.bench.send("DELETE /arm/c/i1"));
  CHECK(c.bench.engine.next_deadline() == c.bench.clock.now().steady + milliseconds(1500));
  c.bench.clock.advance(milliseconds(1499));
  for (const auto& s : sent) CHECK_FALSE(c.bench.answer(s));
  c.bench.clock.advance(milliseconds(1));
  for (std::size_t i = 0; i < sent.size(); ++i) {
    CAPTURE(i);
    const auto answer = c.bench.answer(sent[i]);
    REQUIRE(answer);
    CHECK(answer->status == 503);
    CHECK(answer->field("Retry-After") == "7");
    CHECK(answer->says("in time"));
  }
  c.bench.run();  // the program goes on
  CHECK(c.writes == 0);
  CHECK(c.commands == 0);
  CHECK(c.creates == 0);
  CHECK(c.removes == 0);
  CHECK(c.bench.get("/arm/c/i1").status == 200);
  // And all works again.
  CHECK(c.bench.turtle("PUT", "/arm/p", number_body("1")).status == 204);
  CHECK(c.bench.ask("POST /arm/actions/sync").status == 204);
  CHECK(c.bench.turtle("POST", "/arm/c", "<> vom:numericalValue 1 .").status == 201);
  CHECK(c.bench.ask("DELETE /arm/c/i1").status == 204);
  CHECK(c.commands == 1);
  CHECK(c.bench.ask("POST /arm/actions/async").status == 204);
  CHECK(c.commands == 2);
}

TEST_CASE("a command of a client that does not wait fails if it is not begun in time, and is not carried out later", "[engine][R0.6]") {
  Counting c;
  REQUIRE(c.bench.send("POST /arm/actions/async\nPrefer: respond-async").answer.status == 202);
  const auto waiting = c.bench.send("POST /arm/actions/sync\nPrefer: wait=60");
  c.bench.clock.advance(seconds(3));
  c.bench.collect();
  CHECK(missing(c.bench.send("GET /arm/actions/async/i1").answer, "<arm/actions/async/i1> lrt:status lrt:failed .") == "");
  const auto answer = c.bench.answer(waiting);
  REQUIRE(answer);
  CHECK(answer->status == 503);
  CHECK(answer->has("Retry-After"));
  c.bench.run();
  CHECK(c.commands == 0);
}

TEST_CASE("a client that would not wait so long gets 202, and its command still begins", "[engine][R0.7]") {
  Counting c;
  const auto sent = c.bench.send("POST /arm/actions/sync\nPrefer: wait=1");
  c.bench.clock.advance(seconds(1));
  CHECK(c.bench.answer(sent)->status == 202);
  c.bench.run();
  CHECK(c.commands == 1);
}

TEST_CASE("a command that runs when its time is over gets 202 and goes on", "[engine][R0.6]") {
  Bench bench;
  std::optional<Bench::Sent> sent;
  bool seen = false;
  Thing thing{"arm"};
  thing.action("slow", [&] {
    bench.clock.advance(seconds(5));
    const auto answer = bench.answer(*sent);  // what the I/O thread does meanwhile
    REQUIRE(answer);
    CHECK(answer->status == 202);
    CHECK(answer->field("Location") == "http://localhost/arm/actions/slow/i1");
    seen = true;
  });
  bench.add(std::move(thing));
  sent = bench.send("POST /arm/actions/slow");
  bench.run();
  CHECK(seen);
  CHECK(missing(bench.get("/arm/actions/slow/i1"), "<arm/actions/slow/i1> lrt:status lrt:succeeded .") == "");
}

TEST_CASE("a write or a change of a collection that runs when its time is over gets 202 and goes on", "[engine][R0.6][R0.7]") {
  Bench bench;
  std::optional<Bench::Sent> sent;
  int seen = 0;
  const auto late = [&] {
    bench.clock.advance(seconds(5));
    const auto answer = bench.answer(*sent);
    REQUIRE(answer);
    CHECK(answer->status == 202);
    CHECK(answer->body.empty());
    CHECK_FALSE(answer->has("Location"));
    ++seen;
  };
  int value = 0;
  bool slow = false;
  Thing thing{"arm"};
  thing.property("p", [&] { return value; }).on_write([&](int v) {
    late();
    value = v;
  });
  thing.collection<int>("c")
      .on_create([&](int) {
        if (slow) late();
      })
      .on_remove([&](const std::string&) { late(); });
  bench.add(std::move(thing));
  const std::string one = "\nContent-Type: application/json\n\n1";
  sent = bench.send("PUT /arm/p" + one);
  bench.run();
  CHECK(value == 1);
  CHECK(bench.ask("POST /arm/c" + one).status == 201);
  slow = true;
  sent = bench.send("POST /arm/c" + one);
  bench.run();
  CHECK(bench.get("/arm/c/i2").status == 200);
  sent = bench.send("DELETE /arm/c/i1");
  bench.run();
  CHECK(bench.get("/arm/c/i1").status == 404);
  CHECK(seen == 3);
}

TEST_CASE("a write that the robot refuses or that throws is an error, and so is a change of a collection", "[engine][R0.6]") {
  Bench bench;
  int step = 0;
  const auto refuse = [&]() -> Result<void> {
    if (step == 0) return unexpected(Errc::refused, "the brake is on");
    if (step == 1) throw std::runtime_error("the motor is hot");
    if (step == 2) throw 7;
    return {};
  };
  Thing thing{"arm"};
  thing.property("pulled", [] { return 0; }).on_write([&](int) { return refuse(); });
  const auto pushed = thing.property<int>("pushed").on_write([&](int) { return refuse(); });
  thing.collection<int>("c").on_create([&](int) { return refuse(); }).on_remove([&](const std::string&) { return refuse(); });
  bench.add(std::move(thing));
  const std::string one = "\nContent-Type: application/json\n\n1";
  step = 3;
  REQUIRE(bench.ask("POST /arm/c" + one).status == 201);
  for (step = 0; step < 3; ++step) {
    CAPTURE(step);
    const int status = step == 0 ? 409 : 500;
    for (const char* fields : {"", "\nPrefer: return=representation", "\nPrefer: respond-async"}) {
      CHECK(bench.ask(std::string("PUT /arm/pulled") + fields + one).status == status);
      CHECK(bench.ask(std::string("PUT /arm/pushed") + fields + one).status == status);
      CHECK(bench.ask(std::string("POST /arm/c") + fields + one).status == status);
    }
    CHECK(bench.ask("DELETE /arm/c/i1").status == status);
  }
  CHECK_FALSE(bench.get("/arm/pushed").says("numericalValue"));
  CHECK(bench.get("/arm/c").graph().objects(rdf::iri("http://localhost/arm/c"), vocab::ldp::contains).size() == 1);
}

TEST_CASE("a stop on the I/O thread is carried out though too many requests wait for the host", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.max_waiting_requests = 3;
  Bench bench(options);
  int stops = 0;
  Thing thing{"arm"};
  thing.property("p", [] { return 1; });
  thing.action("stop", [&] { ++stops; }).dispatch(Dispatch::io_thread);
  thing
      .action("stop_later",
              [&](const Responder& done) {
                ++stops;
                done.succeed();
              })
      .dispatch(Dispatch::io_thread);
  bench.add(std::move(thing));
  while (bench.send("GET /arm/p").ticket) {}
  const auto jobs = bench.take_jobs();  // the host does not poll
  CHECK(bench.send("GET /arm/p").answer.status == 503);
  CHECK(bench.ask("POST /arm/actions/stop").status == 204);
  CHECK(bench.ask("POST /arm/actions/stop_later").status == 204);
  CHECK(stops == 2);
}

TEST_CASE("an asynchronous action whose lambda does not return in time gets 202: it may still be refused", "[engine][R0.6][R0.7]") {
  Bench bench;
  std::optional<Bench::Sent> sent;
  bool seen = false;
  Thing thing{"arm"};
  thing.action("slow", [&](Responder done) {
    bench.clock.advance(seconds(5));
    const auto answer = bench.answer(*sent);
    REQUIRE(answer);
    CHECK(answer->status == 202);
    CHECK(answer->field("Location") == "http://localhost/arm/actions/slow/i1");
    CHECK_FALSE(answer->has("Preference-Applied"));
    seen = true;
    done.fail(Error{Errc::refused, "the brake is on"});
  });
  bench.add(std::move(thing));
  sent = bench.send("POST /arm/actions/slow");
  bench.run();
  CHECK(seen);
  CHECK(missing(bench.get("/arm/actions/slow/i1"), "<arm/actions/slow/i1> lrt:status lrt:failed ; lrt:error \"the brake is on\" .") == "");
}

TEST_CASE("more waiting requests than the limit are 503 at once, and do nothing", "[engine][R0.6][judged_at_once]") {
  engine::EngineOptions options;
  options.max_waiting_requests = 3;
  Counting c(options);
  for (int i = 0; i < 3; ++i) CHECK(c.bench.send("GET /arm/p").ticket);
  for (const std::string& request : {std::string("GET /arm/p"), Bench::turtle_request("PUT", "/arm/p", number_body("1")),
                                     std::string("POST /arm/actions/sync"), Bench::turtle_request("POST", "/arm/c", "<> vom:numericalValue 1 .")}) {
    CAPTURE(request);
    const auto sent = c.bench.send(request);
    REQUIRE_FALSE(sent.ticket);
    CHECK(sent.answer.status == 503);
    CHECK(sent.answer.has("Retry-After"));
  }
  CHECK(c.bench.get("/arm/pushed").status == 200);
  c.bench.run();
  CHECK(c.writes + c.commands + c.creates == 0);
  CHECK(c.bench.get("/arm/p").status == 200);
}

TEST_CASE("clients that disconnect free their places and cancel what has not begun", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.max_waiting_requests = 2;
  Counting c(options);
  const auto write = c.bench.send(Bench::turtle_request("PUT", "/arm/p", number_body("1")));
  const auto create = c.bench.send(Bench::turtle_request("POST", "/arm/c", "<> vom:numericalValue 1 ."));
  REQUIRE(write.ticket);
  REQUIRE(create.ticket);
  c.bench.engine.abandon(*write.ticket);
  c.bench.engine.abandon(*create.ticket);
  c.bench.engine.abandon(*create.ticket);  // twice does no harm
  const auto read = c.bench.send("GET /arm/p");
  REQUIRE(read.ticket);
  c.bench.run();
  CHECK(c.bench.answer(read)->status == 200);
  CHECK(c.writes == 0);
  CHECK(c.creates == 0);
}

TEST_CASE("reads that come while one runs share the next one", "[engine][R0.5]") {
  Counting c;
  std::vector<Bench::Sent> sent;
  for (int i = 0; i < 100; ++i) sent.push_back(c.bench.send("GET /arm/p"));
  auto jobs = c.bench.take_jobs();
  REQUIRE(jobs.size() == 1);
  jobs[0].run();
  c.bench.run();
  for (const auto& s : sent) CHECK(c.bench.answer(s)->status == 200);
  CHECK(c.reads <= 2);
}

TEST_CASE("a value is never older than its request", "[engine][R0.5]") {
  Bench bench;
  int value = 1;
  std::optional<Bench::Sent> second;
  Thing thing{"arm"};
  thing.property("p", [&] {
    const int read = value;
    if (!second) {
      second = bench.send("GET /arm/p");  // arrives while this read is under way
      value = 2;
    }
    return read;
  });
  bench.add(std::move(thing));
  const auto first = bench.send("GET /arm/p");
  bench.run();
  CHECK(missing(*bench.answer(first), "<arm/p> vom:numericalValue \"1\"^^xsd:int .") == "");
  CHECK(missing(*bench.answer(*second), "<arm/p> vom:numericalValue \"2\"^^xsd:int .") == "");
}

TEST_CASE("stop responds 503 to waiting requests and closes; later requests get the same", "[engine][R0.6]") {
  Counting c;
  const auto read = c.bench.send("GET /arm/p");
  const auto write = c.bench.send(Bench::turtle_request("PUT", "/arm/p", number_body("1")));
  const auto command = c.bench.send("POST /arm/actions/sync");
  const auto queued = c.bench.send("POST /arm/actions/sync");
  const auto asynchronous = c.bench.send("POST /arm/actions/async");
  c.bench.engine.stop();
  for (const auto& s : {read, write, command, queued, asynchronous}) {
    const auto answer = c.bench.answer(s);
    REQUIRE(answer);
    CHECK(answer->status == 503);
  }
  RequestText request("GET /");
  auto outcome = c.bench.engine.handle(request.get(), c.bench.clock.now());
  REQUIRE(std::holds_alternative<http::Response>(outcome));
  CHECK(std::get<http::Response>(outcome).status == 503);
  CHECK(std::get<http::Response>(outcome).close);
  c.bench.run();
  CHECK(c.writes == 0);
  CHECK(c.commands == 0);
}

TEST_CASE("jobs carry where their thing's lambdas are to run", "[engine]") {
  engine::EngineOptions options;
  options.dispatch = Dispatch::io_thread;
  Bench bench(options);
  for (const auto& [name, where] : {std::pair{"a", Dispatch::as_server}, {"b", Dispatch::in_poll}, {"c", Dispatch::executor}}) {
    Thing thing{name};
    thing.dispatch(where).property("p", [] { return 1; });
    bench.add(std::move(thing));
    (void)bench.send(std::string("GET /") + name + "/p");
  }
  const auto jobs = bench.take_jobs();
  REQUIRE(jobs.size() == 3);
  CHECK(jobs[0].where == Dispatch::io_thread);
  CHECK(jobs[1].where == Dispatch::in_poll);
  CHECK(jobs[2].where == Dispatch::executor);
}

TEST_CASE("a job that is run twice does its work once, and one that is dropped is a time-out", "[engine]") {
  Counting c;
  const auto command = c.bench.send("POST /arm/actions/sync");
  auto jobs = c.bench.take_jobs();
  jobs.at(0).run();
  jobs.at(0).run();
  CHECK(c.bench.answer(command)->status == 204);
  CHECK(c.commands == 1);
  const auto lost = c.bench.send("POST /arm/actions/sync");
  c.bench.take_jobs().clear();
  c.bench.clock.advance(seconds(10));
  CHECK(c.bench.answer(lost)->status == 503);
}

TEST_CASE("the cache of representations keeps to its budget and serves the right bytes", "[engine][R0.11]") {
  engine::EngineOptions options;
  options.max_cache_bytes = 0;
  Bench bench(options);
  SampleRobot robot;
  bench.add(robot.arm());
  Bench other;
  SampleRobot twin;
  other.add(twin.arm());
  for (int round = 0; round < 2; ++round)
    for (const char* path : {"/", "/arm", "/arm/blueprint", "/arm/count", "/arm/actions/turn"}) CHECK(bench.get(path).body == other.get(path).body);
  CHECK(bench.turtle("PUT", "/arm/count", number_body("3"), "If-Match: " + bench.get("/arm/count").tag() + "\n").status == 204);
}

TEST_CASE("values published by another thread are read whole and in order", "[engine][R0.11]") {
  Bench bench;
  Thing thing{"arm"};
  auto p = thing.property<std::array<double, 4>>("p");
  auto text = thing.property<std::string>("text");
  bench.add(std::move(thing));
  p.publish({0, 0, 0, 0});
  text.publish("0");
  std::atomic<bool> stop{false};
  std::thread loop([&] {
    for (int i = 1; !stop; ++i) {
      const double d = i;
      p.publish({d, d, d, d});
      text.publish(std::to_string(i));
    }
  });
  double last = 0;
  for (int i = 0; i < 300; ++i) {
    const Answer a = bench.get("/arm/p");
    const rdf::Graph graph = a.graph();
    const auto list = graph.list(*graph.object(*graph.find(rdf::iri("http://localhost/arm/p")), *graph.find(vocab::rdf_::value)));
    REQUIRE(list);
    REQUIRE(list->size() == 4);
    for (const rdf::TermId id : *list) CHECK(id == list->front());
    const double now = std::stod(std::string(graph.term(list->front()).text));
    CHECK(now >= last);
    last = now;
    CHECK(bench.get("/arm/text").status == 200);
  }
  stop = true;
  loop.join();
}

TEST_CASE("what a host that does not poll leaves lying is bounded, and all is well when it polls again", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.max_waiting_requests = 10;
  Counting c(options);
  std::size_t busy = 0;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 10; ++i) {
      for (const char* request : {"POST /arm/actions/async", "POST /arm/actions/sync", "GET /arm/p"}) {
        const auto sent = c.bench.send(request);
        if (!sent.ticket && sent.answer.status == 503) ++busy;
      }
    }
    c.bench.clock.advance(seconds(3));
    c.bench.collect();
  }
  CHECK(busy > 300);
  CHECK(c.bench.run() <= 2 * 10 + 2 * 17);  // and what waited in the queues of the two actions
  CHECK(c.commands == 0);
  CHECK(c.bench.get("/arm/p").status == 200);
  CHECK(c.bench.ask("POST /arm/actions/sync").status == 204);
}
