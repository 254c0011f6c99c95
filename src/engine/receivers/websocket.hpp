// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "src/engine/receivers/protocols.hpp"
#include "src/engine/receivers/receiver.hpp"

namespace lrt::engine {

/// GET with Upgrade: websocket (R0.12, R0.14).
class WebSocketOpening final : public Opening {
 public:
  constexpr WebSocketOpening() noexcept = default;
  std::optional<http::Response> check(const Context& context, SubscriptionRequest& wanted, const ReceiverParts& parts) const override;
  bool must_open_now(const Context& context) const override { return context.request().must_upgrade_now; }
  std::string_view lacks_heartbeat(const SubscriptionRequest& wanted) const noexcept override {
    return wanted.stamped ? std::string_view()
                          : "expected a WebSocket with the subprotocol lrt.stamped; a message of another one is a representation";
  }
  Outcome open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const override;
};

/// A WebSocket: a message is the representation. In http::stamped_protocol a stamp precedes it.
class WebSocketReceiver final : public Receiver {
 public:
  WebSocketReceiver(SubscriptionResource& s, const SubscriptionRequest& request, const ReceiverParts& parts) noexcept
      : Receiver(s), parts_(parts), stamped_(request.stamped) {}
  Push push_of(const subscription::Item& item) override;
  std::optional<Push> rest() override;
  std::string heartbeat(const std::string& stamp) const override;

 private:
  const ReceiverParts& parts_;
  const bool stamped_;
  subscription::Item stamped_item_;  ///< its stamp was taken
};

}  // namespace lrt::engine
