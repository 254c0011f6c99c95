// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using std::chrono::milliseconds;
using subscription::DeliveryResult;

namespace {

engine::EngineOptions allowing(std::vector<std::string> hosts = {"127.0.0.0/8", "receiver.example"}) {
  engine::EngineOptions options;
  options.callbacks.allow = std::move(hosts);
  return options;
}

struct Arm {
  explicit Arm(engine::EngineOptions options = allowing()) : bench(std::move(options)) { bench.add(robot.arm()); }
  void publish(double v) {
    robot.angle_handle->publish(v);
    bench.look();
  }
  /// Channels that have something to post.
  std::vector<Channel> due() {
    (void)bench.pushes();
    return callbacks();
  }
  std::vector<Channel> callbacks() {
    std::vector<Channel> channels;
    for (const subscription::ReadyCallback& due : bench.take_callbacks()) {
      CHECK(due.receiver == "http://127.0.0.1:9");
      channels.push_back(due.channel);
    }
    return channels;
  }
  std::optional<subscription::Notification> notice(Channel c) { return bench.engine.next_notification(c, bench.clock.now()); }
  void receipt(Channel c, DeliveryResult r) { bench.engine.delivered(c, r, bench.clock.now()); }
  std::string describe(const std::string& id) { return bench.get("/arm/subscriptions/" + id).body; }

  SampleRobot robot;
  Bench bench;
};

const std::string callback = "\nUpgrade: callback\nCallback: http://127.0.0.1:9/receiver";

std::string description(const std::string& more = {}, const std::string& url = "http://127.0.0.1:9/receiver") {
  return "<> a hybrit:Subscription, hybrit:WebCallback ; hybrit:onResource <../arm/angle> ; hybrit:callbackURL \"" + url + "\"^^xsd:anyURI" +
         (more.empty() ? "" : " ; " + more) + " .";
}

}  // namespace

TEST_CASE("GET with Upgrade: callback makes a subscription, described in the response", "[engine][R0.13][R0.16]") {
  Arm arm;
  for (const char* upgrade : {"callback", "webhook", "Callback"}) {
    const Answer made = arm.bench.ask(std::string("GET /arm/angle\nUpgrade: ") + upgrade + "\nCallback: http://127.0.0.1:9/receiver");
    CHECK(made.status == 201);
    CHECK(made.members("Vary") == std::set<std::string>{"Accept", "Prefer"});
    const std::string location = made.field("Location");
    CHECK(missing(made, "<" + location +
                            "> a hybrit:Subscription, hybrit:WebCallback ; hybrit:onResource <http://localhost/arm/angle> ; "
                            "hybrit:callbackURL \"http://127.0.0.1:9/receiver\"^^xsd:anyURI ; hybrit:mediaType \"text/turtle\" .") == "");
  }
  CHECK(arm.bench.get("/arm/subscriptions").linked("related").size() == 3);
}

TEST_CASE("the container has all of Figure 4, and its entity tag does not change with a notification", "[engine][paper 5.3][R0.11]") {
  Arm arm;
  const Answer empty = arm.bench.get("/arm/subscriptions");
  REQUIRE(arm.bench.ask("GET /arm/angle" + callback).status == 201);
  REQUIRE(arm.bench.upgrade("/arm/angle", "Accept: application/n-triples\n").channel);
  const Answer listed = arm.bench.get("/arm/subscriptions");
  CHECK(missing(listed,
                "<arm/subscriptions> a ldp:Container ; ldp:contains <arm/subscriptions/i1> , <arm/subscriptions/i2> ."
                "<arm/subscriptions/i1> a hybrit:Subscription , hybrit:WebCallback ; hybrit:onResource <arm/angle> ;"
                "  hybrit:callbackURL \"http://127.0.0.1:9/receiver\"^^xsd:anyURI ; hybrit:mediaType \"text/turtle\" ; dcterms:identifier \"i1\" ."
                "<arm/subscriptions/i2> a hybrit:Subscription , hybrit:WebSocket ; hybrit:onResource <arm/angle> ;"
                "  hybrit:mediaType \"application/n-triples\" ; dcterms:identifier \"i2\" .") == "");
  for (const char* counter : {"lrt:delivered", "lrt:dropped", "dcterms:created", "lrt:lastError"}) CHECK_FALSE(listed.says(counter));
  const auto due = arm.due();
  REQUIRE(due.size() == 1);
  REQUIRE(arm.notice(due[0]));
  arm.receipt(due[0], {204, {}});
  arm.publish(20);
  (void)arm.due();
  CHECK(arm.describe("i1").find("lrt:delivered 1") != std::string::npos);
  CHECK(arm.bench.get("/arm/subscriptions").tag() == listed.tag());
  REQUIRE(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 204);
  REQUIRE(arm.bench.ask("DELETE /arm/subscriptions/i2").status == 204);
  CHECK(arm.bench.get("/arm/subscriptions").tag() == empty.tag());
}

