// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/websocket.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/clock.hpp>

#include "src/engine/subscriptions.hpp"
#include "src/http/stamp.hpp"
#include "src/http/websocket.hpp"

namespace lrt::engine {

std::optional<http::Response> WebSocketOpening::check(const Context& context, SubscriptionRequest& wanted, const ReceiverParts& parts) const {
  wanted.stamped = http::offers_subprotocol(context.request(), http::stamped_protocol);
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
  http::Response response;
  response.status = 101;
  if (wanted.stamped) response.fields.add("Sec-WebSocket-Protocol", http::stamped_protocol);
  const SubscriptionResource& made = subscriptions.make(context, std::move(wanted));
  parts.responses.add_types(response.fields, context.resource);
  response.fields.add("Location", parts.responses.iri(context, made.path));
  return Upgraded{made.channel, std::move(response)};
}

Push WebSocketReceiver::push_of(const subscription::Item& item) {
  if (!stamped_) return Receiver::push_of(item);
  std::string text = "{";
  const auto member = [&text](std::string_view name, std::string_view json) {
    text.append(text.size() > 1 ? ",\"" : "\"").append(name).append("\":").append(json);
  };
  const auto quoted = [](const std::string& plain) { return "\"" + plain + "\""; };
  if (s_.messages == 1) member(http::series_member, quoted(series(parts_)));
  if (item->stamp.at) member(http::time_member, quoted(to_xsd_date_time(*item->stamp.at)));
  member(http::sequence_member, std::to_string(item->stamp.number));
  member(http::left_out_member, std::to_string(s_.left_out));
  stamped_item_ = item;
  Push stamp;
  stamp.message = std::make_shared<const std::string>(std::move(text += "}"));
  return stamp;
}

std::string WebSocketReceiver::heartbeat(const std::string& stamp) const {
  return std::string("{\"").append(http::heartbeat_name).append("\":\"").append(stamp).append("\"}");
}

std::optional<Push> WebSocketReceiver::rest() {
  if (!stamped_item_) return std::nullopt;
  return Receiver::push_of(std::exchange(stamped_item_, nullptr));
}

}  // namespace lrt::engine
