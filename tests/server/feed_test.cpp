// SPDX-License-Identifier: Apache-2.0
#include <lrt/feed.hpp>

#include <poll.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

struct Arm {
  explicit Arm(Options options = {}, Io io = GENERATE(Io::own_thread, Io::in_poll)) {
    options.listen.transport = transport::no_network;
    options.threads.io = io;
    server.emplace(Server::create(std::move(options)).value());
    Thing arm{"arm"};
    angle = arm.property<double>("angle");
    arm.property("pulled", [this] { return ++reads; });
    arm.action("turn", [](double, Responder done) { std::move(done).succeed(); });
    server->add(std::move(arm)).value();
    feed.emplace(Feed::create(*server).value());
  }
  /// Takes until a condition holds.
  template <class F>
  void until(F condition, Feed::Bounds bounds = {}) {
    const auto end = std::chrono::steady_clock::now() + seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) FAIL("it did not come true in twenty seconds");
      server->poll();
      take(bounds);
    }
  }
  void take(Feed::Bounds bounds = {}) {
    Feed::Batch batch = feed->take(bounds);
    for (auto& r : batch.resources) resources.push_back(std::move(r));
    for (auto& m : batch.messages) messages.push_back(std::move(m));
    for (auto& r : batch.responses) responses.push_back(std::move(r));
    closed = batch.closed;
  }
  Feed::Channel add(const std::string& path, std::optional<std::size_t> queue = std::nullopt) {
    engine::FeedSubscription s;
    s.path = path;
    s.media_type = "application/json";
    s.queue_length = queue;
    return feed->add(std::move(s)).value();
  }
  std::string newest(Feed::Channel channel) const {
    std::string found = "(none)";
    for (const engine::FeedMessage& m : messages)
      if (m.channel == channel && m.body) found = *m.body;
    return found;
  }
  bool has(const std::string& path) const {
    return std::any_of(resources.begin(), resources.end(), [&](const auto& r) { return r.path == path; });
  }
  /// By which requests name the server.
  std::string host() const { return feed->base().substr(7); }
  http::Response get(const std::string& path, const std::string& method = "GET") {
    RequestText request(method + " " + path + "\nHost: " + host() + "\nAccept: application/n-triples");
    return server->serve(request.get()).response;
  }

  std::optional<Server> server;
  std::optional<Feed> feed;
  PushedProperty<double> angle;
  int reads = 0;
  bool closed = false;
  std::vector<engine::ObservableResource> resources;
  std::vector<engine::FeedMessage> messages;
  std::vector<Feed::Response> responses;
};

bool is_readable(int descriptor) {
  pollfd item{descriptor, POLLIN, 0};
  return ::poll(&item, 1, 0) == 1;
}

}  // namespace

TEST_CASE("a feed finds what can be observed, and gets the present and each newer value", "[server]") {
  Arm arm;
  arm.angle.publish(1);
  arm.until([&] { return arm.has("/arm/angle") && arm.has("/arm/state") && arm.has("/arm/actions/turn"); });
  const Feed::Channel angle = arm.add("/arm/angle"), pulled = arm.add("/arm/pulled");
  arm.until([&] { return arm.newest(angle) == "1" && arm.newest(pulled) != "(none)"; });
  arm.angle.publish(2);
  arm.until([&] { return arm.newest(angle) == "2"; });
  arm.feed->remove(angle);
  arm.messages.clear();
  arm.angle.publish(3);
  arm.until([&] { return arm.newest(pulled) != "(none)"; });
  CHECK(arm.newest(angle) == "(none)");
  CHECK(arm.server->counters().feeds == 1);
}

TEST_CASE("what is not taken costs nothing, and the newest value is there when it is", "[server]") {
  Arm arm;
  arm.angle.publish(1);
  const Feed::Channel newest = arm.add("/arm/angle"), queued = arm.add("/arm/angle", 3);
  arm.until([&] { return arm.newest(newest) == "1" && arm.newest(queued) == "1"; });
  Feed::Bounds nothing;
  nothing.max_messages = 0;
  const auto dropped = arm.server->counters().messages_dropped;
  for (int i = 2; i <= 9; ++i) {
    const auto before = arm.server->counters().messages_dropped;
    arm.angle.publish(i);
    if (i > 4) arm.until([&] { return arm.server->counters().messages_dropped > before; }, nothing);
    else
      for (int turn = 0; turn < 100; ++turn) arm.server->poll();
  }
  CHECK(arm.server->counters().messages_dropped > dropped);
  CHECK(arm.newest(newest) == "1");
  Feed::Bounds only_newest;
  only_newest.queued = false;
  arm.messages.clear();
  arm.until([&] { return arm.newest(newest) == "9"; }, only_newest);
  CHECK(arm.newest(queued) == "(none)");
  arm.until([&] { return arm.newest(queued) == "9"; });
  const auto first = std::find_if(arm.messages.begin(), arm.messages.end(), [&](const auto& m) { return m.channel == queued; });
  CHECK(first->queued);
  CHECK(first->missed > 0);
  arm.messages.clear();
  arm.feed->repeat_all();
  arm.until([&] { return arm.newest(newest) == "9"; });
  CHECK(arm.newest(queued) == "(none)");
}

