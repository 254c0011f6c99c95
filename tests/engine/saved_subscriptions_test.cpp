// SPDX-License-Identifier: Apache-2.0
#include "src/engine/saved_subscriptions.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/thing.hpp>

#include "src/engine/parts.hpp"
#include "src/engine/resources/thing.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

namespace {

struct Saved {
  explicit Saved(std::vector<std::string> allow = {"receiver.example"}) {
    EngineOptions options;
    options.clock = &clock;
    options.ids = std::make_shared<FixedIds>();
    options.callbacks.allow = std::move(allow);
    options.log = [this](LogLevel, std::string_view line) { log.emplace_back(line); };
    parts = std::make_unique<Parts>(std::move(options));
  }
  void add_arm() {
    Thing thing{"arm"};
    thing.property<double>("angle");
    parts->add(std::move(thing)).value();
    parts->saved.resume();
  }
  SubscriptionResource& subscribe(const std::string& id) {
    SubscriptionRequest request;
    request.observed = parts->registry.find("/arm/angle");
    request.protocol = Protocol::callback;
    request.url = "http://receiver.example/" + id;
    request.secret = "secret of " + id;
    request.policy.queue_length = 3;
    return parts->subscriptions.make(std::move(request), 0, id, clock.now().utc);
  }
  FakeClock clock;
  std::vector<std::string> log;
  std::unique_ptr<Parts> parts;
};

}  // namespace

TEST_CASE("callbacks are saved when they have changed, and only then", "[engine][R0.13]") {
  Saved s;
  s.add_arm();
  CHECK_FALSE(s.parts->saved.take());
  SubscriptionResource& made = s.subscribe("c1");
  const auto text = s.parts->saved.take();
  REQUIRE(text);
  CHECK(text->text.find("http://receiver.example/c1") != std::string::npos);
  CHECK(text->text.find("secret of c1") != std::string::npos);
  CHECK_FALSE(s.parts->saved.take());
  s.parts->subscriptions.end(made, 1000, {});
  CHECK(s.parts->saved.take());
}

TEST_CASE("a restored callback waits for its resource and then goes on as it was", "[engine][R0.13]") {
  Saved before;
  before.add_arm();
  before.subscribe("c1");
  const std::string text = before.parts->saved.take().value().text;

  Saved after;
  after.parts->saved.restore(text).value();
  CHECK(after.parts->subscriptions.callback_count() == 0);
  CHECK(after.parts->registry.find("/arm/subscriptions/c1") == nullptr);
  after.add_arm();
  CHECK(after.parts->subscriptions.callback_count() == 1);
  CHECK(after.parts->registry.find("/arm/subscriptions/c1") != nullptr);
  CHECK(after.parts->saved.take().value().text == text);
}

TEST_CASE("a callback whose resource does not come is not forgotten", "[engine][R0.13]") {
  Saved before;
  before.add_arm();
  before.subscribe("c1");
  const std::string text = before.parts->saved.take().value().text;
  Saved after;
  after.parts->saved.restore(text).value();
  Thing other{"other"};
  other.property<double>("angle");
  after.parts->add(std::move(other)).value();
  auto& unrelated = *after.parts->registry.find("/other/angle");
  SubscriptionRequest request;
  request.observed = &unrelated;
  request.protocol = Protocol::callback;
  request.url = "http://receiver.example/";
  after.parts->subscriptions.make(std::move(request), 0, "c2", after.clock.now().utc);
  CHECK(after.parts->saved.take()->text.find("http://receiver.example/c1") != std::string::npos);
}

TEST_CASE("a callback to a receiver that may not be called now waits, and the log says so", "[engine][R0.13]") {
  Saved before;
  before.add_arm();
  before.subscribe("c1");
  const std::string text = before.parts->saved.take().value().text;
  Saved after({"other.example"});
  after.parts->saved.restore(text).value();
  after.add_arm();
  CHECK(after.parts->subscriptions.callback_count() == 0);
  REQUIRE(after.log.size() == 1);
  CHECK(after.log[0].find("receiver.example is not in the list of allowed receivers") != std::string::npos);
}

