// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <thread>

#include "tests/support/allocations.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using std::chrono::milliseconds;

namespace {

/// The sample robot's arm on a bench.
struct Arm {
  explicit Arm(engine::EngineOptions options = {}) : bench(std::move(options)) {
    bench.add(robot.arm());
    bench.add(robot.tool());
  }
  void publish(double v) {
    robot.angle_handle->publish(v);
    bench.look();
  }
  SampleRobot robot;
  Bench bench;
};

std::string body(Bench& bench, const std::string& path, const std::string& fields = {}) {
  return bench.ask("GET " + path + (fields.empty() ? "" : "\n" + fields)).body;
}

std::vector<std::string> members(Bench& bench, const std::string& thing) { return bench.get(thing + "/subscriptions").linked("related"); }

class CountingWaker final : public Waker {
 public:
  void wake() noexcept override { ++count; }
  std::atomic<int> count{0};
};

}  // namespace

TEST_CASE("an opened WebSocket gets at once the representation of GET, and again after each change", "[engine][R0.12][R0.14][R0.15]") {
  Arm arm;
  const Channel channel = arm.bench.open("/arm/angle");
  CHECK(arm.bench.messages(channel) == std::vector<std::string>{body(arm.bench, "/arm/angle")});
  CHECK(arm.bench.messages(channel).empty());
  arm.publish(20);
  const auto told = arm.bench.messages(channel);
  REQUIRE(told.size() == 1);
  CHECK(told[0] == body(arm.bench, "/arm/angle"));
  CHECK(told[0].find("20") != std::string::npos);
  arm.publish(20);  // SPEC 3.8: bit-identical
  CHECK(arm.bench.messages(channel).empty());
}

TEST_CASE("the opening response names the subscription, which lives as long as the socket", "[engine][R0.12][R1.8]") {
  Arm arm;
  const auto sent = arm.bench.upgrade("/arm/angle");
  REQUIRE(sent.channel);
  CHECK(sent.answer.status == 101);
  const std::string location = sent.answer.field("Location");
  CHECK(location == "http://localhost/arm/subscriptions/i1");
  CHECK(members(arm.bench, "/arm") == std::vector<std::string>{location});
  const Answer member = arm.bench.get("/arm/subscriptions/i1");
  CHECK(missing(member,
                "<http://localhost/arm/subscriptions/i1> a hybrit:Subscription, hybrit:WebSocket ; "
                "hybrit:onResource <http://localhost/arm/angle> ; hybrit:mediaType \"text/turtle\" ; "
                "dcterms:identifier \"i1\" ; lrt:delivery lrt:latest ; lrt:delivered 0 ; lrt:dropped 0 .") == "");
  CHECK(member.field("Allow") == "GET, HEAD, OPTIONS, DELETE");
  CHECK(member.links_to("http://localhost/arm/subscriptions", "up"));
  arm.bench.engine.closed(*sent.channel);
  CHECK(members(arm.bench, "/arm").empty());
  CHECK(arm.bench.get("/arm/subscriptions/i1").status == 404);
}

TEST_CASE("deleting its subscription closes a socket with 1000, after which no message follows", "[engine][R0.12][paper 5.3]") {
  Arm arm;
  const Channel channel = arm.bench.open("/arm/angle");
  arm.publish(30);
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 204);
  const auto told = arm.bench.pushes();
  REQUIRE(told.size() == 1);
  CHECK(told[0].first == channel);
  CHECK(told[0].second.close == 1000);
  CHECK_FALSE(told[0].second.message);
  arm.publish(31);
  CHECK(arm.bench.pushes().empty());
  arm.bench.engine.closed(channel);
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 404);
}

TEST_CASE("the media type is negotiated by Accept, or by ?accept= where a browser cannot set it", "[engine][R0.17]") {
  Arm arm;
  CHECK(arm.bench.messages(arm.bench.open("/arm/angle", "Accept: application/n-triples\n")) ==
        std::vector<std::string>{body(arm.bench, "/arm/angle", "Accept: application/n-triples")});
  CHECK(arm.bench.messages(arm.bench.open("/arm/angle?accept=application%2Fn-triples", "Accept: text/turtle\n")) ==
        std::vector<std::string>{body(arm.bench, "/arm/angle", "Accept: application/n-triples")});
  CHECK(arm.bench.upgrade("/arm/angle", "Accept: image/png\n").answer.status == 406);
  CHECK(arm.bench.upgrade("/arm/angle?accept=image/png").answer.status == 406);
  CHECK(members(arm.bench, "/arm").size() == 2);
}

