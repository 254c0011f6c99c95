// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/event_stream.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/engine/subscriptions.hpp"
#include "src/http/stamp.hpp"

namespace lrt::engine {

Outcome EventStreamOpening::open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const {
  http::Response response;
  parts.responses.add_types(response.fields, context.resource);
  response.fields.add("Content-Type", event_stream_type);
  response.fields.add("Cache-Control", "no-store");
  response.fields.add("Vary", context.vary());
  response.fields.add("X-Accel-Buffering", "no");  // nginx would buffer events
  if (context.request().method == "HEAD") return Streamed{parts.subscribers.new_channel(), std::move(response)};
  // WHATWG HTML 9.2.3: the client has this representation already.
  if (const auto known = context.request().find("Last-Event-ID")) wanted.known_tag = std::string(*known);
  const SubscriptionResource& made = subscriptions.make(context, std::move(wanted));
  response.fields.add("Location", parts.responses.iri(context, made.path));
  response.fields.add(http::series_field, made.receiver->series(parts));
  return Streamed{made.channel, std::move(response)};
}

Push EventStreamReceiver::push_of(const subscription::Item& item) {
  Push push = Receiver::push_of(item);
  if (s_.left_out == 0) return push;
  std::string event(http::event_left_out);
  event.append(": ").append(std::to_string(s_.left_out)).append("\n").append(*push.message);
  push.message = std::make_shared<const std::string>(std::move(event));
  return push;
}

std::string EventStreamReceiver::heartbeat(const std::string& stamp) const {
  return std::string("event: ").append(http::heartbeat_name).append("\ndata: ").append(stamp).append("\n\n");
}

bool names_event_stream(const http::Request& request) {
  if (!request.can_stream) return false;
  const auto names_it = [](std::string_view accept) {
    const auto same = [](char a, char b) { return lrt::detail::lower(a) == b; };
    return std::search(accept.begin(), accept.end(), event_stream_type.begin(), event_stream_type.end(), same) != accept.end();
  };
  return std::any_of(request.fields.begin(), request.fields.end(), [&](const http::Field& field) {
    return field.value.size() >= event_stream_type.size() && http::iequals(field.name, "Accept") && names_it(field.value);
  });
}

}  // namespace lrt::engine