TEST_CASE("a callback that is missing, no URL or not allowed makes nothing", "[engine][R0.13]") {
  Arm arm;
  const auto status = [&](const std::string& field) { return arm.bench.ask("GET /arm/angle\nUpgrade: callback" + field).status; };
  CHECK(status("") == 400);
  CHECK(status("\nCallback: http://127.0.0.1:9/a\nCallback: http://127.0.0.1:9/b") == 400);
  for (const char* bad : {"/receiver", "ftp://127.0.0.1/", "http://user@127.0.0.1/", "http://127.0.0.1:0/", "http://127.0.0.1/#x", "mailto:a@b"})
    CHECK(status(std::string("\nCallback: ") + bad) == 400);
  for (const char* stranger : {"http://evil.example/", "http://10.0.0.1/", "http://169.254.169.254/latest", "http://[::1]:9/", "http://127.1/",
                               "http://2130706433/", "http://receiver.example.evil/"})
    CHECK(status(std::string("\nCallback: ") + stranger) == 403);
  CHECK(status("\nCallback: http://127.0.0.1:9/r\nAccept: image/png") == 406);
  CHECK(arm.bench.get("/arm/subscriptions").linked("related").empty());
  // The robot itself: it would carry out what it says of itself.
  arm.bench.engine.listens_on("127.0.0.1", 9000);
  for (const char* self : {"http://127.0.0.1:9000/arm/actions/turn", "http://localhost:9000/", "http://127.0.0.2:9000/", "http://[::1]:9000/"}) {
    const Answer answer = arm.bench.ask("GET /arm/angle\nHost: localhost:9000\nUpgrade: callback\nCallback: " + std::string(self));
    CHECK(answer.status == 403);
    CHECK(answer.says("this server itself"));
  }
  CHECK(arm.bench.ask("GET /arm/angle\nHost: localhost:9000\nUpgrade: callback\nCallback: http://127.0.0.1:9001/").status == 201);

  Arm closed(allowing({}));  // the default: no receiver may be called
  CHECK(closed.bench.ask("GET /arm/angle" + callback).status == 403);
}

TEST_CASE("a notification is the representation with its ETag, the resource and the subscription", "[engine][R0.16][SPEC 3.6]") {
  Arm arm;
  REQUIRE(arm.bench.ask("GET /arm/angle" + callback + "\nAccept: application/n-triples").status == 201);
  const auto due = arm.due();
  REQUIRE(due.size() == 1);
  const auto first = arm.notice(due[0]);
  REQUIRE(first);
  const Answer get = arm.bench.ask("GET /arm/angle\nAccept: application/n-triples");
  CHECK(first->url == "http://127.0.0.1:9/receiver");
  CHECK(*first->body == get.body);
  CHECK(first->fields.find("ETag") == get.tag());
  CHECK(first->fields.find("Content-Type") == "application/n-triples");
  const auto links = parse_links(first->fields.joined("Link"));
  REQUIRE(links.size() == 2);
  CHECK(links[0].target == "http://localhost/arm/angle");
  CHECK(links[0].rel == "about");
  CHECK(links[1].target == "http://localhost/arm/subscriptions/i1");
  CHECK(links[1].rel == "via");
  CHECK_FALSE(arm.notice(due[0]));  // one at a time
  arm.publish(3);
  CHECK(arm.due().empty());  // under way
  arm.receipt(due[0], {204});
  CHECK(arm.callbacks() == due);
  const auto second = arm.notice(due[0]);
  REQUIRE(second);
  CHECK(*second->body == arm.bench.ask("GET /arm/angle\nAccept: application/n-triples").body);
  arm.receipt(due[0], {200});
  CHECK_FALSE(arm.notice(due[0]));
  CHECK(missing(arm.bench.get("/arm/subscriptions/i1"), "<http://localhost/arm/subscriptions/i1> lrt:delivered 2 .") == "");
}

