// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/event_stream.hpp"

#include <optional>
#include <string>
#include <variant>

#include "src/engine/receivers/protocols.hpp"
#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

namespace {

Streamed open(ArmParts& arm, const std::string& text) {
  ArmRequest request(arm, text);
  Outcome outcome = opening_of(Protocol::event_stream)
                        .open(request.context, arm.request(Protocol::event_stream), arm.parts->receiver_parts, arm.parts->subscriptions);
  return std::get<Streamed>(std::move(outcome));
}

}  // namespace

TEST_CASE("an event stream is not stored, and its response names the subscription", "[engine][R1.8]") {
  ArmParts arm;
  const Streamed streamed = open(arm, "GET /arm/angle\nAccept: text/event-stream");
  CHECK(streamed.response.fields.joined("Content-Type") == "text/event-stream");
  CHECK(streamed.response.fields.joined("Cache-Control") == "no-store");
  CHECK(streamed.response.fields.joined("Location").find("/arm/subscriptions/i1") != std::string::npos);
  const SubscriptionResource* const s = arm.parts->subscribers.find(streamed.channel);
  REQUIRE(s);
  const auto push = arm.next_push(*s);
  REQUIRE(push);
  CHECK(push->message->find("\ndata: ") != std::string::npos);
  CHECK(push->text);
}

TEST_CASE("a HEAD of an event stream subscribes nobody", "[engine][R0.5]") {
  ArmParts arm;
  const Streamed streamed = open(arm, "HEAD /arm/angle\nAccept: text/event-stream");
  CHECK(streamed.response.fields.joined("Content-Type") == "text/event-stream");
  CHECK_FALSE(streamed.response.fields.find("Location"));
  CHECK(arm.parts->subscribers.empty());
}

TEST_CASE("a client that reconnects does not get what it has", "[engine]") {
  ArmParts arm;
  SubscriptionResource& first = arm.subscribe(Protocol::event_stream);
  CHECK(arm.next_push(first));
  const Streamed again = open(arm, "GET /arm/angle\nAccept: text/event-stream\nLast-Event-ID: " + first.last_tag);
  const SubscriptionResource* const s = arm.parts->subscribers.find(again.channel);
  REQUIRE(s);
  CHECK_FALSE(arm.next_push(*s));
}

TEST_CASE("the query selects the media type of events", "[engine][R0.17]") {
  ArmParts arm;
  const Opening& opening = opening_of(Protocol::event_stream);
  CHECK(opening.needs_text());
  CHECK_FALSE(opening_of(Protocol::websocket).needs_text());
  CHECK_FALSE(opening.accept(ArmRequest(arm, "GET /arm/angle\nAccept: text/event-stream").context));
  CHECK(opening.accept(ArmRequest(arm, "GET /arm/angle?accept=text/turtle\nAccept: text/event-stream").context) == "text/turtle");
}

TEST_CASE("Accept must name the media type of event streams", "[engine]") {
  const auto names = [](const std::string& accept, bool can_stream = true) {
    RequestText request("GET /arm/angle\nAccept: " + accept);
    request.get().can_stream = can_stream;
    return names_event_stream(request.get());
  };
  CHECK(names("text/event-stream"));
  CHECK(names("text/html, TEXT/Event-stream;q=0.5"));
  CHECK_FALSE(names("text/event-stream", false));
  CHECK_FALSE(names("text/*"));
}
