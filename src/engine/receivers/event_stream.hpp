// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "src/engine/receivers/protocols.hpp"
#include "src/engine/receivers/receiver.hpp"
#include "src/http/form.hpp"

namespace lrt::engine {

/// GET with Accept: text/event-stream. A HEAD gets the same header section without a subscription.
class EventStreamOpening final : public Opening {
 public:
  constexpr EventStreamOpening() noexcept = default;
  /// Accept selects the stream itself. The query selects the media type in its events.
  std::optional<std::string> accept(const Context& context) const override { return http::query_parameter(context.request().target, "accept"); }
  bool needs_text() const noexcept override { return true; }
  std::string_view lacks_heartbeat(const SubscriptionRequest&) const noexcept override { return {}; }
  Outcome open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const override;
};

/// An event stream (WHATWG HTML 9.2): a message is one event with the representation.
class EventStreamReceiver final : public Receiver {
 public:
  EventStreamReceiver(SubscriptionResource& s, const SubscriptionRequest&, const ReceiverParts&) noexcept : Receiver(s) {}
  const subscription::Item& message_of(Representation& representation, Representations& representations) const override {
    return representations.event_of(representation, s_.audience);
  }
  /// The event is shared. What only this subscriber gets precedes it.
  Push push_of(const subscription::Item& item) override;
  std::string heartbeat(const std::string& stamp) const override;
};

/// Accept names the media type of event streams, and the transport can send them. A wildcard does not count.
bool names_event_stream(const http::Request& request);

}  // namespace lrt::engine