TEST_CASE("a notification beyond ASCII says its charset as GET does", "[engine][R0.16][R1.2]") {
  Bench bench(allowing());
  Thing thing{"arm"};
  auto text = thing.property<std::string>("angle");
  text.publish("43.6 deg");
  bench.add(std::move(thing));
  REQUIRE(bench.ask("GET /arm/angle" + callback).status == 201);
  std::string types;
  for (const char* value : {"43.6 \u00b0", "43.6 deg"}) {
    (void)bench.pushes();
    for (const subscription::ReadyCallback& due : bench.take_callbacks()) {
      const auto notification = bench.engine.next_notification(due.channel, bench.clock.now());
      REQUIRE(notification);
      CHECK(notification->fields.find("Content-Type") == bench.get("/arm/angle").field("Content-Type"));
      types += std::string(notification->fields.find("Content-Type").value_or("")) + "\n";
      bench.engine.delivered(due.channel, {204}, bench.clock.now());
    }
    text.publish(value);
    bench.look();
  }
  CHECK(types == "text/turtle\ntext/turtle; charset=utf-8\n");
}

TEST_CASE("a server does not take a notification for a command, unless its sender is allowed", "[engine][R0.16][security]") {
  const auto status = [](Arm& arm, const std::string& field) {
    return arm.bench.ask("POST /arm/actions/home\nLrt-Notification-Of: " + field).status;
  };
  Arm arm;
  REQUIRE(arm.bench.ask("GET /arm/angle" + callback).status == 201);
  const auto notice = arm.notice(arm.due().at(0));
  REQUIRE(notice);
  const std::string mark = notice->fields.joined("Lrt-Notification-Of");
  CHECK_FALSE(mark.empty());
  CHECK(mark.find("; base=\"http://localhost\"") != std::string::npos);
  const std::string other = "4d1c; base=\"http://arm.example:8080\"";
  for (const std::string& field : {mark, other, std::string("another"), std::string("; base=\""), std::string("*")}) CHECK(status(arm, field) == 403);
  CHECK(arm.bench.ask("PUT /arm/angle\nContent-Type: application/json\nLrt-Notification-Of: " + other + "\n\n41").status == 403);
  CHECK(arm.bench.ask("DELETE /arm/waypoints\nLrt-Notification-Of: " + other).status == 403);
  CHECK(arm.bench.ask("GET /arm/angle\nLrt-Notification-Of: " + other).status == 200);
  CHECK(arm.robot.homed == 0);

  engine::EngineOptions options = allowing();
  options.notification_senders = {"http://arm.example:8080"};
  Arm named(std::move(options));
  CHECK(status(named, other) == 204);
  CHECK(status(named, mark) == 403);
  CHECK(status(named, other + "\nLrt-Notification-Of: " + other) == 403);
  CHECK(status(named, "4d1c; base=\"http://arm.example:80800\"") == 403);
  CHECK(named.robot.homed == 1);

  options = allowing();
  options.notification_senders = {"*"};
  Arm any(std::move(options));
  CHECK(status(any, other) == 204);
  CHECK(status(any, mark) == 204);
  REQUIRE(any.bench.ask("GET /arm/angle" + callback).status == 201);
  CHECK(status(any, any.notice(any.due().at(0))->fields.joined("Lrt-Notification-Of")) == 403);  // its own
}