TEST_CASE("a handshake of another version gets 426, a bad one 400, and an upgrade where nothing is observable is ignored",
          "[engine][R0.12][RFC 6455 4.4]") {
  Arm arm;
  const auto ask = [&](const std::string& text) {
    RequestText request(text);
    request.get().can_upgrade = true;
    return arm.bench.sent(arm.bench.engine.handle(request.get(), arm.bench.clock.now())).answer;
  };
  const std::string ws = "\nUpgrade: websocket\nConnection: Upgrade\n";
  const Answer old = ask("GET /arm/angle" + ws + "Sec-WebSocket-Version: 8\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==");
  CHECK(old.status == 426);
  CHECK(old.field("Sec-WebSocket-Version") == "13");
  CHECK(old.field("Upgrade") == "websocket");
  CHECK(ask("GET /arm/angle" + ws + "Sec-WebSocket-Version: 13\nSec-WebSocket-Key: abc").status == 400);
  for (const char* path : {"/", "/arm/subscriptions", "/arm/blueprint", "/ns/lrt"}) CHECK(arm.bench.upgrade(path).answer.status == 200);
  CHECK(arm.bench.upgrade("/nowhere").answer.status == 404);
  CHECK(arm.bench.ask("GET /arm/angle" + ws).status == 200);  // by a transport that cannot
  CHECK(members(arm.bench, "/arm").empty());
}

TEST_CASE("a slow subscriber gets the newest value, and the ones between are counted", "[engine][R0.12][delivery]") {
  Arm arm;
  const Channel channel = arm.bench.open("/arm/angle");
  (void)arm.bench.messages(channel);
  for (int i = 1; i <= 5; ++i) {
    arm.publish(i);
    while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}  // notified, but the client takes nothing
  }
  const auto push = arm.bench.engine.next_push(channel, arm.bench.clock.now());
  REQUIRE(push);
  CHECK(*push->message == body(arm.bench, "/arm/angle"));
  CHECK_FALSE(arm.bench.engine.next_push(channel, arm.bench.clock.now()));
  CHECK(missing(arm.bench.get("/arm/subscriptions/i1"), "<http://localhost/arm/subscriptions/i1> lrt:delivered 2 ; lrt:dropped 4 .") == "");
}

TEST_CASE("with a queue a subscriber gets each change, up to its length; the oldest go first", "[engine][delivery]") {
  Arm arm;
  const Channel channel = arm.bench.open("/arm/angle?queueLength=3");
  (void)arm.bench.messages(channel);
  std::vector<std::string> expected;
  for (int i = 1; i <= 5; ++i) {
    arm.publish(i);
    while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}
    if (i > 2) expected.push_back(body(arm.bench, "/arm/angle"));
  }
  std::vector<std::string> got;
  while (const auto push = arm.bench.engine.next_push(channel, arm.bench.clock.now())) got.push_back(*push->message);
  CHECK(got == expected);
  CHECK(missing(arm.bench.get("/arm/subscriptions/i1"),
                "<http://localhost/arm/subscriptions/i1> lrt:delivery lrt:queue ; lrt:queueLength 3 ; lrt:dropped 2 ; lrt:delivered 4 .") == "");
  CHECK(arm.bench.upgrade("/arm/angle?queueLength=1001").answer.status == 400);
  CHECK(arm.bench.upgrade("/arm/angle?queueLength=-1").answer.status == 400);
}

TEST_CASE("a queue is bounded in bytes too", "[engine][delivery]") {
  engine::EngineOptions options;
  options.subscriptions.max_queue_bytes = 2000;
  Arm arm(options);
  const Channel channel = arm.bench.open("/arm/angle?queueLength=100");
  (void)arm.bench.messages(channel);
  for (int i = 1; i <= 50; ++i) {
    arm.publish(i);
    (void)arm.bench.engine.next_ready(arm.bench.clock.now());
  }
  std::size_t bytes = 0, count = 0;
  while (const auto push = arm.bench.engine.next_push(channel, arm.bench.clock.now())) bytes += push->message->size(), ++count;
  CHECK(count > 0);
  CHECK(bytes <= 2000);
}

TEST_CASE("a request that finds a change makes no representation for queues, a scan does", "[engine][delivery]") {
  Arm arm;
  const Channel channel = arm.bench.open("/arm/angle?queueLength=100");
  (void)arm.bench.messages(channel);
  arm.robot.angle_handle->publish(33);
  const std::string now = body(arm.bench, "/arm/angle");
  CHECK_FALSE(arm.bench.engine.next_push(channel, arm.bench.clock.now()));
  REQUIRE(arm.bench.engine.next_deadline());
  arm.bench.look();
  CHECK(arm.bench.messages(channel) == std::vector<std::string>{now});
}

TEST_CASE("all queues together are bounded in bytes", "[engine][limits]") {
  engine::EngineOptions options;
  options.subscriptions.max_total_queue_bytes = 4000;
  Arm arm(options);
  std::vector<Channel> channels;
  for (int i = 0; i < 5; ++i) channels.push_back(arm.bench.open("/arm/angle?queueLength=100"));
  (void)arm.bench.pushes();
  for (int i = 1; i <= 50; ++i) {
    arm.publish(i);
    while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}
  }
  std::size_t bytes = 0;
  for (const Channel c : channels) {
    std::size_t count = 0;
    while (const auto push = arm.bench.engine.next_push(c, arm.bench.clock.now())) bytes += push->message->size(), ++count;
    CHECK(count >= 1);  // the newest, whatever the others have
  }
  CHECK(bytes <= 4000 + 5 * 1000);
}

