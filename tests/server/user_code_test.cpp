// SPDX-License-Identifier: Apache-2.0
// User code never runs under a lock of lrt: whatever the user hands to a server may call that server, or wait for a thread that does.

#include <lrt/server.hpp>

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/delivery/deliverer.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// A type with traits of the user's own.
struct Level {
  double litres = 0;
};
std::function<void()> in_traits;  ///< called by encode and decode

}  // namespace

template <>
struct lrt::rdf::traits<Level> {
  static const Type& type() { return traits<double>::type(); }
  static Value encode(const Level& v) {
    if (in_traits) in_traits();
    return traits<double>::encode(v.litres);
  }
  static Result<Level> decode(const Value& v) {
    if (in_traits) in_traits();
    const Result<double> litres = traits<double>::decode(v);
    if (!litres) return Unexpected{litres.error()};
    return Level{*litres};
  }
  static bool same(const Level& a, const Level& b) noexcept { return a.litres == b.litres; }
};

namespace {

/// A server whose host polls while it waits for a response. A hang ends the test.
struct Host {
  explicit Host(Io io, Options options = {}, std::string what = "the server") : watchdog(std::move(what)) {
    options.listen.port = 0;
    options.threads.io = io;
    server.emplace(Server::create(std::move(options)).value());
    here = server.has_value();
  }
  Answer ask(const std::string& text) {
    return Socket(server->port()).ask(text + fields(), [this] { server->poll(); });
  }
  Answer put(const std::string& path, const std::string& number) {
    return Socket(server->port()).ask(Bench::turtle_request("PUT", path, number_body(number), host()), [this] { server->poll(); });
  }
  std::string host() const { return "Host: 127.0.0.1:" + std::to_string(server->port()) + "\n"; }
  std::string fields() const { return "\n" + host(); }
  /// A function that adds a Thing and removes it again.
  std::function<void()> comes_and_goes(const std::string& name) {
    return [this, name] {
      if (!here || server->remove(name)) return;
      if (server->add(Thing{name})) ++added;
      (void)server->remove(name);
    };
  }

  Watchdog watchdog;
  std::atomic<bool> here{false};
  std::atomic<int> added{0};
  std::optional<Server> server;
};

}  // namespace

TEST_CASE("the log callback may add and remove Things", "[server][user code]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  std::function<void()> call;
  Options options;
  options.log = [&](LogLevel, std::string_view) {
    if (call) call();
  };
  Host host(io, std::move(options), "the log callback");
  Thing thing{"arm"};
  thing.property("broken", []() -> double { throw std::runtime_error("no voltage"); });
  host.server->add(std::move(thing)).value();
  call = host.comes_and_goes("logged");
  CHECK(host.ask("GET /arm/broken").status == 500);
  CHECK(host.added >= 1);
}

TEST_CASE("the log callback may stop the server", "[server][user code]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  std::atomic<bool> stopped{false};
  std::function<void()> call;
  Options options;
  options.log = [&](LogLevel, std::string_view) {
    if (call) call();
  };
  Host host(io, std::move(options), "the log callback that stops the server");
  Thing thing{"arm"};
  thing.property("broken", []() -> double { throw std::runtime_error("no voltage"); });
  host.server->add(std::move(thing)).value();
  call = [&] {
    host.server->stop();
    stopped = true;
  };
  Socket client(host.server->port());
  client.send("GET /arm/broken" + host.fields());
  while (!stopped) host.server->poll();
  host.server->stop();
  CHECK(host.server->add(Thing{"late"}).error().code == Errc::closed);
}

TEST_CASE("an encoder may add and remove Things", "[server][user code][R0.17]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "an encoder");
  const auto call = host.comes_and_goes("encoded");
  Thing thing{"camera"};
  auto image = thing.property<int>("image").representation("image/x-test", [&](int v) {
    call();
    return std::to_string(v);
  });
  thing.property("pulled", [] { return 5; }).representation("image/x-test", [&](int v) {
    call();
    return std::to_string(v);
  });
  host.server->add(std::move(thing)).value();
  image.publish(7);
  CHECK(host.ask("GET /camera/image\nAccept: image/x-test").body == "7");
  CHECK(host.ask("GET /camera/pulled\nAccept: image/x-test").body == "5");
  CHECK(host.ask("GET /camera/state").status == 200);  // RDF states sizes
  CHECK(host.added == 2);                              // once for each value
}

TEST_CASE("an encoder may wait for another thread that adds a Thing", "[server][user code][R0.17]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "an encoder that waits");
  const auto call = host.comes_and_goes("encoded");
  Thing thing{"camera"};
  auto image = thing.property<int>("image").representation("image/x-test", [&](int v) {
    std::async(std::launch::async, call).get();
    return std::to_string(v);
  });
  host.server->add(std::move(thing)).value();
  image.publish(7);
  CHECK(host.ask("GET /camera/image\nAccept: image/x-test").body == "7");
  CHECK(host.added == 1);
}