TEST_CASE("a receiver confirms a subscription before its first notification, but for those of this machine", "[engine][R0.13][security]") {
  engine::EngineOptions options = allowing();
  options.callbacks.confirmation = subscription::Confirmation::all;
  Arm arm(std::move(options));
  const auto subscribed = [&] {
    REQUIRE(arm.bench.ask("GET /arm/angle?queueLength=10" + callback).status == 201);
    const auto due = arm.due();
    REQUIRE(due.size() == 1);
    return due[0];
  };
  const auto count = [&] { return arm.bench.get("/arm/subscriptions").linked("related").size(); };
  const Channel channel = subscribed();
  const auto question = arm.notice(channel);
  REQUIRE(question);
  CHECK(question->url == "http://127.0.0.1:9/receiver");
  CHECK_FALSE(question->body);
  CHECK(question->challenge.size() >= 32);
  CHECK(question->query == "hub.mode=subscribe&hub.challenge=" + question->challenge + "&hub.topic=http%3A%2F%2Flocalhost%2Farm%2Fangle");
  arm.publish(3);
  CHECK(arm.due().empty());
  CHECK_FALSE(arm.notice(channel));  // it has been asked
  SECTION("it confirms") {
    arm.receipt(channel, {200, {}, false, true});
    CHECK(arm.callbacks() == std::vector<Channel>{channel});
    const auto first = arm.notice(channel);
    REQUIRE(first);
    CHECK(first->challenge.empty());
    CHECK(first->body);
    arm.receipt(channel, {204});
    CHECK(arm.callbacks() == std::vector<Channel>{channel});
    CHECK(arm.notice(channel)->body);  // what was published meanwhile
    CHECK(count() == 1);
  }
  SECTION("it does not") {
    const int status = GENERATE(200, 204, 302, 400, 404, 405, 410);
    CAPTURE(status);
    arm.receipt(channel, {status});
    CHECK(count() == 0);
    CHECK(arm.callbacks().empty());
    CHECK_FALSE(arm.notice(channel));
  }
  SECTION("it cannot be asked now") {
    arm.receipt(channel, GENERATE(values<DeliveryResult>({{0, "connection refused"}, {500}, {503}, {429}})));
    CHECK(count() == 1);
    CHECK(arm.due().empty());
    arm.bench.clock.advance(milliseconds(750));  // first_pause, with the largest factor
    REQUIRE(arm.due() == std::vector<Channel>{channel});
    const auto again = arm.notice(channel);
    REQUIRE(again);
    CHECK_FALSE(again->challenge.empty());
    CHECK(again->challenge != question->challenge);
    CHECK(again->failed_before);
    arm.receipt(channel, {200, {}, false, true});
    REQUIRE(arm.callbacks() == std::vector<Channel>{channel});
    CHECK(arm.notice(channel)->body);
  }
  SECTION("it is cancelled meanwhile") {
    REQUIRE(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 204);
    arm.receipt(channel, {200, {}, false, true});
    CHECK(arm.callbacks().empty());
  }
}

TEST_CASE("a subscription says whether its receiver has confirmed, and only where it must", "[engine][R0.13][R0.11]") {
  engine::EngineOptions options = allowing();
  options.callbacks.confirmation = subscription::Confirmation::all;
  Arm arm(std::move(options));
  const Answer made = arm.bench.ask("GET /arm/angle" + callback);
  REQUIRE(made.status == 201);
  CHECK(missing(made, "<arm/subscriptions/i1> lrt:confirmed false .") == "");
  const Answer before = arm.bench.get("/arm/subscriptions/i1");
  CHECK(missing(before, "<arm/subscriptions/i1> lrt:confirmed false .") == "");
  CHECK(arm.bench.ask("GET /arm/subscriptions/i1\nAccept: application/json").says(R"("confirmed":false)"));
  const auto due = arm.due();
  REQUIRE(due.size() == 1);
  REQUIRE(arm.notice(due[0]));
  arm.receipt(due[0], {200, {}, false, true});
  const Answer after = arm.bench.get("/arm/subscriptions/i1");
  CHECK(missing(after, "<arm/subscriptions/i1> lrt:confirmed true .") == "");
  CHECK(after.tag() != before.tag());
  CHECK(arm.bench.ask("GET /arm/subscriptions/i1\nAccept: application/json").says(R"("confirmed":true)"));
  CHECK_FALSE(arm.bench.get("/arm/subscriptions").says("lrt:confirmed"));

  Arm free(allowing());
  CHECK_FALSE(free.bench.ask("GET /arm/angle" + callback).says("lrt:confirmed"));
  REQUIRE(free.bench.upgrade("/arm/angle").channel);
  CHECK_FALSE(free.bench.get("/arm/subscriptions/i2").says("lrt:confirmed"));
}

