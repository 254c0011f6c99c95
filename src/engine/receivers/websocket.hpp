// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "src/engine/receivers/protocols.hpp"
#include "src/engine/receivers/receiver.hpp"

namespace lrt::engine {

/// GET with Upgrade: websocket (R0.12, R0.14).
class WebSocketOpening final : public Opening {
 public:
  constexpr WebSocketOpening() noexcept = default;
  std::optional<http::Response> check(const Context& context, SubscriptionRequest& wanted, const ReceiverParts& parts) const override;
  bool must_open_now(const Context& context) const override { return context.request().must_upgrade_now; }
  Outcome open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const override;
};

/// A WebSocket: a message is the representation.
class WebSocketReceiver final : public Receiver {
 public:
  WebSocketReceiver(SubscriptionResource& s, const SubscriptionRequest&, const ReceiverParts&) noexcept : Receiver(s) {}
};

}  // namespace lrt::engine