TEST_CASE("an encoder may stop the server", "[server][user code][R0.17]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "an encoder that stops the server");
  std::atomic<bool> stopped{false};
  Thing thing{"camera"};
  auto image = thing.property<int>("image").representation("image/x-test", [&](int) {
    host.server->stop();
    stopped = true;
    return std::string("x");
  });
  host.server->add(std::move(thing)).value();
  image.publish(7);
  Socket client(host.server->port());
  client.send("GET /camera/image\nAccept: image/x-test" + host.fields());
  while (!stopped) host.server->poll();
  host.server->stop();
}

TEST_CASE("traits of a user's type may add and remove Things", "[server][user code][R1.2]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "traits");
  double written = 0;
  Thing thing{"tank"};
  auto level = thing.property<Level>("level").on_write([&](Level l) { written = l.litres; });
  thing.property("pulled", [] { return Level{3}; });
  host.server->add(std::move(thing)).value();
  in_traits = host.comes_and_goes("traits");
  level.publish(Level{2.5});
  CHECK(host.ask("GET /tank/level\nAccept: application/json").body.find("2.5") != std::string::npos);
  CHECK(host.added == 1);
  CHECK(host.ask("GET /tank/pulled\nAccept: application/json").status == 200);
  CHECK(host.added == 2);
  CHECK(host.put("/tank/level", "4.0e0").status == 204);
  CHECK(host.added == 3);
  CHECK(written == 4);
  level.publish(Level{5});
  CHECK(host.ask("GET /tank/state").status == 200);
  in_traits = {};
}

TEST_CASE("the authorizer may add and remove Things, and is asked once for each request", "[server][user code][R0.2]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  std::function<void()> call;
  std::atomic<int> asked{0};
  Options options;
  options.security.authorize = [&](const http::Request&) {
    ++asked;
    if (call) call();
    return engine::Access::granted;
  };
  Host host(io, std::move(options), "the authorizer");
  Thing thing{"arm"};
  thing.property("pulled", [] { return 1; });
  host.server->add(std::move(thing)).value();
  call = host.comes_and_goes("authorized");
  CHECK(host.ask("GET /arm/pulled").status == 200);
  CHECK(asked == 1);
  CHECK(host.added == 1);
}

TEST_CASE("the authorizer is called once, before the body is received, wherever the body is", "[server][user code][R0.2]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  std::atomic<int> calls{0}, bodies{0};
  Options options;
  options.security.authorize = [&](const http::Request& request) {
    ++calls;
    if (!request.body.empty()) ++bodies;
    return request.find("Authorization") ? engine::Access::granted : engine::Access::unauthenticated;
  };
  Host host(io, std::move(options), "the authorizer");
  std::atomic<int> written{0};
  Thing thing{"arm"};
  thing.property("speed", [] { return 1; }).on_write([&](int v) { written = v; });
  host.server->add(std::move(thing)).value();
  const std::string put = "PUT /arm/speed\nContent-Type: application/json" + host.fields();
  const auto poll = [&] { host.server->poll(); };

  Socket stranger(host.server->port());
  stranger.send_header(put, 10, true);
  CHECK(stranger.await(poll).status == 401);
  CHECK(calls == 1);
  Socket client(host.server->port());
  client.send_header(put + "Authorization: me", 2, true);
  CHECK(client.await(poll).status == 100);
  CHECK(calls == 2);
  client.write("42");
  CHECK(client.await(poll).status == 204);
  CHECK(written == 42);
  CHECK(calls == 2);
  CHECK(client.ask(put + "Authorization: me\n\n43", poll).status == 204);  // with its body
  CHECK(written == 43);
  CHECK(calls == 3);
  CHECK(bodies == 0);
}

TEST_CASE("a lambda may call poll", "[server][user code][R0.5]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  const Dispatch where = GENERATE(Dispatch::io_thread, Dispatch::in_poll);
  Host host(io, {}, "a lambda that polls");
  Thing thing{"arm"};
  thing.dispatch(where).property("pulled", [&] {
    for (int i = 0; i < 3; ++i) host.server->poll();
    return 1;
  });
  host.server->add(std::move(thing)).value();
  CHECK(host.ask("GET /arm/pulled").status == 200);
}

TEST_CASE("user code on the I/O thread is not called within other user code of that thread", "[server][user code][R0.5]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "a lambda and a hook that share a mutex");
  std::mutex mutex;  // a second lock by the same thread hangs
  std::atomic<bool> called{false};
  std::vector<Responder> running;
  Thing gripper{"gripper"};
  gripper.dispatch(Dispatch::io_thread).action("hold", [&](Responder done) {
    done.on_cancel([&] {
      const std::lock_guard lock(mutex);
      called = true;
    });
    running.push_back(std::move(done));
  });
  Thing arm{"arm"};
  arm.dispatch(Dispatch::io_thread).property("pulled", [&] {
    const std::lock_guard lock(mutex);
    return host.server->remove("gripper") ? 1 : 2;
  });
  host.server->add(std::move(gripper)).value();
  host.server->add(std::move(arm)).value();
  REQUIRE(host.ask("POST /gripper/actions/hold\nPrefer: respond-async").status == 202);
  CHECK(host.ask("GET /arm/pulled\nAccept: application/json").body == "1");
  while (!called) host.server->poll();
}