TEST_CASE("a receiver that has confirmed is not asked again after a restart, and another is", "[engine][R0.13][restart]") {
  engine::EngineOptions options = allowing();
  options.callbacks.confirmation = subscription::Confirmation::all;
  Arm first(options);
  for (int i = 0; i < 2; ++i) REQUIRE(first.bench.ask("GET /arm/angle" + callback).status == 201);
  const auto due = first.due();
  REQUIRE(due.size() == 2);
  for (const Channel channel : due) REQUIRE(first.notice(channel));
  const std::string unconfirmed = first.bench.take_saved().value().text;
  CHECK(unconfirmed.find("confirmed") == std::string::npos);  // as in files of earlier versions
  first.receipt(due[0], {200, {}, false, true});
  const auto confirmed = first.bench.take_saved();
  REQUIRE(confirmed);

  const auto questions_after = [&](const std::string& saved) {
    Bench again(options);
    CHECK(again.engine.restore(saved).value() == 2);
    SampleRobot robot;
    again.add(robot.arm());
    const auto same = again.take_saved();
    CHECK((!same || same->text == saved));
    std::vector<bool> questions;
    for (const subscription::ReadyCallback& ready : again.take_callbacks())
      questions.push_back(!again.engine.next_notification(ready.channel, again.clock.now()).value().challenge.empty());
    return questions;
  };
  CHECK(questions_after(unconfirmed) == std::vector<bool>{true, true});
  CHECK(questions_after(confirmed->text) == std::vector<bool>{false, true});
  // While nobody must confirm, and while the resource is not there, it is kept.
  options.callbacks.confirmation = subscription::Confirmation::none;
  CHECK(questions_after(confirmed->text) == std::vector<bool>{false, false});
  Bench waiting(options);
  CHECK(waiting.engine.restore(confirmed->text).value() == 2);
  waiting.add(Thing{"other"});
  if (const auto same = waiting.take_saved()) CHECK(same->text == confirmed->text);
}

TEST_CASE("by default receivers elsewhere confirm, and those on a loopback address need not", "[engine][R0.13][security]") {
  using subscription::Confirmation;
  const auto asks = [](const std::string& url, Confirmation which) {
    engine::EngineOptions options = allowing({"127.0.0.0/8", "::1", "receiver.example", "localhost.example"});
    options.callbacks.confirmation = which;
    Bench bench(std::move(options));
    SampleRobot robot;
    bench.add(robot.arm());
    CHECK(bench.ask("GET /arm/angle\nUpgrade: callback\nCallback: " + url).status == 201);
    (void)bench.pushes();
    const auto due = bench.take_callbacks();
    REQUIRE(due.size() == 1);
    return !bench.engine.next_notification(due[0].channel, bench.clock.now())->challenge.empty();
  };
  CHECK(engine::EngineOptions().callbacks.confirmation == Confirmation::not_loopback);
  for (const char* here : {"http://127.0.0.1:9/", "http://127.1.2.3:9/", "http://[::1]:9/", "http://localhost:9/"}) {
    CAPTURE(here);
    CHECK_FALSE(asks(here, Confirmation::not_loopback));
    CHECK(asks(here, Confirmation::all));
  }
  for (const char* elsewhere : {"http://receiver.example/", "http://localhost.example/"}) {
    CAPTURE(elsewhere);
    CHECK(asks(elsewhere, Confirmation::not_loopback));
    CHECK_FALSE(asks(elsewhere, Confirmation::none));
  }
}