TEST_CASE("things and invocations that come later are told, and the end of those that go", "[server]") {
  Arm arm;
  arm.until([&] { return arm.has("/arm/angle"); });
  Thing tool{"arm/tool"};
  tool.property<int>("width").publish(4);
  REQUIRE(arm.server->add(std::move(tool)));
  arm.until([&] { return arm.has("/arm/tool/width"); });
  const Feed::Channel width = arm.add("/arm/tool/width");
  arm.until([&] { return arm.newest(width) == "4"; });
  REQUIRE(arm.server->remove("arm/tool"));
  arm.until([&] { return std::any_of(arm.messages.begin(), arm.messages.end(), [&](const auto& m) { return m.channel == width && m.end; }); });

  arm.resources.clear();
  RequestText request("POST /arm/actions/turn\nHost: " + arm.host() + "\nContent-Type: application/json\nPrefer: respond-async\n\n1");
  CHECK(arm.server->serve(request.get()).response.status == 202);
  arm.until([&] { return std::any_of(arm.resources.begin(), arm.resources.end(), [](const auto& r) { return r.kind == "invocation"; }); });
}

TEST_CASE("a resource says where its feed sends its values, and no client can end that", "[server]") {
  Arm arm;
  arm.angle.publish(1);
  engine::FeedSubscription s;
  s.path = "/arm/angle";
  s.protocol = "mqtt";
  s.statements.push_back({"https://w3id.org/lrt/ns#mqttTopic", Object("a/b")});
  const std::string tag(arm.get("/arm/angle").fields.find("ETag").value());
  const Feed::Channel channel = arm.feed->add(std::move(s)).value();
  const http::Response document = arm.get("/arm/angle");
  CHECK_THAT(std::string(document.content()), Catch::Matchers::ContainsSubstring("mqttTopic> \"a/b\""));
  CHECK(document.fields.find("ETag").value() != tag);
  const std::string list(arm.get("/arm/subscriptions").content());
  CHECK_THAT(list, Catch::Matchers::ContainsSubstring("ns#Feed>"));
  const std::size_t at = list.find("/arm/subscriptions/");
  const std::string path = list.substr(at, list.find('>', at) - at);
  CHECK_THAT(std::string(arm.get(path).content()), Catch::Matchers::ContainsSubstring("mqttTopic> \"a/b\""));
  CHECK(arm.get(path, "DELETE").status == 405);
  arm.feed->remove(channel);
  CHECK_THAT(std::string(arm.get("/arm/angle").content()), !Catch::Matchers::ContainsSubstring("mqttTopic"));
  CHECK(arm.get(path).status == 404);
}

TEST_CASE("a feed has a limit of its own, which neither takes from clients nor is used up by them", "[server]") {
  Options options;
  options.subscriptions.max_feed_subscriptions = 2;
  options.subscriptions.max_subscriptions = 1;
  Arm arm(std::move(options));
  arm.add("/arm/angle");
  arm.add("/arm/pulled");
  engine::FeedSubscription s;
  s.path = "/arm/state";
  const auto third = arm.feed->add(s);
  REQUIRE_FALSE(third);
  CHECK(third.error().code == Errc::limit_exceeded);
  RequestText request("GET /arm/angle\nHost: " + arm.host() + "\nAccept: text/event-stream");
  request.get().can_stream = true;
  CHECK(arm.server->serve(request.get()).response.status == 200);
  s.path = "/nothing";
  CHECK(arm.feed->add(s).error().code == Errc::unknown_path);
  s.path = "/arm/angle";
  s.media_type = "image/png";
}

TEST_CASE("requests of a feed are handled without waiting", "[server]") {
  Arm arm;
  const std::string host = arm.host();
  http::Request request;
  request.method = "GET";
  request.target = "/arm/pulled";
  request.fields = {{"Host", host}, {"Accept", "application/json"}};
  const std::uint64_t number = arm.feed->send(request);
  arm.until([&] { return !arm.responses.empty(); });
  CHECK(arm.responses[0].number == number);
  CHECK(arm.responses[0].response.status == 200);
  request.target = "/nothing";
  arm.responses.clear();
  const std::uint64_t second = arm.feed->send(request);
  CHECK(second != number);
  CHECK(is_readable(arm.feed->descriptor()));
  arm.take();
  REQUIRE(arm.responses.size() == 1);
  CHECK(arm.responses[0].response.status == 404);
}