TEST_CASE("a restored callback says what its owner is known by, and until when", "[engine][security][R0.13]") {
  Saved before;
  before.add_arm();
  security::Principal owner{"anna", {"reader"}};
  owner.expires = before.clock.now().utc + std::chrono::hours(1);
  owner.known_by = security::KnownBy::function;
  before.subscribe("c1").audience.principal = std::make_shared<const security::Principal>(owner);
  const std::string text = before.parts->saved.take().value().text;
  const auto restored = [](const std::string& from) {
    Saved after;
    after.parts->saved.restore(from).value();
    after.add_arm();
    const Resource* const found = after.parts->registry.find("/arm/subscriptions/c1");
    REQUIRE(found != nullptr);
    return *static_cast<const SubscriptionResource&>(*found).audience.principal;
  };
  const security::Principal found = restored(text);
  CHECK(found.known_by == owner.known_by);
  CHECK(found.expires == owner.expires);
  CHECK(found.roles == owner.roles);
  std::string earlier = text;
  earlier.replace(earlier.find("knownBy"), 7, "unknown");
  CHECK(restored(earlier).known_by == security::KnownBy::token);
}

TEST_CASE("a principal that is signed out has no callback left that waits for its resource", "[engine][security][R0.13]") {
  Saved before;
  before.add_arm();
  const auto subscribe = [&](const std::string& id, const std::string& owner) {
    before.subscribe(id).audience.principal = std::make_shared<const security::Principal>(security::Principal{owner, {"reader"}});
  };
  subscribe("c1", "anna");
  subscribe("c2", "bert");
  const std::string text = before.parts->saved.take().value().text;

  Saved after;
  after.parts->saved.restore(text).value();
  (void)after.parts->saved.take();
  after.parts->saved.sign_out("nobody");
  CHECK_FALSE(after.parts->saved.take());
  after.parts->saved.sign_out("anna");
  const std::string left = after.parts->saved.take().value().text;
  CHECK(left.find("/c1") == std::string::npos);
  CHECK(left.find("/c2") != std::string::npos);
  after.add_arm();
  CHECK(after.parts->registry.find("/arm/subscriptions/c1") == nullptr);
  CHECK(after.parts->registry.find("/arm/subscriptions/c2") != nullptr);
}

TEST_CASE("a text that is no Turtle restores nothing", "[engine][R0.13]") {
  Saved s;
  CHECK_FALSE(s.parts->saved.restore("this is no Turtle"));
  CHECK(s.parts->saved.restore("").has_value());
}

TEST_CASE("of a damaged text each whole subscription is restored, and what is not is counted", "[engine][R0.13]") {
  Saved before;
  before.add_arm();
  for (int i = 1; i <= 5; ++i) before.subscribe("c" + std::to_string(i));
  const std::string text = before.parts->saved.take().value().text;
  const auto recovered = [](const std::string& damaged) {
    Saved after;
    after.add_arm();
    const std::pair<std::size_t, std::size_t> found = after.parts->saved.recover(damaged);
    CHECK(after.parts->subscriptions.callback_count() == found.first);
    CHECK(after.parts->saved.take());  // the file is made whole again
    return found;
  };
  using Pair = std::pair<std::size_t, std::size_t>;
  CHECK(recovered(text) == Pair(5, 0));
  CHECK(recovered(text + std::string(1000, '\0')) == Pair(5, 1));
  CHECK(recovered(text + "garbage \xFF {") == Pair(5, 1));
  CHECK(recovered(text.substr(0, text.size() - 20)) == Pair(4, 1));
  CHECK(recovered(std::string(text).insert(text.find("c3"), "\"\"")) == Pair(4, 1));
  CHECK(recovered("this is { no Turtle") == Pair(0, 1));
  for (std::size_t size = 0; size < text.size(); size += 7) {
    const auto [whole, lost] = recovered(text.substr(0, size));
    CHECK(whole <= 5);
    CHECK(lost <= 1);
  }
}