TEST_CASE("pages of other origins may not send commands, nor open WebSockets, unless allowed_origins names them (SPEC 3.16)", "[engine][security]") {
  engine::EngineOptions options;
  options.allowed_origins = {"https://dashboard.example"};
  for (const bool named : {false, true}) {
    Arm arm(named ? options : engine::EngineOptions{});
    const auto post = [&](const std::string& origin) { return arm.bench.ask("POST /arm/actions/home\nOrigin: " + origin).status; };
    CHECK(post("http://evil.example") == 403);
    CHECK(post("null") == 403);
    CHECK(post("http://localhost") == 204);
    CHECK(post("https://dashboard.example") == (named ? 204 : 403));
    CHECK(arm.bench.ask("GET /arm/angle\nOrigin: http://evil.example").status == 200);  // whose page cannot read the response
    CHECK(arm.bench.upgrade("/arm/angle", "Origin: http://evil.example\n").answer.status == 403);
    CHECK(arm.bench.upgrade("/arm/angle", "Origin: http://localhost\n").channel);
    CHECK(arm.bench.upgrade("/arm/angle").channel);  // no browser
    CHECK(arm.bench.upgrade("/arm/angle", "Origin: https://dashboard.example\n").answer.status == (named ? 101 : 403));
    CHECK(arm.robot.homed == (named ? 2 : 1));
  }
}

TEST_CASE("between two notifications is the interval that the subscriber requested", "[engine][delivery]") {
  Arm arm;
  const Channel channel = arm.bench.open("/arm/angle?minimumInterval=0.5");
  CHECK(arm.bench.messages(channel).size() == 1);
  arm.publish(1);
  CHECK(arm.bench.messages(channel).empty());
  arm.bench.clock.advance(milliseconds(400));
  arm.publish(2);
  CHECK(arm.bench.messages(channel).empty());
  REQUIRE(arm.bench.engine.next_deadline());
  CHECK(*arm.bench.engine.next_deadline() <= arm.bench.clock.now().steady + milliseconds(100));
  arm.bench.clock.advance(milliseconds(100));
  CHECK(arm.bench.messages(channel) == std::vector<std::string>{body(arm.bench, "/arm/angle")});
  for (const char* bad : {"-1", "abc", "1e9", "NaN"}) CHECK(arm.bench.upgrade(std::string("/arm/angle?minimumInterval=") + bad).answer.status == 400);
}

TEST_CASE("every sample that is kept reaches a subscriber with a queue, in order, even of one step", "[engine][delivery]") {
  Bench bench;
  Thing thing{"arm"};
  auto bumps = thing.property<int>("bumps");
  bumps.keep(8);
  bench.add(std::move(thing));
  const Channel queue = bench.open("/arm/bumps?queueLength=100"), latest = bench.open("/arm/bumps");
  (void)bench.pushes();
  for (int i = 1; i <= 6; ++i) bumps.publish(i);
  bench.look();
  const auto told = bench.pushes();
  std::vector<std::string> queued;
  std::size_t newest = 0;
  for (const auto& [channel, push] : told) channel == queue ? queued.push_back(*push.message) : static_cast<void>(newest += channel == latest);
  REQUIRE(queued.size() == 6);
  for (int i = 1; i <= 6; ++i) CHECK(queued[static_cast<std::size_t>(i - 1)].find(std::to_string(i)) != std::string::npos);
  CHECK(newest == 1);
  for (int i = 7; i <= 17; ++i) bumps.publish(i);  // 8 fit, the last is the newest anyway, 2 are lost
  bench.look();
  CHECK(bench.messages(queue).size() == 9);
  CHECK(missing(bench.get("/arm/subscriptions/i1"), "<http://localhost/arm/subscriptions/i1> lrt:dropped 2 .") == "");
}

namespace {

std::uint64_t dropped(Bench& bench, const std::string& subscription) {
  const rdf::Graph graph = bench.get(subscription).graph();
  return std::stoull(std::string(graph.objects(rdf::iri("http://localhost" + subscription), rdf::TermView(vocab::lrt_::dropped)).at(0).text));
}

struct Large {
  std::array<double, 512> numbers{};
};
struct Picture {
  int number = 0;
};

}  // namespace

template <>
struct lrt::rdf::traits<Large> : lrt::rdf::Record<Large> {
  static void describe(Record<Large>& r) { r.field("numbers", &Large::numbers); }
};

template <>
struct lrt::rdf::traits<Picture> : lrt::rdf::Record<Picture> {
  static void describe(Record<Picture>& r) { r.field("number", &Picture::number); }
};