TEST_CASE("a failed notification is tried again after longer and longer pauses, in order", "[engine][R0.16][delivery]") {
  Arm arm;
  REQUIRE(arm.bench.ask("GET /arm/angle?queueLength=10" + callback).status == 201);
  const Channel channel = arm.due().at(0);
  const std::string first = *arm.notice(channel)->body;
  arm.receipt(channel, {0, "connection refused"});
  CHECK(arm.describe("i1").find("no valid response was received") != std::string::npos);
  CHECK(arm.due().empty());
  arm.publish(1);
  CHECK(arm.due().empty());
  auto last = milliseconds(0);
  for (int attempt = 2; attempt <= 4; ++attempt) {
    const auto due = *arm.bench.engine.next_deadline() - arm.bench.clock.now().steady;
    (void)due;
    auto waited = milliseconds(0);
    std::vector<Channel> again;
    for (; again.empty() && waited < milliseconds(60'000); waited += milliseconds(10)) {
      arm.bench.clock.advance(milliseconds(10));
      again = arm.due();
    }
    REQUIRE(again.size() == 1);
    CHECK(waited >= milliseconds(250 << (attempt - 2)));
    CHECK(waited <= milliseconds(760 << (attempt - 2)));
    last = waited;
    const auto notice = arm.notice(channel);
    REQUIRE(notice);
    CHECK(notice->failed_before);
    CHECK(*notice->body == first);
    if (attempt < 4) arm.receipt(channel, {500});
  }
  CHECK(last > milliseconds(0));
  arm.receipt(channel, {200});
  CHECK(arm.callbacks().size() == 1);
  CHECK(*arm.notice(channel)->body != first);
  arm.receipt(channel, {200});
  CHECK(arm.describe("i1").find("lastError") == std::string::npos);
}

TEST_CASE("after the stated failures a callback is suspended, then removed; a response resumes it", "[engine][R0.16][delivery]") {
  engine::EngineOptions options = allowing();
  options.callbacks.attempts = 3;
  options.callbacks.suspended_attempts = 2;
  Arm arm(options);
  REQUIRE(arm.bench.ask("GET /arm/angle?queueLength=5" + callback).status == 201);
  const auto fail = [&](DeliveryResult receipt) {
    for (int i = 0; i < 200; ++i) {
      const auto due = arm.due();
      if (!due.empty()) {
        if (!arm.notice(due[0])) return false;
        arm.receipt(due[0], receipt);
        return true;
      }
      arm.bench.clock.advance(milliseconds(1000));
    }
    return false;
  };
  for (int i = 0; i < 3; ++i) REQUIRE(fail({503}));
  CHECK(arm.describe("i1").find("lrt:suspended true") != std::string::npos);
  CHECK(arm.describe("i1").find("the receiver responded with 503") != std::string::npos);
  for (int i = 0; i < 20; ++i) arm.publish(i);  // nothing is queued for it
  const auto now = arm.bench.clock.now().steady;
  REQUIRE(fail({200}));
  CHECK(arm.bench.clock.now().steady - now >= milliseconds(30'000));
  CHECK(arm.describe("i1").find("lrt:suspended") == std::string::npos);
  arm.publish(-1);
  for (int i = 0; i < 4; ++i) REQUIRE(fail({0, "timed out"}));
  CHECK(arm.describe("i1").find("lrt:suspended") != std::string::npos);
  REQUIRE(fail({0, "timed out"}));
  CHECK(arm.bench.get("/arm/subscriptions/i1").status == 404);
}

TEST_CASE("lastError has the same words whatever is at the receiver's port; the log has the details, each once", "[engine][attack]") {
  engine::EngineOptions options = allowing();
  std::vector<std::string> log;
  options.log = [&](LogLevel, std::string_view line) { log.emplace_back(line); };
  Arm arm(options);
  const std::string words = "lrt:lastError \"no valid response was received\"";
  int made = 0;
  for (const char* detail :
       {"127.0.0.1: Connection refused", "127.0.0.1: timed out while connecting", "it did not respond in time", "its response is not HTTP/1.1",
        "TLS: its certificate is not accepted", "no address of \"receiver.example\"", "its response is longer than 65536 bytes"}) {
    INFO(detail);
    const std::string id = "i" + std::to_string(++made);
    REQUIRE(arm.bench.ask("GET /arm/angle" + callback).status == 201);
    const Channel channel = arm.due().at(0);
    const std::size_t logged = log.size();
    for (int attempt = 0; attempt < 2; ++attempt) {
      REQUIRE(arm.notice(channel));
      arm.receipt(channel, {0, detail});
      CHECK(arm.describe(id).find(words) != std::string::npos);
      CHECK(arm.describe(id).find(detail) == std::string::npos);
      arm.bench.clock.advance(milliseconds(1000));
      (void)arm.due();
    }
    REQUIRE(log.size() == logged + 1);
    CHECK(log.back().find(detail) != std::string::npos);
    REQUIRE(arm.bench.ask("DELETE /arm/subscriptions/" + id).status == 204);
  }
}

TEST_CASE("410 ends a callback, and so does a host whose addresses are not allowed", "[engine][R0.16][SPEC 3.6]") {
  Arm arm;
  for (const DeliveryResult& end : {DeliveryResult{410}, DeliveryResult{0, "receiver.example is 10.0.0.1", true}}) {
    const Answer made = arm.bench.ask("GET /arm/angle" + callback);
    const Channel channel = arm.due().at(0);
    REQUIRE(arm.notice(channel));
    arm.receipt(channel, end);
    CHECK(arm.bench.get(made.field("Location").substr(16)).status == 404);
    CHECK_FALSE(arm.notice(channel));
  }
}

TEST_CASE("a callback may be cancelled while its notification is under way", "[engine][R0.16]") {
  Arm arm;
  REQUIRE(arm.bench.ask("GET /arm/angle" + callback).status == 201);
  const Channel channel = arm.due().at(0);
  REQUIRE(arm.notice(channel));
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 204);
  arm.receipt(channel, {500});
  arm.publish(5);
  CHECK(arm.due().empty());
  CHECK_FALSE(arm.notice(channel));
}

TEST_CASE("POST to the container makes a callback as the Upgrade form does", "[engine][R0.13][SPEC 3.5][LDP 5.2.3]") {
  Arm arm;
  const Answer made = arm.bench.turtle(
      "POST", "/arm/subscriptions",
      description("hybrit:mediaType \"application/n-triples\" ; lrt:minimumInterval 0.25 ; lrt:queueLength 7 ; lrt:secret \"s3cret\""));
  INFO(made.body);
  REQUIRE(made.status == 201);
  CHECK(made.field("Location") == "http://localhost/arm/subscriptions/i1");
  const Answer member = arm.bench.get("/arm/subscriptions/i1");
  CHECK(missing(member,
                "<http://localhost/arm/subscriptions/i1> hybrit:mediaType \"application/n-triples\" ; lrt:queueLength 7 ; "
                "lrt:minimumInterval \"0.25\"^^xsd:double ; hybrit:onResource <http://localhost/arm/angle> .") == "");
  CHECK_FALSE(member.says("s3cret"));
  CHECK_FALSE(made.says("s3cret"));
  const auto notice = arm.notice(arm.due().at(0));
  REQUIRE(notice);
  CHECK(notice->secret == "s3cret");
  CHECK(notice->fields.find("Content-Type") == "application/n-triples");
}

TEST_CASE("a description that the shape refuses gets 422 with the report and constrainedBy", "[engine][SPEC 3.5][LDP 4.2.1.6]") {
  Arm arm;
  const auto post = [&](const std::string& text) { return arm.bench.turtle("POST", "/arm/subscriptions", text); };
  for (const std::string& bad : {std::string("<> a hybrit:WebCallback ; hybrit:onResource <../arm/angle> ."),
                                 std::string("<> a hybrit:WebCallback ; hybrit:callbackURL \"http://127.0.0.1:9/\"^^xsd:anyURI ."),
                                 description("lrt:queueLength 1001"), description("lrt:queueLength -1"), description("lrt:minimumInterval -0.5"),
                                 description("hybrit:mediaType \"text/turtle\", \"text/html\""), std::string()}) {
    const Answer answer = post(bad);
    INFO(bad << answer.body);
    CHECK(answer.status == 422);
    CHECK(answer.says("sh:ValidationReport"));
    CHECK(answer.links_to("http://localhost" + kind_of(arm.bench, "/arm"), vocab::ldp::constrainedBy.text));
  }
  CHECK(post(description("a hybrit:WebSocket")).status == 422);
  CHECK(post(description("a hybrit:WebSocket")).says("Upgrade: websocket"));
  CHECK(post(description("hybrit:mediaType \"image/png\"")).status == 422);
  CHECK(post("<> hybrit:onResource <../elsewhere> ; hybrit:callbackURL \"http://127.0.0.1:9/\"^^xsd:anyURI .").status == 422);
  CHECK(post("<> hybrit:onResource <../arm/subscriptions> ; hybrit:callbackURL \"http://127.0.0.1:9/\"^^xsd:anyURI .").status == 422);
  CHECK(post("<a> hybrit:onResource <../arm/angle> . <b> hybrit:onResource <../arm/angle> .").status == 422);
  CHECK(post(description({}, "nonsense")).status == 422);
  CHECK(post(description({}, "http://evil.example/")).status == 403);
  CHECK(post("this is no Turtle").status == 400);
  CHECK(arm.bench.ask("POST /arm/subscriptions\nContent-Type: text/plain\n\nx").status == 415);
  CHECK(arm.bench.get("/arm/subscriptions").linked("related").empty());
  // The subject may be a blank node, and <> need not occur.
  CHECK(post("[] hybrit:onResource <http://localhost/arm/angle> ; hybrit:callbackURL <http://127.0.0.1:9/> .").status == 201);
}

TEST_CASE("callbacks have a limit of their own", "[engine][limits]") {
  engine::EngineOptions options = allowing();
  options.callbacks.max_callbacks = 2;
  Arm arm(options);
  for (int i = 0; i < 2; ++i) CHECK(arm.bench.ask("GET /arm/angle" + callback).status == 201);
  CHECK(arm.bench.ask("GET /arm/angle" + callback).status == 503);
  CHECK(arm.bench.turtle("POST", "/arm/subscriptions", description()).status == 503);
  CHECK(arm.bench.upgrade("/arm/angle").channel);
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i1").status == 204);
  CHECK(arm.bench.ask("GET /arm/angle" + callback).status == 201);
}

TEST_CASE("callbacks survive in what is saved: policy, secret, base and all", "[engine][restart]") {
  std::string saved;
  std::string before;
  engine::EngineOptions options = allowing();
  options.allowed_hosts = {"robot.local:80"};
  {
    Arm arm(options);
    CHECK_FALSE(arm.bench.take_saved());
    REQUIRE(arm.bench
                .turtle("POST", "/arm/subscriptions", description("lrt:queueLength 7 ; lrt:secret \"s3\\u00e9\\\"cret\" ; lrt:minimumInterval 2"),
                        "Host: robot.local\n")
                .status == 201);
    const Answer thing = arm.bench.ask("GET /arm" + callback);
    INFO(thing.body);
    REQUIRE(thing.status == 201);
    (void)arm.bench.open("/arm/angle");
    before = arm.bench.get("/arm/subscriptions/i1").body;
    const auto text = arm.bench.take_saved();
    REQUIRE(text);
    saved = text->text;
    CHECK_FALSE(arm.bench.take_saved());
    arm.publish(1);
    CHECK_FALSE(arm.bench.take_saved());
  }
  Bench again(options);
  REQUIRE(again.engine.restore(saved));
  CHECK(again.take_callbacks().empty());
  SampleRobot robot;
  again.add(robot.arm());  // the resource is back, and so are they
  CHECK(again.get("/arm/subscriptions").linked("related").size() == 2);
  CHECK(again.get("/arm/subscriptions/i1").body == before);
  std::size_t seen = 0;
  for (const subscription::ReadyCallback& due : again.take_callbacks()) {
    const auto notice = again.engine.next_notification(due.channel, again.clock.now());
    REQUIRE(notice);
    if (notice->secret.empty()) continue;
    ++seen;
    CHECK(notice->secret == "s3\u00e9\"cret");
    CHECK(notice->body->find("http://robot.local/arm/angle") != std::string::npos);
  }
  CHECK(seen == 1);
  CHECK(again.ask("DELETE /arm/subscriptions/i1").status == 204);
  const auto fewer = again.take_saved();
  REQUIRE(fewer);
  CHECK(fewer->text.find("robot.local") == std::string::npos);
}

TEST_CASE("what is saved and damaged, or allowed no more, brings nothing back and harms nothing", "[engine][restart]") {
  Arm arm;
  CHECK(arm.bench.engine.restore("this is { no Turtle").error().code == Errc::expected_rdf);
  CHECK(arm.bench.engine.restore(""));
  const std::string prefixes =
      "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix dcterms: <http://purl.org/dc/terms/> . "
      "@prefix lrt: <https://w3id.org/lrt/ns#> . ";
  const auto entry = [&](const std::string& id, const std::string& url, const std::string& path = "http://localhost/arm/angle") {
    return "[] a hybrit:WebCallback ; dcterms:identifier \"" + id + "\" ; dcterms:isPartOf <http://localhost/> ; hybrit:onResource <" + path +
           "> ; hybrit:callbackURL \"" + url + "\" ; hybrit:mediaType \"text/turtle\" ; lrt:queueLength 0 ; lrt:minimumInterval 0 . ";
  };
  CHECK(arm.bench.engine.restore(prefixes + entry("a", "http://127.0.0.1:9/") + entry("a", "http://127.0.0.1:9/") +
                                 entry("../b", "http://127.0.0.1:9/") + entry("c", "http://evil.example/") +
                                 entry("d", "http://127.0.0.1:9/", "http://elsewhere/arm/angle") + "[] a hybrit:WebCallback . " +
                                 entry("e", "http://127.0.0.1:9/", "http://localhost/not/there")));
  CHECK(arm.bench.get("/arm/subscriptions").linked("related") == std::vector<std::string>{"http://localhost/arm/subscriptions/a"});
  // The one whose resource is not there waits, and so does the one that may not be called now: both stay in the file.
  const std::string kept = arm.bench.take_saved().value_or(engine::SavedText{}).text;
  CHECK(kept.find("not/there") != std::string::npos);
  CHECK(kept.find("evil.example") != std::string::npos);
  CHECK(arm.bench.ask("GET /arm\nHost: elsewhere").status == 421);
}
