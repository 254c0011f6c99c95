// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/websocket.hpp"

#include <utility>

#include "src/engine/subscriptions.hpp"
#include "src/http/websocket.hpp"

namespace lrt::engine {

std::optional<http::Response> WebSocketOpening::check(const Context& context, SubscriptionRequest&, const ReceiverParts& parts) const {
  const auto refusal = http::check_websocket(context.request());
  if (!refusal) return std::nullopt;
  http::Response response = parts.responses.problem(context, refusal->status, refusal->reason);
  if (refusal->status == 426) {
    response.fields.set("Sec-WebSocket-Version", "13");
    response.fields.set("Upgrade", "websocket");
  }
  return response;
}

Outcome WebSocketOpening::open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const {
  const SubscriptionResource& made = subscriptions.make(context, std::move(wanted));
  http::Response response;
  response.status = 101;
  parts.responses.add_types(response.fields, context.resource);
  response.fields.add("Location", parts.responses.iri(context, made.path));
  return Upgraded{made.channel, std::move(response)};
}

}  // namespace lrt::engine
