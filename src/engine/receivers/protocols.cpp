// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/protocols.hpp"

#include <cstddef>

#include <lrt/rdf/vocab.hpp>

#include "src/engine/receivers/callback.hpp"
#include "src/engine/receivers/event_stream.hpp"
#include "src/engine/receivers/feed.hpp"
#include "src/engine/receivers/websocket.hpp"

namespace lrt::engine {

namespace {

template <class R>
std::unique_ptr<Receiver> make(SubscriptionResource& s, SubscriptionRequest& request, const ReceiverParts& parts) {
  return std::make_unique<R>(s, request, parts);
}

constexpr WebSocketOpening websocket_opening;
constexpr CallbackOpening callback_opening;
constexpr EventStreamOpening event_stream_opening;

/// By Protocol.
constexpr ProtocolEntry entries[protocol_count] = {
    {"websocket", vocab::hybrit::WebSocket, make<WebSocketReceiver>, &websocket_opening},
    {"callback", vocab::hybrit::WebCallback, make<CallbackReceiver>, &callback_opening},
    {"event_stream", vocab::lrt_::EventStream, make<EventStreamReceiver>, &event_stream_opening},
    {"feed", vocab::lrt_::Feed, make<FeedReceiver>, nullptr},
};

}  // namespace

const ProtocolEntry& entry_of(Protocol protocol) noexcept { return entries[static_cast<std::size_t>(protocol)]; }

}  // namespace lrt::engine
