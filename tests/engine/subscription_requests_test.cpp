// SPDX-License-Identifier: Apache-2.0
#include "src/engine/subscription_requests.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "tests/support/arm_parts.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using std::chrono::milliseconds;

namespace {

const std::string websocket = "\nUpgrade: websocket\nConnection: Upgrade\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";

std::optional<Protocol> protocol_of(const std::string& text) {
  ArmParts arm;
  ArmRequest request(arm, text);
  return arm.parts->subscription_requests.requested_protocol(request.context);
}

struct Reading {
  explicit Reading(EngineOptions options = ArmParts::allowing()) : arm(std::move(options)) {}
  /// The status of the response that refuses it; 0: it was judged.
  int read(const std::string& text, Protocol protocol = Protocol::websocket) {
    ArmRequest request(arm, text);
    SubscriptionRequests::Read read = arm.parts->subscription_requests.read(request.context, protocol);
    if (const auto* refused = std::get_if<http::Response>(&read)) return refused->status;
    wanted = std::get<SubscriptionRequest>(std::move(read));
    return 0;
  }
  int describe(const std::string& more) {
    const std::string body =
        "<> a hybrit:WebCallback ; hybrit:onResource </arm/angle> ; hybrit:callbackURL \"http://receiver.example/r\"^^xsd:anyURI " + more + " .";
    ArmRequest request(arm, Bench::turtle_request("POST", "/arm/subscriptions", body), "/arm/subscriptions");
    SubscriptionRequests::Described described = arm.parts->subscription_requests.read_description(request.context);
    if (auto* outcome = std::get_if<Outcome>(&described)) return arm.respond(std::move(*outcome)).status;
    wanted = std::get<SubscriptionRequest>(std::move(described));
    return 0;
  }
  ArmParts arm;
  SubscriptionRequest wanted;
};

}  // namespace

TEST_CASE("Upgrade or Accept says by which protocol a GET subscribes", "[engine][R0.12][R0.13][R0.14]") {
  CHECK_FALSE(protocol_of("GET /arm/angle"));
  CHECK_FALSE(protocol_of("GET /arm/angle\nUpgrade: h2c"));
  CHECK(protocol_of("GET /arm/angle\nUpgrade: websocket\nConnection: Upgrade") == Protocol::websocket);
  CHECK(protocol_of("GET /arm/angle\nUpgrade: callback") == Protocol::callback);
  CHECK(protocol_of("GET /arm/angle\nUpgrade: webhook") == Protocol::callback);
  CHECK_FALSE(protocol_of("PUT /arm/angle\nUpgrade: callback"));
  CHECK(protocol_of("GET /arm/angle\nAccept: text/event-stream") == Protocol::event_stream);
  CHECK(protocol_of("HEAD /arm/angle\nAccept: Text/Event-Stream") == Protocol::event_stream);
  CHECK_FALSE(protocol_of("GET /arm/angle\nAccept: */*"));
  CHECK_FALSE(protocol_of("GET /arm/angle\nAccept: text/turtle, text/event-stream;q=0.1"));
}

TEST_CASE("the query of a GET has the policy", "[engine][R0.14]") {
  Reading r;
  CHECK(r.read("GET /arm/angle" + websocket) == 0);
  CHECK(r.wanted.observed == &r.arm.resource());
  CHECK(r.wanted.policy.queue_length == 0);
  CHECK(r.wanted.policy.minimum_interval == milliseconds(0));
  CHECK(r.read("GET /arm/angle?minimumInterval=0.25&queueLength=7" + websocket) == 0);
  CHECK(r.wanted.policy.queue_length == 7);
  CHECK(r.wanted.policy.minimum_interval == milliseconds(250));
  for (const char* query : {"minimumInterval=x", "minimumInterval=-1", "minimumInterval=86401", "queueLength=-1", "queueLength=1001"})
    CHECK(r.read("GET /arm/angle?" + std::string(query) + websocket) == 400);
}

TEST_CASE("a GET without what its protocol needs is refused", "[engine][R0.12][R0.13]") {
  Reading r;
  CHECK(r.read("GET /arm/angle\nUpgrade: websocket\nConnection: Upgrade") == 426);
  CHECK(r.read("GET /arm/angle", Protocol::callback) == 400);
  CHECK(r.read("GET /arm/angle\nCallback: http://other.example/", Protocol::callback) == 403);
  CHECK(r.read("GET /arm/angle\nCallback: http://receiver.example/r", Protocol::callback) == 0);
  CHECK(r.wanted.url == "http://receiver.example/r");
}