TEST_CASE("a queue gets each value that was published between two scans, without keep()", "[engine][delivery]") {
  Bench bench;
  Thing thing{"arm"};
  auto bumps = thing.property<int>("bumps");
  auto words = thing.property<std::string>("words");
  bench.add(std::move(thing));
  const Channel number = bench.open("/arm/bumps?queueLength=1000&accept=text/plain"),
                word = bench.open("/arm/words?queueLength=1000&accept=text/plain");
  words.publish("0");  // its size determines how many are kept
  bench.look();
  (void)bench.pushes();
  for (int i = 1; i <= 900; ++i) bumps.publish(i), words.publish(std::to_string(i));
  bench.look();
  std::vector<std::string> expected;
  for (int i = 1; i <= 900; ++i) expected.push_back(std::to_string(i));
  std::vector<std::string> numbers, texts;
  for (const auto& [channel, push] : bench.pushes()) (channel == number ? numbers : texts).push_back(*push.message);
  CHECK(numbers == expected);
  CHECK(texts == expected);
  CHECK(dropped(bench, "/arm/subscriptions/i1") == 0);
  CHECK(dropped(bench, "/arm/subscriptions/i2") == 0);
  (void)word;
}

TEST_CASE("each value that a queue does not get is counted", "[engine][delivery]") {
  engine::EngineOptions options;
  options.subscriptions.max_kept_bytes = 100 * sizeof(Large);
  Bench bench(std::move(options));
  Thing thing{"arm"};
  auto large = thing.property<Large>("large");
  auto few = thing.property<int>("few"), none = thing.property<int>("none");
  few.keep(10);
  none.keep(0);
  bench.add(std::move(thing));
  const std::vector<std::string> paths = {"/arm/large", "/arm/few", "/arm/none"};
  std::map<Channel, std::size_t> got;
  std::vector<Channel> channels;
  for (const std::string& path : paths) channels.push_back(bench.open(path + "?queueLength=1000&accept=application/cbor"));
  (void)bench.pushes();
  constexpr int count = 2'000;
  for (int i = 1; i <= count; ++i) {
    Large value;
    value.numbers[0] = i;
    large.publish(value);
    few.publish(i);
    none.publish(i);
    if (i % 250 != 0) continue;
    bench.look();
    for (const auto& [channel, push] : bench.pushes()) ++got[channel];
    if (i == 1000) (void)bench.get("/arm/few"), (void)bench.get("/arm/state");
  }
  for (std::size_t i = 0; i < channels.size(); ++i) {
    CAPTURE(paths[i], got[channels[i]]);
    CHECK(got[channels[i]] >= 8);
    CHECK(got[channels[i]] + dropped(bench, "/arm/subscriptions/i" + std::to_string(i + 1)) == count);
  }
  CHECK(got[channels[1]] == 8 * 11);
  CHECK(got[channels[2]] == 8);
}

TEST_CASE("a queue of a thing's state gets each value of its properties", "[engine][delivery]") {
  Bench bench;
  Thing thing{"arm"};
  auto bumps = thing.property<int>("bumps");
  bench.add(std::move(thing));
  const Channel channel = bench.open("/arm/state?queueLength=1000&accept=application/json");
  (void)bench.pushes();
  for (int i = 1; i <= 500; ++i) bumps.publish(i);
  bench.look();
  CHECK(bench.messages(channel).size() == 500);
  for (int i = 501; i <= 1700; ++i) bumps.publish(i);
  bench.look();
  CHECK(bench.messages(channel).size() + dropped(bench, "/arm/subscriptions/i1") == 1200);
}

TEST_CASE("values for queues keep the engine busy for a limited time, then the newest follows and the others are counted", "[engine][delivery]") {
  engine::EngineOptions options;
  options.subscriptions.max_catch_up_time = milliseconds(5);
  Bench bench(std::move(options));
  Thing thing{"arm"};
  auto bumps = thing.property<int>("bumps");
  auto words = thing.property<std::string>("words");
  auto pictures = thing.property<Picture>("pictures");
  pictures.representation("image/x-lrt", [](const Picture& p) { return std::to_string(p.number); });
  bench.add(std::move(thing));
  std::vector<Channel> channels;
  for (const char* path : {"bumps", "words", "state"})
    channels.push_back(bench.open("/arm/" + std::string(path) + "?queueLength=1000&accept=application/json"));
  channels.push_back(bench.open("/arm/pictures?queueLength=1000&accept=image/x-lrt"));
  words.publish("0");
  pictures.publish({0});
  for (int i = 0; i < 2; ++i) bench.look(), (void)bench.pushes();
  for (int i = 1; i <= 900; ++i) bumps.publish(i), words.publish(std::to_string(i)), pictures.publish({i});
  bench.clock.run_slowly(std::chrono::microseconds(500));
  bench.look();
  std::map<Channel, std::vector<std::string>> got;
  const auto take = [&] {
    for (const auto& [channel, push] : bench.pushes()) got[channel].push_back(*push.message);
  };
  take();
  for (int i = 0; i < 10; ++i) {  // what the first scan had no time for
    bench.clock.advance(milliseconds(100));
    bench.look();
    take();
  }
  bench.clock.run_slowly({});
  const auto check = [&](std::size_t of, const std::string& newest) {
    const std::vector<std::string>& messages = got[channels[of]];
    const std::uint64_t lost = dropped(bench, "/arm/subscriptions/i" + std::to_string(of + 1));
    CAPTURE(of, messages.size(), lost);
    REQUIRE(!messages.empty());
    CHECK(messages.size() <= 30);
    CHECK(messages.back() == newest);
    if (of != 2) CHECK(messages.size() + lost == 900);
  };
  check(0, "900");
  check(1, "\"900\"");
  check(2, R"({"bumps":900,"words":"900","pictures":{"number":900}})");
  check(3, "900");
  for (const char* path : {"bumps", "words"}) CHECK(bench.get("/arm/" + std::string(path)).body.find("900") != std::string::npos);
}

