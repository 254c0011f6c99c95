// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string_view>
#include <variant>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/bodies.hpp"
#include "src/engine/context.hpp"
#include "src/engine/receivers/receiver.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/responses.hpp"

namespace lrt::engine {

/// Reads requests for subscriptions, and judges them: a GET with its query, a POST with a description, what a feed requests. It changes nothing.
class SubscriptionRequests {
 public:
  /// The request, or the response that refuses it.
  using Read = std::variant<SubscriptionRequest, http::Response>;
  /// The same, where the values or encodings that the choice needs may be missing.
  using Selected = std::variant<SubscriptionRequest, http::Response, Representations::Missing>;
  /// The same, where the outcome may be that the body is not validated yet.
  using Described = std::variant<SubscriptionRequest, Outcome>;

  SubscriptionRequests(const ReceiverParts& parts, const Registry& registry, Bodies& bodies, Representations& representations)
      : parts_(parts), registry_(registry), bodies_(bodies), representations_(representations) {}

  /// The protocol by which a GET of an observable resource subscribes; nullopt: it does not. For a HEAD only an event stream counts.
  std::optional<Protocol> requested_protocol(const Context& context) const;
  /// A GET: what its protocol needs, the policy in its query, the limits.
  Read read(const Context& context, Protocol protocol) const;
  /// Chooses the media type of the messages (R0.17).
  /// @param current  as in Representations::Step
  Selected select(Context& context, SubscriptionRequest wanted, bool current) const;
  /// A POST to a container.
  Described read_description(Context& context) const;
  /// @par Errors  unknown_path, refused, limit_exceeded, unsupported_syntax
  Result<SubscriptionRequest> read_feed(FeedSubscription wanted) const;

 private:
  std::optional<http::Response> renew(Context& context) const;
  subscription::Policy default_policy(const Resource& observed) const;
  std::optional<http::Response> read_query(const Context& context, SubscriptionRequest& request) const;
  std::optional<http::Response> read_policy(const Context& context, const rdf::Graph& graph, rdf::TermId node, subscription::Policy& policy) const;
  std::optional<http::Response> too_many(const Context& context, Protocol protocol) const;

  const ReceiverParts& parts_;
  const Registry& registry_;
  Bodies& bodies_;
  Representations& representations_;
};

/// The current rights of the owner of a subscription; nullopt: it may not subscribe to the resource.
std::optional<Audience> renewed(const EngineOptions& options, const Audience& owner, const Resource& observed);

/// A number of seconds from 0 to max_interval; nullopt: it is something else.
std::optional<std::chrono::milliseconds> interval_of(std::string_view seconds);

}  // namespace lrt::engine
