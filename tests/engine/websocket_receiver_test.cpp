// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/websocket.hpp"

#include <variant>

#include "src/engine/receivers/protocols.hpp"
#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

TEST_CASE("a WebSocket is opened by 101 with the path of its subscription", "[engine][R0.12]") {
  ArmParts arm;
  ArmRequest get(arm, "GET /arm/angle\nUpgrade: websocket");
  const Outcome outcome =
      opening_of(Protocol::websocket).open(get.context, arm.request(Protocol::websocket), arm.parts->receiver_parts, arm.parts->subscriptions);
  const auto* upgraded = std::get_if<Upgraded>(&outcome);
  REQUIRE(upgraded);
  CHECK(upgraded->response.status == 101);
  CHECK(upgraded->response.fields.joined("Location").find("/arm/subscriptions/i1") != std::string::npos);
  CHECK(arm.parts->subscribers.find(upgraded->channel));
}

TEST_CASE("a handshake in another version is told which one there is", "[engine][R0.12]") {
  ArmParts arm;
  ArmRequest get(arm,
                 "GET /arm/angle\nUpgrade: websocket\nConnection: Upgrade\nSec-WebSocket-Version: 8\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==");
  SubscriptionRequest wanted;
  const auto refused = opening_of(Protocol::websocket).check(get.context, wanted, arm.parts->receiver_parts);
  REQUIRE(refused);
  CHECK(refused->status == 426);
  CHECK(refused->fields.joined("Sec-WebSocket-Version") == "13");
  CHECK(refused->fields.joined("Upgrade") == "websocket");
}

TEST_CASE("only a transport that upgrades at once makes a WebSocket begin without a value", "[engine][R0.12]") {
  ArmParts arm;
  ArmRequest get(arm, "GET /arm/angle");
  CHECK_FALSE(opening_of(Protocol::websocket).must_open_now(get.context));
  get.request.get().must_upgrade_now = true;
  CHECK(opening_of(Protocol::websocket).must_open_now(get.context));
  CHECK_FALSE(opening_of(Protocol::event_stream).must_open_now(get.context));
  CHECK_FALSE(opening_of(Protocol::callback).must_open_now(get.context));
}

TEST_CASE("a WebSocket gets the representation, and closes with 1000 when it is cancelled", "[engine][R0.14]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::websocket, 3);
  const Channel channel = s.channel;
  CHECK(s.receiver->name() == "websocket");
  const auto push = arm.next_push(s);
  REQUIRE(push);
  CHECK(push->message->find("Value \"0\"") != std::string::npos);
  arm.publish(1);
  ArmRequest request(arm, "DELETE " + s.path, s.path);
  const http::Response response = arm.respond(s.receiver->cancel(request.context, {}, arm.parts->subscriptions));
  CHECK(response.status == 200);
  CHECK_FALSE(arm.parts->subscribers.find(channel));
  const auto close = arm.parts->subscriptions.next_push(channel, arm.clock.now());  // without what was in the queue
  REQUIRE(close);
  CHECK(close->close == 1000);
}