TEST_CASE("GET gives the newest value, however many keep() keeps", "[engine][delivery][R0.11]") {
  Bench bench;
  Thing thing{"arm"};
  auto bumps = thing.property<int>("bumps");
  auto words = thing.property<std::string>("words");
  bumps.keep(5'000);
  words.keep(5'000);
  bench.add(std::move(thing));
  int last = 0;
  const auto publish = [&](int count) {
    for (int i = 0; i < count; ++i) bumps.publish(++last), words.publish(std::to_string(last));
  };
  const auto shows_last = [&] {
    for (const char* path : {"/arm/bumps", "/arm/words"}) CHECK(bench.get(std::string(path) + "?accept=text/plain").body == std::to_string(last));
  };
  publish(10'000);  // nobody is there
  shows_last();
  publish(3'000);
  std::vector<Channel> channels;
  for (const char* path : {"/arm/bumps", "/arm/words"}) channels.push_back(bench.open(std::string(path) + "?queueLength=1000&accept=text/plain"));
  for (const auto& [channel, push] : bench.pushes()) CHECK(*push.message == std::to_string(last));  // no news of before
  publish(4'000);
  shows_last();  // with all of them kept
  bench.look();
  (void)bench.pushes();
  for (const Channel channel : channels) bench.engine.closed(channel);
  publish(7'000);
  shows_last();
}

TEST_CASE("a queue gets each value of a thread that publishes 1,000 times a second, or it is counted", "[engine][delivery]") {
  constexpr int count = 1'000;
  Bench bench;
  Thing thing{"arm"};
  auto bumps = thing.property<int>("bumps");
  bench.add(std::move(thing));
  const Channel channel = bench.open("/arm/bumps?queueLength=1000&accept=text/plain");
  (void)bench.pushes();
  std::atomic<bool> done{false};
  std::thread publisher([&] {
    auto next = std::chrono::steady_clock::now();
    for (int i = 1; i <= count; ++i) {
      bumps.publish(i);
      std::this_thread::sleep_until(next += milliseconds(1));
    }
    done = true;
  });
  std::vector<int> got;
  while (true) {
    const bool was_done = done;
    bench.look();
    for (const std::string& text : bench.messages(channel)) got.push_back(std::stoi(text));
    if (was_done) break;
    std::this_thread::yield();
  }
  publisher.join();
  CHECK(std::is_sorted(got.begin(), got.end()));
  CHECK(got.back() == count);
  CHECK(got.size() + dropped(bench, "/arm/subscriptions/i1") == count);
}

TEST_CASE("a pulled property is read while a client observes it: at its rate, or after changed()", "[engine][delivery]") {
  int reads = 0;
  double value = 1;
  Bench bench;
  Thing thing{"arm"};
  auto slow = thing.property("slow", [&] { return ++reads, value; });
  slow.sample(milliseconds(200));
  auto told = thing.property("told", [&] { return value; });
  told.sample(milliseconds(0));
  bench.add(std::move(thing));
  bench.clock.advance(milliseconds(1000));
  (void)bench.pushes();
  CHECK(reads == 0);

  const Channel channel = bench.open("/arm/slow");
  CHECK(reads == 1);
  CHECK(bench.messages(channel) == std::vector<std::string>{body(bench, "/arm/slow")});
  reads = 0;
  value = 2;
  bench.clock.advance(milliseconds(199));
  CHECK(bench.messages(channel).empty());
  bench.clock.advance(milliseconds(1));
  CHECK(bench.messages(channel).size() == 1);
  bench.clock.advance(milliseconds(200));
  CHECK(bench.messages(channel).empty());  // the same value again
  CHECK(reads == 2);
  slow.changed();
  value = 3;
  bench.look();
  CHECK(bench.messages(channel).size() == 1);
  bench.engine.closed(channel);
  reads = 0;
  bench.clock.advance(milliseconds(1000));
  (void)bench.pushes();
  CHECK(reads == 0);

  const Channel second = bench.open("/arm/told");
  CHECK(bench.messages(second).size() == 1);
  value = 4;
  bench.clock.advance(milliseconds(10'000));
  CHECK(bench.messages(second).empty());
  told.changed();
  bench.look();
  CHECK(bench.messages(second).size() == 1);
}

TEST_CASE("a subscription to a pulled property that cannot be read is refused as the GET would be", "[engine][R0.12][R0.6]") {
  Bench bench;
  Thing thing{"arm"};
  bool works = false;
  thing.property("broken", [&]() -> double {
    if (!works) throw std::runtime_error("no bus");
    return 1;
  });
  bench.add(std::move(thing));
  const auto refused = bench.upgrade("/arm/broken");
  bench.run();
  CHECK(bench.answer(refused)->status == 500);
  const auto late = bench.upgrade("/arm/broken");
  bench.clock.advance(std::chrono::seconds(3));
  CHECK(bench.answer(late)->status == 503);
  CHECK(members(bench, "/arm").empty());
  works = true;
  bench.run();
  CHECK(bench.messages(bench.open("/arm/broken")).size() == 1);
}

TEST_CASE("observers of the state are notified of every property's change, observers of the thing of its structure", "[engine][R0.12]") {
  double speed = 1;
  Bench bench;
  Thing arm{"arm"};
  auto angle = arm.property<double>("angle");
  arm.property("speed", [&] { return speed; });
  angle.publish(1);
  bench.add(std::move(arm));
  const Channel state = bench.open("/arm/state"), thing = bench.open("/arm");
  const auto first = bench.pushes();
  REQUIRE(first.size() == 2);
  for (const auto& [channel, push] : first) CHECK(*push.message == body(bench, channel == thing ? "/arm" : "/arm/state"));
  angle.publish(55);
  bench.look();
  auto told = bench.pushes();
  REQUIRE(told.size() == 1);
  CHECK(told[0].first == state);
  CHECK(*told[0].second.message == body(bench, "/arm/state"));
  speed = 9;  // pulled, and sampled
  bench.clock.advance(milliseconds(100));
  CHECK(bench.messages(state).size() == 1);

  bench.add(Thing{"arm/hand"});
  told = bench.pushes();
  CHECK(told.size() == 2);
  for (const auto& [channel, push] : told) CHECK(*push.message == body(bench, channel == thing ? "/arm" : "/arm/state"));
  bench.add(Thing{"elsewhere"});  // changes nothing that they show
  CHECK(bench.pushes().empty());
}

TEST_CASE("observers of an action are notified of new invocations, observers of an invocation of status and progress", "[engine][R0.12]") {
  Arm arm;
  const Channel action = arm.bench.open("/arm/actions/grip");
  (void)arm.bench.pushes();
  const Answer posted = arm.bench.ask(Bench::turtle_request("POST", "/arm/actions/grip", number_body("5"), "Prefer: respond-async\n"));
  INFO(posted.body);
  REQUIRE(posted.status == 202);
  const std::string invocation = posted.field("Location").substr(std::string("http://localhost").size());
  CHECK(arm.bench.messages(action) == std::vector<std::string>{body(arm.bench, "/arm/actions/grip")});

  const Channel channel = arm.bench.open(invocation);
  CHECK(arm.bench.messages(channel).size() == 1);
  REQUIRE(arm.robot.grips.size() == 1);
  arm.robot.grips[0].progress(0.5);
  arm.bench.look();
  auto told = arm.bench.messages(channel);
  REQUIRE(told.size() == 1);
  CHECK(told[0].find("0.5") != std::string::npos);
  // Nothing between is lost: an invocation has a queue.
  arm.robot.grips[0].progress(0.7);
  arm.bench.look();
  while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}  // named, and next_push() was not called yet
  arm.robot.grips[0].succeed();
  arm.bench.collect();
  told.clear();
  while (const auto push = arm.bench.engine.next_push(channel, arm.bench.clock.now())) told.push_back(*push->message);
  REQUIRE(told.size() == 2);
  CHECK(told.front().find("0.7") != std::string::npos);
  CHECK(told.back() == body(arm.bench, invocation));
  CHECK(told.back().find("lrt:succeeded") != std::string::npos);
  CHECK(arm.bench.ask("DELETE " + invocation).status == 204);
  const auto end = arm.bench.pushes();
  REQUIRE_FALSE(end.empty());
  CHECK(std::any_of(end.begin(), end.end(), [&](const auto& p) { return p.first == channel && p.second.close == 1001; }));
}

TEST_CASE("the last representation of an invocation is sent before its socket closes", "[engine][R0.12]") {
  engine::EngineOptions options;
  options.max_finished_invocations = 0;
  Arm arm(options);
  const Answer posted = arm.bench.ask(Bench::turtle_request("POST", "/arm/actions/grip", number_body("5"), "Prefer: respond-async\n"));
  const std::string invocation = posted.field("Location").substr(std::string("http://localhost").size());
  for (const char* query : {"", "?queueLength=0"}) (void)arm.bench.open(invocation + query);
  (void)arm.bench.pushes();
  REQUIRE(arm.robot.grips.size() == 1);
  arm.robot.grips[0].succeed();
  const auto told = arm.bench.pushes();
  std::size_t finals = 0, closes = 0;
  for (const auto& [channel, push] : told) {
    finals += push.message && push.message->find("lrt:succeeded") != std::string::npos;
    closes += push.close == 1001;
  }
  CHECK(finals == 2);
  CHECK(closes == 2);
  CHECK(arm.bench.get(invocation).status == 404);
}

TEST_CASE("a thing that is removed while observed closes its sockets with 1001", "[engine][R0.12]") {
  Arm arm;
  std::vector<Channel> channels;
  for (const char* path : {"/arm", "/arm/tool/state", "/arm/angle", "/arm/speed", "/arm/actions/grip", "/arm/tool", "/arm/tool/weight"})
    channels.push_back(arm.bench.open(path));
  (void)arm.bench.pushes();
  arm.publish(3);
  arm.bench.engine.remove("arm").value();
  std::size_t closes = 0;
  for (const auto& [channel, push] : arm.bench.pushes()) closes += push.close == 1001;
  CHECK(closes == channels.size());
  for (const Channel c : channels) arm.bench.engine.closed(c);
  arm.robot.angle_handle->publish(4);  // the handle is inert
  arm.bench.look();
  CHECK(arm.bench.pushes().empty());
}

TEST_CASE("there are as many subscriptions as the limit says; then 503 with Retry-After", "[engine][R0.6][limits]") {
  engine::EngineOptions options;
  options.subscriptions.max_subscriptions = 3;
  Arm arm(options);
  std::vector<Channel> open;
  for (int i = 0; i < 3; ++i) open.push_back(arm.bench.open("/arm/angle"));
  const Answer refused = arm.bench.upgrade("/arm/angle").answer;
  CHECK(refused.status == 503);
  CHECK(refused.field("Retry-After") == "1");
  arm.bench.engine.closed(open[1]);
  CHECK(arm.bench.upgrade("/arm/angle").channel);
}

TEST_CASE("publish makes no system call while the engine scans by itself, and one when it sleeps", "[engine][control loop]") {
  auto waker = std::make_shared<CountingWaker>();
  Arm arm;
  arm.bench.engine.set_waker(waker);
  arm.robot.angle_handle->publish(1);
  CHECK(waker->count == 0);  // no observer
  const Channel channel = arm.bench.open("/arm/angle");
  waker->count = 0;
  const auto before = allocations;
  for (int i = 0; i < 100; ++i) arm.robot.angle_handle->publish(i);
  CHECK(allocations == before);
  CHECK(waker->count == 0);
  for (int i = 0; i < 50; ++i) {
    arm.bench.look();
    (void)arm.bench.messages(channel);
  }
  CHECK_FALSE(arm.bench.engine.next_deadline());  // asleep
  for (int i = 0; i < 100; ++i) arm.robot.angle_handle->publish(i / 7.0);
  CHECK(waker->count == 1);
  CHECK(arm.bench.messages(channel).size() == 1);
  arm.bench.engine.closed(channel);
  for (int i = 0; i < 50; ++i) arm.bench.look(), (void)arm.bench.pushes();
  waker->count = 0;
  arm.robot.angle_handle->publish(0.5);
  CHECK(waker->count == 0);

  engine::EngineOptions options;
  options.subscriptions.always_scan = true;
  Arm ticking(options);
  ticking.bench.engine.set_waker(waker);
  (void)ticking.bench.open("/arm/angle");
  for (int i = 0; i < 50; ++i) ticking.bench.look(), (void)ticking.bench.pushes();
  waker->count = 0;
  ticking.robot.angle_handle->publish(77);
  CHECK(waker->count == 0);
  CHECK(ticking.bench.engine.next_deadline());
}

TEST_CASE("subscribers with the same media type share the bytes of one rendering", "[engine][delivery]") {
  Arm arm;
  std::vector<Channel> channels;
  for (int i = 0; i < 20; ++i) channels.push_back(arm.bench.open("/arm/angle"));
  (void)arm.bench.pushes();
  arm.publish(12);
  const auto told = arm.bench.pushes();
  REQUIRE(told.size() == 20);
  for (const auto& [channel, push] : told) CHECK(push.message.get() == told[0].second.message.get());
}

TEST_CASE("closes and commands are named before telemetry", "[engine][delivery]") {
  Arm arm;
  const Answer posted = arm.bench.ask(Bench::turtle_request("POST", "/arm/actions/grip", number_body("5"), "Prefer: respond-async\n"));
  const std::string invocation = posted.field("Location").substr(std::string("http://localhost").size());
  std::vector<Channel> telemetry;
  for (int i = 0; i < 5; ++i) telemetry.push_back(arm.bench.open("/arm/angle"));
  const Channel command = arm.bench.open(invocation);
  const Channel cancelled = arm.bench.open("/arm/angle");
  (void)arm.bench.pushes();
  const std::string last = "/arm/subscriptions/i" + std::to_string(2 + 5 + 1);
  arm.publish(14);
  arm.robot.grips.at(0).progress(0.25);
  REQUIRE(arm.bench.ask("DELETE " + last).status == 204);
  std::vector<Channel> order;
  while (const auto channel = arm.bench.engine.next_ready(arm.bench.clock.now())) order.push_back(*channel);
  REQUIRE(order.size() == 7);
  CHECK((order[0] == cancelled || order[0] == command));
  CHECK((order[1] == cancelled || order[1] == command));
}

TEST_CASE("the container's ETag moves with its members and its minimal form leaves them out", "[engine][R0.11][LDP 7.2]") {
  Arm arm;
  const Answer empty = arm.bench.get("/arm/subscriptions");
  CHECK(empty.field("Allow") == "GET, HEAD, OPTIONS, POST");
  CHECK(empty.has("Accept-Post"));
  const Channel channel = arm.bench.open("/arm/angle");
  const Answer one = arm.bench.get("/arm/subscriptions");
  CHECK(one.tag() != empty.tag());
  CHECK(missing(one,
                "<http://localhost/arm/subscriptions> a ldp:BasicContainer ; ldp:contains <http://localhost/arm/subscriptions/i1> . "
                "<http://localhost/arm/subscriptions/i1> a hybrit:Subscription .") == "");
  (void)arm.bench.pushes();
  CHECK(arm.bench.get("/arm/subscriptions").tag() == one.tag());  // counters are the member's
  for (const char* prefer : {"return=representation; include=\"http://www.w3.org/ns/ldp#PreferMinimalContainer\"",
                             "return=representation; omit=\"http://www.w3.org/ns/ldp#PreferContainment\"", "return=minimal"}) {
    const Answer minimal = arm.bench.ask(std::string("GET /arm/subscriptions\nPrefer: ") + prefer);
    INFO(prefer);
    CHECK(minimal.status == 200);
    CHECK_FALSE(minimal.says("ldp:contains"));
    CHECK(minimal.has("Preference-Applied"));
    CHECK(minimal.tag() != one.tag());
    CHECK(minimal.members("Vary") == std::set<std::string>{"Accept", "Prefer"});
    CHECK(minimal.linked("related").empty());
  }
  arm.bench.engine.closed(channel);
  CHECK(arm.bench.get("/arm/subscriptions").body == empty.body);
}

TEST_CASE("a subscription keeps the base of the request that made it", "[engine][SPEC 3.7]") {
  engine::EngineOptions options;
  options.allowed_hosts = {"robot.local:80"};
  Arm arm(options);
  const Channel here = arm.bench.open("/arm/angle"), there = arm.bench.open("/arm/angle", "Host: robot.local\n");
  CHECK(arm.bench.messages(here).at(0).find("http://localhost/arm/angle") != std::string::npos);
  arm.publish(2);
  CHECK(arm.bench.messages(there).at(0).find("http://robot.local/arm/angle") != std::string::npos);
}

TEST_CASE("publishing, subscribing and cancelling at once loses nothing that is the newest", "[engine][control loop]") {
  Arm arm;
  std::atomic<bool> go{true};
  std::thread loop([&] {
    for (int i = 0; i < 20'000; ++i) arm.robot.angle_handle->publish(i % 90);
    arm.robot.angle_handle->publish(-42);
    go = false;
  });
  std::vector<Channel> open;
  unsigned step = 0;
  while (go) {
    arm.bench.look();
    if (++step % 3 == 0 && open.size() < 20) open.push_back(arm.bench.open("/arm/angle"));
    if (step % 5 == 0 && !open.empty()) {
      arm.bench.engine.closed(open.back());
      open.pop_back();
    }
    (void)arm.bench.pushes();
  }
  loop.join();
  const Channel last = arm.bench.open("/arm/angle");
  arm.bench.look();
  CHECK(arm.bench.messages(last).back().find("-42") != std::string::npos);
}

TEST_CASE("available() allocates nothing, also while its thing is observed", "[engine][subscription]") {
  Bench bench;
  Thing thing{"arm"};
  Action grip = thing.action("grip", [] {});
  bench.add(std::move(thing));
  bench.open("/arm");
  const std::size_t before = allocations;
  for (int i = 0; i < 100; ++i) grip.available(i % 2 == 0, "the gripper is empty");
  CHECK(allocations == before);
}
