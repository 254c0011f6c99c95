// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/iri.hpp>
#include <lrt/engine/engine.hpp>

#include "src/engine/context.hpp"
#include "src/engine/receivers/receiver.hpp"

namespace lrt::engine {

/// How clients open subscriptions by one protocol. Without state.
class Opening {
 public:
  /// What a GET must have besides the policy: the response if it has not. Completes the request of the subscription.
  virtual std::optional<http::Response> check(const Context& context, SubscriptionRequest& wanted, const ReceiverParts& parts) const {
    (void)context, (void)wanted, (void)parts;
    return std::nullopt;
  }
  /// The acceptable media types of messages (R0.17); nullopt: any.
  virtual std::optional<std::string> accept(const Context& context) const {
    const std::optional<std::string_view> accept = context.accept();
    return accept ? std::optional<std::string>(*accept) : std::nullopt;
  }
  /// Why the subscription cannot have heartbeats; empty: it can.
  virtual std::string_view lacks_heartbeat(const SubscriptionRequest& wanted) const noexcept {
    (void)wanted;
    return "a web callback has no heartbeat";
  }
  /// Messages have the media types that are text.
  virtual bool needs_text() const noexcept { return false; }
  /// The response cannot wait for the first value.
  virtual bool must_open_now(const Context& context) const {
    (void)context;
    return false;
  }
  /// Which maximum is reached; empty: another subscription may be opened.
  virtual std::string_view reached_maximum(const Subscribers& subscribers, const EngineOptions& options) const {
    return subscribers.of_clients() < options.subscriptions.max_subscriptions ? "" : "the maximum number of subscriptions is reached";
  }
  /// Makes the subscription that was requested, and responds.
  virtual Outcome open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const = 0;

 protected:
  ~Opening() = default;
};

/// What the engine knows of one protocol.
struct ProtocolEntry {
  std::string_view name;  ///< in counters and in the audit
  Iri type;               ///< of its subscriptions
  std::unique_ptr<Receiver> (*make_receiver)(SubscriptionResource& s, SubscriptionRequest& request, const ReceiverParts& parts);
  const Opening* opening;  ///< nullptr: clients cannot open it
};

const ProtocolEntry& entry_of(Protocol protocol) noexcept;

/// @pre clients can open it
inline const Opening& opening_of(Protocol protocol) noexcept { return *entry_of(protocol).opening; }

}  // namespace lrt::engine
