// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/callback.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "src/engine/receivers/protocols.hpp"
#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using std::chrono::milliseconds;
using subscription::DeliveryResult;

namespace {

EngineOptions without_confirmation() {
  EngineOptions options = ArmParts::allowing();
  options.callbacks.confirmation = subscription::Confirmation::none;
  return options;
}

struct Callback {
  explicit Callback(EngineOptions options = without_confirmation(), std::size_t queue_length = 0)
      : arm(std::move(options)), s(arm.subscribe(Protocol::callback, queue_length)), receiver(*s.receiver->callback()) {}
  std::optional<subscription::Notification> next() { return receiver.next(arm.clock.now()); }
  bool delivered(DeliveryResult result) { return receiver.delivered(result, arm.clock.now()); }
  std::size_t reported() { return arm.parts->subscriptions.take_callbacks().size(); }

  ArmParts arm;
  SubscriptionResource& s;
  CallbackReceiver& receiver;
};

}  // namespace

TEST_CASE("the deliverer gets one notification at a time", "[engine][R0.16]") {
  Callback c;
  CHECK(c.reported() == 1);
  const auto first = c.next();
  REQUIRE(first);
  CHECK(first->url == "http://receiver.example/");
  CHECK(first->fields.find("ETag") == c.s.last_tag);
  CHECK(c.s.held);
  c.arm.publish(1);
  CHECK(c.reported() == 0);
  CHECK_FALSE(c.next());
  CHECK(c.delivered({204}));
  CHECK(c.s.delivered == 1);
  CHECK(c.arm.parts->subscribers.sent == 1);
  CHECK(c.reported() == 1);
  CHECK(c.next());
}

TEST_CASE("a notification that fails after its reader has lost a right is not sent again", "[engine][security][R0.16]") {
  EngineOptions options = without_confirmation();
  options.renew = [](const security::Principal*) {
    Caller caller;
    caller.view = std::make_shared<const security::View>(security::Right::subscribe);
    return std::optional<Caller>(std::move(caller));
  };
  Callback c(std::move(options), 3);
  const auto first = c.next();
  REQUIRE(first);
  CHECK_FALSE(first->body->empty());
  c.arm.publish(1);
  c.arm.parts->subscriptions.renew_rights();
  CHECK(c.delivered({500}));
  c.arm.clock.advance(std::chrono::hours(1));
  c.arm.parts->schedule.scan(c.arm.clock.now());
  const auto second = c.next();
  REQUIRE(second);
  CHECK(second->body->empty());
  CHECK(c.delivered({204}));
  CHECK_FALSE(c.next());
}

TEST_CASE("a receiver that does not confirm ends the subscription, one that fails is asked again", "[engine][R0.13][security]") {
  EngineOptions options = ArmParts::allowing();
  options.callbacks.confirmation = subscription::Confirmation::all;
  Callback c(std::move(options));
  const auto question = c.next();
  REQUIRE(question);
  CHECK_FALSE(question->challenge.empty());
  CHECK(question->query.find("hub.topic=http%3A%2F%2F") != std::string::npos);
  CHECK_FALSE(c.next());  // it is asked
  CHECK(c.delivered({503}));
  c.arm.clock.advance(std::chrono::seconds(60));
  CHECK(c.next()->challenge != question->challenge);
  CHECK_FALSE(c.delivered({404}));
  CHECK(c.s.delivered == 0);

  c.receiver.next(c.arm.clock.now());
  DeliveryResult confirmed{200};
  confirmed.confirmed = true;
  const std::uint64_t saves = c.arm.parts->saves.revision();
  CHECK(c.delivered(confirmed));
  CHECK(c.receiver.has_confirmed());
  CHECK(c.arm.parts->saves.revision() > saves);
  CHECK(c.next()->challenge.empty());
}

TEST_CASE("a failed notification is sent again, and a suspended subscription has no queue", "[engine][R0.16]") {
  EngineOptions options = without_confirmation();
  options.callbacks.attempts = 2;
  options.callbacks.suspended_attempts = 2;
  Callback c(std::move(options), 5);
  const auto first = c.next();
  REQUIRE(first);
  CHECK(c.delivered({500}));
  CHECK_FALSE(c.next());  // a pause
  c.arm.clock.advance(std::chrono::seconds(60));
  const auto again = c.next();
  REQUIRE(again);
  CHECK(again->failed_before);
  CHECK(*again->body == *first->body);
  CHECK(c.delivered({500}));
  CHECK(c.s.suspended);
  c.arm.publish(1);
  c.arm.publish(2);
  c.arm.clock.advance(std::chrono::seconds(120));
  CHECK(c.next()->body->find("Value \"2\"") != std::string::npos);
  CHECK(c.delivered({500}));
  c.arm.clock.advance(std::chrono::seconds(120));
  CHECK(c.next());
  CHECK_FALSE(c.delivered({500}));  // the last attempt
}

TEST_CASE("a success ends the suspension", "[engine][R0.16]") {
  EngineOptions options = without_confirmation();
  options.callbacks.attempts = 1;
  Callback c(std::move(options), 5);
  CHECK(c.next());
  CHECK(c.delivered({500}));
  CHECK(c.s.suspended);
  c.arm.clock.advance(std::chrono::seconds(120));
  CHECK(c.next());
  CHECK(c.delivered({204}));
  CHECK_FALSE(c.s.suspended);
}

TEST_CASE("410 and an address that is not allowed end the subscription", "[engine][R0.16]") {
  Callback c;
  CHECK(c.next());
  CHECK_FALSE(c.delivered({410}));
  DeliveryResult refused;
  refused.error = "10.0.0.1 is not allowed";
  refused.refused = true;
  c.s.backlog.mark_pending();
  c.s.last_tag.clear();
  CHECK(c.next());
  CHECK_FALSE(c.delivered(refused));
}

TEST_CASE("a callback is saved before the response, and removed from the file before it ends", "[engine][R0.13][saves]") {
  EngineOptions options = without_confirmation();
  options.save_timeout = std::chrono::seconds(10);
  ArmParts arm(std::move(options));
  ArmRequest get(arm, "GET /arm/angle\nUpgrade: callback");
  const Outcome outcome =
      opening_of(Protocol::callback).open(get.context, arm.request(Protocol::callback), arm.parts->receiver_parts, arm.parts->subscriptions);
  CHECK(std::holds_alternative<Deferred>(outcome));
  REQUIRE(arm.parts->subscribers.count(Protocol::callback) == 1);
  SubscriptionResource* s = nullptr;
  arm.parts->subscribers.for_each([&](SubscriptionResource& one) { s = &one; });
  CHECK(s->held);
  arm.parts->saves.saved(arm.parts->saves.revision(), true, arm.clock.now());
  CHECK_FALSE(s->held);
  CHECK(arm.parts->subscriptions.take_callbacks().size() == 1);

  CallbackReceiver& receiver = *s->receiver->callback();
  ArmRequest request(arm, "DELETE " + s->path, s->path);
  CHECK(std::holds_alternative<Deferred>(receiver.cancel(request.context, {}, arm.parts->subscriptions)));
  CHECK(receiver.is_cancelling());
  arm.parts->saves.saved(arm.parts->saves.revision(), false, arm.clock.now());
  CHECK_FALSE(receiver.is_cancelling());  // the file could not be written: nothing has changed
  (void)receiver.cancel(request.context, {}, arm.parts->subscriptions);
  arm.parts->saves.saved(arm.parts->saves.revision(), true, arm.clock.now());
  CHECK(arm.parts->subscribers.empty());
}
