// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/thing.hpp>

#include "src/engine/context.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/thing.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"

namespace lrt::test {

/// The parts of an engine with one Thing, "arm", that has a pushed property, "angle". Its value is 0.
struct ArmParts {
  explicit ArmParts(engine::EngineOptions options = {}) {
    options.clock = &clock;
    options.ids = std::make_shared<FixedIds>();
    options.log = [this](LogLevel, std::string_view line) { log.emplace_back(line); };
    parts = std::make_unique<engine::Parts>(std::move(options));
    Thing thing{"arm"};
    angle = thing.property<double>("angle");
    angle.publish(0);
    parts->add(std::move(thing)).value();
  }

  static engine::EngineOptions allowing(std::vector<std::string> hosts = {"receiver.example", "127.0.0.0/8"}) {
    engine::EngineOptions options;
    options.callbacks.allow = std::move(hosts);
    return options;
  }

  engine::Resource& resource(const std::string& path = "/arm/angle") { return *parts->registry.find(path); }
  /// A request for a subscription to the angle in its first media type.
  engine::SubscriptionRequest request(engine::Protocol protocol, std::size_t queue_length = 0) {
    engine::SubscriptionRequest wanted;
    wanted.observed = &resource();
    wanted.protocol = protocol;
    wanted.variant = wanted.observed->variants().variants.front();
    wanted.policy.queue_length = queue_length;
    if (protocol == engine::Protocol::callback) wanted.url = "http://receiver.example/";
    if (protocol == engine::Protocol::feed) wanted.feed = std::make_shared<const engine::FeedProtocol>(engine::FeedProtocol{"mqtt", {}, true});
    return wanted;
  }
  engine::SubscriptionResource& make(engine::SubscriptionRequest wanted) {
    return parts->subscriptions.make(std::move(wanted), 0, parts->options.ids->next(), clock.now().utc);
  }
  engine::SubscriptionResource& subscribe(engine::Protocol protocol, std::size_t queue_length = 0) { return make(request(protocol, queue_length)); }

  /// Publishes, and lets the engine find it.
  void publish(double value) {
    angle.publish(value);
    clock.advance(std::chrono::milliseconds(1));
    parts->schedule.scan(clock.now());
  }
  std::optional<engine::Channel> next_ready() { return parts->subscriptions.next_ready(clock.now()); }
  std::optional<engine::Push> next_push(const engine::SubscriptionResource& s) { return parts->subscriptions.next_push(s.channel, clock.now()); }
  /// The response to a request if it is there at once.
  http::Response respond(engine::Outcome outcome) { return std::get<http::Response>(std::move(outcome)); }

  FakeClock clock;
  std::vector<std::string> log;
  std::unique_ptr<engine::Parts> parts;
  PushedProperty<double> angle;
};

/// The context of a request for a resource.
struct ArmRequest {
  ArmRequest(ArmParts& arm, const std::string& text, const std::string& path = "/arm/angle")
      : request(text), context(request.get(), arm.clock.now()) {
    request.get().can_upgrade = request.get().can_stream = true;
    context.resource = &arm.resource(path);
    context.resource_id = context.resource->id;
  }
  RequestText request;
  engine::Context context;
};

}  // namespace lrt::test