TEST_CASE("the descriptor of a feed is readable while it has something", "[server]") {
  Arm arm({}, Io::in_poll);
  arm.angle.publish(1);
  CHECK(is_readable(arm.feed->descriptor()));  // all resources
  const Feed::Channel angle = arm.add("/arm/angle");
  arm.until([&] { return arm.newest(angle) == "1"; });
  while (is_readable(arm.feed->descriptor())) arm.take();
  arm.angle.publish(2);
  CHECK_FALSE(is_readable(arm.feed->descriptor()));
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (!is_readable(arm.feed->descriptor()) && std::chrono::steady_clock::now() < end) arm.server->poll();
  CHECK(is_readable(arm.feed->descriptor()));
  arm.take();
  CHECK(arm.newest(angle) == "2");
}

TEST_CASE("a stopped server has nothing more for a feed", "[server]") {
  Arm arm;
  const Feed::Channel angle = arm.add("/arm/angle");
  arm.server->stop();
  arm.take();
  CHECK(arm.closed);
  CHECK(is_readable(arm.feed->descriptor()) == false);
  http::Request request;
  request.method = "GET";
  request.target = "/arm/angle";
  (void)arm.feed->send(request);
  arm.take();
  REQUIRE(arm.responses.size() == 1);
  CHECK(arm.responses[0].response.status == 503);
  engine::FeedSubscription s;
  s.path = "/arm/pulled";
  CHECK(arm.feed->add(s).error().code == Errc::closed);
  arm.feed->remove(angle);
  CHECK_FALSE(Feed::create(*arm.server));
}

TEST_CASE("two feeds have their own channels and responses", "[server]") {
  Arm arm;
  arm.angle.publish(1);
  Feed other = Feed::create(*arm.server).value();
  const Feed::Channel mine = arm.add("/arm/angle");
  engine::FeedSubscription s;
  s.path = "/arm/angle";
  s.media_type = "application/json";
  const Feed::Channel its = other.add(s).value();
  std::vector<engine::FeedMessage> messages;
  std::size_t resources = 0;
  arm.until([&] {
    Feed::Batch batch = other.take({});
    resources += batch.resources.size();
    for (auto& m : batch.messages) messages.push_back(std::move(m));
    return arm.newest(mine) == "1" && !messages.empty();
  });
  CHECK(resources == arm.resources.size());
  CHECK(messages.front().channel == its);
  CHECK(arm.server->counters().feeds == 2);
  arm.feed.reset();
  CHECK(arm.server->counters().feeds == 1);
}

TEST_CASE("a feed knows whether requests without credentials are restricted", "[server][security][R0.2]") {
  const auto is_protected = [](const std::function<void(Security&)>& change) {
    Options options;
    if (change) change(options.security);
    const Arm arm(std::move(options), Io::in_poll);
    return arm.feed->is_protected();
  };
  CHECK_FALSE(is_protected({}));
  CHECK_FALSE(is_protected([](Security& s) { s.allow_unprotected_network = true; }));
  CHECK_FALSE(is_protected([](Security& s) { s.allowed_hosts = {"robot.example"}; }));  // says nothing about who may do what
  CHECK(is_protected([](Security& s) { s.authorize = [](const http::Request&) { return engine::Access::granted; }; }));
  CHECK(is_protected([](Security& s) { s.authenticate = [](const http::Request&) { return std::optional<security::Principal>(); }; }));
  CHECK(is_protected([](Security& s) { s.rules = {{"/", security::Scope::tree, {}, security::Right::read}}; }));
}

TEST_CASE("a feed says how long its longest waiting subscription has waited", "[server][newest]") {
  test::FakeClock clock;
  Options options;
  options.clock = &clock;
  Arm arm(std::move(options), Io::in_poll);
  Feed::Bounds nothing;
  nothing.max_messages = 0;
  const auto is_waiting = [&](const Feed::Bounds& bounds) {
    clock.advance(milliseconds(1));
    return arm.feed->take(bounds).waiting > milliseconds(0);
  };
  const auto has = [&](const char* value, Feed::Channel channel) {
    clock.advance(milliseconds(1));
    return arm.newest(channel) == value;
  };
  arm.angle.publish(1);
  const Feed::Channel angle = arm.add("/arm/angle");
  arm.until([&] { return has("1", angle); });
  arm.until([&] { return !is_waiting({}); });
  arm.angle.publish(2);
  arm.until([&] { return is_waiting(nothing); }, nothing);
  clock.advance(seconds(3));
  CHECK(arm.feed->take(nothing).waiting >= seconds(3));
  arm.until([&] { return has("2", angle); });
  arm.until([&] { return !is_waiting({}); });
}