TEST_CASE("an executor may call the server and run lambdas at once", "[server][user code][R0.5]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  std::function<void()> call;
  Options options;
  options.threads.dispatch = Dispatch::executor;
  options.threads.executor = [&](std::function<void()> job) {
    if (call) call();
    job();
  };
  Host host(io, std::move(options), "an executor");
  Thing thing{"arm"};
  const auto add = host.comes_and_goes("executed");
  thing.property("pulled", [&] { return add(), 1; });
  host.server->add(std::move(thing)).value();
  call = host.comes_and_goes("handed");
  CHECK(host.ask("GET /arm/pulled").status == 200);
  CHECK(host.added == 2);
}

TEST_CASE("a hook of on_cancel may call the server", "[server][user code][R0.5]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "a hook of on_cancel");
  std::vector<Responder> running;
  std::atomic<bool> called{false};
  const auto call = host.comes_and_goes("cancelled");
  Thing thing{"arm"};
  thing.action("move", [&](Responder done) {
    done.on_cancel([&] {
      call();
      called = true;
    });
    running.push_back(std::move(done));
  });
  host.server->add(std::move(thing)).value();
  const Answer started = host.ask("POST /arm/actions/move\nPrefer: respond-async");
  REQUIRE(started.status == 202);
  const std::string path = started.field("Location").substr(host.server->url().size() - 1);
  while (running.empty()) host.server->poll();
  SECTION("DELETE of the invocation") { CHECK(host.ask("DELETE " + path).status == 204); }
  SECTION("removing the Thing") { host.server->remove("arm").value(); }
  while (!called) host.server->poll();
  CHECK(host.added == 1);
}

TEST_CASE("a deliverer may call the server when it is notified", "[server][user code][R0.13]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  struct Calling final : delivery::Deliverer {
    Calling(delivery::Source& s, std::function<void()>& c, std::atomic<int>& n) : source(s), call(c), posted(n) {}
    void notify(subscription::Channel channel, std::string_view) override {
      if (call) call();
      if (source.next_notification(channel)) {
        ++posted;
        source.delivered(channel, {204, {}, false});
      }
    }
    void stop() noexcept override {}
    delivery::Source& source;
    std::function<void()>& call;
    std::atomic<int>& posted;
  };
  std::function<void()> call;
  std::atomic<int> posted{0};
  Options options;
  options.callbacks.allow = {"receiver.example"};
  options.callbacks.confirmation = subscription::Confirmation::none;
  options.callbacks.deliverer = [&](delivery::Source& source, const subscription::CallbackOptions&,
                                    LogCallback) -> Result<std::unique_ptr<delivery::Deliverer>> {
    return std::unique_ptr<delivery::Deliverer>(std::make_unique<Calling>(source, call, posted));
  };
  Host host(io, std::move(options), "a deliverer");
  Thing thing{"arm"};
  auto pushed = thing.property<double>("pushed");
  host.server->add(std::move(thing)).value();
  pushed.publish(1);
  call = host.comes_and_goes("delivered");
  CHECK(host.ask("GET /arm/pushed\nUpgrade: callback\nConnection: Upgrade\nCallback: http://receiver.example/").status == 201);
  while (posted < 1) host.server->poll();
  pushed.publish(2);
  while (posted < 2) host.server->poll();
  CHECK(host.added >= 2);
}

TEST_CASE("what lambdas have captured is destroyed without a lock", "[server][user code][R0.3]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Host host(io, {}, "a destructor");
  struct Calling {
    std::function<void()> call;
    ~Calling() {
      if (call) call();
    }
  };
  const auto thing_with = [&](const std::string& path) {
    auto captured = std::make_shared<Calling>();
    captured->call = host.comes_and_goes("destroyed");
    Thing thing{path};
    thing.property("pulled", [captured] { return 1; });
    return thing;
  };
  host.server->add(thing_with("arm")).value();
  SECTION("of a Thing that is removed") { host.server->remove("arm").value(); }
  SECTION("of a Thing that is refused for its path") { CHECK_FALSE(host.server->add(thing_with("arm"))); }
  SECTION("of a Thing that is refused for what it says") {
    Thing bad = thing_with("bad");
    bad.add_turtle("this is no Turtle");
    CHECK_FALSE(host.server->add(std::move(bad)));
  }
  SECTION("of several Things that are refused together") {
    std::vector<Thing> both;
    both.push_back(thing_with("first"));
    both.push_back(thing_with("arm"));
    CHECK_FALSE(host.server->add(std::move(both)));
  }
  CHECK(host.added >= 1);
  host.here = false;
}