TEST_CASE("the limits of subscriptions and of callbacks apply before one is made", "[engine][R0.13]") {
  EngineOptions options = ArmParts::allowing();
  options.subscriptions.max_subscriptions = 2;
  options.callbacks.max_callbacks = 1;
  Reading r(std::move(options));
  const std::string callback = "GET /arm/angle\nCallback: http://receiver.example/r";
  (void)r.arm.subscribe(Protocol::feed);  // does not count
  (void)r.arm.subscribe(Protocol::callback);
  CHECK(r.read(callback, Protocol::callback) == 503);
  CHECK(r.read("GET /arm/angle" + websocket) == 0);
  (void)r.arm.subscribe(Protocol::event_stream);
  CHECK(r.read("GET /arm/angle" + websocket) == 503);
}

TEST_CASE("an event stream has the media types that are text", "[engine][R0.17]") {
  Reading r;
  const auto selected = [&](const std::string& text) {
    ArmRequest request(r.arm, text);
    SubscriptionRequests::Read read = r.arm.parts->subscription_requests.read(request.context, Protocol::event_stream);
    return r.arm.parts->subscription_requests.select(request.context, std::get<SubscriptionRequest>(std::move(read)), true);
  };
  const auto chosen = selected("GET /arm/angle?accept=application/json\nAccept: text/event-stream");
  const auto* wanted = std::get_if<SubscriptionRequest>(&chosen);
  REQUIRE(wanted);
  CHECK(r.arm.resource().variants().type_of(wanted->variant) == "application/json");
  CHECK(std::get<http::Response>(selected("GET /arm/angle?accept=application/cbor\nAccept: text/event-stream")).status == 406);
}

TEST_CASE("a description has the policy and the media type", "[engine][R0.13][SPEC 3.5]") {
  Reading r;
  CHECK(r.describe("; hybrit:mediaType \"application/json\" ; lrt:minimumInterval 0.5 ; lrt:queueLength 3 ; lrt:secret \"s\"") == 0);
  CHECK(r.wanted.protocol == Protocol::callback);
  CHECK(r.wanted.url == "http://receiver.example/r");
  CHECK(r.wanted.secret == "s");
  CHECK(r.wanted.policy.queue_length == 3);
  CHECK(r.wanted.policy.minimum_interval == milliseconds(500));
  CHECK(r.arm.resource().variants().type_of(r.wanted.variant) == "application/json");
  CHECK(r.describe("; hybrit:mediaType \"image/png\"") == 422);
  CHECK(r.describe("; lrt:delivery lrt:queue") == 0);
  CHECK(r.wanted.policy.queue_length == 64);
  CHECK(r.describe("; lrt:delivery lrt:sometimes") == 422);
  CHECK(r.describe("; hybrit:onResource </arm/state>") == 422);  // two
  Reading closed{EngineOptions{}};
  CHECK(closed.describe("") == 403);
}

TEST_CASE("what a feed requests is judged by the same policy", "[engine]") {
  Reading r;
  const auto read = [&](auto set) {
    FeedSubscription wanted;
    wanted.path = "/arm/angle";
    set(wanted);
    return r.arm.parts->subscription_requests.read_feed(std::move(wanted));
  };
  const auto judged = read([](FeedSubscription& f) {
    f.queue_length = 5'000;
    f.minimum_interval = milliseconds(-1);
    f.media_type = "application/json";
  });
  REQUIRE(judged);
  CHECK(judged->policy.queue_length == 1'000);
  CHECK(judged->policy.minimum_interval == milliseconds(0));
  CHECK(judged->protocol == Protocol::feed);
  CHECK(read([](FeedSubscription& f) { f.path = "/arm/other"; }).error().code == Errc::unknown_path);
  CHECK(read([](FeedSubscription& f) { f.path = "/arm/subscriptions"; }).error().code == Errc::refused);
  CHECK(read([](FeedSubscription& f) { f.media_type = "image/png"; }).error().code == Errc::unsupported_syntax);
}
